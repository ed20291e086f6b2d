"""Episodes for experiments with forgetting: what left working memory when, when it was used, and what is looked for."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.forgetting import Candidate
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import (
    AddSegment,
    Commit,
    CoreSegmentDefinition,
    EntityUpdate,
    Evicted,
    MemoryServer,
    Snapshot,
)
from armem_bridge.working.history import Source
from elm.errors import StoreFailure


@dataclass(frozen=True, kw_only=True)
class Episode:
    """The snapshots of one recording in the order in which they left working memory, with the time of each.

    `used` tells when snapshots were used last in the life of the robot, had it kept those that it is given:
    what was forgotten cannot be used, and something else is in its place. `end` is when the robot goes to
    rest and forgets offline. `found` tells which share of the things looked for is found in what was kept.
    """

    name: str
    left: tuple[tuple[Snapshot, int], ...]
    used: Callable[[Collection[MemoryID]], Mapping[MemoryID, int]]
    end: int
    found: Callable[[Collection[MemoryID]], float]

    def candidates(self) -> list[tuple[Candidate, int]]:
        """New candidates, whose numbers nobody has asked for yet: so that what is measured is all there is to do."""
        return [(Candidate.of(snapshot), at) for snapshot, at in self.left]


def update_of(entity: MemoryID, referenced: int, **members: object) -> EntityUpdate:
    """The update that brings one instance whose data have these members."""
    data = Dict({name: to_aron(value) for name, value in members.items()})
    return EntityUpdate(entity=entity, instances=(data,), referenced=referenced)


def recorded(memory: str, updates: Iterable[EntityUpdate], *, limit: int) -> list[tuple[Snapshot, int]]:
    """What leaves a memory server that takes these updates, each at its reference time, and is cleared in the end.

    It keeps `limit` snapshots of each entity in working memory.
    """
    clock = _Clock()
    outflow = _Outflow(clock)
    segments: dict[str, set[str]] = {}
    given = list(updates)
    for update in given:
        segments.setdefault(update.entity.core_segment, set()).add(update.entity.provider_segment)
    definitions = [CoreSegmentDefinition(name=name) for name in segments]
    limits = {MemoryID(memory=memory): limit}
    with MemoryServer(memory, definitions, archive=outflow, limits=limits, clock=clock) as server:
        for update in given:
            clock.moment = update.referenced
            result = server.commit(Commit(updates=[update]))
            if not result.success:
                raise StoreFailure(f"a memory server does not take what it is to forget: {'; '.join(result.errors)}")
        for core, providers in segments.items():
            wishes = [
                AddSegment(core_segment=core, provider_segment=provider, clear_when_exists=True)
                for provider in sorted(providers)
            ]
            server.add_segments(wishes)
    return outflow.left


class _Clock:
    def __init__(self) -> None:
        self.moment = 0

    def __call__(self) -> int:
        return self.moment


class _Outflow:
    """An archive that writes down what leaves working memory, and when."""

    def __init__(self, clock: _Clock) -> None:
        self._clock = clock
        self.left: list[tuple[Snapshot, int]] = []

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        """Nothing is written through: everything waits until it leaves."""

    def on_eviction(self, evicted: Sequence[Evicted]) -> None:
        self.left += [(each.snapshot, self._clock()) for each in evicted]

    def source(self, memory: str) -> Source | None:
        return None

    def status(self) -> Mapping[str, object]:
        return {"left": len(self.left)}
