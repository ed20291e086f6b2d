"""Committing event by event against bare inserts, call by call in turn, durable and relaxed."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from typing import Any

import elm
from elm.errors import StoreFailure
from elm.event import Event
from simulators.bench.scratch import bare_schema, connect, scratch_memory, with_setting
from simulators.bench.timing import in_milliseconds, in_turn, mean_ratio, median_ratio, seconds, steady_heap
from simulators.worlds import hierarchy
from simulators.worlds.events import PARTS, simulate

MODES = {"durable": "on", "relaxed": "off"}
"""What is measured, and the `synchronous_commit` that it is measured with."""

_GROUP = PARTS + 1
_BLOCKS = 5
"""Turns of each mode: the load of the machine changes while all this runs, and must hit both alike."""
_WARM_UP = _GROUP
"""Events at the start of a block that are committed and not counted."""
_ROW_BYTES = 200

_CREATE = "CREATE TABLE bare_row (id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, data bytea NOT NULL)"
_INSERT = "INSERT INTO bare_row (data) VALUES (%s)"


@dataclass(slots=True)
class Series:
    """The times of one mode, in seconds."""

    bare: list[float] = field(default_factory=list)
    event: list[float] = field(default_factory=list)
    complex_event: list[float] = field(default_factory=list)
    ten_rows: list[float] = field(default_factory=list)
    ten_rows_executemany: list[float] = field(default_factory=list)

    def figures(self) -> dict[str, Any]:
        """Each series in milliseconds, and the ratios, of means and of medians."""
        return {
            "bare": in_milliseconds(self.bare),
            "event": in_milliseconds(self.event),
            "complex_event": in_milliseconds(self.complex_event),
            "ten_rows": in_milliseconds(self.ten_rows),
            "ten_rows_executemany": in_milliseconds(self.ten_rows_executemany),
            "ratio": mean_ratio(self.event, self.bare),
            "ratio_of_medians": median_ratio(self.event, self.bare),
            "complex_vs_ten_rows": mean_ratio(self.complex_event, self.ten_rows),
            "complex_vs_ten_rows_of_medians": median_ratio(self.complex_event, self.ten_rows),
            "complex_vs_ten_rows_executemany": mean_ratio(self.complex_event, self.ten_rows_executemany),
        }


class _Bare:
    """The table with which events are compared, through one connection in autocommit mode."""

    def __init__(self, dsn: str, memory: str) -> None:
        self._connection = connect(with_setting(dsn, "search_path", bare_schema(memory)))

    def create(self) -> None:
        self._connection.execute(_CREATE)

    def one(self, row: bytes) -> None:
        self._connection.execute(_INSERT, (row,), prepare=True)

    def ten(self, rows: Sequence[bytes]) -> None:
        with self._connection.transaction():
            for row in rows:
                self._connection.execute(_INSERT, (row,), prepare=True)

    def ten_by_executemany(self, rows: Sequence[bytes]) -> None:
        with self._connection.transaction():
            self._connection.cursor().executemany(_INSERT, [(row,) for row in rows])

    def count(self) -> int:
        row = self._connection.execute("SELECT count(*) FROM bare_row").fetchone()
        return int(row[0]) if row else 0

    def close(self) -> None:
        self._connection.close()


def measure(dsn: str, *, events: int, seed: int, advance: Callable[[int], None]) -> dict[str, Series]:
    """The times of both modes, over at least `events` events each, all in one new memory.

    The memory has a past of one event of each type, which every connection has seen: neither empty
    indexes nor the first sight of a type's name are in the figures.
    """
    per_block = -(-events // (_BLOCKS * _GROUP)) * _GROUP
    needed = len(MODES) * _BLOCKS * (_WARM_UP + per_block)
    life = _grouped(islice(simulate(seed), needed))
    chance = random.Random(seed)
    rows = [[chance.randbytes(_ROW_BYTES) for _ in range(_GROUP)] for _ in range(needed // _GROUP)]
    past = _past(seed + 1)
    series = {mode: Series() for mode in MODES}
    with scratch_memory(dsn) as name, ExitStack() as opened:
        memories = {
            mode: opened.enter_context(elm.connect(with_setting(dsn, "synchronous_commit", value), name))
            for mode, value in MODES.items()
        }
        bare = {mode: _Bare(with_setting(dsn, "synchronous_commit", value), name) for mode, value in MODES.items()}
        for side in bare.values():
            opened.callback(side.close)
        bare["durable"].create()
        memories["durable"].add_types(hierarchy.event_types())
        memories["durable"].load(past)
        for memory in memories.values():
            for _ in memory.recall():
                pass
        groups = zip(life, rows, strict=True)
        with steady_heap():
            for turn in range(_BLOCKS):
                for mode in in_turn(list(MODES), turn):
                    for number, group in enumerate(islice(groups, (_WARM_UP + per_block) // _GROUP)):
                        is_counted = number * _GROUP >= _WARM_UP
                        _commit(memories[mode], bare[mode], *group, number, series[mode] if is_counted else Series())
                        advance(_GROUP if is_counted else 0)
        _check_count("events", memories["durable"].statistics().events, len(past) + needed)
        # Each group has nine rows beside the atomic events, and ten in each of two ways beside the complex one.
        _check_count("bare rows", bare["durable"].count(), needed // _GROUP * (PARTS + 2 * _GROUP))
    return series


def _commit(
    memory: elm.Memory, bare: _Bare, group: Sequence[Event], rows: Sequence[bytes], number: int, series: Series
) -> None:
    """One group of events and as many bare rows, whoever comes first taking turns."""
    *atomic, whole = group
    for index, (event, row) in enumerate(zip(atomic, rows, strict=False)):
        _time([(series.bare, partial(bare.one, row)), (series.event, partial(memory.commit, event))], number + index)
    _time(
        [
            (series.ten_rows, partial(bare.ten, rows)),
            (series.complex_event, partial(memory.commit, whole)),
            (series.ten_rows_executemany, partial(bare.ten_by_executemany, rows)),
        ],
        number,
    )


def _time(calls: Sequence[tuple[list[float], Callable[[], object]]], turn: int) -> None:
    for times, call in in_turn(calls, turn):
        times.append(seconds(call))


def _grouped(events: Iterable[Event]) -> list[list[Event]]:
    """Nine atomic events and the complex one that has them as parts, again and again."""
    stream: Iterator[Event] = iter(events)
    groups = []
    while group := list(islice(stream, _GROUP)):
        groups.append(group)
    return groups


def _past(seed: int) -> list[Event]:
    """One atomic event of each type."""
    names = (name for level in hierarchy.levels() for name in level)
    atomic = (event for event in simulate(seed) if not event.is_complex)
    return [replace(event, type=name) for name, event in zip(names, atomic, strict=False)]


def _check_count(what: str, found: int, expected: int) -> None:
    if found != expected:
        raise StoreFailure(f"{found:,} {what} where {expected:,} were written: the figures would be of something else")
