"""The paper's three experiments: 100 insertions and 25 queries in turn, by cues of one, two and three components."""

from __future__ import annotations

import sys
from argparse import Namespace
from datetime import UTC, datetime
from time import perf_counter
from typing import Any

from rich.table import Table

from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.machine import circumstances, load_average
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.paper import course as experimental_run
from simulators.paper.finished import Finished, beside, conditions, differences, find, keep
from simulators.paper.published import INSERTION, RETRIEVAL, Published
from simulators.paper.schedule import EXPERIMENTS, courses
from simulators.paper.summary import figures

RUNS, QUICK_RUNS = 10, 2
EVENTS, QUICK_EVENTS = 100_000, 1_000
LINEAR = 7.0
"""How many times as many events a memory has in the middle of its last tenth as in that of its second, 95 / 15 = 6.3,
and a tenth for chance."""


def main(argv: list[str]) -> int:
    """The command `paper`; its exit code."""
    parser = options("paper", __doc__)
    parser.add_argument(
        "--events", type=int, metavar="N", help=f"events of a run; default {EVENTS}, quick {QUICK_EVENTS}"
    )
    parser.add_argument(
        "--runs", type=int, metavar="N", help=f"runs of each experiment; default {RUNS}, quick {QUICK_RUNS}"
    )
    parser.add_argument(
        "--components",
        type=int,
        nargs="+",
        choices=tuple(EXPERIMENTS),
        default=list(EXPERIMENTS),
        metavar="N",
        help="the experiments: components of their cues; default 1 2 3",
    )
    given = parser.parse_args(argv)
    given.events = given.events or (QUICK_EVENTS if given.quick else EVENTS)
    given.runs = given.runs or (QUICK_RUNS if given.quick else RUNS)
    given.components = sorted(set(given.components))
    return run("paper", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    under = conditions(circumstances(dsn))
    directory = None if given.json is None else beside(given.json)
    if directory is None:
        _say("without --json no finished run is kept: a second try begins anew")
    planned = courses(runs=given.runs, events=given.events, components=given.components, seed=given.seed)
    done = {course.name: finished for course in planned if (finished := find(directory, course, under))}
    left = [course for course in planned if course.name not in done]
    if done:
        _say(f"{len(done)} of {len(planned)} runs were finished before, with these settings and this code: {directory}")
    if other := {name for course in left for name in differences(directory, course, under)}:
        _say(f"{directory} has runs with another {' and '.join(sorted(other))}: they are kept, and do not count")
    with progress(f"{len(left)} runs", total=sum(course.events + course.queries for course in left)) as advance:
        for number, course in enumerate(left, start=1):
            before, started, begin = load_average(), datetime.now(UTC), perf_counter()
            times = experimental_run.run(dsn, course, advance)
            finished = Finished(
                course=course,
                times=times,
                seconds=round(perf_counter() - begin, 1),
                started=started.isoformat(timespec="seconds"),
                load_average={"before": before, "after": load_average()},
            )
            keep(directory, finished, under)
            done[course.name] = finished
            _say(f"{course.name}: {finished.seconds:,.0f} s; {len(left) - number} runs left")
    found = figures((done[course.name] for course in planned), events=given.events)
    return Report(figures=found, goals=_goals(found), tables=_tables(found))


def _say(line: str) -> None:
    print(f"simulators paper: {line}", file=sys.stderr, flush=True)


def _goals(found: dict[str, Any]) -> list[Goal]:
    """Insertion hardly grows, and retrieval no faster than the memory does: what the paper concludes (VI-B3)."""
    insertion = found["insertion"]
    goals = [
        Goal(name="insert_growth", value=insertion["growth"], at_most=1.2),
        Goal(name="insert_vs_bare", value=insertion["vs_bare"], at_most=2.5),
    ]
    for components, experiment in found["experiments"].items():
        for answer, asked in experiment["queries"].items():
            grown = asked["all"]["growth"]
            if grown is not None:
                goals.append(Goal(name=f"growth.{components}.{answer}", value=grown, at_most=LINEAR))
    return goals


def _tables(found: dict[str, Any]) -> dict[str, Table]:
    overview = table_of("in ms", "calls", "mean", "sd", "max", "class means", "class sds", "rows", "vs limit")
    insertion = found["insertion"]
    _published_row(overview, "insertion, published", INSERTION)
    overview.add_row(
        "insertion", f"{insertion['count']:,}", *_three(insertion), "", "", "", f"{insertion['vs_bare']:.2f}"
    )
    for components, experiment in found["experiments"].items():
        _published_row(overview, f"{EXPERIMENTS[int(components)]}, published", RETRIEVAL[int(components)])
        for answer, asked in experiment["queries"].items():
            every = asked["all"]
            overview.add_row(
                f"{EXPERIMENTS[int(components)]}, {answer}",
                f"{every['count']:,}",
                *_three(every),
                _range(asked, "mean"),
                _range(asked, "sd"),
                f"{every['rows']:,.0f}",
                "" if every["vs_fetch"] is None else f"{every['vs_fetch']:.2f}",
            )
    return {f"{len(found['runs'])} runs of {found['events']:,} events": overview}


def _published_row(table: Table, name: str, known: Published) -> None:
    means, sds = ("" if ends is None else f"{ends[0]:g}..{ends[1]:g}" for ends in (known.class_means, known.class_sds))
    table.add_row(name, "", f"{known.mean:g}", f"{known.sd:g}", f"{known.max:,.0f}", means, sds, "", "")


def _three(found: dict[str, Any]) -> list[str]:
    return [f"{found[name]:.2f}" if found[name] is not None else "" for name in ("mean", "sd", "max")]


def _range(asked: dict[str, Any], name: str) -> str:
    values = [each[name] for each in asked["classes"].values() if each[name] is not None]
    return f"{min(values):.2f}..{max(values):.2f}" if values else ""
