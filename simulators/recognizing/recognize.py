"""What recognition costs: the engine against another one, many patterns against one, the database, time and memory."""

from __future__ import annotations

import sys
from argparse import Namespace
from typing import Any

from rich.table import Table

from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.recognizing import at_once, bounded, catching_up, engine, latency

EVENTS, QUICK_EVENTS = 20_000, 1_000
STREAM, QUICK_STREAM = 1_000_000, 20_000
MATCHES, QUICK_MATCHES = 60, 3
ROUNDS, QUICK_ROUNDS = 5, 1


def main(argv: list[str]) -> int:
    """The command `recognize`; its exit code."""
    parser = options("recognize", __doc__)
    for name, what, usual, quick in (
        ("events", "events to recognize in, for each of the rates", EVENTS, QUICK_EVENTS),
        ("matches", "matches whose latency is measured, in each of two ways", MATCHES, QUICK_MATCHES),
        ("stream", "events of the stream through which memory is watched", STREAM, QUICK_STREAM),
    ):
        parser.add_argument(f"--{name}", type=int, metavar="N", help=f"{what}; default {usual}, quick {quick}")
    given = parser.parse_args(argv)
    given.events = given.events or (QUICK_EVENTS if given.quick else EVENTS)
    given.matches = given.matches or (QUICK_MATCHES if given.quick else MATCHES)
    given.stream = given.stream or (QUICK_STREAM if given.quick else STREAM)
    return run("recognize", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    rounds = QUICK_ROUNDS if given.quick else ROUNDS
    asked = {"events": given.events, "rounds": rounds, "seed": given.seed}
    with progress("the engine alone", total=rounds) as advance:
        alone = engine.measure(**asked, advance=advance)
    with progress("twenty patterns and one", total=rounds) as advance:
        many = at_once.measure(**asked, advance=advance)
    with progress("loading and catching up", total=rounds) as advance:
        database = catching_up.measure(dsn, **asked, advance=advance)
    with progress("waiting for matches", total=2 * given.matches) as advance:
        waited = latency.measure(dsn, matches=given.matches, seed=given.seed, advance=advance)
    with progress("a long stream", total=1):
        held = bounded.measure(events=given.stream, seed=given.seed)
    figures: dict[str, Any] = {
        "engine_vs_bobocep": alone["engine_vs_bobocep"],
        "engine_vs_bobocep_divided": alone["engine_vs_bobocep_divided"],
        "twenty_vs_one": many["twenty_vs_one"],
        "db_vs_load": database["db_vs_load"],
        "latency_vs_commit": waited["latency_vs_commit"],
        "latency_vs_commit_own_process": waited["latency_vs_commit_own_process"],
        "memory_bounded": held["memory_bounded"],
        "engine": alone,
        "twenty": many,
        "database": database,
        "latency": waited,
        "stream": held,
    }
    if alone["engine_vs_bobocep"] is None:
        print(f"simulators recognize: no engine_vs_bobocep: {engine.MISSING}", file=sys.stderr)
    tables = {
        f"{given.events:,} events": _rates(alone, many, database),
        "from the commit of the last part, in ms": _times(waited),
        f"{given.stream:,} events, a horizon of {held['horizon_seconds']:g} s": _held(held),
    }
    return Report(figures=figures, goals=_goals(figures), tables=tables)


def _goals(figures: dict[str, Any]) -> list[Goal]:
    found = [
        Goal(name="twenty_vs_one", value=figures["twenty_vs_one"], at_most=8.0),
        Goal(name="db_vs_load", value=figures["db_vs_load"], at_least=0.4),
        Goal(name="latency_vs_commit", value=figures["latency_vs_commit"], at_most=60.0),
        Goal(name="memory_bounded", value=figures["memory_bounded"], at_most=1.1),
    ]
    if figures["engine_vs_bobocep"] is not None:
        found.insert(0, Goal(name="engine_vs_bobocep", value=figures["engine_vs_bobocep"], at_least=4.0))
    return found


def _rates(alone: dict[str, Any], many: dict[str, Any], database: dict[str, Any]) -> Table:
    rates = alone["events_per_second"]
    rows = {
        "engine alone, three steps with one object": rates["elm"],
        "BoboCEP, one decider": rates["bobocep_together"],
        "BoboCEP, a decider for each object": rates["bobocep_divided"],
        "twenty patterns at once, log in memory": many["twenty_events_per_second"],
        "one of them, on average": many["one_events_per_second"],
        "load into PostgreSQL": database["load_events_per_second"],
        "catch up: read, recognize, commit": database["events_per_second"],
    }
    table = table_of("", "events/s")
    for name, rate in rows.items():
        table.add_row(name, "make opponents" if rate is None else f"{rate:,.0f}")
    return table


def _times(waited: dict[str, Any]) -> Table:
    table = table_of("", "calls", "median", "p95", "max")
    for name, shown in {
        "bare_commit": "bare row: commit",
        "event_commit": "event: commit",
        "in_process": "complex event, manager in a thread",
        "own_process": "complex event, manager in a process of its own",
    }.items():
        figures = waited[name]
        millis = [f"{figures[column]:.2f}" for column in ("median", "p95", "max")]
        table.add_row(shown, f"{figures['count']:,}", *millis)
    return table


def _held(held: dict[str, Any]) -> Table:
    table = table_of("after events", "runs", "most runs", "events held", "checkpoint, KB", "peak memory, MB")
    for stage in held["stages"]:
        table.add_row(
            f"{stage['events']:,}",
            f"{stage['runs']:,}",
            f"{stage['most_runs']:,}",
            f"{stage['held_events']:,}",
            f"{stage['checkpoint_bytes'] / 1e3:,.1f}",
            f"{stage['peak_mb']:.1f}",
        )
    return table
