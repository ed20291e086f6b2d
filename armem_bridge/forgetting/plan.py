"""Plans: what offline forgetting would take away and why, before anybody takes it away."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

from armem_bridge.memory_id import MemoryID


@dataclass(frozen=True, slots=True, kw_only=True)
class Going:
    """One snapshot that goes, with the mechanism that says so and its reason in words."""

    snapshot: MemoryID
    size: int
    mechanism: str
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What would be forgotten at `now` of the snapshots that were looked at: a dry run, for making it changes nothing.

    `going` is ordered by ID. `unmet` are budgets that were not kept, in words, because the newest snapshots
    of entities stay.
    """

    now: int
    looked_at: int
    size: int
    going: tuple[Going, ...]
    unmet: tuple[str, ...] = ()

    @property
    def snapshots(self) -> tuple[MemoryID, ...]:
        """The IDs of what goes."""
        return tuple(going.snapshot for going in self.going)

    @property
    def freed(self) -> int:
        """The bytes of what goes."""
        return sum(going.size for going in self.going)

    def by_entity(self) -> dict[MemoryID, tuple[Going, ...]]:
        """What goes of each entity, the earliest reference time first."""
        grouped = groupby(self.going, key=lambda going: going.snapshot.entity_id)
        return {entity: tuple(going) for entity, going in grouped}

    def by_mechanism(self) -> dict[str, int]:
        """How many each mechanism forgets."""
        counted: dict[str, int] = {}
        for going in self.going:
            counted[going.mechanism] = counted.get(going.mechanism, 0) + 1
        return counted

    def lines(self) -> Iterator[str]:
        """The plan as a text: the sums, then entity by entity what goes and why."""
        yield f"{len(self.going):,} of {self.looked_at:,} snapshots would go, {self.freed:,} of {self.size:,} bytes"
        yield from self.unmet
        for entity, going in self.by_entity().items():
            yield f"{entity}: {len(going):,}"
            for each in going:
                yield f"  {each.snapshot.timestamp}  {each.mechanism}: {each.why}"
