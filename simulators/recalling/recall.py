"""What recalling costs: each class of cues against the best statement by hand, and large answers against a fetch."""

from __future__ import annotations

from argparse import Namespace
from itertools import islice
from typing import Any

from rich.table import Table

import elm
from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.bench.scratch import scratch_memory
from simulators.bench.timing import steady_heap
from simulators.recalling import classes, hand_sql, rates
from simulators.recalling.classes import SMALL_ANSWER, Answers
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate
from simulators.worlds.queries import CLASSES

EVENTS, QUICK_EVENTS = 100_000, 2_000
CUES, QUICK_CUES = 30, 3
ROUNDS, QUICK_ROUNDS = 5, 1


def main(argv: list[str]) -> int:
    """The command `recall`; its exit code."""
    parser = options("recall", __doc__)
    parser.add_argument(
        "--events", type=int, metavar="N", help=f"events in the memory; default {EVENTS}, quick {QUICK_EVENTS}"
    )
    parser.add_argument("--cues", type=int, metavar="N", help=f"cues of each class; default {CUES}, quick {QUICK_CUES}")
    given = parser.parse_args(argv)
    given.events = given.events or (QUICK_EVENTS if given.quick else EVENTS)
    given.cues = given.cues or (QUICK_CUES if given.quick else CUES)
    return run("recall", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    rounds = QUICK_ROUNDS if given.quick else ROUNDS
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory:
        _fill(memory, given)
        with steady_heap():
            with (
                hand_sql.like_elm(dsn, name) as hand,
                progress("recalling by class", total=len(CLASSES) * given.cues) as advance,
            ):
                answers = classes.measure(memory, hand, cues=given.cues, seed=given.seed, advance=advance)
            with progress("reading large answers", total=rounds) as advance:
                rows_per_second = rates.measure(dsn, memory, rounds=rounds, advance=advance)
    figures: dict[str, Any] = {
        "events": given.events,
        "classes": {name: _figures(found) for name, found in answers.items()},
        **_ratios(rows_per_second),
        "rows_per_second": rows_per_second,
    }
    tables = {
        f"one recall among {given.events:,} events": _class_table(answers),
        f"all {given.events:,} events by begin": _rate_table(rows_per_second),
    }
    return Report(figures=figures, goals=_goals(answers, figures), tables=tables)


def _fill(memory: elm.Memory, given: Namespace) -> None:
    memory.add_types(hierarchy.event_types())
    with progress("loading", total=given.events) as advance:
        done = 0

        def loaded(count: int) -> None:
            nonlocal done
            advance(count - done)
            done = count

        memory.load(islice(simulate(given.seed), given.events), progress=loaded)


def _figures(found: Answers) -> dict[str, Any]:
    """All answers of a class, and those up to `SMALL_ANSWER` rows where there are others too."""
    small = found.small()
    if not small.rows or len(small.rows) == len(found.rows):
        return found.figures()
    return {**found.figures(), f"up_to_{SMALL_ANSWER}_rows": small.figures()}


def _ratios(rows_per_second: dict[str, float]) -> dict[str, float]:
    """The rates of elm's sides over those of the others, as far as both are installed."""
    pairs = {
        "objects_vs_fetch": ("objects", "fetch"),
        "objects_vs_raw_fetch": ("objects", "raw_fetch"),
        "objects_read_vs_fetch": ("objects_read", "fetch"),
        "arrow_vs_fetch": ("arrow", "fetch"),
        "arrow_vs_raw_fetch": ("arrow", "raw_fetch"),
        "arrow_vs_adbc": ("arrow", "adbc"),
    }
    return {
        name: rows_per_second[ours] / rows_per_second[theirs]
        for name, (ours, theirs) in pairs.items()
        if ours in rows_per_second and theirs in rows_per_second
    }


def _goals(answers: dict[str, Answers], figures: dict[str, Any]) -> list[Goal]:
    small = {name: found.small() for name, found in answers.items()}
    goals = [
        Goal(name=name, value=found.figures()["ratio"], at_most=1.5) for name, found in small.items() if found.rows
    ]
    bounds = {"objects_vs_fetch": 0.5, "arrow_vs_fetch": 1.2}
    return goals + [
        Goal(name=name, value=figures[name], at_least=bound) for name, bound in bounds.items() if name in figures
    ]


def _class_table(answers: dict[str, Answers]) -> Table:
    table = table_of("class", "cues", "mean rows", "elm ms", "by hand ms", "ratio")
    for name, found in answers.items():
        figures = found.figures()
        times = [f"{figures[column]:.2f}" for column in ("elm_ms", "hand_ms", "ratio")]
        table.add_row(name, str(figures["cues"]), f"{figures['rows']:,.1f}", *times)
    return table


def _rate_table(rows_per_second: dict[str, float]) -> Table:
    table = table_of("read as", "rows/s")
    for side, rate in rows_per_second.items():
        table.add_row(rates.SIDES[side], f"{rate:,.0f}")
    return table
