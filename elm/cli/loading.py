"""`elm load`: events from JSON Lines."""

from __future__ import annotations

import sys
from pathlib import Path
from threading import Event as Signal
from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.sources import STDIN, opened, reads, size_of
from elm.cli.stopping import set_by_signals
from elm.cli.terminal import progress, say

if TYPE_CHECKING:
    from elm.loading import FileReport, RefusedLine

REASONS = 20
"""Refusals that are told on a terminal; into a file or pipe all of them are."""


@takes_groups
def load(
    *,
    file: Annotated[str, typer.Argument(metavar="FILE|-", help="JSON Lines of events; - for stdin.")],
    refused: Annotated[
        Path | None,
        typer.Option("--refused", metavar="FILE", help="Where refused lines go. Default: FILE.refused.jsonl."),
    ] = None,
    where: MemoryOptions,
) -> None:
    """Load events from JSON Lines; parts stand before their wholes, or are in the memory.

    Lines that cannot be kept are set aside and named with the reason, the rest is loaded; exit code 1 then. Ctrl-C
    ends it between two lines, and what was read is kept; exit code 130 then.
    """
    from elm.loading import load_stream

    name = "stdin" if file == STDIN else file
    refused_file = refused or Path(f"{name}.refused.jsonl")
    reasons, stop = _Reasons(), Signal()
    with (
        opened(file, hint="FILE") as stream,
        where.open() as memory,
        progress(f"loading {name}", total=size_of(file), unit="bytes") as done,
    ):
        if reads(stream, refused_file):
            raise typer.BadParameter(f"{refused_file} is the file to load: name another", param_hint="--refused")
        with set_by_signals(stop):
            report = load_stream(
                memory.writer,
                stream,
                refused_file=refused_file,
                refused=reasons.tell,
                progress=done,
                stopped=stop.is_set,
            )
    reasons.finish()
    if stop.is_set():
        say("stopped: lines behind those that were read are not loaded")
    _report(report, refused_file)
    if stop.is_set():
        raise typer.Exit(ExitCode.INTERRUPTED)
    if report.refused:
        raise typer.Exit(ExitCode.ERROR)


def _report(report: FileReport, refused_file: Path) -> None:
    told = [f"{report.new:,} events loaded"]
    if report.tombstones:
        told.append(f"{report.tombstones:,} tombstones kept")
    if report.existing:
        told.append(f"{report.existing:,} were there already")
    if report.refused:
        told.append(f"{report.refused:,} of {report.read:,} lines refused, they are in {refused_file}")
    told += [f"{name!r} passed over on {count:,} lines" for name, count in report.ignored.items()]
    say("; ".join(told))


class _Reasons:
    """Tells why lines were refused: all of them to a file, the first ones to a person."""

    def __init__(self) -> None:
        self._limit = REASONS if sys.stderr.isatty() else None
        self._count = 0

    def tell(self, line: RefusedLine) -> None:
        self._count += 1
        if self._limit is None or self._count <= self._limit:
            say(f"elm: line {line.number}: {line.reason}")

    def finish(self) -> None:
        if self._limit is not None and self._count > self._limit:
            say(f"elm: and {self._count - self._limit:,} more lines; redirect stderr to see all reasons")
