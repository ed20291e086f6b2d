"""Each of the 27 classes of cues against its statement written by hand: same cues, same columns, same answers."""

from __future__ import annotations

import gc
import random
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import elm
from elm.cues.algebra import Cue
from elm.errors import StoreFailure
from elm.event import StoredEvent
from simulators.bench.scratch import Connection
from simulators.bench.timing import in_turn, seconds
from simulators.recalling import hand_sql
from simulators.worlds.queries import CLASSES, cue_of

SMALL_ANSWER = 1_000
"""Rows up to which the goal for a class holds, and a call is short enough to be timed several times."""

_REPEATS = 5
_ENOUGH_ROWS = 150_000
"""Rows after which a class gets no further cue, once it had `_FEWEST_CUES`."""
_FEWEST_CUES = 5


@dataclass(slots=True, kw_only=True)
class Answers:
    """The answers to the cues of one class: their rows, and the seconds that each side took."""

    rows: list[int] = field(default_factory=list)
    elm: list[float] = field(default_factory=list)
    hand: list[float] = field(default_factory=list)

    @property
    def are_enough(self) -> bool:
        """Whether the answers are so large that further ones would take more time than they are worth."""
        return len(self.rows) >= _FEWEST_CUES and sum(self.rows) >= _ENOUGH_ROWS

    def figures(self) -> dict[str, Any]:
        """The median of the cues' ratios, the mean of their rows, and the median times in milliseconds."""
        ratios = [ours / theirs for ours, theirs in zip(self.elm, self.hand, strict=True)]
        return {
            "ratio": statistics.median(ratios),
            "rows": statistics.fmean(self.rows),
            "elm_ms": statistics.median(self.elm) * 1e3,
            "hand_ms": statistics.median(self.hand) * 1e3,
            "cues": len(self.rows),
        }

    def small(self) -> Answers:
        """Those for which the goal holds."""
        kept = [index for index, rows in enumerate(self.rows) if rows <= SMALL_ANSWER]
        return Answers(
            rows=[self.rows[index] for index in kept],
            elm=[self.elm[index] for index in kept],
            hand=[self.hand[index] for index in kept],
        )


def measure(
    memory: elm.Memory, hand: Connection, *, cues: int, seed: int, advance: Callable[[int], None]
) -> dict[str, Answers]:
    """The answers to `cues` cues of each class, made of events drawn from the memory; to fewer if they are huge."""
    chance = random.Random(seed)
    ids = list(memory.recall(order="id").ids())
    drawn = [memory.get(number) for number in chance.sample(ids, min(len(ids), 20 * cues))]
    found = {}
    for name in CLASSES:
        answers = found[name] = Answers()
        for turn, event in enumerate(_with(name, drawn)[:cues]):
            _ask(memory, hand, name, event, turn, answers)
            advance(1)
            if answers.are_enough:
                advance(cues - turn - 1)
                break
    return found


def _with(name: str, events: Sequence[StoredEvent]) -> list[StoredEvent]:
    """The events of which a cue of this class can be made; of parts and wholes, those that have some.

    Nine events in ten have no parts, one in ten no wholes: cues with empty sets ask for all of those, or
    for none, and would measure nothing but how fast rows are read, which `rates` does.
    """
    match name.partition(".")[0]:
        case "parts":
            return [event for event in events if event.parts]
        case "wholes":
            return [event for event in events if event.wholes]
        case _:
            return list(events)


def _ask(memory: elm.Memory, hand: Connection, name: str, event: StoredEvent, turn: int, answers: Answers) -> None:
    cue, text, values = cue_of(name, event), hand_sql.statement(name), hand_sql.values(name, event)
    rows = check_same(
        name, cue, [found.id for found in recall(memory, cue)], [row[0] for row in fetch(hand, text, values)]
    )
    calls: dict[str, Callable[[], object]] = {
        "elm": partial(recall, memory, cue),
        "hand": partial(fetch, hand, text, values),
    }
    times: dict[str, list[float]] = {side: [] for side in calls}
    gc.collect()
    for repeat in range(_REPEATS if rows <= SMALL_ANSWER else 1):
        for side in in_turn(list(calls), turn + repeat):
            times[side].append(seconds(calls[side]))
    answers.rows.append(rows)
    answers.elm.append(statistics.median(times["elm"]))
    answers.hand.append(statistics.median(times["hand"]))


def recall(memory: elm.Memory, cue: Cue) -> list[StoredEvent]:
    """elm's side: all events that match, as objects, in order of begin."""
    return list(memory.recall(cue))


def fetch(hand: Connection, text: str, values: dict[str, Any]) -> list[tuple[Any, ...]]:
    """The other side: all rows of a prepared statement, in binary."""
    return hand.execute(text, values, prepare=True, binary=True).fetchall()


def check_same(name: str, cue: Cue, ours: Sequence[int], theirs: Sequence[int]) -> int:
    """How many events both sides found; times of different answers would mean nothing."""
    if ours != theirs:
        raise StoreFailure(
            f"class {name}: elm recalls {len(ours):,} events and the statement by hand {len(theirs):,}, "
            f"or in another order, for {cue!r:.200}"
        )
    return len(ours)
