"""`elm forget`: events that match a cue go, for good."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.answers import RecordFormat, RecordOutput, record_format, write_records
from elm.cli.cue_options import CueOptions
from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.rows import RowFormat, write_rows
from elm.cli.terminal import progress, say

if TYPE_CHECKING:
    from elm.forgetting import ForgettingReport

VACUUM_HINT = (
    "the database uses the room again after its next vacuum, which it does by itself; VACUUM FULL gives it back to "
    "the disk"
)


@takes_groups
def forget(
    *,
    wanted: CueOptions,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would go, and change nothing.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Forget the events that match a cue; what they are parts of stays as it was.

    Events still going on, and those that recognizers hold, are not forgotten: they are counted, and the exit code is
    1 then.
    """
    if wanted == CueOptions():
        everything = """--cue '{"op": "and", "args": []}'"""
        raise typer.BadParameter(f"say which events to forget; all of them are {everything}", param_hint="--cue")
    if not (dry_run or yes or sys.stdin.isatty()):
        raise typer.BadParameter("nobody is there to be asked: say --yes, or --dry-run", param_hint="--yes")
    cue = wanted.read()
    with where.open() as memory:
        if not (dry_run or yes):
            _tell(memory.forget(cue, dry_run=True), "would be forgotten")
            typer.confirm("forget them for good?", abort=True, err=True)
        with progress("forgetting", total=None) as done:
            report = memory.forget(cue, dry_run=dry_run, progress=done)
    _write(report, record_format(output))
    _tell(report, "would be forgotten" if dry_run else "forgotten")
    if report.events and not dry_run:
        say(VACUUM_HINT)
    if report.still_open or report.held:
        raise typer.Exit(ExitCode.ERROR)


def _write(report: ForgettingReport, form: RecordFormat) -> None:
    if form is RecordFormat.TABLE:
        write_rows(("type", "events"), report.types.items(), RowFormat.TABLE, right=("events",))
        return
    told = asdict(report) | {"run": None if report.run is None else str(report.run), "types": dict(report.types)}
    # A cue names no uids that could be unknown.
    del told["unknown"]
    write_records([told])


def _tell(report: ForgettingReport, done: str) -> None:
    told = [f"{report.events:,} events {done}, {report.bytes:,} bytes"]
    if report.tombstones:
        told.append(f"{report.tombstones:,} of them parts of others, which keep their tombstones")
    if report.dissolved:
        told.append(f"{report.dissolved:,} earlier tombstones are parts of nothing any more")
    say("; ".join(told))
    if report.still_open:
        say(f"elm: {report.still_open:,} events are still going on: close them first")
    if report.held:
        say(f"elm: {report.held:,} events are held by recognizers: let these finish with them, or remove them first")
