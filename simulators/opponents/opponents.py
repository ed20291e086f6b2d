"""elm beside the stores that a user would pick instead: what the same writes and the same answers cost each."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from tempfile import TemporaryDirectory

from simulators.bench.findings import Report
from simulators.bench.measurement import options, run
from simulators.bench.progress import progress
from simulators.opponents import compared, workload
from simulators.opponents.catalogue import ENVIRONMENTS, ROOT, SIDES, chosen
from simulators.opponents.protocol import KINDS, MODES
from simulators.opponents.runner import Runner

EVENTS, QUICK_EVENTS = 20_000, 400
COMMITS, QUICK_COMMITS = 1_000, 20
QUESTIONS, QUICK_QUESTIONS = 10, 1
REMEDY = "not installed: run `make opponents`"


def main(argv: list[str]) -> int:
    """The command `opponents`; its exit code."""
    parser = options("opponents", __doc__)
    parser.add_argument(
        "--events", type=int, metavar="N", help=f"events in each store; default {EVENTS}, quick {QUICK_EVENTS}"
    )
    parser.add_argument(
        "--questions", type=int, metavar="N", help=f"of each kind; default {QUESTIONS}, quick {QUICK_QUESTIONS}"
    )
    parser.add_argument(
        "--sides",
        nargs="+",
        default=[],
        choices=[side.name for side in SIDES],
        metavar="NAME",
        help=f"beside elm only these; default all: {', '.join(side.name for side in SIDES[1:])}",
    )
    parser.add_argument(
        "--environments", type=Path, default=ENVIRONMENTS, metavar="DIR", help="where `make opponents` put them"
    )
    parser.add_argument(
        "--scratch",
        type=Path,
        default=ROOT / "out",
        metavar="DIR",
        help="where the stores' files are made, and removed: on the disk that the server's are on; default out",
    )
    given = parser.parse_args(argv)
    given.events = given.events or (QUICK_EVENTS if given.quick else EVENTS)
    given.questions = given.questions or (QUICK_QUESTIONS if given.quick else QUESTIONS)
    return run("opponents", given, _measure)


def _measure(dsn: str, given: Namespace) -> Report:
    sides = chosen(given.sides)
    missing = {side.name: REMEDY for side in sides if not side.is_installed(given.environments)}
    commits = min(QUICK_COMMITS if given.quick else COMMITS, given.events // 2)
    given.scratch.mkdir(parents=True, exist_ok=True)
    task = workload.make(events=given.events, per_kind=given.questions, seed=given.seed)
    steps = len(MODES) * commits + len(KINDS) * given.questions
    with (
        TemporaryDirectory(prefix="opponents-", dir=given.scratch) as directory,
        progress("comparing", total=steps) as advance,
    ):
        runner = Runner(task, dsn, Path(directory), given.environments.absolute(), advance)
        race = runner.run([side for side in sides if side.name not in missing], commits)
    figures = compared.figures(race, task, commits) | {"missing": missing}
    for line in compared.complaints(figures):
        print(line, file=sys.stderr)
    return Report(figures=figures, goals=[], tables=compared.tables(figures))
