"""Reading a memory as of one moment: many statements in one transaction that sees nothing of what happens meanwhile."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any, TypeVar
from uuid import UUID

from elm.event import StoredEvent
from elm.query import Order, Query
from elm.storage import recall_statements, tombstone_rows
from elm.storage.connections import Connection
from elm.storage.planning import Planning
from elm.storage.session import Session
from elm.tombstone import RunTombstone, Tombstone

EVENTS_AT_ONCE = 64
"""Events that are held at a time: their payloads may be images."""
_NAMES_AT_ONCE = 1_000

_Item = TypeVar("_Item")


@contextmanager
def one_moment(session: Session) -> Iterator[Connection]:
    """A connection all of whose statements see the memory as of the first of them."""
    session.ready_to_recall()
    # Named: what is asked piece by piece is planned once. A cursor's plan is made for its values all the same.
    with session.connections.recalling(Planning.ONCE) as connection, connection.transaction():
        connection.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
        yield connection


def pieces(connection: Connection, text: str, values: Mapping[str, Any], *, size: int) -> Iterator[list[Sequence[Any]]]:
    """The rows of a statement, `size` at a time; between two pieces the connection is free for other statements."""
    with connection.cursor("pieces") as cursor:
        cursor.execute(text, values, binary=True)
        while rows := cursor.fetchmany(size):
            yield rows


def by_ids(session: Session, connection: Connection, ids: Iterable[int]) -> list[StoredEvent]:
    """The events with these ids, in id order."""
    text = session.statements.text("by id", recall_statements.by_ids)
    rows = connection.execute(text, {"ids": list(ids)}, prepare=True, binary=True).fetchall()
    session.learn(rows)
    return [StoredEvent.of_row(row, session.decode) for row in rows]


def everything(session: Session) -> Iterator[StoredEvent | Tombstone | RunTombstone]:
    """All that the memory holds: tombstones of forgettings, those of events, events by id."""
    with one_moment(session) as connection:
        yield from tombstone_rows.run_tombstones(connection, session.frame_name)
        yield from tombstone_rows.tombstones(connection, None, session.frame_name)
        yield from _found(session, connection, Query(order=Order.ID))


def with_parts(session: Session, query: Query) -> Iterator[StoredEvent | Tombstone]:
    """The events a query asks for and all they are made of, by id, after the tombstones of forgotten parts."""
    ids: set[int] = set()
    found: set[UUID] = set()
    wanted: set[UUID] = set()
    asked: set[UUID] = set()
    with one_moment(session) as connection:
        some: Iterable[StoredEvent] = _found(session, connection, query)
        while True:
            for event in some:
                ids.add(event.id)
                found.add(event.uid)
                wanted.update(event.parts)
            missing = wanted - found - asked
            if not missing:
                break
            asked |= missing
            some = (event for uids in _chunks(missing) for event in session.stored(connection, uids))
        for uids in _chunks(wanted - found):
            yield from tombstone_rows.tombstones(connection, uids, session.frame_name)
        text = session.statements.text("by id", recall_statements.by_ids)
        for numbers in _chunks(sorted(ids)):
            yield from _read(session, connection, text, {"ids": numbers})


def _found(session: Session, connection: Connection, query: Query) -> Iterator[StoredEvent]:
    text, values = session.asked("find", query, recall_statements.find)
    return _read(session, connection, text, values)


def _read(session: Session, connection: Connection, text: str, values: Mapping[str, Any]) -> Iterator[StoredEvent]:
    for rows in pieces(connection, text, values, size=EVENTS_AT_ONCE):
        session.learn(rows)
        for row in rows:
            yield StoredEvent.of_row(row, session.decode)


def _chunks(items: Iterable[_Item]) -> Iterator[list[_Item]]:
    rest = iter(items)
    while chunk := list(islice(rest, _NAMES_AT_ONCE)):
        yield chunk
