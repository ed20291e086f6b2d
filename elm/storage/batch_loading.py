"""Loading a batch by COPY: into a temporary table, from there level by level into the memory, refusals told apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from uuid import UUID

from elm.event import Event, content_hash
from elm.storage import encoding
from elm.storage import write_statements as sql
from elm.storage.connections import Connection
from elm.store import Arrival


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


def stage(connection: Connection, rows: Mapping[int, encoding.Row], heights: Sequence[int]) -> None:
    """Copy rows into the temporary table, under their index in the batch and with their level."""
    connection.execute(sql.CREATE_STAGING)
    count = 2 + len(encoding.COLUMNS)
    with connection.cursor().copy(sql.COPY_STAGING) as copy:
        copy.write(encoding.COPY_BEGIN)
        for index, row in rows.items():
            copy.write(encoding.copied((encoding.int4(index), encoding.int4(heights[index]), *row), count))
        copy.write(encoding.COPY_END)


def existing(connection: Connection) -> list[tuple[int, int, bool]]:
    """Row, id, and whether the content is the same, of staged rows whose uid is in the memory."""
    return connection.execute(sql.STAGED_EXISTING).fetchall()


def drop(connection: Connection, indexes: Sequence[int]) -> None:
    """Take rows out of the temporary table."""
    if indexes:
        connection.execute(sql.DROP_STAGED, {"rows": list(indexes)})


def insert(connection: Connection, *, highest: int, now: Any) -> dict[UUID, bool]:
    """Move the staged rows into the memory, lowest level first; uid -> whether it was there already."""
    taken = list(connection.execute(sql.LOAD_ATOMIC, {"now": now}, binary=True))
    if highest:
        connection.execute(sql.LOCK_OPEN_PARTS)
    for level in range(1, highest + 1):
        taken += connection.execute(sql.LOAD_LEVEL, {"level": level, "now": now}, binary=True)
    return {UUID(bytes=uid): existed for uid, existed in taken}
