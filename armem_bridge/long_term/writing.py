"""From what waits to events in elm: made, typed, placed and written, each version once however often it is tried."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Final
from uuid import UUID

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.long_term.backlog import Waiting
from armem_bridge.long_term.catalogue import Catalogue
from armem_bridge.long_term.event_types import EventTypes
from armem_bridge.long_term.mapping import arrival_of
from armem_bridge.long_term.robot_place import LocationPort
from armem_bridge.long_term.subjects import SubjectFinder
from armem_bridge.working.snapshot import Snapshot
from elm.app import Memory
from elm.cues import uid
from elm.errors import (
    ClusterError,
    ConflictingContent,
    DatabaseUnfit,
    DatabaseUnreachable,
    MemoryMissing,
    SchemaMismatch,
    StoreClosed,
    StoreFailure,
)
from elm.geometry import Region
from elm.store import Arrival, Committed

UNAVAILABLE: Final = (
    ClusterError,
    DatabaseUnfit,
    DatabaseUnreachable,
    MemoryMissing,
    SchemaMismatch,
    StoreClosed,
)
"""What says that the database cannot write anything now, whatever it is given: it is tried again."""

ATTEMPTS: Final = 5
"""A snapshot that the database fails to write so often, by itself, is set aside: others wait behind it."""

_COUNTED: Final = ("consolidated", "repeated", "without_region", "place_failures")

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class SetAside:
    """A snapshot that cannot be consolidated, and why."""

    snapshot: Snapshot
    reason: str

    def __str__(self) -> str:
        return f"{self.snapshot.id}: {self.reason}"


class EventWriter:
    """Writes snapshots to an elm memory; from one thread at a time, but for `write_all`."""

    def __init__(
        self,
        memory: Memory,
        catalogue: Catalogue,
        *,
        agent: str | None,
        location: LocationPort | None,
        subjects: SubjectFinder | None,
    ) -> None:
        self._memory = memory
        self._catalogue = catalogue
        self._agent = agent
        self._location = location
        self._subjects = subjects
        self._types = EventTypes(memory.store)
        self._counts: Counter[str] = Counter()
        self._lock = Lock()

    def write(
        self, given: Sequence[Waiting], *, done: Callable[[Sequence[Waiting]], None], aside: Callable[[SetAside], None]
    ) -> None:
        """Write what can be written of these; `done` is told what needs no more care, `aside` what cannot be kept.

        Raises what the database says where it should be tried again; what was `done` is done nevertheless.
        """
        ready: list[tuple[Waiting, Arrival]] = []
        for waiting in given:
            try:
                ready.append((waiting, self._arrival(waiting.snapshot, waiting.aron_type)))
            except UNAVAILABLE:
                raise
            except Exception as error:
                _give_up(waiting, error, aside)
                done([waiting])
        self._write(ready, done=done, aside=aside)

    def _write(
        self,
        ready: Sequence[tuple[Waiting, Arrival]],
        *,
        done: Callable[[Sequence[Waiting]], None],
        aside: Callable[[SetAside], None],
    ) -> None:
        if not ready:
            return
        try:
            report = self._memory.store.load([arrival for _, arrival in ready])
            known = self._known(ready[refusal.index][1].event.uid for refusal in report.refused)
        except UNAVAILABLE:
            raise
        except Exception as error:
            # One of them may be what the database stumbles over: the others are not to wait for it.
            if len(ready) > 1:
                middle = len(ready) // 2
                self._write(ready[:middle], done=done, aside=aside)
                self._write(ready[middle:], done=done, aside=aside)
                return
            _give_up(ready[0][0], error, aside)
            done([ready[0][0]])
            return
        # Not when they are made: that is done again as often as the database has to be asked.
        nowhere = sum(arrival.event.region is None for _, arrival in ready)
        self._count(consolidated=report.new, repeated=report.existing, without_region=nowhere)
        lost: set[int] = set()
        for refusal in report.refused:
            waiting, arrival = ready[refusal.index]
            if arrival.event.uid in known:
                self._count(repeated=1)
            else:
                lost.add(refusal.index)
                aside(SetAside(snapshot=waiting.snapshot, reason=refusal.reason))
        kept = (waiting for index, (waiting, _) in enumerate(ready) if index not in lost)
        self._catalogue.add(waiting.snapshot.id.entity_id for waiting in kept)
        done([waiting for waiting, _ in ready])

    def write_all(self, given: Sequence[tuple[Snapshot, TypeObject | None]]) -> None:
        """Write all of these or none, and return when they are durable."""
        arrivals = {
            arrival.event.uid: arrival
            for arrival in (self._arrival(snapshot, aron_type) for snapshot, aron_type in given)
        }
        try:
            written = self._commit(list(arrivals.values()))
        except ConflictingContent:
            # Where the robot was is known better now, or the type of the segment is another one.
            fresh = arrivals.keys() - self._known(arrivals)
            if len(fresh) == len(arrivals):
                raise
            written = self._commit([arrivals[each] for each in arrivals if each in fresh])
        self._catalogue.add(snapshot.id.entity_id for snapshot, _ in given)
        new = sum(each.new for each in written)
        nowhere = sum(arrival.event.region is None for arrival in arrivals.values())
        self._count(consolidated=new, repeated=len(arrivals) - new, without_region=nowhere)

    def _commit(self, arrivals: Sequence[Arrival]) -> list[Committed]:
        store = self._memory.store
        return [store.commit(arrivals[0])] if len(arrivals) == 1 else store.commit_all(arrivals)

    def _arrival(self, snapshot: Snapshot, aron_type: TypeObject | None) -> Arrival:
        location, subjects = self._location, self._subjects
        return arrival_of(
            snapshot,
            event_type=self._types.of(snapshot.id, aron_type),
            region=self._place(lambda: location.region(snapshot.referenced)) if location is not None else None,
            subject=self._place(lambda: subjects.subject(snapshot)) if subjects is not None else None,
            agent=self._agent,
        )

    def _place(self, find: Callable[[], Region | None]) -> Region | None:
        """The place that a port finds; where that fails itself the place is not known, and the snapshot kept."""
        try:
            return find()
        except Exception:
            self._count(place_failures=1)
            if self._counts["place_failures"] == 1:
                _logger.exception("where a snapshot was could not be found out; those are kept without, and counted")
            return None

    def _known(self, uids: Iterable[UUID]) -> set[UUID]:
        """Those of these uids that are in the memory: the snapshots that they name are kept, whatever else differs."""
        asked = list(uids)
        return {event.uid for event in self._memory.recall(uid(*asked))} if asked else set()

    def _count(self, **more: int) -> None:
        with self._lock:
            self._counts.update(more)

    def status(self) -> Mapping[str, object]:
        """What was written so far, and what could not be told of it."""
        with self._lock:
            counted = {name: self._counts[name] for name in _COUNTED}
        return {
            **counted,
            "type_contradictions": self._types.contradictions,
            **(self._subjects.status() if self._subjects is not None else {}),
        }


def _give_up(waiting: Waiting, error: Exception, aside: Callable[[SetAside], None]) -> None:
    """Set a snapshot aside that cannot be kept; where only the database failed, not before it was tried some times."""
    waiting.attempts += 1
    if isinstance(error, StoreFailure) and waiting.attempts < ATTEMPTS:
        raise error
    aside(SetAside(snapshot=waiting.snapshot, reason=f"{type(error).__name__}: {error}"))
