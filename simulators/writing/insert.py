"""What writing costs: one commit against a bare insert, and a load against a bare COPY of the finished rows."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from rich.table import Table

from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.writing import commits, loads

EVENTS = 10_000
QUICK_EVENTS = 200
LOADED_PER_COMMITTED = 4
"""Loading is so much faster that its share of the run allows for more events."""

_SERIES = {
    "bare": "bare row",
    "event": "event",
    "ten_rows": "ten rows, one by one",
    "ten_rows_executemany": "ten rows, executemany",
    "complex_event": "complex event, nine parts",
}


def main(argv: list[str]) -> int:
    """The command `insert`; its exit code."""
    parser = options("insert", __doc__)
    parser.add_argument(
        "--events",
        type=int,
        metavar="N",
        help=f"events to commit in each mode, {LOADED_PER_COMMITTED} N to load; default {EVENTS}, quick {QUICK_EVENTS}",
    )
    given = parser.parse_args(argv)
    given.events = given.events or (QUICK_EVENTS if given.quick else EVENTS)
    return run("insert", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    with progress("committing", total=len(commits.MODES) * given.events) as advance:
        committed = commits.measure(dsn, events=given.events, seed=given.seed, advance=advance)
    to_load = given.events * LOADED_PER_COMMITTED
    with progress("loading", total=to_load) as advance:
        loaded = loads.measure(dsn, events=to_load, seed=given.seed, advance=advance).figures()
    modes = {mode: series.figures() for mode, series in committed.items()}
    figures: dict[str, Any] = {
        "ratio_durable": modes["durable"]["ratio"],
        "ratio_relaxed": modes["relaxed"]["ratio"],
        "complex_vs_ten_rows": modes["durable"]["complex_vs_ten_rows"],
        "load_vs_copy": loaded["load_vs_copy"],
        **modes,
        "load": loaded,
    }
    goals = (
        Goal(name="ratio_durable", value=figures["ratio_durable"], at_most=2.0),
        Goal(name="ratio_relaxed", value=figures["ratio_relaxed"], at_most=2.5),
        Goal(name="complex_vs_ten_rows", value=figures["complex_vs_ten_rows"], at_most=2.5),
        Goal(name="load_vs_copy", value=figures["load_vs_copy"], at_least=0.6),
    )
    tables = {
        "one call with its commit, in ms": _times(modes),
        f"{loaded['events']:,} events in batches of {loaded['batch']:,}": _rates(loaded),
    }
    return Report(figures=figures, goals=goals, tables=tables)


def _times(modes: dict[str, dict[str, Any]]) -> Table:
    table = table_of("", "calls", "mean", "median", "p95", "p99", "max")
    for mode, found in modes.items():
        for name, shown in _SERIES.items():
            figures = found[name]
            millis = [f"{figures[column]:.3f}" for column in ("mean", "median", "p95", "p99", "max")]
            table.add_row(f"{mode}: {shown}", f"{figures['count']:,}", *millis)
    return table


def _rates(loaded: dict[str, Any]) -> Table:
    table = table_of("", "events/s")
    table.add_row("load", f"{loaded['events_per_second']:,.0f}")
    table.add_row("bare COPY of the finished rows", f"{loaded['copy_events_per_second']:,.0f}")
    return table
