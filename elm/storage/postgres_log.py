"""The log of a memory in PostgreSQL: sequenced when somebody asks for its head, read by position, kept by consumers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from typing import Any

import msgspec
import psycopg

from elm.event import StoredEvent
from elm.log import (
    Advance,
    Consumer,
    LogEntry,
    LogKind,
    Progress,
    Tick,
    beyond_the_end,
    check_position,
    position_lost,
    unknown_consumer,
)
from elm.storage import log_statements as sql
from elm.storage.connections import Connection, repeated
from elm.storage.log_signals import Ear, News, exclusive
from elm.storage.rows import Column, moment
from elm.storage.session import Session
from elm.storage.tables import LOG_CLOSE, LOG_COMMIT, LOG_OPEN, LOG_PUNCTUATION, LOG_TICK
from elm.storage.writing_together import Together
from elm.store import Arrival, Committed
from elm.text import check_short_name

SEQUENCED_AT_ONCE = 50_000
"""Entries that enter the log in one transaction: some 200 ms, for which others that read the log wait."""
POLL = 0.02
"""Seconds after which a waiting reader looks by itself: not every commit is told of."""

_EVENT_COLUMNS = len(Column)
_KINDS = {
    LOG_COMMIT: LogKind.COMMIT,
    LOG_CLOSE: LogKind.CLOSE,
    LOG_OPEN: LogKind.OPEN,
    LOG_TICK: LogKind.TICK,
    LOG_PUNCTUATION: LogKind.PUNCTUATION,
}
_NUMBERS = {kind: number for number, kind in _KINDS.items()}


class PostgresLog:
    """The `Log` of one schema of a PostgreSQL database; safe to share between threads."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._connections = session.connections
        self._news = News(session.memory)

    # Entries

    def head(self) -> int:
        """Bring everything committed so far into the log; the position of the last entry, 0 when there is none.

        Who may only read the tables of the log, or is connected to a database that is read-only, gets the last entry
        of those that others brought in.
        """
        self._session.ready_to_recall()
        with self._connections.recalling() as connection:
            return _sequenced(connection)

    def read(self, after: int, limit: int) -> list[LogEntry]:
        """Up to `limit` entries behind position `after`, of those that a call of `head` brought in."""
        check_position(after)
        check_position(limit, what="the number of entries to read")
        self._session.ready_to_recall()
        text = self._session.statements.text("log", sql.read)
        with self._connections.recalling() as connection:
            rows = connection.execute(text, {"after": after, "limit": limit}, binary=True).fetchall()
            self._session.learn([row for row in rows if row[0] is not None], connection)
        return [self._entry(row) for row in rows]

    def _entry(self, row: Sequence[Any]) -> LogEntry:
        position, kind, agent, deadline, at = row[_EVENT_COLUMNS:]
        return LogEntry(
            position=position,
            kind=_KINDS[kind],
            at=moment(at),
            agent=agent,
            event=None if row[0] is None else StoredEvent.of_row(row, self._session.decode),
            deadline=None if deadline is None else moment(deadline),
        )

    @repeated
    def write(self, ticks: Sequence[Tick]) -> None:
        """Write entries of clocks."""
        self._session.ready_to_write()
        values = {
            "kinds": [_NUMBERS[tick.kind] for tick in ticks],
            "agents": [tick.agent for tick in ticks],
            "deadlines": [tick.deadline for tick in ticks],
            "now": datetime.now(UTC),
        }
        with self._connections.writing() as connection:
            connection.execute(sql.WRITE, values)
            self.tell(connection)

    def wait(self, after: int, seconds: float) -> bool:
        """Wait until there is more than position `after`, at most `seconds`; whether there is."""
        check_position(after)
        until = time.monotonic() + seconds
        if self.head() > after:
            return True
        # A server that hangs up on who waits may be there again; a new connection tells.
        for is_last in (False, True):
            with self._connections.recalling() as connection:
                try:
                    with self._news.heard_by(connection) as ear:
                        return self._waited(connection, ear, after, until)
                except psycopg.OperationalError:
                    if is_last:
                        raise
        raise AssertionError("the last turn returns or raises")

    def _waited(self, connection: Connection, ear: Ear, after: int, until: float) -> bool:
        while True:
            self._connections.check_open()
            if _sequenced(connection) > after:
                return True
            left = until - time.monotonic()
            if left <= 0:
                return False
            ear.wait(min(left, POLL))

    def tell(self, connection: Connection) -> None:
        """Wake who waits, by the connection that has just committed something."""
        self._news.tell(connection)

    # Consumers

    def consumers(self) -> list[Consumer]:
        """All consumers, by name."""
        return [_consumer(row) for row in self._recalled(sql.CONSUMERS_BY_NAME, {})]

    def progress(self) -> list[Progress]:
        """How far all consumers got, by name, without what they know."""
        return [_progress(row) for row in self._recalled(sql.PROGRESS, {})]

    def consumer(self, name: str) -> Consumer | None:
        """The consumer of this name."""
        return next((_consumer(row) for row in self._recalled(sql.CONSUMER, {"name": name})), None)

    @repeated
    def register(self, name: str, *, position: int = 0) -> Consumer:
        """The consumer of this name; a new one begins behind `position`."""
        check_short_name(name, what="the name of a consumer")
        check_position(position)
        self._session.ready_to_write()
        with self._connections.writing() as connection:
            connection.execute(sql.REGISTER, {"name": name, "position": position, "now": datetime.now(UTC)})
            row = connection.execute(sql.CONSUMER, {"name": name}, binary=True).fetchone()
            if row is None:
                raise beyond_the_end(name, position, _head(connection))
        return _consumer(row)

    @repeated
    def advance(self, advances: Sequence[Advance], results: Sequence[Arrival] = ()) -> list[Committed]:
        """Commit results and move consumers on, all in one transaction.

        A consumer that is not at the `before` of its advance refuses the whole call with `PositionLost`: another
        process has done the work.
        """
        self._session.ready_to_write()
        together = Together(results, self._session.names)
        with self._connections.writing() as connection:
            with connection.transaction():
                # First the consumers: who comes second waits there, and finds its position lost before it writes.
                # In order of names, so that two that move the same consumers do not wait for each other.
                for each in sorted(advances, key=lambda each: each.name):
                    _advance(connection, each)
                done = together.commit(connection, partial(self._session.stored, connection))
            if results:
                self.tell(connection)
        return done

    @repeated
    def rewind(self, name: str, position: int) -> None:
        """Have a consumer begin again behind `position`, without state."""
        check_position(position)
        self._session.ready_to_change()
        with self._connections.writing() as connection:
            values = {"name": name, "position": position, "now": datetime.now(UTC)}
            if connection.execute(sql.REWIND, values).rowcount == 0:
                _known_position(connection, name)
                raise beyond_the_end(name, position, _head(connection))

    def remove(self, name: str) -> None:
        """Forget a consumer; an unknown one is no error."""
        self._session.ready_to_change()
        with self._connections.writing() as connection:
            connection.execute(sql.REMOVE, {"name": name})

    @contextmanager
    def exclusive(self, name: str) -> Iterator[None]:
        """Be the only one to work under this name while the context is open; `ConsumerBusy` when another does."""
        check_short_name(name, what="the name of a consumer")
        self._connections.check_open()
        with exclusive(self._session.dsn, self._session.memory, name):
            yield

    # Definitions

    def definitions(self) -> dict[str, str]:
        """Fingerprints of the definitions that have been at work here, by name and version."""
        return dict(self._recalled(sql.DEFINITIONS, {}))

    @repeated
    def define(self, fingerprints: Mapping[str, str]) -> None:
        """Remember definitions; the first fingerprint of a name stays."""
        for name in fingerprints:
            check_short_name(name, what="the name of a definition")
        self._session.ready_to_write()
        names = sorted(fingerprints)
        with self._connections.writing() as connection:
            values = {"names": names, "fingerprints": [fingerprints[name] for name in names]}
            connection.execute(sql.DEFINE, values)

    def _recalled(self, statement: str, values: dict[str, Any]) -> list[Any]:
        self._session.ready_to_recall()
        with self._connections.recalling() as connection:
            return connection.execute(statement, values, binary=True).fetchall()


