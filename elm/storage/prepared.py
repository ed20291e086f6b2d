"""Statements prepared once per connection and run straight through libpq: the write path has no time to convert."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast
from weakref import WeakKeyDictionary

from psycopg import errors
from psycopg.pq import ExecStatus
from psycopg.pq.abc import PGresult

from elm.storage.connections import Connection

_known: WeakKeyDictionary[Any, set[str]] = WeakKeyDictionary()


def run(connection: Connection, name: str, statement: str, values: Sequence[bytes | None]) -> list[list[bytes | None]]:
    """The rows of a statement whose parameters $1, $2 ... and results are in PostgreSQL's binary format.

    Inside a transaction block of the connection it is part of it, otherwise one of its own. Of libpq,
    because the driver would look up a converter for each of the twenty values at every call, which costs
    more than the server takes to insert them.
    """
    libpq = connection.pgconn
    names = _known.setdefault(connection, set())
    if name not in names:
        _check(libpq.prepare(name.encode(), statement.encode()), connection)
        names.add(name)
    # libpq takes None for NULL; the driver's type for its parameters does not say so.
    given = cast("Sequence[bytes]", values)
    result = _check(libpq.exec_prepared(name.encode(), given, [1] * len(given), 1), connection)
    columns = range(result.nfields)
    return [[result.get_value(row, column) for column in columns] for row in range(result.ntuples)]


def _check(result: PGresult, connection: Connection) -> PGresult:
    if result.status not in (ExecStatus.COMMAND_OK, ExecStatus.TUPLES_OK):
        error = errors.error_from_result(result, encoding=connection.info.encoding)
        # Of a connection that broke libpq has no SQLSTATE, from which the driver would choose the class.
        raise errors.OperationalError(str(error)) if connection.closed else error
    return result
