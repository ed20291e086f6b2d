"""Writing events to the database: one, several in one transaction, a batch by COPY, and the end of an open one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from heapq import heapify, heappop, heappush
from uuid import UUID

from elm.errors import ConflictingContent, ExtentRefused, ForgottenEvent, InvalidValue, UnknownEvent
from elm.event import Event, StoredEvent, content_hash
from elm.storage import encoding, prepared
from elm.storage import write_statements as sql
from elm.storage.connections import Connection, TransactionUndone
from elm.storage.names import NameCache
from elm.storage.tombstone_rows import forgotten_among
from elm.store import Arrival, Closed, Committed
from elm.tombstone import still_counts

Stored = Callable[[Sequence[UUID]], Iterable[StoredEvent]]
"""Gives the events of some uids, as the writing transaction sees them."""


def encoded(arrivals: Sequence[Arrival], names: NameCache, now: datetime) -> list[encoding.Row]:
    """The rows of arrivals; unknown types are an error, new frames are added."""
    return [*map(encoder([arrival.event for arrival in arrivals], names, now), arrivals)]


def encoder(events: Sequence[Event], names: NameCache, now: datetime) -> Callable[[Arrival], encoding.Row]:
    """What makes the rows of arrivals of these events; unknown types are an error, new frames are added."""
    types = names.type_ids([event.type for event in events])
    places = [(event, place.frame) for event in events for place in (event.region, event.subject) if place is not None]
    frames = names.frame_ids([frame for event, frame in places if not event.parts])
    # The frame of an extent that derives is there already, or the extent given is not the derived one.
    frames = frames | {frame: names.frame_id(frame) for event, frame in places if event.parts}
    return lambda arrival: encoding.row(
        arrival.event, types=types, frames=frames, recorded_at=arrival.recorded_at or now
    )


def commit(connection: Connection, event: Event, row: encoding.Row, now: datetime) -> Committed | None:
    """Write one event; None when it was not taken."""
    name, statement = ("elm_complex", sql.COMMIT_COMPLEX) if event.parts else ("elm_atomic", sql.COMMIT_ATOMIC)
    values = (*row, encoding.timestamp(now))
    found = prepared.run(connection, name, statement, values)
    if not found and event.parts and forgotten_among(connection, event.parts):
        found = prepared.run(connection, "elm_complex_forgotten", sql.COMMIT_OVER_TOMBSTONES, values)
    if not found:
        return None
    (number, existed), *_ = found
    assert number is not None  # noqa: S101 - a primary key
    return Committed(id=int.from_bytes(number), uid=event.uid, new=existed == b"\0")


def same_or_refused(connection: Connection, event: Event, stored: Stored) -> Committed:
    """An event that was not taken is the one already stored, as it stands now, or refused."""
    known = {each.uid: each for each in stored([event.uid, *event.parts])}
    if event.uid not in known:
        raise why_refused(connection, event, known.values())
    refuse_other(event, known[event.uid])
    return Committed(id=known[event.uid].id, uid=event.uid, new=False)


def why_refused(connection: Connection, event: Event, parts: Iterable[StoredEvent]) -> Exception:
    """The reason for which the database did not take a new event, whose stored parts are `parts`."""
    forgotten = forgotten_among(connection, [event.uid, *event.parts])
    if event.uid in forgotten:
        return ForgottenEvent(still_counts(event.uid))
    known = {part.uid for part in parts} | forgotten
    if missing := [str(uid) for uid in event.parts if uid not in known]:
        return UnknownEvent(
            f"event {event.uid} has parts that are not in the memory: {', '.join(missing[:5])}"
            f"{' ...' if len(missing) > 5 else ''}. Commit them first"
        )
    if event.parts and (event.interval or event.region or event.subject):
        return ExtentRefused(
            f"an extent given for the complex event {event.uid} is not the one its parts have: leave interval, "
            f"region and subject out, they derive; commit an instant event as a part for a bound that no part has"
        )
    # Nothing speaks against it any more: its parts were committed since it was refused.
    return TransactionUndone(f"event {event.uid} and its parts were written by several processes at once: try again")


def refuse_other(event: Event, stored: StoredEvent) -> None:
    """Refuse an event whose uid is taken, unless it equals the stored event as it stands now."""
    if content_hash(stored.as_event()) != content_hash(event):
        raise ConflictingContent(
            f"the uid {event.uid} is taken by an event of other content "
            f"(id {stored.id}, type {stored.type!r}): use a new uid"
        )


def close(connection: Connection, uid: UUID, end: datetime) -> Closed | None:
    """End an open atomic event and recompute its wholes; None when there was nothing to end."""
    now = datetime.now(UTC)
    row = connection.execute(sql.CLOSE_EVENT, {"uid": uid, "end": end}).fetchone()
    if row is None:
        return None
    number, agent = row
    log = [{"id": number, "agent": agent, "now": now}]
    closed: list[UUID] = []
    above = [whole for (whole,) in connection.execute(sql.WHOLES_OF, {"id": number})]
    heapify(above)
    done = 0
    while above:
        whole = heappop(above)
        if whole == done:
            continue
        done = whole
        ((whole_uid, was_open),) = connection.execute(sql.LOCK_WHOLE, {"id": whole}, binary=True).fetchall()
        ((still_open, whole_agent, further),) = connection.execute(sql.RECOMPUTE_WHOLE, {"id": whole}).fetchall()
        for each in further:
            heappush(above, each)
        if was_open and not still_open:
            closed.append(UUID(bytes=whole_uid))
            log.append({"id": whole, "agent": whole_agent, "now": now})
    connection.cursor().executemany(sql.LOG_CLOSED, log)
    return Closed(new=True, wholes=tuple(closed))


def why_not_closed(connection: Connection, uid: UUID, end: datetime, stored: StoredEvent | None) -> Closed:
    """Nothing to do for an event that ended just then; otherwise the reason why it cannot be ended."""
    if stored is None and forgotten_among(connection, [uid]):
        raise ForgottenEvent(f"event {uid} had ended when it was forgotten: it cannot be closed")
    if stored is None:
        raise UnknownEvent(f"there is no event {uid} to close: commit it first")
    if stored.parts:
        raise InvalidValue(f"event {uid} is complex: it ends when its last open part is closed")
    if end < stored.interval.begin:
        raise InvalidValue(f"event {uid} began at {stored.interval.begin.isoformat()}: it cannot end before")
    if stored.interval.end != end:
        raise InvalidValue(f"event {uid} has already ended, at {stored.interval}: an end is given once")
    return Closed(new=False, wholes=())
