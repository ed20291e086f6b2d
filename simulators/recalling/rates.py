"""How fast a large answer is read, as objects and as an Arrow table, against psycopg and ADBC fetching its rows."""

from __future__ import annotations

import gc
import statistics
from collections.abc import Callable
from contextlib import ExitStack
from importlib import import_module

from psycopg.types.string import ByteaBinaryLoader

import elm
from elm.errors import StoreFailure
from elm.event import StoredEvent
from simulators.bench.scratch import Connection
from simulators.bench.timing import in_turn, seconds
from simulators.recalling import hand_sql
from simulators.recalling.classes import fetch

SIDES = {
    "objects": "Event objects",
    "objects_read": "Event objects, each field looked at",
    "fetch": "psycopg, its own loaders",
    "raw_fetch": "psycopg, values left as bytes",
    "arrow": "Arrow table",
    "adbc": "ADBC",
}
_INTEGERS = ("int2", "int4", "int8")


def measure(dsn: str, memory: elm.Memory, *, rounds: int, advance: Callable[[int], None]) -> dict[str, float]:
    """Rows per second of each side that is installed: medians over rounds in which each reads all events by begin."""
    with ExitStack() as opened:
        plain = opened.enter_context(hand_sql.like_elm(dsn, memory.name))
        raw = opened.enter_context(hand_sql.like_elm(dsn, memory.name))
        _leave_as_bytes(raw)
        calls: dict[str, Callable[[], int]] = {
            "objects": lambda: len(list(memory.recall())),
            "objects_read": lambda: sum(map(_look_at, memory.recall())),
            "fetch": lambda: len(fetch(plain, hand_sql.EVERYTHING, {})),
            "raw_fetch": lambda: len(fetch(raw, hand_sql.EVERYTHING, {})),
        }
        if _has("pyarrow"):
            calls["arrow"] = lambda: int(memory.recall().to_arrow().read_all().num_rows)
        if _has("pyarrow") and _has("adbc_driver_postgresql"):
            calls["adbc"] = _adbc(dsn, plain, opened)
        rows = {side: call() for side, call in calls.items()}
        if len(set(rows.values())) != 1:
            raise StoreFailure(f"the sides read different numbers of rows: {rows}")
        times: dict[str, list[float]] = {side: [] for side in calls}
        for turn in range(rounds):
            for side in in_turn(list(calls), turn):
                gc.collect()
                times[side].append(seconds(calls[side]))
            advance(1)
    return {side: rows[side] / statistics.median(series) for side, series in times.items()}


def _look_at(event: StoredEvent) -> int:
    for name in StoredEvent.FIELDS:
        getattr(event, name)
    return 1


def _leave_as_bytes(connection: Connection) -> None:
    columns = connection.execute(hand_sql.EVERYTHING + " LIMIT 0", binary=True).description or []
    integers = {connection.adapters.types[name].oid for name in _INTEGERS}
    for oid in {column.type_code for column in columns} - integers:
        connection.adapters.register_loader(oid, ByteaBinaryLoader)


def _has(package: str) -> bool:
    try:
        import_module(package)
    except ImportError:
        return False
    return True


def _adbc(dsn: str, model: Connection, opened: ExitStack) -> Callable[[], int]:
    """Fetching the same columns through ADBC, in a session with the settings of `model`."""
    connection = opened.enter_context(import_module("adbc_driver_postgresql.dbapi").connect(dsn, autocommit=True))
    cursor = opened.enter_context(connection.cursor())
    for name, setting in model.execute("SELECT name, setting FROM pg_settings WHERE source = 'session'").fetchall():
        cursor.execute("SELECT set_config($1, $2, false)", (name, setting))
        cursor.fetchall()

    def read() -> int:
        cursor.execute(hand_sql.EVERYTHING)
        return int(cursor.fetch_arrow_table().num_rows)

    return read
