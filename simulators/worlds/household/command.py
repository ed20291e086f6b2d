"""The command that writes a household's life to files, as `elm types load` and `elm load` read them."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

from elm.errors import ElmError
from elm.exchange import event_to_json, to_line, type_to_json
from simulators.bench.progress import progress
from simulators.worlds.household.household import Household
from simulators.worlds.household.kinds import DAY, event_types


def main(argv: list[str]) -> int:
    """The command `household`; its exit code."""
    parser = ArgumentParser(prog="python -m simulators household", description=__doc__)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help="write the events to this")
    parser.add_argument("--types", type=Path, metavar="FILE", help="write the types to this; default FILE.types.jsonl")
    parser.add_argument("--days", type=int, default=1, metavar="N", help="days to simulate; default 1")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of what is simulated; default 1")
    parser.add_argument("--structured", action="store_true", help="with routines and days as complex events")
    given = parser.parse_args(argv)
    types: Path = given.types or given.output.with_suffix(".types.jsonl")
    try:
        types.write_text("".join(f"{to_line(type_to_json(each))}\n" for each in event_types()), encoding="utf-8")
        number = _write(given.output, given.seed, given.days, structured=given.structured)
    except (ElmError, OSError) as error:
        print(f"simulators household: {error}", file=sys.stderr)
        return 1
    print(f"{given.days} days, {number:,} events in {given.output}. Load them with")
    print(f"  elm types load {types}")
    print(f"  elm load {given.output}")
    return 0


def _write(file: Path, seed: int, days: int, *, structured: bool) -> int:
    """Write the events of so many days; how many they were."""
    number = 0
    household = Household(seed, structured=True)
    events = household.events(days)
    with file.open("w", encoding="utf-8") as lines, progress("simulating days", total=days) as advance:
        for event in events:
            if event.type == DAY:
                advance(1)
            if structured or not event.is_complex:
                lines.write(f"{to_line(event_to_json(event))}\n")
                number += 1
    return number
