"""Committing what happened: one event, several at once, the end of one still going on, or a long stream of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from elm.event import Event
from elm.interval import as_utc
from elm.store import Arrival, BatchReport, Closed, Committed, Store
from elm.tombstone import RunTombstone, Tombstone

LOAD_BATCH = 5_000
"""Events of a load that are kept in one transaction."""
BATCH_BYTES = 64 * 1024 * 1024
"""Bytes of payload after which a batch is not filled further: it is in memory as a whole."""


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
        `recorded_at` is when the memory learned of it, by default now.
        """
        return self._store.commit(_arrival(event, recorded_at))

    def commit_all(self, events: Iterable[Event], *, recorded_at: datetime | None = None) -> list[Committed]:
        """Keep all of these events or none; they may be parts of each other, in any order."""
        return self._store.commit_all([_arrival(event, recorded_at) for event in events])

    def close(self, uid: UUID, end: datetime) -> Closed:
        """End an event that is still going on; the extents of all its wholes follow.

        The same end again changes nothing; another end is refused.
        """
        return self._store.close_event(uid, as_utc(end, what="the end of an event"))

    def keep_tombstones(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory, before the events that have them as parts.

        An event that this memory has stays, and its tombstone is not kept: it counts as existing.
        """
        return self._store.keep_tombstones(given)

    def load(
        self,
        events: Iterable[Event | Arrival],
        *,
        progress: Callable[[int], None] | None = None,
        refused: Callable[[Arrival, str], None] | None = None,
        batch: int = LOAD_BATCH,
    ) -> LoadReport:
        """Keep a stream of events, at most `batch` of them to a transaction; parts come before their wholes.

        An event that cannot be kept is passed to `refused` with the reason, and the rest are kept.
        `progress` is told the number of events dealt with so far, after every batch.
        """
        read = new = existing = refusals = 0
        for chunk in _batches(events, batch):
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


def _batches(events: Iterable[Event | Arrival], size: int) -> Iterator[list[Arrival]]:
    chunk: list[Arrival] = []
    held = 0
    for given in events:
        arrival = given if isinstance(given, Arrival) else Arrival(event=given)
        chunk.append(arrival)
        held += len(arrival.event.payload.data) if arrival.event.payload else 0
        if len(chunk) >= size or held >= BATCH_BYTES:
            yield chunk
            chunk, held = [], 0
    if chunk:
        yield chunk


def _arrival(event: Event, recorded_at: datetime | None) -> Arrival:
    known = None if recorded_at is None else as_utc(recorded_at, what="recorded_at")
    return Arrival(event=event, recorded_at=known)
