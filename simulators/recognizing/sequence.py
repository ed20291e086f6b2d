"""elm's engine at the sequence that engines are compared by: a process, asked by `simulators.recognizing.engine`.

The first line of stdin tells of the work, as JSON. For each line after it all events are fed once to a process
that has seen nothing, and a line of JSON says in how many seconds and with how many matches.
"""

from __future__ import annotations

import gc
import json
import sys
from collections.abc import Sequence
from datetime import timedelta
from time import perf_counter

from elm import cues
from elm.recognition.judging import TypeJudge
from elm.recognizers import AfterMatch, Fed, Pattern, step
from elm.recognizers.base import Judge
from simulators.worlds import handling
from simulators.worlds.handling import Done


def sequence(steps: Sequence[str], within: int) -> Pattern:
    """One step after the other with one object, whatever lies between; every first step may begin a match."""
    return Pattern(
        name="sequence",
        version=1,
        type="Sequence",
        elements=[step(kind, cues.is_a(kind)) for kind in steps],
        within=timedelta(microseconds=within),
        partition=["object"],
        after_match=AfterMatch.ALL,
    )


def matches(pattern: Pattern, judge: Judge, events: Sequence[Fed]) -> int:
    """How many results the engine finds, with nothing around it but the order of time."""
    process = pattern.start(judge)
    found = 0
    for fed in events:
        while (deadline := process.deadline()) is not None and deadline < fed.moment:
            found += len(process.expire(deadline))
        found += len(process.feed(fed))
    return found


def main() -> None:
    """Do what stdin asks for, until it ends."""
    work = json.loads(sys.stdin.readline())
    pattern, judge = sequence(work["steps"], work["within"]), TypeJudge(handling.types)
    events = [
        handling.fed(Done(kind, key, handling.PLACES[0], 0, moment), number)
        for number, (kind, key, moment) in enumerate(work["events"], start=1)
    ]
    gc.collect()
    gc.freeze()
    for _ in sys.stdin:
        begin = perf_counter()
        found = matches(pattern, judge, events)
        print(json.dumps({"seconds": perf_counter() - begin, "matches": found}), flush=True)


if __name__ == "__main__":
    main()
