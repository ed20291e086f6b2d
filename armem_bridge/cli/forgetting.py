"""`elm armem forget`: what long-term memory need not keep, by the mechanisms of a configuration or by budgets."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armem_bridge.cli.naming import WantedOrAll, memory_id
from elm.cli.exits import ExitCode
from elm.cli.forgetting import VACUUM_HINT
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.rows import RowOutput, row_format, write_rows
from elm.cli.terminal import progress, say

if TYPE_CHECKING:
    from armem_bridge.config import LongTermConfig
    from armem_bridge.forgetting import Plan
    from armem_bridge.forgetting.mechanisms import Offline
    from armem_bridge.memory_id import MemoryID
    from elm.app import Memory
    from elm.cli.rows import RowFormat

_COLUMNS = ("id", "mechanism", "bytes", "why")


@takes_groups
def forget(
    *,
    context: typer.Context,
    wanted: WantedOrAll = "",
    config: Annotated[
        Path | None,
        typer.Option(
            "--config",
            metavar="FILE",
            dir_okay=False,
            help="Take the offline mechanisms of this configuration, and its memory unless --memory says otherwise.",
        ),
    ] = None,
    count: Annotated[
        int | None, typer.Option("--count", min=0, metavar="N", help="Keep the N last snapshots of each entity.")
    ] = None,
    age: Annotated[
        float | None, typer.Option("--age", min=0, metavar="SECONDS", help="Keep what is at most so old.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would go and why, and change nothing.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    output: RowOutput = None,
    where: MemoryOptions,
) -> None:
    """Forget consolidated snapshots that need not be kept, for good; the newest of each entity stays.

    Exit code 4 when there is nothing of what is named.
    What is held by recognizers stays for now; the exit code is 1 then.
    """
    from armem_bridge.moments import now

    named, form = memory_id(wanted), row_format(output)
    mechanisms, keep_newest, place = _mechanisms(config, count, age)
    if not (dry_run or yes or sys.stdin.isatty()):
        raise typer.BadParameter("nobody is there to be asked: say --yes, or --dry-run", param_hint="--yes")
    with _there(context, where, place).open() as memory:
        from armem_bridge.long_term_forgetting import plan_forgetting

        with progress("looking", total=None, unit=""):
            plan = plan_forgetting(memory, mechanisms, now=now(), wanted=named, keep_newest=keep_newest)
        if not plan.looked_at:
            _say_nothing_is_there(memory, named)
        _write(plan, form)
        if dry_run:
            _tell(plan, "would be forgotten")
        elif plan.going:
            if not yes:
                _tell(plan, "would be forgotten")
                typer.confirm("forget them for good?", abort=True, err=True)
            _forget(memory, plan)
        else:
            _tell(plan, "forgotten")


def _there(context: typer.Context, where: MemoryOptions, place: LongTermConfig | None) -> MemoryOptions:
    """The memory of the configuration, as far as the command line does not say otherwise: it has these thresholds."""
    if place is None:
        return where
    memory = where.memory if _is_typed(context, "memory") else place.memory
    dsn = where.dsn if place.dsn is None or _is_typed(context, "dsn") else place.dsn
    return MemoryOptions(memory=memory, dsn=dsn)


def _is_typed(context: typer.Context, option: str) -> bool:
    """Whether an option stands on the command line, and not only in the environment."""
    source = context.get_parameter_source(option)
    return source is not None and source.name == "COMMANDLINE"


def _say_nothing_is_there(memory: Memory, named: MemoryID) -> None:
    """Where there are no snapshots, that a name is perhaps misspelt: raises `MemoryMissing`, or ends the command."""
    memory.recall().exists()
    if named.memory:
        say("nothing there")
        raise typer.Exit(ExitCode.NOTHING_MATCHED)


def _mechanisms(
    config: Path | None, count: int | None, age: float | None
) -> tuple[tuple[Offline, ...], bool, LongTermConfig | None]:
    """What is to forget, whether the newest snapshots stay, and the long-term memory that it is meant for."""
    from armem_bridge.forgetting import Retention

    if count is not None or age is not None:
        if config is not None:
            raise typer.BadParameter("budgets are given here or in the file, not in both", param_hint="--config")
        return (Retention(count=count, age=age),), True, None
    if config is None:
        raise typer.BadParameter("say what to forget by: --config, --count or --age", param_hint="--config")
    from armem_bridge.config import read_config

    given = read_config(config)
    if not given.offline:
        raise typer.BadParameter(f"{config} has no mechanisms in [forgetting.offline]", param_hint="--config")
    return given.offline, given.keep_newest, given.long_term


def _write(plan: Plan, form: RowFormat) -> None:
    rows = [(str(going.snapshot), going.mechanism, going.size, going.why) for going in plan.going]
    write_rows(_COLUMNS, rows, form, right=("bytes",))


def _tell(plan: Plan, done: str) -> None:
    say(f"{len(plan.going):,} of {plan.looked_at:,} snapshots {done}, {plan.freed:,} of {plan.size:,} bytes of data")
    for unmet in plan.unmet:
        say(f"elm: {unmet}")


def _forget(memory: Memory, plan: Plan) -> None:
    from armem_bridge.forgetting import Forgetter
    from armem_bridge.long_term_forgetting import LongTermForgetting

    port = LongTermForgetting(memory)
    with progress("forgetting", total=len(plan.going)) as done:
        applied = Forgetter(port).apply(plan, progress=done)
    say(f"{applied.forgotten:,} of {plan.looked_at:,} snapshots forgotten, in {port.events:,} versions")
    for unmet in plan.unmet:
        say(f"elm: {unmet}")
    if applied.forgotten:
        say(VACUUM_HINT)
    if port.held:
        say(f"elm: {port.held:,} events are held by recognizers: let these finish with them, or remove them first")
        raise typer.Exit(ExitCode.ERROR)
