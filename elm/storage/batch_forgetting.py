"""Forgetting a batch of events in one transaction: links, tombstones, the run's own tombstone, and the events."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from datetime import datetime
from uuid import UUID

import psycopg

from elm.errors import DatabaseUnfit
from elm.storage import forgetting_statements as sql
from elm.storage.connections import Connection
from elm.tombstone import Forgotten

_LOCK = 0x656C6E
"""The advisory lock under which memories of one database get their first tombstone."""

TypeNames = Callable[[Connection, Iterable[int]], dict[int, str]]
"""Gives the names of types by their numbers."""


class _FirstTombstone(Exception):
    """The memory is about to get a tombstone, and some writers may not look for it."""


def forget(connection: Connection, ids: Sequence[int], run: UUID, at: datetime, names: TypeNames) -> Forgotten:
    """Forget those of these events that have ended."""
    try:
        with connection.transaction():
            return _forget(connection, ids, run, at, names)
    except _FirstTombstone:
        admit_tombstones(connection)
    with connection.transaction():
        return _forget(connection, ids, run, at, names)


def _forget(connection: Connection, ids: Sequence[int], run: UUID, at: datetime, names: TypeNames) -> Forgotten:
    connection.execute(sql.TAKE_TURNS)
    locked = connection.execute(sql.LOCK_EVENTS, {"ids": list(ids)}).fetchall()
    going = [number for number, is_open in locked if not is_open]
    if not going:
        return Forgotten(still_open=len(locked))
    touched = _numbers(connection, sql.LOCK_TOMBSTONES, going)
    connection.execute(sql.UNLINK, {"ids": going})
    kept = _numbers(connection, sql.STILL_PARTS, going)
    if kept and not admits_tombstones(connection):
        raise _FirstTombstone
    if kept:
        connection.execute(sql.JOIN_TWINS, {"ids": kept})
    dissolved = sorted(set(touched) - set(_numbers(connection, sql.STILL_PARTS, touched)))
    rest = sorted(set(going) - set(kept))
    told = {"run": run, "at": at, "ids": rest, "dissolved": dissolved}
    connection.execute(sql.COUNT_IN, told)
    connection.execute(sql.PLACE_IN, told)
    if kept:
        connection.execute(sql.BURY, {"ids": kept, "run": run})
    tally = connection.execute(sql.TALLY, {"ids": going}).fetchall()
    connection.execute(sql.REMOVE_EVENTS, {"ids": going})
    if dissolved:
        connection.execute(sql.DISSOLVE, {"ids": dissolved})
    types = names(connection, [number for number, _, _ in tally])
    return Forgotten(
        events=len(going),
        tombstones=len(kept),
        dissolved=len(dissolved),
        still_open=len(locked) - len(going),
        bytes=sum(size for _, _, size in tally),
        types={types[number]: count for number, count, _ in tally},
    )


def would_forget(connection: Connection, ids: Sequence[int], names: TypeNames) -> Forgotten:
    """What forgetting these events would do."""
    rows = connection.execute(sql.WOULD_FORGET, {"ids": list(ids)}).fetchall()
    types = names(connection, [row[0] for row in rows])
    return Forgotten(
        events=sum(row[1] for row in rows),
        tombstones=sum(row[3] for row in rows),
        dissolved=rows[0][5] if rows else 0,
        still_open=sum(row[4] for row in rows),
        bytes=sum(row[2] for row in rows),
        types={types[row[0]]: row[1] for row in rows if row[1]},
    )


def admits_tombstones(connection: Connection) -> bool:
    """Whether every statement of every process looks for tombstones."""
    return _says(connection, sql.ADMITS_TOMBSTONES)


def admit_tombstones(connection: Connection) -> None:
    """Have every statement of every process look for tombstones from now on; none is there before that is certain."""
    try:
        with connection.transaction():
            connection.execute(sql.LOCK_PRISTINE, [_LOCK])
            if _says(connection, sql.IS_PRISTINE):
                connection.execute(sql.END_PRISTINE)
        with connection.transaction():
            connection.execute(sql.WAIT_FOR_WRITERS)
            connection.execute(sql.LOCK_PRISTINE, [_LOCK])
            if not admits_tombstones(connection):
                connection.execute(sql.ADMIT_TOMBSTONES)
    except psycopg.errors.InsufficientPrivilege as error:
        said = error.diag.message_primary
        raise DatabaseUnfit(
            f"the first tombstone of a memory needs the database user who created it: {said}. "
            f"Forget, or load the tombstones, as that user once; afterwards others can"
        ) from error


def _says(connection: Connection, question: str) -> bool:
    ((answer,),) = connection.execute(question).fetchall()
    return bool(answer)


def _numbers(connection: Connection, statement: str, ids: Sequence[int]) -> list[int]:
    if not ids:
        return []
    return [number for (number,) in connection.execute(statement, {"ids": list(ids)})]