def _sequenced(connection: Connection) -> int:
    """The head of the log after everything committed by now has entered it, where the user may see to that."""
    ((head, is_to_enter),) = connection.execute(sql.HEAD).fetchall()
    moved = SEQUENCED_AT_ONCE if is_to_enter else 0
    # Fewer than asked for were all there were: not until the inbox is empty, for others go on writing.
    while moved == SEQUENCED_AT_ONCE:
        with connection.transaction():
            connection.execute(sql.LOCK_HEAD)
            ((head, moved),) = connection.execute(sql.SEQUENCE, {"most": SEQUENCED_AT_ONCE}).fetchall()
    return int(head)


def _advance(connection: Connection, advance: Advance) -> None:
    values = {
        "name": advance.name,
        "before": advance.before,
        "position": advance.position,
        "state": advance.state,
        "report": msgspec.json.encode(dict(advance.report)).decode(),
        "now": datetime.now(UTC),
    }
    statement = sql.ADVANCE if advance.state is None else sql.ADVANCE_CHECKPOINT
    if connection.execute(statement, values).rowcount == 0:
        found = _known_position(connection, advance.name)
        if found != advance.before:
            raise position_lost(advance, found)
        raise beyond_the_end(advance.name, advance.position, _head(connection))


def _known_position(connection: Connection, name: str) -> int:
    row = connection.execute(sql.CONSUMER, {"name": name}).fetchone()
    if row is None:
        raise unknown_consumer(name)
    return int(row[1])


def _head(connection: Connection) -> int:
    ((head, _),) = connection.execute(sql.HEAD).fetchall()
    return int(head)


def _consumer(row: Sequence[Any]) -> Consumer:
    name, position, checkpoint, state, report, updated_at = row
    return Consumer(
        name=name,
        position=position,
        checkpoint=checkpoint,
        state=state,
        report=msgspec.json.decode(report),
        updated_at=moment(updated_at),
    )


def _progress(row: Sequence[Any]) -> Progress:
    name, position, report, updated_at = row
    return Progress(name=name, position=position, report=msgspec.json.decode(report), updated_at=moment(updated_at))
