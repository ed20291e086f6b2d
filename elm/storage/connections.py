"""Connections to PostgreSQL: opened with the settings that writing and recalling want, their errors translated."""

from __future__ import annotations

import random
import re
import select
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import wraps
from threading import RLock
from typing import Any, ParamSpec, TypeVar
from weakref import WeakSet

import psycopg
from psycopg import sql
from psycopg.types.string import ByteaBinaryLoader

from elm.errors import DatabaseUnfit, DatabaseUnreachable, ElmError, MemoryMissing, StoreClosed, StoreFailure
from elm.storage import forking
from elm.storage.planning import SESSION, WRITING, Planning
from elm.storage.unreachable import unreachable

Connection = psycopg.Connection[Any]
_P = ParamSpec("_P")
_T = TypeVar("_T")

MINIMUM_SERVER = 14
"""The oldest PostgreSQL that has multiranges, from which the span of a complex event is derived."""

# Decoded by elm, when somebody looks: until then the bytes as they came.
_RAW_OIDS = (
    *(psycopg.adapters.types[name].oid for name in ("uuid", "tstzrange", "timestamptz", "json")),
    psycopg.adapters.types["uuid"].array_oid,
)


@contextmanager
def translated(memory: str) -> Iterator[None]:
    """Turns the driver's errors into elm's; nothing else knows psycopg's classes."""
    try:
        yield
    except psycopg.Error as error:
        raise _translate(error, memory) from error


class TransactionUndone(StoreFailure):
    """The server undid a transaction so that another could go on, or it must be begun anew to see what another did."""


_ATTEMPTS = 10


def repeated(call: Callable[_P, _T]) -> Callable[_P, _T]:
    """`call`, which is one transaction, begun anew as often as the server undid it."""

    @wraps(call)
    def run(*args: _P.args, **named: _P.kwargs) -> _T:
        for attempt in range(1, _ATTEMPTS):
            with suppress(TransactionUndone):
                return call(*args, **named)
            # Out of step with the other, or both would be undone again.
            time.sleep(random.uniform(0, 0.02 * attempt))  # noqa: S311 - nothing secret
        return call(*args, **named)

    return run


def _translate(error: psycopg.Error, memory: str) -> ElmError:
    said = str(error.diag.message_primary or error).strip()
    match error:
        case psycopg.errors.InsufficientPrivilege():
            return DatabaseUnfit(
                f"the database user lacks rights for memory {memory!r}: {said}. "
                f"Grant them (CREATE on the database for a new memory; for an existing one all on schema {memory!r}, "
                f"on its tables and on its sequences)"
            )
        case psycopg.errors.UndefinedTable() | psycopg.errors.InvalidSchemaName():
            return MemoryMissing(
                f"memory {memory!r} is missing or incomplete: {said}. Run `elm migrate --memory {memory}`"
            )
        case psycopg.errors.DiskFull() | psycopg.errors.OutOfMemory() | psycopg.errors.ProgramLimitExceeded():
            return DatabaseUnfit(f"the database server is out of room for this: {said}")
        case psycopg.errors.ReadOnlySqlTransaction():
            return DatabaseUnfit(f"the database is read-only: {said}. Connect to the primary server to write")
        case psycopg.errors.QueryCanceled():
            return StoreFailure(f"the database cancelled a statement: {said}")
        case psycopg.errors.DeadlockDetected() | psycopg.errors.SerializationFailure():
            return TransactionUndone(f"writers of memory {memory!r} kept waiting for each other: {said}. Try again")
        case psycopg.errors.CheckViolation() if error.diag.table_name == "part":
            # An id was reserved for a whole before another process drew that of its part.
            return TransactionUndone(f"parts of events of memory {memory!r} were written meanwhile: {said}. Try again")
        case psycopg.OperationalError() | psycopg.InterfaceError():
            return DatabaseUnreachable(f"the connection to the database was lost: {said}. Try again")
        case _:
            return StoreFailure(
                f"the database refused a statement on memory {memory!r}: {said} "
                f"(SQLSTATE {error.sqlstate}). Please report this with the output of `elm doctor`"
            )


def open_connection(dsn: str, settings: Mapping[str, str], *, memory: str | None = None) -> Connection:
    """A connection in autocommit mode whose search_path leads into `memory`."""
    try:
        check_password(dsn)
        connection = psycopg.connect(dsn, autocommit=True, fallback_application_name="elm", client_encoding="UTF8")
    except psycopg.ProgrammingError as error:
        # libpq repeats what it does not understand, which may be the password or a part of it.
        said = "it cannot be parsed" if _PASSWORD.search(dsn) else str(error).strip()
        raise DatabaseUnreachable(
            f"this is not a PostgreSQL DSN: {said}. Write it like postgresql://user@host:5432/database"
        ) from error
    except psycopg.OperationalError as error:
        raise unreachable(dsn, error) from error
    forking.lost_by_children(connection)
    try:
        _set_up(connection, settings, memory)
    except BaseException:
        connection.close()
        raise
    return connection


