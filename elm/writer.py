"""Committing what happened: one event, several at once, the end of one still going on, or a long stream of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from elm.arguments import as_count, as_uid_or_id, check_callable, check_several
from elm.chunks import CHUNK_BYTES
from elm.errors import InvalidValue, UnknownEvent
from elm.event import Event, StoredEvent
from elm.interval import as_utc
from elm.lines import Waiting
from elm.query import MOST_ID
from elm.store import Arrival, BatchReport, Closed, Committed, Store
from elm.tombstone import RunTombstone, Tombstone

LOAD_BATCH = 5_000
"""Events of a load that are kept in one transaction."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadReport:
    """What became of a load: events read, kept as new, there already, and refused."""

    read: int
    new: int
    existing: int
    refused: int


class Writer:
    """Writes to one memory (the paper's ELMWriter). Every call is durable when it returns."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def commit(self, event: Event, *, recorded_at: datetime | None = None) -> Committed:
        """Keep one event (Def 11) in one transaction; its parts must be in the memory.

        The same uid with the same content again changes nothing and returns the existing id.
        `recorded_at` is when the memory learned of it, by default now. Of an event that is stored, commit the
        `as_event()`.
        """
        return self._store.commit(_arrival(event, recorded_at))

    def commit_all(self, events: Iterable[Event], *, recorded_at: datetime | None = None) -> list[Committed]:
        """Keep all of these events or none; they may be parts of each other, in any order."""
        return self._store.commit_all([_arrival(event, recorded_at) for event in check_several(events, what="events")])

    def close(self, uid: UUID | str | int, end: datetime) -> Closed:
        """End an event that is still going on; the extents of all its wholes follow.

        It is named by its uid, which may be given as text, or by its id. The same end again changes nothing; another
        end is refused.
        """
        wanted, ended = as_uid_or_id(uid, what="the event to close"), as_utc(end, what="the end of an event")
        if isinstance(wanted, UUID):
            return self._store.close_event(wanted, ended)
        for found in self._store.get([wanted]):
            return self._store.close_event(found.uid, ended)
        raise UnknownEvent(f"no event {wanted} in memory {self._store.memory!r}")

    def keep_tombstones(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory, before the events that have them as parts.

        An event that this memory has stays, and its tombstone is not kept: it counts as existing.
        """
        tombstones = tuple(check_several(given, what="tombstones"))
        for each in tombstones:
            if not isinstance(each, Tombstone | RunTombstone):
                raise InvalidValue(f"what is kept are tombstones (elm.tombstone), not {each!r:.80}")
        return self._store.keep_tombstones(tombstones)

    def load(
        self,
        events: Iterable[Event | StoredEvent | Arrival | Waiting],
        *,
        progress: Callable[[int], None] | None = None,
        refused: Callable[[Arrival, str], None] | None = None,
        batch: int = LOAD_BATCH,
    ) -> LoadReport:
        """Keep a stream of events, at most `batch` of them to a transaction; parts come before their wholes.

        An event that another memory has stored is kept as it stands, with the time at which that one learned of it;
        of an `elm.store.Arrival` the time it says is kept, and all others are learned of now. At an
        `elm.lines.Waiting` what has come until then is kept at once.

        An event that cannot be kept is passed to `refused` with the reason, and the rest are kept.
        `progress` is told the number of events dealt with so far, after every batch. What is no event at all, or
        has no possible time of recording, ends the load with `InvalidValue`; the batches before it are kept.
        """
        check_callable(progress, what="progress is a function that a load tells what it does")
        check_callable(refused, what="refused is a function that a load tells what it does")
        size = as_count(batch, what="a batch of a load", least=1, most=MOST_ID)
        read = new = existing = refusals = 0
        for chunk in _batches(check_several(events, what="events"), size):
            report = self._store.load(chunk)
            read += len(chunk)
            new += report.new
            existing += report.existing
            refusals += len(report.refused)
            if refused is not None:
                for refusal in report.refused:
                    refused(chunk[refusal.index], refusal.reason)
            if progress is not None:
                progress(read)
        self._store.finish_load()
        return LoadReport(read=read, new=new, existing=existing, refused=refusals)


def _batches(events: Iterable[Event | StoredEvent | Arrival | Waiting], size: int) -> Iterator[list[Arrival]]:
    chunk: list[Arrival] = []
    held = 0
    for given in events:
        if not isinstance(given, Waiting):
            arrival = _to_load(given)
            chunk.append(arrival)
            held += len(arrival.event.payload.data) if arrival.event.payload else 0
            if len(chunk) < size and held < CHUNK_BYTES:
                continue
        if chunk:
            yield chunk
            chunk, held = [], 0
    if chunk:
        yield chunk


def _to_load(given: Event | StoredEvent | Arrival) -> Arrival:
    if isinstance(given, StoredEvent):
        return Arrival(event=given.as_event(), recorded_at=given.recorded_at)
    arrival = given if isinstance(given, Arrival) else Arrival(event=given)
    if not isinstance(arrival.event, Event):
        raise _no_event(arrival.event)
    if arrival.recorded_at is not None:
        as_utc(arrival.recorded_at, what="recorded_at")
    return arrival


def _no_event(given: object) -> InvalidValue:
    remedy = ""
    if isinstance(given, StoredEvent):
        remedy = ": of one that is stored take as_event(), with recorded_at=stored.recorded_at where that is to stay"
    return InvalidValue(f"what is committed is an Event, not {given!r:.80}{remedy}")


def _arrival(event: Event, recorded_at: datetime | None) -> Arrival:
    if not isinstance(event, Event):
        raise _no_event(event)
    known = None if recorded_at is None else as_utc(recorded_at, what="recorded_at")
    return Arrival(event=event, recorded_at=known)
