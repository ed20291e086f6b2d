"""Loading a batch by COPY: into a temporary table, from there level by level into the memory, refusals told apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from uuid import UUID

from elm.errors import ConflictingContent
from elm.event import Event, StoredEvent, content_hash
from elm.storage import encoding
from elm.storage import write_statements as sql
from elm.storage.connections import Connection
from elm.storage.event_writing import encoded, refuse_other, why_refused
from elm.storage.names import NameCache
from elm.store import Arrival, BatchReport, Refusal


def levels(events: Sequence[Event]) -> list[int]:
    """How many steps each event stands above those of the batch that come before it and are its parts."""
    level: dict[UUID, int] = {}
    found = []
    for event in events:
        height = 1 + max((level.get(part, 0) for part in event.parts), default=-1) if event.parts else 0
        level.setdefault(event.uid, height)
        found.append(height)
    return found


def repeated(arrivals: Sequence[Arrival]) -> tuple[dict[int, str], set[int]]:
    """The rows of a batch whose uid stands earlier in it: those with other content, with a reason, and the rest."""
    first: dict[UUID, Event] = {}
    other: dict[int, str] = {}
    same: set[int] = set()
    for index, arrival in enumerate(arrivals):
        known = first.setdefault(arrival.event.uid, arrival.event)
        if known is arrival.event:
            continue
        if content_hash(known) == content_hash(arrival.event):
            same.add(index)
        else:
            other[index] = f"the uid {known.uid} stands earlier with other content: give one of them a new uid"
    return other, same


def parts_to_come(arrivals: Sequence[Arrival]) -> dict[int, set[UUID]]:
    """For each row the parts that stand only later in the batch."""
    place = {arrival.event.uid: index for index, arrival in reversed(list(enumerate(arrivals)))}
    found = {
        index: {part for part in arrival.event.parts if place.get(part, -1) > index}
        for index, arrival in enumerate(arrivals)
        if arrival.event.parts
    }
    return {index: parts for index, parts in found.items() if parts}


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """A batch made ready to be sent: what is refused already, and the rest as the bytes of a binary COPY."""

    arrivals: Sequence[Arrival]
    now: datetime
    heights: list[int]
    refused: dict[int, str]
    repeats: set[int]
    kept: list[int]
    copy: bytes


def made_ready(arrivals: Sequence[Arrival], names: NameCache) -> Batch:
    """What can be done for a batch without waiting for the database, but for names it has not seen yet."""
    now = datetime.now(UTC)
    refused, repeats = repeated(arrivals)
    types = names.known_type_ids([arrival.event.type for arrival in arrivals])
    for index, arrival in enumerate(arrivals):
        if arrival.event.type not in types:
            refused[index] = f"unknown event type {arrival.event.type!r}: add it first (`elm types add`)"
    kept = [index for index in range(len(arrivals)) if index not in refused and index not in repeats]
    heights = levels([arrival.event for arrival in arrivals])
    rows = encoded([arrivals[index] for index in kept], names, now)
    count = 2 + len(encoding.COLUMNS)
    copied = [
        encoding.copied((encoding.int4(index), encoding.int4(heights[index]), *row), count)
        for index, row in zip(kept, rows, strict=True)
    ]
    copy = b"".join([encoding.COPY_BEGIN, *copied, encoding.COPY_END])
    return Batch(arrivals=arrivals, now=now, heights=heights, refused=refused, repeats=repeats, kept=kept, copy=copy)


def stage(connection: Connection, batch: Batch) -> None:
    """Copy a batch into the temporary table, under the rows' index in it and with their level."""
    connection.execute(sql.CREATE_STAGING)
    with connection.cursor().copy(sql.COPY_STAGING) as copy:
        copy.write(batch.copy)


def existing(connection: Connection) -> list[tuple[int, int, bool]]:
    """Row, id, and whether the content is the same, of staged rows whose uid is in the memory."""
    return connection.execute(sql.STAGED_EXISTING).fetchall()


def drop(connection: Connection, indexes: Sequence[int]) -> None:
    """Take rows out of the temporary table."""
    if indexes:
        connection.execute(sql.DROP_STAGED, {"rows": list(indexes)})


def insert(connection: Connection, *, highest: int, now: datetime) -> dict[UUID, bool]:
    """Move the staged rows into the memory, lowest level first; uid -> whether it was there already."""
    taken = list(connection.execute(sql.LOAD_ATOMIC, {"now": now}, binary=True))
    if highest:
        connection.execute(sql.LOCK_OPEN_PARTS)
    for level in range(1, highest + 1):
        taken += connection.execute(sql.LOAD_LEVEL, {"level": level, "now": now}, binary=True)
    return {UUID(bytes=uid): existed for uid, existed in taken}


Stored = Callable[[Sequence[UUID]], Iterable[StoredEvent]]
"""Gives the events of some uids, as the loading transaction sees them."""


def load(connection: Connection, batch: Batch, stored: Stored) -> BatchReport:
    """Keep what can be kept of a batch, in the transaction that the connection is in."""
    arrivals, refused = batch.arrivals, batch.refused
    taken: dict[UUID, bool] = {}
    if batch.kept:
        stage(connection, batch)
        present = _set_aside(connection, batch, stored)
        taken = insert(connection, highest=max(batch.heights), now=batch.now)
        for index in batch.kept:
            event = arrivals[index].event
            if index not in present and index not in refused and event.uid not in taken:
                refused[index] = str(why_refused(event, stored(event.parts)))
    lost = {arrivals[index].event.uid for index in refused}
    doubles = {index for index in batch.repeats if arrivals[index].event.uid in lost}
    refused |= dict.fromkeys(doubles, "the same event was refused earlier in this batch")
    new = sum(not existed for existed in taken.values())
    reasons = tuple(Refusal(index=index, reason=refused[index]) for index in sorted(refused))
    return BatchReport(new=new, existing=len(arrivals) - new - len(reasons), refused=reasons)


def _set_aside(connection: Connection, batch: Batch, stored: Stored) -> set[int]:
    """Take the staged rows out that are in the memory (returned) and those that cannot be kept."""
    arrivals, refused = batch.arrivals, batch.refused
    found = existing(connection)
    present = {index for index, _, _ in found}
    for index, _, same in found:
        event = arrivals[index].event
        if not same:
            try:
                refuse_other(event, next(iter(stored([event.uid]))))
            except ConflictingContent as error:
                refused[index] = str(error)
    kept = set(batch.kept)
    later = {index: parts for index, parts in parts_to_come(arrivals).items() if index in kept}
    known = {each.uid for each in stored([uid for parts in later.values() for uid in parts])}
    for index, parts in later.items():
        if index not in present and (missing := parts - known):
            named = ", ".join(sorted(map(str, missing))[:5])
            refused[index] = f"its parts {named} stand later in the load: move the whole behind them"
    drop(connection, sorted(present | (kept & refused.keys())))
    return present
