"""`elm recognize`: which recognizers there are, running them, how they are doing, and replaying the log."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.recognition_options import CONSUMER, Consumer, RecognizerOptions, TimingOptions
from elm.cli.rows import RowFormat, RowOutput, row_format, write_rows
from elm.cli.terminal import answers, progress, say, visible

if TYPE_CHECKING:
    from collections.abc import Sequence

    from elm.recognition import Replay
    from elm.recognition.status import RecognizerStatus

recognize = typer.Typer(help="Find complex events: run recognizers, or replay the log.", no_args_is_help=True)


@recognize.command("list")
@takes_groups
def list_recognizers(
    *,
    which: RecognizerOptions,
    output: RowOutput = None,
) -> None:
    """List the recognizers that can be found, and where they are from."""
    found = which.find()
    names = ("recognizer", "version", "finds", "across_agents", "from")
    rows = [
        (
            each.recognizer.name,
            each.recognizer.version,
            [kind.name for kind in each.recognizer.outputs],
            each.recognizer.across_agents,
            each.origin,
        )
        for each in sorted(found, key=lambda each: each.recognizer.name)
    ]
    write_rows(names, rows, row_format(output), right=("version",))
    if not found:
        say("no recognizers: name a module that has some with --from MODULE[:NAME]")


@recognize.command()
@takes_groups
def run(
    *,
    which: RecognizerOptions,
    consumer: Consumer = CONSUMER,
    once: Annotated[bool, typer.Option("--once", help="Deal with what the log holds by now, and end.")] = False,
    waits: TimingOptions,
    where: MemoryOptions,
) -> None:
    """Find complex events as the log grows, until stopped by Ctrl-C or SIGTERM.

    What was found is kept together with how far the recognizers got: the next run goes on from there. With
    --once the exit code is 1 when a recognizer fails.
    """
    from elm.cli.recognition_run import run_once, run_until_stopped

    recognizers, timing = which.load(), waits.read()
    with where.open() as memory:
        manager = memory.recognition(recognizers, consumer=consumer, timing=timing)
        if not once:
            run_until_stopped(memory, manager)
        elif not run_once(manager):
            raise typer.Exit(ExitCode.ERROR)


@recognize.command()
@takes_groups
def status(
    *,
    consumer: Annotated[
        str | None, typer.Option("--consumer", metavar="NAME", help="Those that work under this name. Default: all.")
    ] = None,
    output: RowOutput = None,
    where: MemoryOptions,
) -> None:
    """Say how the recognizers at work in a memory are doing, as last committed."""
    from elm.recognition.status import status as status_of

    with where.open() as memory:
        found = status_of(memory.log, consumer)
    form = row_format(output)
    _write_status(found, form)
    if not found:
        say("no recognizers have worked here" + ("" if consumer is None else f" as {consumer!r}"))


@recognize.command()
@takes_groups
def replay(
    *,
    which: RecognizerOptions,
    since: Annotated[int, typer.Option("--since", min=0, metavar="POSITION", help="Begin behind this position.")] = 0,
    complete: Annotated[bool, typer.Option("--complete", help="Also feed the events that came too late.")] = False,
    diff: Annotated[bool, typer.Option("--diff", help="List what only the replay or only a live run found.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Keep nothing of what is found.")] = False,
    waits: TimingOptions,
    output: RowOutput = None,
    where: MemoryOptions,
) -> None:
    """Find complex events in the log as it stands, with recognizers that have seen nothing."""
    recognizers, timing, form = which.load(), waits.read(), row_format(output)
    with where.open() as memory, progress("replaying", total=None, unit=""):
        done = memory.recognize(recognizers, since=since, complete=complete, timing=timing, commit=not dry_run)
    counts = {
        "entries": done.entries,
        "found": len(done.found),
        "new": len(done.new),
        "missing": len(done.missing),
        "late": done.late,
    }
    if diff:
        _write_difference(done, form)
        say(", ".join(f"{count:,} {name}" for name, count in counts.items()))
    else:
        write_rows(tuple(counts), [tuple(counts.values())], form, right=tuple(counts))
    if done.forgotten is not None:
        before = f"the replay ended before position {done.forgotten:,} of the log, whose event was forgotten"
        say(f"elm: {before}: what follows from it cannot be known, nor what is missing")
        raise typer.Exit(ExitCode.ERROR)


def _write_difference(done: Replay, form: RowFormat) -> None:
    only = [("replay", str(uid)) for uid in done.new] + [("live", str(uid)) for uid in done.missing]
    write_rows(("only", "uid"), only, form)


_STATUS = (
    *("consumer", "recognizer", "version", "position", "lag", "fed", "found", "partial", "late", "dropped"),
    *("split", "passed_over", "cut", "forgotten", "events_per_second", "slowest", "failures", "is_failing", "error"),
)


def _write_status(found: Sequence[RecognizerStatus], form: RowFormat) -> None:
    if form is RowFormat.TABLE:
        _print_status(found)
        return
    rows = [[getattr(each, "name" if name == "recognizer" else name) for name in _STATUS] for each in found]
    write_rows(_STATUS, rows, form)


def _print_status(found: Sequence[RecognizerStatus]) -> None:
    """The numbers as a table, and below it in full why recognizers failed."""
    names = (*_STATUS[:14], "events/s", "slowest", "failures", "failing")
    rows = [
        (
            *(each.consumer, each.name, each.version, each.position, each.lag, each.fed, each.found, each.partial),
            *(each.late, each.dropped, each.split, each.passed_over, each.cut, each.forgotten),
            None if each.events_per_second is None else round(each.events_per_second),
            f"{1000 * each.slowest:,.1f} ms",
            each.failures,
            each.is_failing,
        )
        for each in found
    ]
    write_rows(names, rows, RowFormat.TABLE, right=names[2:17])
    for each in found:
        if each.error is not None:
            answers().print(visible(f"{each.name} failed {each.failures:,} times, the last time with: {each.error}"))
