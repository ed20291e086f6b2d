"""The pattern engine alone against BoboCEP on the same events: processes that take turns, and must find the same."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import Any

from elm.errors import StoreFailure
from simulators.bench.timing import in_turn
from simulators.worlds import handling

STEPS = ("Grasp", "Carry", "Place")
KINDS = (*STEPS, "Look", "Speak", "Bump")
"""Half of the events are none of the pattern's."""
OBJECTS = 20
PAUSE = 0.1
"""Seconds between two events, on average."""
WITHIN = 30_000_000
"""Microseconds from the first step to the last."""

ROOT = Path(__file__).parents[2]
ENVIRONMENT = ROOT / ".opponents" / "bobocep"
"""Where `make opponents` puts BoboCEP."""
MISSING = "BoboCEP is not installed: run `make opponents`, then this again"
_SCRIPT = Path(__file__).parent / "bobocep_sequence.py"


def measure(*, events: int, rounds: int, seed: int, advance: Callable[[int], None]) -> dict[str, Any]:
    """Events per second of each side, medians over rounds, and how many times BoboCEP's ours are.

    Without BoboCEP's environment its rates and the ratios are None.
    """
    life = islice(handling.live(seed, kinds=KINDS, objects=OBJECTS, pause=PAUSE), events)
    told = [[done.kind, done.object, done.moment] for done in life]
    work = {"events": told, "steps": STEPS, "within": WITHIN}
    bobocep = ENVIRONMENT / "bin" / "python"
    times: dict[str, list[float]] = {"elm": []}
    with ExitStack() as opened:
        sides = {"elm": opened.enter_context(_side([sys.executable, "-m", "simulators.recognizing.sequence"], work))}
        if bobocep.exists():
            for name in ("together", "divided"):
                asked = {**work, "divided": name == "divided"}
                sides[f"bobocep_{name}"] = opened.enter_context(_side([str(bobocep), str(_SCRIPT)], asked))
                times[f"bobocep_{name}"] = []
        found: dict[str, int] = {}
        for turn in range(rounds):
            for name in in_turn(list(sides), turn):
                answer = sides[name]()
                times[name].append(answer["seconds"])
                found[name] = answer["matches"]
            advance(1)
    check_same(found)
    rates = {name: events / statistics.median(series) for name, series in times.items()}
    return {
        "events": events,
        "rounds": rounds,
        "objects": OBJECTS,
        "matches": found["elm"],
        "events_per_second": {name: rates.get(name) for name in ("elm", "bobocep_together", "bobocep_divided")},
        "engine_vs_bobocep": _ratio(rates, "bobocep_together"),
        "engine_vs_bobocep_divided": _ratio(rates, "bobocep_divided"),
    }


def check_same(found: dict[str, int]) -> None:
    """Refuse to compare sides that did different work."""
    if len(set(found.values())) != 1:
        raise StoreFailure(f"the engines found different numbers of matches: {found}")


def _ratio(rates: dict[str, float], side: str) -> float | None:
    return rates["elm"] / rates[side] if side in rates else None


@contextmanager
def _side(command: Sequence[str], work: dict[str, Any]) -> Iterator[Callable[[], dict[str, Any]]]:
    """A process that has been told of the work: each call has it done once, and gives what it says of it."""
    with subprocess.Popen(  # noqa: S603 - our own programs
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT
    ) as process:
        into, out = process.stdin, process.stdout
        assert into is not None  # noqa: S101 - both are pipes
        assert out is not None  # noqa: S101

        def ask(line: str) -> None:
            try:
                into.write(line + "\n")
                into.flush()
            except BrokenPipeError:
                raise StoreFailure(f"{command[0]} ended before it was asked: see what it wrote above") from None

        def once() -> dict[str, Any]:
            ask("once")
            line = out.readline()
            if not line:
                raise StoreFailure(f"{command[0]} ended before it answered: see what it wrote above")
            answer: dict[str, Any] = json.loads(line)
            return answer

        try:
            ask(json.dumps(work))
            yield once
        finally:
            # What a process that ended did not read would be written once more.
            with suppress(BrokenPipeError):
                into.close()
