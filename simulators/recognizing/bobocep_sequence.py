"""BoboCEP at the sequence that engines are compared by: a process of its own environment, asked by `engine`.

The first line of stdin tells of the work, as JSON. For each line after it all events are fed once to an engine
that has seen nothing, and a line of JSON says in how many seconds and with how many matches.
"""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import Any, NamedTuple

from bobocep.cep.engine.decider.decider import BoboDecider
from bobocep.cep.event import BoboEventSimple
from bobocep.cep.gen.event_id import BoboGenEventIDUnique
from bobocep.cep.phenom.pattern.builder import BoboPatternBuilder
from bobocep.cep.phenom.phenom import BoboPhenomenon

Predicate = Callable[[Any, Any], bool]


class Data(NamedTuple):
    """What an event is about."""

    kind: str
    key: str


class Found:
    """Told by deciders of what changed: counts the runs that were completed."""

    def __init__(self) -> None:
        self.matches = 0

    def on_decider_update(
        self, completed: Sequence[object], halted: Sequence[object], updated: Sequence[object], local: bool
    ) -> None:
        """Take in one change."""
        self.matches += len(completed)


def decider(steps: Sequence[str], within: int, found: Found) -> Any:
    """The task of BoboCEP that matches, without those around it, with the sequence as its only pattern.

    BoboCEP has no windows: a run is halted by the first event that is too late for it.
    """
    pattern = BoboPatternBuilder("sequence")
    pattern.followed_by(_begins(steps[0]))
    for kind in steps[1:]:
        pattern.followed_by(_goes_on(kind))
    pattern.haltcondition(lambda event, history: event.timestamp - history.first().timestamp > within)
    phenomenon = BoboPhenomenon("sequences", patterns=[pattern.generate()])
    made = BoboDecider([phenomenon], BoboGenEventIDUnique(), BoboGenEventIDUnique())
    made.subscribe(found)
    return made


def _begins(kind: str) -> Predicate:
    return lambda event, history: event.data.kind == kind


def _goes_on(kind: str) -> Predicate:
    # BoboCEP has no partitions either: the key is compared with that of the event which began the run.
    return lambda event, history: event.data.kind == kind and event.data.key == history.first().data.key


def together(events: Sequence[Any], steps: Sequence[str], within: int) -> int:
    """One decider for all keys; the number of matches."""
    found = Found()
    only = decider(steps, within, found)
    for event in events:
        only.on_receiver_update(event)
        only.update()
    return found.matches


def divided(events: Sequence[Any], steps: Sequence[str], within: int) -> int:
    """A decider for each key, chosen before the event is given to it; the number of matches."""
    found = Found()
    deciders: dict[str, Any] = {}
    for event in events:
        own = deciders.get(event.data.key)
        if own is None:
            own = deciders[event.data.key] = decider(steps, within, found)
        own.on_receiver_update(event)
        own.update()
    return found.matches


def main() -> None:
    """Do what stdin asks for, until it ends."""
    work = json.loads(sys.stdin.readline())
    run = divided if work["divided"] else together
    events = [
        BoboEventSimple(str(number), moment, Data(kind, key))
        for number, (kind, key, moment) in enumerate(work["events"])
    ]
    gc.collect()
    gc.freeze()
    for _ in sys.stdin:
        begin = perf_counter()
        matches = run(events, work["steps"], work["within"])
        print(json.dumps({"seconds": perf_counter() - begin, "matches": matches}), flush=True)


if __name__ == "__main__":
    main()
