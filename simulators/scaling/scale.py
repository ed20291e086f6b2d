"""How commits and recalls grow with the memory: from ten thousand events to a million, or ten, in one run."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

from rich.table import Table

from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.bench.scratch import database
from simulators.scaling import asking, explaining, growth, inserting
from simulators.scaling.loaded import Loaded, drop_kept, memory_of
from simulators.worlds.queries import CLASSES

SMALLEST, QUICK_SMALLEST = 10_000, 1_000
LARGEST, QUICK_LARGEST = 1_000_000, 10_000
CUES, QUICK_CUES = 30, 5
GROUPS, QUICK_GROUPS = 200, 10


def main(argv: list[str]) -> int:
    """The command `scale`; its exit code."""
    parser = options("scale", __doc__)
    parser.add_argument(
        "--largest",
        type=_size,
        metavar="N",
        help=f"events of the largest memory, a power of ten; default {LARGEST:,}, quick {QUICK_LARGEST:,}",
    )
    parser.add_argument("--cues", type=int, metavar="N", help=f"cues of each class; default {CUES}, quick {QUICK_CUES}")
    parser.add_argument(
        "--groups",
        type=int,
        metavar="N",
        help="groups of nine atomic events and a complex one to commit into each memory in each mode; "
        f"default {GROUPS}, quick {QUICK_GROUPS}",
    )
    parser.add_argument("--keep", action="store_true", help="use the memories of earlier runs, and leave them there")
    parser.add_argument("--drop", action="store_true", help="drop the memories that were kept, and measure nothing")
    given = parser.parse_args(argv)
    if given.drop:
        for name in drop_kept(database(given.dsn)):
            print(f"dropped {name}")
        return 0
    given.largest = given.largest or (QUICK_LARGEST if given.quick else LARGEST)
    given.cues = given.cues or (QUICK_CUES if given.quick else CUES)
    given.groups = given.groups or (QUICK_GROUPS if given.quick else GROUPS)
    return run("scale", given, _measure)


def _size(text: str) -> int:
    number = float(text)
    if not number.is_integer():
        raise ArgumentTypeError(f"{text} is no number of events")
    return int(number)


def _measure(dsn: str, given: Namespace) -> Report:
    sizes = growth.sizes_up_to(given.largest, smallest=QUICK_SMALLEST if given.quick else SMALLEST)
    with ExitStack() as opened:
        with progress("loading", total=sum(sizes)) as advance:
            memories = [
                opened.enter_context(memory_of(dsn, size, given.seed, keep=given.keep, advance=advance))
                for size in sizes
            ]
        committed = _committed(dsn, memories, given)
        recalled = _recalled(dsn, memories, given)
    figures: dict[str, Any] = {
        "sizes": sizes,
        "insert_growth": committed["durable"]["event"]["growth"],
        "insert_between": list(growth.compared(sizes, growth.INSERT_SIZES)),
        "recall_between": list(growth.compared(sizes, growth.RECALL_SIZES)),
        "limit": asking.LIMIT,
        "memories": {str(each.events): each.figures() for each in memories},
        "insert": committed,
        **recalled,
    }
    return Report(figures=figures, goals=_goals(figures), tables=_tables(figures))


def _committed(dsn: str, memories: Sequence[Loaded], given: Namespace) -> dict[str, Any]:
    between = growth.compared([each.events for each in memories], growth.INSERT_SIZES)
    with progress("committing", total=len(inserting.MODES) * given.groups) as advance:
        found = inserting.measure(dsn, memories, groups=given.groups, seed=given.seed, advance=advance)
    return {mode: inserting.figures(times, between) for mode, times in found.items()}


def _recalled(dsn: str, memories: Sequence[Loaded], given: Namespace) -> dict[str, Any]:
    sizes = [each.events for each in memories]
    between = growth.compared(sizes, growth.RECALL_SIZES)
    total = (len(CLASSES) + len(asking.DEPTHS)) * given.cues
    with ExitStack() as opened, progress("recalling", total=total) as advance:
        sides = asking.open_sides(opened, dsn, memories, cues=given.cues, seed=given.seed)
        classes = asking.by_class(sides, between, cues=given.cues, advance=advance)
        depths = asking.by_depth(sides, between, cues=given.cues, seed=given.seed, advance=advance)
        figures = {name: found.figures(between) for name, found in classes.items()}
        names = explaining.slowest(figures, sizes[-1])
        return {
            "classes": figures,
            "subtypes": {name: found.figures(between) for name, found in depths.items()},
            "slowest": explaining.explained(sides[-1], names, classes),
        }


def _goals(figures: Mapping[str, Any]) -> list[Goal]:
    growing = {f"classes.{name}": found for name, found in figures["classes"].items()}
    growing |= {f"subtypes.{depth}": found for depth, found in figures["subtypes"].items()}
    return [
        Goal(name="insert_growth", value=figures["insert_growth"], at_most=growth.INSERT_GOAL),
        *(Goal(name=name, value=found["growth"], at_most=growth.RECALL_GOAL) for name, found in growing.items()),
    ]


def _tables(figures: Mapping[str, Any]) -> dict[str, Table]:
    sizes = [str(size) for size in figures["sizes"]]
    heads = [f"{int(size):,}" for size in sizes]
    loads = table_of("memory", "events/s", "bare COPY, events/s", "load s", "bytes per event", "MB")
    for found in figures["memories"].values():
        loads.add_row(
            f"{found['events']:,}",
            f"{found['events_per_second']:,.0f}",
            f"{found['copy_events_per_second']:,.0f}",
            f"{found['load_seconds']:.1f}",
            f"{found['bytes_per_event']:,.0f}",
            f"{found['bytes'] / 1e6:,.0f}",
        )
    commits = table_of("mean ms of a commit", *heads, "growth", "of medians")
    for mode, kinds in figures["insert"].items():
        for kind, found in kinds.items():
            means = [f"{found['sizes'][size]['mean']:.3f}" for size in sizes]
            commits.add_row(f"{mode}: {kind}", *means, f"{found['growth']:.2f}", f"{found['growth_of_medians']:.2f}")
    between = [str(size) for size in figures["recall_between"]]
    recalls = table_of("median ms", *heads, *(f"rows {head}" for head in between), "limit", "growth", "first", "bare")
    for name, found in {**figures["classes"], **figures["subtypes"]}.items():
        times = [f"{found['sizes'][size]['ms']:.2f}" for size in sizes]
        rows = [f"{found['sizes'][size]['rows']:.1f}" for size in between]
        growths = [f"{found[key]:.2f}" for key in ("growth", "first_growth", "bare_growth")]
        recalls.add_row(name, *times, *rows, str(found["limit"]), *growths)
    return {
        "memories": loads,
        f"commits between {growth.pair(figures['insert_between'])} events": commits,
        f"recalls of up to {figures['limit']} events, growth between equally many": recalls,
    }
