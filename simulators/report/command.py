"""The figures of all measurements as one document with plots, rebuilt from their JSON files without a database."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

from elm.errors import ElmError
from simulators.report.document import document
from simulators.report.sources import SOURCES, found


def main(argv: list[str]) -> int:
    """The command `report`; its exit code."""
    parser = ArgumentParser(prog="python -m simulators report", description=__doc__)
    parser.add_argument(
        "--from",
        dest="origin",
        type=Path,
        default=Path("out"),
        metavar="DIR",
        help="where the figures are; default out",
    )
    parser.add_argument(
        "--to",
        dest="target",
        type=Path,
        metavar="DIR",
        help="where report.md goes; default: report, beside the figures",
    )
    given = parser.parse_args(argv)
    target = given.target or given.origin / "report"
    try:
        measured = found(given.origin)
        if not measured:
            raise ElmError(f"no figures in {given.origin}: {SOURCES[0].command(given.origin)} makes the first")
        text = document(measured, origin=given.origin, target=target)
    except ElmError as error:
        print(f"simulators report: {error}", file=sys.stderr)
        return 1
    target.mkdir(parents=True, exist_ok=True)
    file = target / "report.md"
    file.write_text(text, encoding="utf-8")
    missing = [source.name for source in SOURCES if source not in measured]
    print(f"{file}: {len(measured)} measurements{', without ' + ', '.join(missing) if missing else ''}")
    return 0
