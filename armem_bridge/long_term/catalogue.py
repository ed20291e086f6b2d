"""The names in long-term memory, remembered: to group all snapshots by name at each question takes too long."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from threading import Lock
from typing import Final

from armem_bridge.long_term.mapping import ID, below
from armem_bridge.memory_id import InvalidMemoryID, Level, MemoryID
from elm.app import Memory
from elm.errors import MemoryMissing
from elm.query import ByFeature
from elm.store import ForgettingCount

MAX_AGE: Final = 300.0
"""After so many seconds the names are looked up again, for other processes may have written some."""


def names_below(parent: MemoryID, entities: Iterable[MemoryID]) -> list[str]:
    """The names one level below a memory, core segment or provider segment that these entities have, in order."""
    return sorted({entity.names[parent.level] for entity in entities if parent.contains(entity)})


class Catalogue:
    """The entities that an elm memory has snapshots of; any thread may ask.

    It is told what this process writes, and looks everything up again after a forgetting. Of what other
    processes write it learns after `max_age` seconds.
    """

    def __init__(
        self, memory: Memory, *, max_age: float = MAX_AGE, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._memory = memory
        self._max_age = max_age
        self._clock = clock
        self._lock = Lock()
        self._looking_up = Lock()
        self._entities: set[MemoryID] = set()
        self._written: set[MemoryID] = set()
        self._known_at: float | None = None
        self._forgotten = ForgettingCount(runs=0, events=0)

    def add(self, entities: Iterable[MemoryID]) -> None:
        """There are snapshots of these now."""
        with self._lock:
            for entity in entities:
                self._entities.add(entity)
                self._written.add(entity)

    def entities(self) -> list[MemoryID]:
        """All entities."""
        with self._looking_up:
            forgotten = self._forgotten_so_far()
            moment = self._clock()
            if self._known_at is None or moment - self._known_at >= self._max_age or forgotten != self._forgotten:
                with self._lock:
                    self._written.clear()
                found = self._looked_up()
                with self._lock:
                    self._entities = found | self._written
                self._known_at, self._forgotten = moment, forgotten
        with self._lock:
            return list(self._entities)

    def _looked_up(self) -> set[MemoryID]:
        try:
            groups = self._memory.recall(below(MemoryID())).groups(ByFeature(name=ID))
        except MemoryMissing:
            return set()
        return {found for group in groups if (found := _entity(group.key)) is not None}

    def _forgotten_so_far(self) -> ForgettingCount:
        try:
            return self._memory.store.forgetting_count()
        except MemoryMissing:
            return ForgettingCount(runs=0, events=0)


def _entity(text: object) -> MemoryID | None:
    """The entity of that text. Events of others in the memory may say anything there: what names none is none."""
    if not isinstance(text, str):
        return None
    try:
        found = MemoryID.parse(text)
    except InvalidMemoryID:
        return None
    return found if found.level is Level.ENTITY else None
