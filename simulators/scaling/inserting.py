"""Committing into memories of several sizes, call by call in turn, with bare inserts into tables of as many rows."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from typing import Any

import elm
from elm.errors import StoreFailure
from elm.event import Event
from simulators.bench.scratch import Connection, bare_schema, connect, with_setting
from simulators.bench.timing import in_milliseconds, in_turn, seconds, steady_heap
from simulators.scaling import growth
from simulators.scaling.loaded import Loaded, take_out_what_came_later
from simulators.worlds.events import DEFAULT_WORLD, PARTS, simulate

MODES = {"durable": "on", "relaxed": "off"}
"""What is measured, and the `synchronous_commit` that it is measured with."""
KINDS = ("event", "complex_event", "bare")
"""What is timed: committing an atomic event, committing a complex one, and inserting a bare row."""

_BLOCKS = 5
"""Turns of each mode: the load of the machine changes while all this runs, and must hit both alike."""
_ROW_BYTES = 200
_INSERT = "INSERT INTO bare_row (data) VALUES (%s)"

Times = dict[str, dict[int, list[float]]]
"""Seconds of each call, by what was called and the number of events in the memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Side:
    """One memory in one mode, the events to come, and the connection to the bare rows beside it."""

    size: int
    memory: elm.Memory
    life: Iterator[Event]
    bare: Connection

    def insert(self, row: bytes) -> None:
        self.bare.execute(_INSERT, (row,), prepare=True)


def measure(
    dsn: str, memories: Sequence[Loaded], *, groups: int, seed: int, advance: Callable[[int], None]
) -> dict[str, Times]:
    """The times of both modes, over `groups` groups of nine atomic events and a complex one for each memory.

    The events come after those of the memory, as new events do, and are otherwise the same for all sizes. In
    the end they are taken out again.
    """
    per_block = -(-groups // _BLOCKS)
    found = {mode: _no_times(memories) for mode in MODES}
    chance = random.Random(seed)
    number = len(MODES) * _BLOCKS * (1 + per_block) * (PARTS + 1)
    with ExitStack() as opened:
        for each in memories:
            opened.callback(take_out_what_came_later, dsn, each.name)
        lives = {each.name: _life_after(dsn, each, seed + 1, number) for each in memories}
        sides = {
            mode: [_side(opened, with_setting(dsn, "synchronous_commit", value), each, lives) for each in memories]
            for mode, value in MODES.items()
        }
        with steady_heap():
            for turn in range(_BLOCKS):
                for mode in in_turn(list(MODES), turn):
                    # The first group of a block is committed and not counted.
                    _group(sides[mode], chance, turn, _no_times(memories))
                    for index in range(per_block):
                        _group(sides[mode], chance, index, found[mode])
                        advance(1)
    return found


def figures(times: Times, between: tuple[int, int]) -> dict[str, Any]:
    """Each series in milliseconds by size, and its growth, of means and of medians."""
    return {
        kind: {
            "growth": growth.of_means(series, between),
            "growth_of_medians": growth.of_medians(series, between),
            "sizes": {str(size): in_milliseconds(calls) for size, calls in series.items()},
        }
        for kind, series in times.items()
    }


def _no_times(memories: Sequence[Loaded]) -> Times:
    return {kind: {each.events: [] for each in memories} for kind in KINDS}


def _life_after(dsn: str, loaded: Loaded, seed: int, number: int) -> Iterator[Event]:
    """Events that begin when the last one of a memory began, the same ones for each memory but for their time."""
    with elm.connect(dsn, loaded.name) as memory:
        last = memory.statistics().last_begin
    if last is None:
        raise StoreFailure(f"memory {loaded.name!r} is empty: there is nothing to compare with")
    return iter(list(islice(simulate(seed, replace(DEFAULT_WORLD, begin=last)), number)))


def _side(opened: ExitStack, dsn: str, loaded: Loaded, lives: dict[str, Iterator[Event]]) -> _Side:
    memory = opened.enter_context(elm.connect(dsn, loaded.name))
    bare = opened.enter_context(connect(with_setting(dsn, "search_path", bare_schema(loaded.name))))
    return _Side(size=loaded.events, memory=memory, life=lives[loaded.name], bare=bare)


def _group(sides: Sequence[_Side], chance: random.Random, number: int, times: Times) -> None:
    """Nine atomic events and a complex one for each memory, the calls of all of them in turn."""
    for place in range(PARTS + 1):
        kind = "event" if place < PARTS else "complex_event"
        row = chance.randbytes(_ROW_BYTES)
        calls: list[tuple[list[float], Callable[[], object]]] = []
        for side in sides:
            calls.append((times["bare"][side.size], partial(side.insert, row)))
            calls.append((times[kind][side.size], partial(side.memory.commit, next(side.life))))
        for series, call in in_turn(calls, number * (PARTS + 1) + place):
            series.append(seconds(call))
