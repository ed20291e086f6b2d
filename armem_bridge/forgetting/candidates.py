"""Candidates: a snapshot as forgetting looks at it, with when it was used last and how large it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

from armem_bridge.forgetting.distances import Compared
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import is_set
from armem_bridge.working.access_statistics import UNUSED, Usage
from armem_bridge.working.admission import size_of
from armem_bridge.working.archive import Evicted
from armem_bridge.working.snapshot import Snapshot


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A snapshot that may be forgotten.

    `used` is when it was used last, in microseconds, by the clock of who asks. `size` is in bytes. Two
    candidates with one ID are one snapshot.
    """

    snapshot: Snapshot
    used: int
    size: int

    @classmethod
    def of(cls, snapshot: Snapshot, usage: Usage = UNUSED, *, size: int | None = None) -> Candidate:
        """The candidate that a snapshot is.

        What no query has returned yet was used last when it arrived, for committing it is a use; where that
        is not known, at its reference time. Without a `size` the data are counted (`admission.size_of`).
        """
        arrived = max((instance.metadata.arrived for instance in snapshot.instances), default=-1)
        known = (moment for moment in (usage.last, arrived) if is_set(moment))
        counted = sum(size_of(instance.data) for instance in snapshot.instances) if size is None else size
        return cls(snapshot=snapshot, used=next(known, snapshot.referenced), size=counted)

    @classmethod
    def evicted(cls, evicted: Evicted) -> Candidate:
        """The candidate that something is which left working memory."""
        return cls.of(evicted.snapshot, evicted.usage)

    @property
    def id(self) -> MemoryID:
        """The ID of the snapshot."""
        return self.snapshot.id

    @property
    def entity(self) -> MemoryID:
        """The ID of its entity."""
        return self.snapshot.id.entity_id

    def idle(self, now: int) -> float:
        """Seconds since it was used last, 0 if that is still to come."""
        return max(now - self.used, 0) / 1e6

    @cached_property
    def compared(self) -> Compared:
        """Its numbers; made when they are first asked for."""
        return Compared.of(instance.data for instance in self.snapshot.instances)


def by_entity(candidates: Iterable[Candidate]) -> dict[MemoryID, list[Candidate]]:
    """The candidates of each entity, the earliest reference time first; one for each ID, the last one given."""
    last = {candidate.id: candidate for candidate in candidates}
    entities: dict[MemoryID, list[Candidate]] = {}
    for candidate in sorted(last.values(), key=lambda candidate: candidate.id):
        entities.setdefault(candidate.entity, []).append(candidate)
    return entities
