"""Memories full of simulated events: loaded in bulk, kept under a stable name on request, continued after a stop."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from time import perf_counter
from uuid import uuid4

import psycopg
from psycopg import sql

import elm
from elm.errors import StoreFailure
from elm.event import Event
from elm.storage import migrate
from elm.writer import LOAD_BATCH
from simulators.bench.scratch import Connection, bare_schema, connect, with_setting
from simulators.bench.timing import seconds
from simulators.bench.twins import Twins
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate

COPIED = 20_000
"""Events at the end of a load whose finished rows are also put into empty tables by a bare COPY."""

_CREATE_RECORD = """
CREATE TABLE IF NOT EXISTS record (
    events bigint NOT NULL, last_id bigint NOT NULL, load_seconds float8 NOT NULL, tidy_seconds float8, copy_rate float8
)
"""
_FIRST_RECORD = "INSERT INTO record SELECT 0, 0, 0, NULL, NULL WHERE NOT EXISTS (SELECT FROM record)"
_ADD = "UPDATE record SET events = %s, last_id = (SELECT max(id) FROM event), load_seconds = load_seconds + %s"

_CREATE_BARE = "CREATE TABLE bare_row (id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, data bytea NOT NULL)"
# 200 bytes that no compression makes smaller, as in the rows that are inserted later.
_FILL_BARE = """
INSERT INTO bare_row (data)
SELECT substr(sha512(a) || sha512(a || 'b') || sha512(a || 'c') || sha512(a || 'd'), 1, 200)
FROM (SELECT n::text::bytea FROM generate_series(1, %s) AS series (n)) AS numbered (a)
"""

_BEHIND = (
    "DELETE FROM part WHERE whole_id > (SELECT last_id FROM record)",
    "DELETE FROM log WHERE event_id > (SELECT last_id FROM record)",
    "DELETE FROM log_inbox WHERE event_id > (SELECT last_id FROM record)",
    "DELETE FROM event WHERE id > (SELECT last_id FROM record)",
)
_READ_ALL = """
SELECT sum(pg_prewarm(oid::regclass, 'read')) FROM pg_class
WHERE relnamespace = ANY (%s::regnamespace[]) AND relkind IN ('r', 'i')
"""
_SIZES = """
SELECT c.relname, pg_relation_size(c.oid) FROM pg_class c
WHERE c.relnamespace = %s::regnamespace AND c.relkind IN ('r', 'i') AND pg_relation_size(c.oid) > 8192
ORDER BY 2 DESC
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Loaded:
    """A memory of exactly `events` simulated events, and what loading them took, in however many runs."""

    name: str
    events: int
    last_id: int
    load_seconds: float
    tidy_seconds: float
    copy_events_per_second: float
    bytes: int
    relations: dict[str, int]
    """Bytes of each table and index, the largest first."""

    def figures(self) -> dict[str, object]:
        """Time and disk of the load."""
        return {
            "events": self.events,
            "load_seconds": round(self.load_seconds, 3),
            "tidy_seconds": round(self.tidy_seconds, 3),
            "events_per_second": self.events / self.load_seconds,
            "copy_events_per_second": self.copy_events_per_second,
            "bytes": self.bytes,
            "bytes_per_event": self.bytes / self.events,
            "relations": self.relations,
        }


def name_of(events: int, seed: int) -> str:
    """The name under which a memory of so many events is kept."""
    return f"scale_{events}_{seed}"


@contextmanager
def memory_of(dsn: str, events: int, seed: int, *, keep: bool, advance: Callable[[int], None]) -> Iterator[Loaded]:
    """A memory of the first `events` simulated events of a seed; `advance` is told of events as they are loaded.

    A kept one is found again, continued where its last batch ended, and stays; any other is new, has a name of
    its own and is dropped. Only one process can use a kept one at a time.
    """
    name = name_of(events, seed) if keep else f"{name_of(events, seed)}_{uuid4().hex[:8]}"
    with connect(dsn) as owning:
        # Gone with the connection, whatever becomes of this process.
        row = owning.execute("SELECT pg_try_advisory_lock(hashtext(%s))", [name]).fetchone()
        if row is None or not row[0]:
            raise StoreFailure(f"another process is measuring in memory {name!r}: wait for it")
        try:
            with _beside(dsn, name) as connection:
                _load(dsn, name, connection, events, seed, advance)
                _read_all(connection, name)
                yield _described(connection, name, events)
        finally:
            if not keep:
                _drop(owning, name)


def take_out_what_came_later(dsn: str, name: str) -> None:
    """Remove the events that were written after the load, and the bare rows, so that as many are left as before."""
    with _beside(dsn, name) as connection:
        _take_out_behind(connection)
        connection.execute("DELETE FROM bare_row WHERE id > (SELECT events FROM record)")
        # Of a few dead rows the indexes would not be told, and each recall would pass over them.
        connection.execute("VACUUM (INDEX_CLEANUP ON) event, part, log_inbox, bare_row")


def drop_kept(dsn: str) -> list[str]:
    """Drop all kept memories, of all sizes and seeds; their names."""
    with connect(dsn) as connection:
        found = connection.execute(
            "SELECT nspname FROM pg_namespace WHERE nspname ~ '^scale_[0-9]+_[0-9]+$' ORDER BY nspname"
        ).fetchall()
        for (name,) in found:
            _drop(connection, name)
    return [name for (name,) in found]


def _drop(connection: Connection, name: str) -> None:
    for schema in (name, bare_schema(name)):
        connection.execute(sql.SQL("DROP SCHEMA IF EXISTS {} CASCADE").format(sql.Identifier(schema)))


