"""Recalling from memories of several sizes: cues of one distribution, answers of one limit, call by call in turn."""

from __future__ import annotations

import random
import statistics
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter
from typing import Any

import elm
from elm.cues.algebra import Cue, TypeCue
from elm.cues.relations import TypeRelation
from elm.errors import StoreFailure, UnknownEvent
from elm.event import StoredEvent
from simulators.bench.scratch import Connection
from simulators.bench.timing import in_turn, seconds, steady_heap
from simulators.recalling import hand_sql
from simulators.scaling import growth
from simulators.scaling.loaded import Loaded
from simulators.worlds import hierarchy
from simulators.worlds.queries import CLASSES, cue_of

LIMIT = 100
"""Events that an answer has at most."""
DEPTHS = ("root", "one_below", "two_below", "leaf")
"""The levels of the type hierarchy, whose types have 1,111, 111, 11 and 1 descendants, themselves included."""

_ALIKE = 1.25
"""How many times the rows of the smaller memory's answers the larger one's may be, to be compared as they are."""
_REPEATS = 3
_DRAWN_FOR_A_CUE, _FEWEST_DRAWN = 20, 150
"""Events drawn for each cue, and at least: those of parts need events that have some, one in ten."""
_BY_IDS = hand_sql.COLUMNS + " WHERE e.id = ANY (%(ids)s) " + hand_sql.ORDER


@dataclass(slots=True)
class Answers:
    """The answers to the cues of one kind in one memory: their rows, and the seconds that each took."""

    rows: list[int] = field(default_factory=list)
    first: list[float] = field(default_factory=list)
    """When asked for the first time, with whatever of the memory is in the server's buffers."""
    again: list[float] = field(default_factory=list)
    """The median of further times."""
    bare: list[float] = field(default_factory=list)
    """The median time of fetching the same rows by their ids."""

    def figures(self) -> dict[str, Any]:
        """The medians in milliseconds, and the mean of the rows."""
        return {
            "ms": statistics.median(self.again) * 1e3,
            "first_ms": statistics.median(self.first) * 1e3,
            "bare_ms": statistics.median(self.bare) * 1e3,
            "rows": statistics.fmean(self.rows),
            "cues": len(self.rows),
        }


BySize = dict[int, Answers]
"""Answers by the number of events in the memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The answers to the cues of one kind with a limit of `LIMIT`, and with a smaller one where they grew."""

    answers: BySize
    limit: int
    """What both memories that are compared can fill: `LIMIT`, or the rows of the smaller one's answers."""
    bounded: BySize
    """The answers with this limit: results of equal size."""

    def figures(self, between: tuple[int, int]) -> dict[str, Any]:
        """Growth of the medians between answers of equal size, of their first times and of the bare fetch.

        What each memory's figures are is given for a limit of `LIMIT`.
        """
        found = {
            "growth": growth.of_medians({size: each.again for size, each in self.bounded.items()}, between),
            "first_growth": growth.of_medians({size: each.first for size, each in self.bounded.items()}, between),
            "bare_growth": growth.of_medians({size: each.bare for size, each in self.bounded.items()}, between),
            "limit": self.limit,
            "sizes": {str(size): each.figures() for size, each in self.answers.items()},
        }
        if self.limit == LIMIT:
            return found
        whole = growth.of_medians({size: each.again for size, each in self.answers.items()}, between)
        sizes = {str(size): each.figures() for size, each in self.bounded.items()}
        return {**found, f"growth_limit_{LIMIT}": whole, f"sizes_limit_{self.limit}": sizes}


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """One memory, a connection that fetches from it, and events drawn from it to make cues of."""

    size: int
    memory: elm.Memory
    hand: Connection
    drawn: Sequence[StoredEvent]

    def recall(self, cue: Cue, limit: int) -> list[StoredEvent]:
        """The first events that match, by begin."""
        return list(self.memory.recall(cue, limit=limit))

    def fetch(self, ids: Sequence[int]) -> list[tuple[Any, ...]]:
        """The rows of these ids, by begin: the limit line."""
        return self.hand.execute(_BY_IDS, {"ids": ids}, prepare=True, binary=True).fetchall()

    def cues(self, name: str, number: int) -> list[Cue]:
        """Cues of a class, each from an event drawn; those of parts and wholes from events that have some."""
        needed = name.partition(".")[0]
        has_it = [event for event in self.drawn if needed not in ("parts", "wholes") or getattr(event, needed)]
        return [cue_of(name, event) for event in has_it[:number]]


