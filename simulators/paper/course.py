"""One experimental run: events committed one by one, cues asked in between, and the limits of both call by call."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from itertools import islice
from time import perf_counter

import elm
from elm import cues
from elm.cues.algebra import Cue
from elm.errors import StoreFailure
from elm.event import Event
from simulators.bench.scratch import Connection, bare_schema, connect, scratch_memory, with_setting
from simulators.bench.timing import in_turn, seconds, steady_heap
from simulators.paper.copies import Copies
from simulators.paper.moments import BySize
from simulators.paper.schedule import INSERTIONS, QUERIES, Answer, Course
from simulators.paper.times import ALL, Longest, Times
from simulators.recalling import hand_sql
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate
from simulators.worlds.queries import SimulatedQuery, simulate_queries

FIRST = 1_000
"""Events that are read as objects where an answer is not read whole."""
BARE_EVERY = 10
"""Of how many insertions one has a bare insert beside it."""
FETCH_EVERY = 10
"""Of how many queries one is followed by a bare fetch of its rows."""

_ROW_BYTES = 200
_CREATE = "CREATE TABLE bare_row (id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, data bytea NOT NULL)"
_INSERT = "INSERT INTO bare_row (data) VALUES (%s)"
_FETCH = hand_sql.COLUMNS + " WHERE e.id = ANY(%(ids)s::bigint[])" + hand_sql.ORDER


def run(dsn: str, course: Course, advance: Callable[[int], None]) -> Times:
    """Go through one run in a new memory, which knows all types and no event; `advance` hears of each period."""
    times = Times(course.step)
    with ExitStack() as opened:
        name = opened.enter_context(scratch_memory(dsn))
        memory = opened.enter_context(elm.connect(dsn, name))
        hand = opened.enter_context(hand_sql.like_elm(dsn, name))
        bare = opened.enter_context(connect(with_setting(dsn, "search_path", bare_schema(name))))
        copies = opened.enter_context(Copies())
        bare.execute(_CREATE)
        memory.add_types(hierarchy.event_types())
        life = simulate(course.own_seed)
        queries = simulate_queries(copies, seed=course.own_seed, components=course.components)
        rows = _rows(course.own_seed)
        opened.enter_context(steady_heap())
        for first, last in course.periods():
            events = list(islice(life, INSERTIONS))
            for size, event in enumerate(events, first):
                _insert(memory, bare, event, size, rows, times)
            # The copies are the stored events, which know their wholes and what derived from their parts.
            copies.extend(memory.recall(cues.uid(*(event.uid for event in events))))
            _check_count(len(copies), last)
            for number, query in enumerate(islice(queries, QUERIES)):
                asked = _ask(memory, query, course.answer, last, times)
                if (last // INSERTIONS * QUERIES + number) % FETCH_EVERY == 0:
                    _fetch(hand, query, last, *asked, times)
            advance(INSERTIONS + QUERIES)
        _check_count(memory.statistics().events, course.events)
    return times


def _rows(seed: int) -> Iterator[bytes]:
    chance = random.Random(seed)
    while True:
        yield chance.randbytes(_ROW_BYTES)


def _insert(memory: elm.Memory, bare: Connection, event: Event, size: int, rows: Iterator[bytes], times: Times) -> None:
    """One commit, timed; beside every tenth, which is an atomic event, a bare insert."""
    calls: list[tuple[BySize, Callable[[], object]]] = [(times.insertion, partial(memory.commit, event))]
    if size % BARE_EVERY == BARE_EVERY // 2:
        calls.append((times.bare, partial(bare.execute, _INSERT, (next(rows),), prepare=True)))
    for series, call in in_turn(calls, size // BARE_EVERY):
        series.add(size, seconds(call))


def _ask(
    memory: elm.Memory, query: SimulatedQuery, answer: Answer, size: int, times: Times
) -> tuple[float, int, list[int]]:
    """One query, timed: its seconds, how many rows it has, and the ids of the first of them."""
    begin = perf_counter()
    events, rows = _answer(memory, query.cue, answer)
    taken = perf_counter() - begin
    for key in (ALL, *query.classes):
        series = times.of(key)
        series["time"].add(size, taken)
        series["rows"].add(size, rows)
    if taken > times.longest.seconds:
        times.longest = Longest(seconds=taken, classes=query.classes, rows=rows, events=size)
    return taken, rows, [event.id for event in events[:FIRST]]


def _answer(memory: elm.Memory, cue: Cue, answer: Answer) -> tuple[list[elm.StoredEvent], int]:
    match answer:
        case Answer.OBJECTS:
            events = list(memory.recall(cue))
            return events, len(events)
        case Answer.IDS:
            ids = list(memory.recall(cue).ids())
            return list(memory.recall(cue, limit=FIRST if len(ids) > FIRST else None)), len(ids)


def _fetch(
    hand: Connection, query: SimulatedQuery, size: int, taken: float, rows: int, ids: list[int], times: Times
) -> None:
    """The limit: the same rows, up to `FIRST`, by their ids, prepared and in binary, as psycopg loads them."""
    begin = perf_counter()
    fetched = hand.execute(_FETCH, {"ids": ids}, prepare=True, binary=True).fetchall()
    bare = perf_counter() - begin
    _check_count(len(fetched), len(ids))
    for key in (ALL, *query.classes):
        series = times.of(key)
        series["fetch"].add(size, bare)
        if rows <= FIRST:
            series["fetched"].add(size, taken)
            series["fetch_whole"].add(size, bare)


def _check_count(found: int, expected: int) -> None:
    if found != expected:
        raise StoreFailure(f"{found:,} events where {expected:,} are known: the figures would be of something else")