@contextmanager
def _beside(dsn: str, name: str) -> Iterator[Connection]:
    """A connection that finds the memory's tables, and those in the schema beside it."""
    path = f'"{name}","{bare_schema(name)}",public'
    with connect(with_setting(dsn, "search_path", path)) as connection:
        yield connection


def _load(dsn: str, name: str, connection: Connection, events: int, seed: int, advance: Callable[[int], None]) -> None:
    done = _prepare(dsn, name, connection, events)
    advance(done)
    row = connection.execute("SELECT tidy_seconds IS NOT NULL FROM record").fetchone()
    if row is not None and row[0]:
        return
    batch = min(LOAD_BATCH, max(events // 10, 100))
    life = _Life(islice(simulate(seed), done, events), batch)
    with elm.connect(dsn, name) as memory:
        memory.add_types(hierarchy.event_types())
        told = 0
        begin, made = perf_counter(), 0.0

        def loaded(count: int) -> None:
            nonlocal told, begin, made
            taken = perf_counter() - begin - (life.seconds - made)
            connection.execute(_ADD, [done + count, taken])
            advance(count - told)
            told = count
            begin, made = perf_counter(), life.seconds

        memory.load(life.events(), progress=loaded, batch=batch)
        tidying = perf_counter() - begin
    _check_count(connection, events)
    rate = _copy_rate(connection, name, events)
    connection.execute("UPDATE record SET tidy_seconds = %s, copy_rate = %s", [tidying, rate])


def _prepare(dsn: str, name: str, connection: Connection, events: int) -> int:
    """Make what is missing, and take out what no record tells of; how many events are there."""
    migrate(dsn, name)
    beside = sql.Identifier(bare_schema(name))
    with connection.transaction():
        connection.execute(sql.SQL("CREATE SCHEMA IF NOT EXISTS {}").format(beside))
        connection.execute(sql.SQL("SET LOCAL search_path = {}").format(beside))
        connection.execute(_CREATE_RECORD)
        connection.execute(_FIRST_RECORD)
        if connection.execute("SELECT to_regclass('bare_row')").fetchone() == (None,):
            connection.execute(_CREATE_BARE)
            connection.execute(_FILL_BARE, [events])
    _take_out_behind(connection)
    row = connection.execute("SELECT events FROM record").fetchone()
    return int(row[0]) if row else 0


def _take_out_behind(connection: Connection) -> None:
    with connection.transaction():
        for statement in _BEHIND:
            connection.execute(statement)


class _Life:
    """Events made in blocks, with the time that making them took, which is no part of loading them."""

    def __init__(self, stream: Iterator[Event], block: int) -> None:
        self._stream = stream
        self._block = block
        self.seconds = 0.0

    def events(self) -> Iterator[Event]:
        while block := self._next():
            yield from block

    def _next(self) -> list[Event]:
        begin = perf_counter()
        block = list(islice(self._stream, self._block))
        self.seconds += perf_counter() - begin
        return block


def _check_count(connection: Connection, events: int) -> None:
    row = connection.execute("SELECT (SELECT count(*) FROM event), events FROM record").fetchone()
    if row != (events, events):
        raise StoreFailure(f"events in the memory and in its record: {row}, where {events:,} were loaded")


def _copy_rate(connection: Connection, name: str, events: int) -> float:
    """Events per second of a bare COPY of the last finished rows into empty tables with equal indexes and checks."""
    number = min(COPIED, events)
    row = connection.execute("SELECT id FROM event ORDER BY id DESC OFFSET %s LIMIT 1", [number - 1]).fetchone()
    first = row[0] if row else 0
    with connect(connection.info.dsn) as own:
        twins = Twins(own, name, ["event", "part"])
        try:
            rows = {
                "event": twins.finished("event", f"id >= {first} ORDER BY id"),
                "part": twins.finished("part", f"whole_id >= {first} ORDER BY whole_id, ordinal"),
            }
            return number / seconds(lambda: twins.copy(rows))
        finally:
            for table in ("part", "event"):
                own.execute(sql.SQL("DROP TABLE {}").format(sql.Identifier(bare_schema(name), table)))


def _read_all(connection: Connection, name: str) -> None:
    """Have the operating system read the memory's files, as it has those of a memory that was just loaded.

    Where the extension pg_prewarm cannot be had, a kept memory is measured as it is.
    """
    known = connection.execute("SELECT FROM pg_extension WHERE extname = 'pg_prewarm'").fetchone()
    try:
        if known is None:
            beside = sql.Identifier(bare_schema(name))
            connection.execute(sql.SQL("CREATE EXTENSION pg_prewarm SCHEMA {}").format(beside))
        connection.execute(_READ_ALL, [[f'"{name}"', f'"{bare_schema(name)}"']])
        if known is None:
            connection.execute("DROP EXTENSION pg_prewarm")
    except psycopg.errors.Error as error:
        print(f"not read beforehand: {str(error).strip()}", file=sys.stderr)


def _described(connection: Connection, name: str, events: int) -> Loaded:
    record = connection.execute("SELECT last_id, load_seconds, tidy_seconds, copy_rate FROM record").fetchone()
    size = connection.execute(
        "SELECT sum(pg_total_relation_size(oid))::bigint FROM pg_class"
        " WHERE relnamespace = %s::regnamespace AND relkind = 'r'",
        [f'"{name}"'],
    ).fetchone()
    if record is None or size is None:
        raise StoreFailure(f"memory {name!r} has no record of its load: drop it with --drop")
    return Loaded(
        name=name,
        events=events,
        last_id=record[0],
        load_seconds=record[1],
        tidy_seconds=record[2],
        copy_events_per_second=record[3],
        bytes=size[0],
        relations=dict(connection.execute(_SIZES, [f'"{name}"']).fetchall()),
    )
