"""The evaluation of working memory run again (section 5.2), and what Ice, long-term memory and forgetting cost."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Collection, Iterator, Mapping
from itertools import count
from typing import Any, Final

from rich.table import Table

from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.refusals import IceMissing
from simulators.armem import batches, consolidating, forgetting, published
from simulators.armem.batches import BATCHES, Side
from simulators.armem.data_objects import KINDS
from simulators.armem.processes import Process
from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress

SAMPLES, QUICK_SAMPLES = 1_000, 10
SNAPSHOTS, QUICK_SNAPSHOTS = 5_000, 200
ECHO_GOAL: Final = 2.0
"""How many times a bare echo of the object a commit or query of it through Ice should take at most."""

PARTS: Final = ("calls", "batches", "ages", "long_term", "forgetting")
"""What is measured; the figures of a part that was not are null."""

GOALS: Final = ("commit_vs_echo", "query_vs_echo", "retrieval_hz", "age_hz")
"""The figures that goals are about; null where Ice is missing, or the part that they come from was not measured."""


def main(argv: list[str]) -> int:
    """The command `armem`; its exit code."""
    parser = options("armem", __doc__)
    parser.add_argument(
        "--samples",
        type=int,
        metavar="N",
        help=f"samples of each figure; default {SAMPLES}, quick {QUICK_SAMPLES}",
    )
    parser.add_argument(
        "--snapshots",
        type=int,
        metavar="N",
        help=f"snapshots of each kind that are consolidated; default {SNAPSHOTS:,}, quick {QUICK_SNAPSHOTS}",
    )
    parser.add_argument(
        "--parts",
        nargs="+",
        choices=PARTS,
        help="what to measure; default: everything, with --quick all but forgetting, which takes minutes",
    )
    given = parser.parse_args(argv)
    given.samples = given.samples or (QUICK_SAMPLES if given.quick else SAMPLES)
    given.snapshots = given.snapshots or (QUICK_SNAPSHOTS if given.quick else SNAPSHOTS)
    given.parts = given.parts or [part for part in PARTS if not (given.quick and part == "forgetting")]
    return run("armem", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    figures: dict[str, Any] = {
        **dict.fromkeys(GOALS),
        "samples": given.samples,
        "batch_sizes": list(BATCHES),
        "information": {name: kind.information for name, kind in KINDS.items()},
        "published": published.as_json(),
        **dict.fromkeys(PARTS),
    }
    figures |= _working_memory(given.samples, given.parts)
    if "long_term" in given.parts:
        queries = min(given.samples, given.snapshots // 2)
        with progress("long-term memory", total=consolidating.STEPS) as advance:
            figures["long_term"] = consolidating.measure(
                dsn, snapshots=given.snapshots, queries=queries, advance=advance
            )
    if "forgetting" in given.parts:
        with progress("forgetting", total=forgetting.STEPS) as advance:
            figures["forgetting"] = forgetting.measure(given.seed, given.quick, advance)
    figures |= _headlines(figures)
    return Report(figures=figures, goals=_goals(figures), tables=_tables(figures))


def _working_memory(samples: int, parts: Collection[str]) -> dict[str, Any]:
    """The parts about working memory: through Ice too where it is installed."""
    first = count(1)
    wanted = {"calls", "batches", "ages"}.intersection(parts)
    if not wanted:
        return {}
    try:
        load_ice()
        slice_directory()
    except IceMissing as error:
        print(f"simulators armem: nothing is measured through Ice: {error}", file=sys.stderr)
        return {"batches": _batches(samples, {}, first)} if "batches" in wanted else {}
    return _through_ice(samples, wanted, first)


def _through_ice(samples: int, wanted: Collection[str], first: Iterator[int]) -> dict[str, Any]:
    # They need Ice.
    from armem_bridge.ice import MemoryClient
    from simulators.armem import against_echo, ages
    from simulators.armem.channel import load_channel

    figures: dict[str, Any] = {}
    with Process("simulators.armem.serving") as server:
        locator = server.line()
        with MemoryClient(load_channel()[0], locator) as client:
            if "calls" in wanted:
                with progress("single calls against an echo", total=against_echo.STEPS * samples) as advance:
                    figures["calls"] = against_echo.measure(client, samples=samples, first=first, advance=advance)
            if "batches" in wanted:
                figures["batches"] = _batches(samples, {name: client.memory(name) for name in KINDS}, first)
        # Last, for memories that somebody listens to are slower.
        if "ages" in wanted:
            with progress("the age of data", total=samples * len(KINDS)) as advance:
                figures["ages"] = ages.measure(locator, samples=samples, first=first, advance=advance)
    return figures


def _batches(samples: int, remote: Mapping[str, Side], first: Iterator[int]) -> dict[str, Any]:
    with progress("batches", total=samples * len(KINDS) * len(BATCHES)) as advance:
        return {
            name: {
                str(size): batches.measure(
                    kind, size, samples=samples, remote=remote.get(name), first=first, advance=advance
                )
                for size in BATCHES
            }
            for name, kind in KINDS.items()
        }


def _headlines(figures: Mapping[str, Any]) -> dict[str, float]:
    """The figures that goals are about, as far as what they come from was measured."""
    found: dict[str, float] = {}
    if figures["calls"] is not None:
        found |= {name: figures["calls"]["simple"][name] for name in ("commit_vs_echo", "query_vs_echo")}
    if figures["batches"] is not None and "ice" in (single := figures["batches"]["moderate"]["1"]):
        found["retrieval_hz"] = 1e6 / single["ice"]["query"]["mean"]
    if figures["ages"] is not None:
        found["age_hz"] = 1e6 / figures["ages"]["moderate"]["memory"]["mean"]
    return found


def _goals(figures: Mapping[str, Any]) -> list[Goal]:
    goals = {
        "commit_vs_echo": {"at_most": ECHO_GOAL},
        "query_vs_echo": {"at_most": ECHO_GOAL},
        "retrieval_hz": {"at_least": published.RETRIEVAL_HZ},
        "age_hz": {"at_least": published.RETRIEVAL_HZ},
    }
    return [Goal(name=name, value=figures[name], **bound) for name, bound in goals.items() if figures[name] is not None]


def _tables(figures: Mapping[str, Any]) -> dict[str, Table]:
    makers = {
        "batches": ("conversions of business objects included, means in µs", _batch_table),
        "calls": ("single calls, medians in µs", _calls),
        "ages": ("age of data, means in µs", _ages),
        "long_term": ("long-term memory on elm, medians in µs", _long_term),
    }
    return {title: make(figures[part]) for part, (title, make) in makers.items() if figures[part] is not None}


def _batch_table(times: Mapping[str, Any]) -> Table:
    sides = [side for side in ("ice", "core") if side in times["simple"]["1"]]
    parts = [
        *((f"{part}, {side}", side, part) for side in sides for part in ("commit", "query")),
        ("store", "core", "store"),
        ("lookup", "core", "lookup"),
    ]
    table = table_of("object, batch", *(shown for shown, _, _ in parts))
    for name, of_kind in times.items():
        for size, of_size in of_kind.items():
            table.add_row(f"{name}, {size}", *(f"{of_size[side][part]['mean']:,.0f}" for _, side, part in parts))
    return table


def _calls(calls: Mapping[str, Any]) -> Table:
    shown = ("ping", "echo", "bare_commit", "commit", "core_commit", "bare_query", "query", "core_query")
    ratios = ("commit_vs_echo", "query_vs_echo")
    table = table_of("", *shown, *ratios)
    for name, found in calls.items():
        medians = [f"{found[call]['median']:,.0f}" for call in shown]
        table.add_row(name, *medians, *(f"{found[ratio]:.2f}" for ratio in ratios))
    return table


def _ages(aged: Mapping[str, Any]) -> Table:
    ways = list(aged["simple"])
    table = table_of("", *ways)
    for name, found in aged.items():
        table.add_row(name, *(f"{found[way]['mean']:,.0f}" for way in ways))
    return table


def _long_term(kept: Mapping[str, Any]) -> Table:
    table = table_of("", "snapshots/s", "query LTM", "query WM", "query both", "durable commit")
    for name, found in kept.items():
        medians = [
            f"{found[part]['median']:,.0f}" for part in ("query_ltm", "query_wm", "query_both", "durable_commit")
        ]
        table.add_row(name, f"{found['snapshots_per_second']:,.0f}", *medians)
    return table