def open_sides(opened: ExitStack, dsn: str, memories: Sequence[Loaded], *, cues: int, seed: int) -> list[Side]:
    """The memories with events drawn from them, for `cues` cues of each class."""
    sides = []
    for each in memories:
        memory = opened.enter_context(elm.connect(dsn, each.name))
        hand = opened.enter_context(hand_sql.like_elm(dsn, each.name))
        number = max(cues * _DRAWN_FOR_A_CUE, _FEWEST_DRAWN)
        drawn = list(_drawn(memory, each, number, seed))
        sides.append(Side(size=each.events, memory=memory, hand=hand, drawn=drawn))
    return sides


def _drawn(memory: elm.Memory, loaded: Loaded, number: int, seed: int) -> Iterator[StoredEvent]:
    """Different events, each equally likely."""
    chance = random.Random(seed)
    for drawn in chance.sample(range(1, loaded.last_id + 1), min(number, loaded.events)):
        try:
            yield memory.get(drawn)
        except UnknownEvent:
            # A load that was stopped leaves gaps.
            continue


def by_class(
    sides: Sequence[Side], between: tuple[int, int], *, cues: int, advance: Callable[[int], None]
) -> dict[str, Asked]:
    """The answers to `cues` cues of each of the 27 classes in each memory."""
    return {name: _asked(sides, [side.cues(name, cues) for side in sides], between, advance) for name in CLASSES}


def by_depth(
    sides: Sequence[Side], between: tuple[int, int], *, cues: int, seed: int, advance: Callable[[int], None]
) -> dict[str, Asked]:
    """The answers to the cue type.is_a for types of each level of the hierarchy, the same ones in each memory."""
    chance = random.Random(seed)
    found = {}
    for depth, names in zip(DEPTHS, hierarchy.levels(), strict=True):
        types = chance.sample(names, min(cues, len(names)))
        asked = [TypeCue(relation=TypeRelation.IS_A, type=name) for name in types]
        found[depth] = _asked(sides, [asked for _ in sides], between, advance)
        advance(cues - len(types))
    return found


def _asked(
    sides: Sequence[Side],
    asked: Sequence[Sequence[Cue]],
    between: tuple[int, int],
    advance: Callable[[int], None],
) -> Asked:
    answers = _answers(sides, asked, LIMIT, advance)
    smaller, larger = (statistics.fmean(answers[size].rows) for size in between)
    if larger <= smaller * _ALIKE:
        return Asked(answers=answers, limit=LIMIT, bounded=answers)
    limit = max(1, round(smaller))
    return Asked(answers=answers, limit=limit, bounded=_answers(sides, asked, limit, lambda more: None))


def _answers(
    sides: Sequence[Side], asked: Sequence[Sequence[Cue]], limit: int, advance: Callable[[int], None]
) -> BySize:
    found = {side.size: Answers() for side in sides}
    for side, cues in zip(sides, asked, strict=True):
        # The shape of the statement is compiled once and kept; that is no part of any size.
        side.recall(cues[-1], limit)
    with steady_heap():
        for turn in range(max(map(len, asked))):
            ready = [(side, cues[turn]) for side, cues in zip(sides, asked, strict=True) if turn < len(cues)]
            _ask(ready, limit, turn, found)
            advance(1)
    return found


def _ask(ready: Sequence[tuple[Side, Cue]], limit: int, turn: int, found: BySize) -> None:
    """One cue for each memory: once as it comes, then a few times in turn, with a fetch of the same rows."""
    calls: list[tuple[list[float], Callable[[], object]]] = []
    sides = in_turn(ready, turn)
    for side, cue in sides:
        answers = found[side.size]
        begin = perf_counter()
        ids = [event.id for event in side.recall(cue, limit)]
        answers.first.append(perf_counter() - begin)
        answers.rows.append(len(ids))
        if [row[0] for row in side.fetch(ids)] != ids:
            raise StoreFailure(f"a fetch by id gives other rows than elm recalls for {cue!r:.200}")
        calls += [([], partial(side.recall, cue, limit)), ([], partial(side.fetch, ids))]
    for repeat in range(_REPEATS):
        for times, call in in_turn(calls, turn + repeat):
            times.append(seconds(call))
    medians = iter([statistics.median(times) for times, _ in calls])
    for (side, _), again, bare in zip(sides, medians, medians, strict=False):
        found[side.size].again.append(again)
        found[side.size].bare.append(bare)
