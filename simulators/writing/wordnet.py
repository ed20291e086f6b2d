"""What adding a large type hierarchy costs: WordNet end to end, against a bare COPY of the finished tables."""

from __future__ import annotations

import os
import statistics
import sys
from argparse import Namespace
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.table import Table

import elm
from elm.errors import StoreFailure
from elm.taxonomy import EventType, parents_first
from elm.wordnet import read_wordnet
from simulators.bench.findings import Goal, Report, table_of
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.bench.scratch import connect, scratch_memory
from simulators.bench.timing import seconds, steady_heap
from simulators.bench.twins import Twins

QUICK_TYPES = 2_000
ROUNDS, QUICK_ROUNDS = 3, 1
TEST_DATA = "ELM_TEST_DATA"
_FILE = Path("wordnet", "wn31_types.tsv.gz")
_TABLES = ("event_type", "type_parent", "type_closure")


@dataclass(slots=True)
class Rounds:
    """The rows of the finished tables, and the seconds that each round took: to read, to add, to copy."""

    rows: dict[str, int] = field(default_factory=dict)
    read: list[float] = field(default_factory=list)
    add: list[float] = field(default_factory=list)
    copy: list[float] = field(default_factory=list)

    def figures(self) -> dict[str, Any]:
        """Medians over the rounds, and the ratios of medians, with and without reading the file."""
        read, add, copy = map(statistics.median, (self.read, self.add, self.copy))
        return {
            "types_vs_copy": (read + add) / copy,
            "types_vs_copy_without_reading": add / copy,
            "read_seconds": read,
            "add_seconds": add,
            "copy_seconds": copy,
            "rounds": len(self.copy),
            "rows": self.rows,
        }


def main(argv: list[str]) -> int:
    """The command `types`; its exit code."""
    parser = options("types", __doc__)
    parser.add_argument("--file", type=Path, help=f"the synsets; default {_FILE} in the folder named by {TEST_DATA}")
    parser.add_argument("--types", type=int, metavar="N", help=f"types of it to add; default all, quick {QUICK_TYPES}")
    given = parser.parse_args(argv)
    data = os.environ.get(TEST_DATA)
    given.file = given.file or (Path(data) / _FILE if data else None)
    given.types = given.types or (QUICK_TYPES if given.quick else None)
    if given.file is None or not given.file.is_file():
        print(
            f"simulators types: skipped, for there is no file of synsets"
            f"{f' at {given.file}' if given.file else ''}: name one with --file, or the folder that has "
            f"{_FILE} with {TEST_DATA}",
            file=sys.stderr,
        )
        return 1
    return run("types", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    number = QUICK_ROUNDS if given.quick else ROUNDS
    found = Rounds()
    with progress("adding types", total=number) as advance:
        for _ in range(number):
            _round(dsn, given.file, given.types, found)
            advance(1)
    figures = found.figures()
    goals = [Goal(name="types_vs_copy", value=figures["types_vs_copy"], at_most=5.0)]
    return Report(figures=figures, goals=goals, tables={given.file.name: _table(figures)})


def _round(dsn: str, file: Path, number: int | None, found: Rounds) -> None:
    """Read the file and add its types, or `number` of them; then copy what became of them into empty twins."""
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory, connect(dsn) as connection, steady_heap():
        twins = Twins(connection, name, _TABLES)
        types: list[EventType] = []
        found.read.append(seconds(lambda: types.extend(read_wordnet(file))))
        if number is not None:
            # Parents stand before what is below them: any beginning of the list is a hierarchy of its own.
            types = parents_first(types)[:number]
        found.add.append(seconds(lambda: memory.add_types(types)))
        rows = {table: twins.finished(table) for table in _TABLES}
        found.copy.append(seconds(lambda: twins.copy(rows)))
        found.rows = {table: twins.count(table) for table in _TABLES}
        if found.rows["event_type"] != len({each.name for each in types}):
            raise StoreFailure(f"{len(types):,} types were read, {found.rows['event_type']:,} of them were copied")


def _table(figures: dict[str, Any]) -> Table:
    table = table_of(f"{figures['rows']['event_type']:,} types, {figures['rows']['type_closure']:,} pairs", "s")
    table.add_row("reading the file", f"{figures['read_seconds']:.3f}")
    table.add_row("memory.add_types", f"{figures['add_seconds']:.3f}")
    table.add_row("bare COPY of the finished tables", f"{figures['copy_seconds']:.3f}")
    return table
