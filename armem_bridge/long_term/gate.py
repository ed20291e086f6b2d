"""The port of online forgetting: what decides whether a snapshot that leaves working memory is consolidated."""

from __future__ import annotations

from typing import Protocol

from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import is_set
from armem_bridge.working.archive import Evicted
from armem_bridge.working.history import Source


class Gate(Protocol):
    """Decides for one snapshot after the other, in one thread; moments are microseconds by the archive's clock."""

    @property
    def remembers(self) -> int:
        """So many of an entity's last snapshots in long-term memory it is told of when it first sees the entity."""

    def keeps(self, evicted: Evicted, now: int) -> bool:
        """Whether it is consolidated; otherwise it is forgotten. Asking changes nothing."""

    def kept(self, evicted: Evicted, now: int) -> None:
        """It is consolidated since `now`."""


class OpenGate:
    """Consolidates everything."""

    remembers = 0

    def keeps(self, evicted: Evicted, now: int) -> bool:
        return True

    def kept(self, evicted: Evicted, now: int) -> None:
        """Nothing is to be remembered."""


class RememberingGate:
    """A gate that is told, when it first sees an entity, what long-term memory has of it already.

    After a restart it decides as if there had been none, as far as that can be told: when a snapshot was
    consolidated is taken to be when it arrived.
    """

    def __init__(self, gate: Gate) -> None:
        self._gate = gate
        self._seen: set[MemoryID] = set()

    def keeps(self, evicted: Evicted, now: int, known: Source) -> bool:
        """Whether it is consolidated; if so, the gate is told that it was."""
        entity = evicted.snapshot.id.entity_id
        if entity not in self._seen:
            for snapshot in known.history(entity).latest(self._gate.remembers):
                arrived = max((each.metadata.arrived for each in snapshot.instances), default=snapshot.referenced)
                self._gate.kept(Evicted(snapshot=snapshot, usage=evicted.usage), arrived if is_set(arrived) else now)
            self._seen.add(entity)
        if not self._gate.keeps(evicted, now):
            return False
        self._gate.kept(evicted, now)
        return True
