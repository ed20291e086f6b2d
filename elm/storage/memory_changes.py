"""What writing does to the store in this process: events come and end, their wholes follow, the log is kept."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from uuid import UUID

from elm.cues.relations import Kin
from elm.errors import ConflictingContent, ElmError, ForgottenEvent, InvalidValue, UnknownEvent
from elm.event import Event, StoredEvent, content_hash
from elm.extents import span
from elm.interval import Interval, as_utc
from elm.log import LogKind, Tick
from elm.storage.memory_events import as_stored, changed
from elm.storage.memory_index import EventIndex
from elm.storage.parts_first import parts_first
from elm.store import Arrival, BatchReport, Closed, Committed, Refusal
from elm.taxonomy import Taxonomy
from elm.tombstone import still_counts


@dataclass(frozen=True, slots=True, kw_only=True)
class LogRow:
    """One entry of the log; its place in the list is its position."""

    kind: LogKind
    at: datetime
    agent: str | None
    event_id: int | None = None
    deadline: datetime | None = None


class Changes:
    """Writes events to an index. Not locked: its store does that."""

    def __init__(self, index: EventIndex, taxonomy: Taxonomy) -> None:
        self.log: list[LogRow] = []
        self._index = index
        self._taxonomy = taxonomy
        self.contents: dict[UUID, bytes] = {}
        """The content hashes of the events, as they were committed."""

    def keep(self, arrivals: Sequence[Arrival], contents: Sequence[bytes]) -> list[Committed]:
        """Keep all of the arrivals, whose content hashes are `contents`, or none: all is checked before any is."""
        new: dict[UUID, tuple[Arrival, bytes]] = {}
        for arrival, content in zip(arrivals, contents, strict=True):
            event = arrival.event
            self._taxonomy.check(event.type)
            if event.uid in self._index.tombstones:
                raise ForgottenEvent(still_counts(event.uid))
            if event.uid in self._index:
                self._check_same(event, content)
            elif new.setdefault(event.uid, (arrival, content))[1] != content:
                raise ConflictingContent(f"uid {event.uid} is given to two different events: give one a new uid")
        self._check_parts(new)
        order = [event.uid for event in parts_first(arrival.event for arrival in arrivals)]
        staged = self._staged([new[uid][0] for uid in order if uid in new])
        for stored in staged.values():
            self._index.add(stored)
            self.contents[stored.uid] = new[stored.uid][1]
            for part in stored.parts:
                self._index.link(part, stored.uid)
        self._log((LogKind.OPEN if each.interval.is_open else LogKind.COMMIT, each) for each in staged.values())
        return [
            Committed(id=self._index.ids[uid], uid=uid, new=staged.pop(uid, None) is not None)
            for uid in (arrival.event.uid for arrival in arrivals)
        ]

    def _check_same(self, event: Event, content: bytes) -> None:
        """An event whose uid is there must be what was committed, or what that has become."""
        stored = self._index[event.uid]
        if content != self.contents[event.uid] and content != content_hash(stored.as_event()):
            raise ConflictingContent(
                f"uid {event.uid} is taken by another event, of type {stored.type!r}: "
                f"use a new uid, or commit the same content"
            )

    def _check_parts(self, new: Mapping[UUID, tuple[Arrival, bytes]]) -> None:
        for arrival, _ in new.values():
            for part in arrival.event.parts:
                if part not in new and part not in self._index and part not in self._index.tombstones:
                    raise UnknownEvent(
                        f"event {arrival.event.uid} has the unknown part {part}: commit that event first"
                    )

    def _staged(self, new: Sequence[Arrival]) -> dict[UUID, StoredEvent]:
        """The new events, of which parts come first, as they will be kept, numbered in their order."""
        now = datetime.now(UTC)
        first = self._index.ids_given + 1
        staged: dict[UUID, StoredEvent] = {}
        for arrival in new:
            event, recorded_at = arrival.event, arrival.recorded_at
            staged[event.uid] = as_stored(
                event,
                [staged[part] if part in staged else self._index.part(part) for part in event.parts],
                number=first + len(staged),
                recorded_at=now if recorded_at is None else as_utc(recorded_at, what="recorded_at"),
            )
        return staged

    def load(self, arrivals: Sequence[Arrival], contents: Sequence[bytes]) -> BatchReport:
        """Keep, one after the other, the arrivals that can be kept."""
        new = existing = 0
        refused: dict[int, Refusal] = {}
        lost: set[UUID] = set()
        for index, (arrival, content) in enumerate(zip(arrivals, contents, strict=True)):
            try:
                self._refuse_lost_parts(arrival.event, lost)
                (committed,) = self.keep([arrival], [content])
            except ElmError as error:
                refused[index] = Refusal(index=index, reason=str(error))
                lost.add(arrival.event.uid)
            else:
                new += committed.new
                existing += not committed.new
        return BatchReport(new=new, existing=existing, refused=tuple(refused.values()))

    def _refuse_lost_parts(self, event: Event, lost: set[UUID]) -> None:
        for part in event.parts:
            if part in lost and part not in self._index and part not in self._index.tombstones:
                raise UnknownEvent(f"event {event.uid} has the part {part}, which was refused: correct that one first")

    def close(self, uid: UUID, end: datetime) -> Closed:
        """End the open event `uid`; wholes of which it was the last open part end with it."""
        if uid in self._index.tombstones:
            raise ForgottenEvent(f"event {uid} had ended when it was forgotten: it cannot be closed")
        if uid not in self._index:
            raise UnknownEvent(f"there is no event {uid} to close: commit it first")
        event = self._index[uid]
        if event.parts:
            raise InvalidValue(f"event {uid} has parts, from which its end derives: close those that are open")
        begin, known = event.interval.begin, event.interval.end
        if known == end:
            return Closed(new=False, wholes=())
        if known is not None:
            raise InvalidValue(f"event {uid} ended at {known.isoformat()}: it cannot end at {end.isoformat()} as well")
        if end < begin:
            raise InvalidValue(f"event {uid} began at {begin.isoformat()}: it cannot end at {end.isoformat()}, before")
        ended = changed(event, interval=Interval(begin=begin, end=end))
        self._index.replace(ended)
        # Ids grow from parts to wholes: in their order each whole sees its parts as they are by now.
        above = sorted(self._index.ids[whole] for whole in self._index.kin(uid, Kin.WHOLES, transitive=True))
        closed = [whole for number in above if (whole := self._close_whole(number)) is not None]
        self._log((LogKind.CLOSE, each) for each in (ended, *closed))
        return Closed(new=True, wholes=tuple(whole.uid for whole in closed))

    def _close_whole(self, number: int) -> StoredEvent | None:
        """The open whole `number` as it is once all its parts have ended; None while one has not."""
        whole = self._index.events[number]
        interval = span(self._index.part(part).interval for part in whole.parts)
        if interval.is_open:
            return None
        closed = changed(whole, interval=interval)
        self._index.replace(closed)
        return closed

    def tick(self, ticks: Iterable[Tick]) -> None:
        """Note entries of clocks."""
        at = datetime.now(UTC)
        self.log += [LogRow(kind=tick.kind, at=at, agent=tick.agent, deadline=tick.deadline) for tick in ticks]

    def _log(self, news: Iterable[tuple[LogKind, StoredEvent]]) -> None:
        at = datetime.now(UTC)
        self.log += [LogRow(kind=kind, at=at, agent=event.agent, event_id=event.id) for kind, event in news]