def _set_up(connection: Connection, settings: Mapping[str, str], memory: str | None) -> None:
    if connection.info.server_version < MINIMUM_SERVER * 10_000:
        version = connection.info.parameter_status("server_version")
        raise DatabaseUnfit(f"PostgreSQL {version} is too old: elm needs {MINIMUM_SERVER} or newer")
    if (encoding := connection.info.parameter_status("server_encoding")) != "UTF8":
        raise DatabaseUnfit(
            f"the database has the encoding {encoding}, which cannot hold every text: "
            f"elm needs one made by CREATE DATABASE ... ENCODING 'UTF8' TEMPLATE template0"
        )
    with translated(memory or ""):
        # PostGIS may live in any schema: find it, for the memory's own must come first in the path.
        row = connection.execute(
            "SELECT n.nspname, t.oid FROM pg_extension e JOIN pg_namespace n ON n.oid = e.extnamespace"
            " JOIN pg_type t ON t.typnamespace = n.oid AND t.typname = 'geometry' WHERE e.extname = 'postgis'"
        ).fetchone()
        path = [sql.Identifier(name) for name in (memory, row[0] if row else None) if name]
        chosen = [
            sql.SQL("SET {} = {}").format(sql.Identifier(name), sql.Literal(value))
            for name, value in {**SESSION, **settings}.items()
        ]
        if path:
            chosen.append(sql.SQL("SET search_path = {}").format(sql.SQL(", ").join(path)))
        connection.execute(sql.SQL("; ").join(chosen))
    if row:
        connection.adapters.register_loader(row[1], ByteaBinaryLoader)
    for oid in _RAW_OIDS:
        connection.adapters.register_loader(oid, ByteaBinaryLoader)


_PASSWORD = re.compile(r"://[^/@]*:.*@|\bpassword", re.DOTALL)
"""What tells that there is a password in a DSN, in any of its forms, also in one that libpq cannot parse."""


def check_password(dsn: str) -> None:
    """Refuse a URI of whose password libpq would take a part for a host, a port or a database, and show it as such."""
    known = psycopg.conninfo.conninfo_to_dict(dsn)
    # An @ in front is an abstract socket.
    if "@" in str(known.get("host", ""))[1:] or not str(known.get("port") or 1).replace(",", "").isdigit():
        raise DatabaseUnreachable(
            "this is not a PostgreSQL DSN: host and port cannot be told apart from a password. "
            "In a URI write %40 for @, %2F for /, %3A for : and %25 for % in a password"
        )


class Connections:
    """The connections of one store: one to write with, and as many to recall with as results are being read.

    A forked process opens its own; a result that was being read goes on in the process that asked for it.
    """

    def __init__(self, dsn: str, memory: str) -> None:
        self._dsn = dsn
        self._memory = memory
        self._closed = False
        # Both are reentrant: the garbage collector lets go of results that nobody reads on, and a signal's handler
        # closes, amid whatever this thread was doing.
        self._lock = RLock()
        self._idle: dict[Planning, deque[Connection]] = {planning: deque() for planning in Planning}
        self._writing: Connection | None = None
        self._write_lock = RLock()
        self._opened: WeakSet[Connection] = WeakSet()
        # A memory that nobody closed lets go of the server too, without the driver's warning.
        weakref.finalize(self, _close_all, self._opened)
        forking.renewed_in_children(self)

    def begin_anew(self) -> None:
        """Have no connection yet, and locks that nobody holds: those of another process were not meant for this."""
        self._lock, self._write_lock = RLock(), RLock()
        self._idle = {planning: deque() for planning in Planning}
        self._writing = None
        self._opened.clear()

    def _open(self, settings: Mapping[str, str]) -> Connection:
        connection = open_connection(self._dsn, settings, memory=self._memory)
        self._opened.add(connection)
        return connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """The connection that writes, one caller at a time."""
        with self._write_lock:
            self.check_open()
            if self._writing is None or _is_lost(self._writing):
                self._writing = self._open(WRITING)
                # At a rollback the driver would deallocate its own prepared statements, and with them those of
                # `prepared`, of which it does not know.
                self._writing.prepare_threshold = None
            with translated(self._memory):
                yield self._writing

    @contextmanager
    def recalling(self, planning: Planning = Planning.ANEW) -> Iterator[Connection]:
        """A connection to recall with, to one caller at a time; handed on when the caller is done."""
        idle = self._idle[planning]
        with self._lock:
            self.check_open()
            connection = idle.pop() if idle else None
        if connection is None or _is_lost(connection):
            connection = self._open(planning.value)
        try:
            with translated(self._memory):
                yield connection
        finally:
            reusable = connection.info.transaction_status == psycopg.pq.TransactionStatus.IDLE
            with self._lock:
                is_kept = reusable and not self._closed
                if is_kept:
                    idle.append(connection)
            if not is_kept:
                connection.close()

    def check_open(self) -> None:
        """Refuse to go on after `close`."""
        if self._closed:
            raise StoreClosed(f"memory {self._memory!r} was closed: open it again with elm.connect")

    def close(self) -> None:
        """Close all connections; one that a result is still being read from closes when that ends.

        What is being written by then is written: closing waits for it.
        """
        with self._lock:
            self._closed = True
            for idle in self._idle.values():
                while idle:
                    idle.pop().close()
        with self._write_lock:
            if self._writing is not None:
                self._writing.close()


def _is_lost(connection: Connection) -> bool:
    """Whether the server hung up: an idle connection has nothing to read but its last words, or their end."""
    if connection.closed:
        return True
    poll = select.poll()
    poll.register(connection.fileno(), select.POLLIN)
    if not poll.poll(0):
        return False
    connection.close()
    return True


def _close_all(connections: WeakSet[Connection]) -> None:
    for connection in connections:
        connection.close()
