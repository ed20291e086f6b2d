"""`elm count` and `elm stats`: how many events match, and what a memory holds."""

from __future__ import annotations

from dataclasses import asdict
from datetime import datetime
from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.answers import RecordFormat, RecordOutput, record_format, write_records
from elm.cli.cue_options import CueOptions
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import answers, visible, write

if TYPE_CHECKING:
    from elm.recollector import GroupingName, Recollection


@takes_groups
def count(
    *,
    wanted: CueOptions,
    by: Annotated[
        str | None,
        typer.Option("--by", metavar="KEY", help="One count for each type, agent, frame, day, hour or feature:NAME."),
    ] = None,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Count the events that match a cue: one number, or with --by a line for each key."""
    cue, key = wanted.read(), None if by is None else _grouping(by)
    with where.open() as memory:
        found = memory.recall(cue)
        if key is not None:
            _write_groups(found, key, record_format(output))
        elif output is RecordFormat.JSONL:
            write_records([{"count": found.count()}])
        else:
            write([f"{found.count()}\n".encode()])


@takes_groups
def stats(
    *,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Say what the memory holds, in numbers."""
    from elm.fields import time_text

    with where.open() as memory:
        known = {"memory": memory.name, **asdict(memory.statistics())}
    if record_format(output) is RecordFormat.JSONL:
        write_records([{name: time_text(v) if isinstance(v, datetime) else v for name, v in known.items()}])
        return
    from elm.cli.event_table import cell, moment, plain_table

    table = plain_table("", "", show_header=False)
    for name, value in known.items():
        match value:
            case None:
                text = "none"
            case datetime():
                text = moment(value)
            case int():
                text = f"{value:,}"
            case _:
                text = str(value)
        table.add_row(name.replace("_", " "), cell(text))
    answers().print(table)


def _grouping(by: str) -> GroupingName:
    from elm.errors import InvalidValue
    from elm.query import ByFeature, Grouping

    kind, colon, name = by.partition(":")
    if kind == "feature" and colon:
        try:
            return ByFeature(name=name)
        except InvalidValue as error:
            raise typer.BadParameter(visible(str(error)), param_hint="--by") from error
    if by not in {member.value for member in Grouping}:
        known = ", ".join(member.value for member in Grouping)
        raise typer.BadParameter(f"{by!r} is no key: choose one of {known}, feature:NAME", param_hint="--by")
    return Grouping(by)


def _write_groups(found: Recollection, key: GroupingName, form: RecordFormat) -> None:
    from elm.fields import time_text

    groups = found.groups(key)
    if form is RecordFormat.JSONL:
        write_records(
            {
                "key": time_text(group.key) if isinstance(group.key, datetime) else group.key,
                "count": group.count,
                "seconds": group.duration.total_seconds(),
                "first_begin": time_text(group.first_begin),
                "last_end": None if group.last_end is None else time_text(group.last_end),
            }
            for group in groups
        )
        return
    from elm.cli.event_table import cell, lasting, moment, plain_table

    table = plain_table("key", "count", "together", "first begin (UTC)", "last end (UTC)", right=("count", "together"))
    for group in groups:
        shown = moment(group.key) if isinstance(group.key, datetime) else str(group.key)
        table.add_row(
            cell("none" if group.key is None else shown),
            f"{group.count:,}",
            lasting(group.duration),
            moment(group.first_begin),
            "open" if group.last_end is None else moment(group.last_end),
        )
    answers().print(table)
