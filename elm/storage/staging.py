"""Writing many events at once: ids reserved for them, their rows copied to the server, and then their log entries."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from itertools import islice
from typing import NamedTuple
from uuid import UUID

from elm.storage import encoding
from elm.storage import write_statements as sql
from elm.storage.connections import Connection
from elm.storage.tables import LOG_COMMIT, LOG_OPEN

_AT_ONCE = 64
"""Rows that are sent together: while the server takes them in, the next ones are encoded."""


class Written(NamedTuple):
    """An event that a transaction wrote, with what of it stands in the log."""

    id: int
    is_open: bool
    agent: str | None


def reserved_ids(connection: Connection, count: int) -> list[int]:
    """As many ids of events, ascending, that nobody else gets; those that remain unused are gaps."""
    return [number for (number,) in connection.execute(sql.RESERVE_IDS, [count], binary=True)]


def copy_events(connection: Connection, rows: Iterable[tuple[int, encoding.Row]]) -> None:
    """Put rows, each with its id, into the table of events."""
    _copy(connection, sql.COPY_EVENTS, ((encoding.int8(number), *row) for number, row in rows))


def stage(connection: Connection, rows: Iterable[tuple[int, int, encoding.Row]]) -> None:
    """Put rows, each with its id and its level, where the rest of the transaction finds them."""
    connection.execute(sql.CREATE_STAGING)
    numbered = ((encoding.int8(number), encoding.int4(level), *row) for number, level, row in rows)
    _copy(connection, sql.COPY_STAGING, numbered)


def clear(connection: Connection) -> None:
    """Have nothing staged, though the transaction goes on."""
    connection.execute(sql.CREATE_STAGING)
    connection.execute("DELETE FROM staging")


def lock_parts(connection: Connection, uids: Sequence[UUID]) -> bool:
    """Have nobody close or forget the events of these uids before the transaction ends; whether one is a tombstone."""
    connection.execute(sql.LOCK_PARTS, {"uids": uids})
    return bool(connection.execute(sql.LOCK_FORGOTTEN_PARTS, {"uids": uids}).fetchall())


def log(connection: Connection, written: Iterable[Written], now: datetime) -> None:
    """Enter events into the log, in the order of their ids."""
    at = encoding.timestamp(now)
    kinds = {True: encoding.int2(LOG_OPEN), False: encoding.int2(LOG_COMMIT)}
    entries = (
        (encoding.int8(number), kinds[is_open], None if agent is None else agent.encode(), at)
        for number, is_open, agent in sorted(written)
    )
    _copy(connection, sql.COPY_LOG, entries)


def _copy(connection: Connection, statement: str, rows: Iterable[encoding.Row]) -> None:
    """Run a COPY with rows in its binary format."""
    encoded = map(encoding.copied, rows)
    with connection.cursor().copy(statement) as copying:
        copying.write(encoding.COPY_BEGIN)
        while piece := b"".join(islice(encoded, _AT_ONCE)):
            copying.write(piece)
        copying.write(encoding.COPY_END)
