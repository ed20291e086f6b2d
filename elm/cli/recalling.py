"""`elm recall`: the events that match a cue, or how the memory finds them."""

from __future__ import annotations

from enum import StrEnum
from itertools import islice
from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.answers import Counted, EventFormat, EventOutput, event_format, write_events
from elm.cli.cue_options import CueOptions, nearest_to
from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import say

if TYPE_CHECKING:
    from elm.query import Cursor
    from elm.recollector import OrderName

TABLE_LIMIT = 100
"""Rows of a table unless asked otherwise."""


class RecallOrder(StrEnum):
    """In which order events come: by (begin, id), or by that reversed."""

    BEGIN = "begin"
    REVERSED = "-begin"


@takes_groups
def recall(
    *,
    wanted: CueOptions,
    order: Annotated[
        RecallOrder | None,
        typer.Option("--order", help="By begin (default), or the latest first.", show_default=False),
    ] = None,
    nearest: Annotated[
        str | None,
        typer.Option(
            "--nearest",
            metavar="X,Y[,FRAME]",
            help="Instead of an order in time: those whose observer was nearest to the point X,Y of FRAME first.",
        ),
    ] = None,
    limit: Annotated[
        int | None,
        typer.Option("--limit", min=1, metavar="N", help=f"At most N events. Default: all; {TABLE_LIMIT} in a table."),
    ] = None,
    after: Annotated[
        str | None, typer.Option("--after", metavar="CURSOR", help="Go on where a limited recall ended.")
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Show how the memory finds the answer, instead of the answer.")
    ] = False,
    output: EventOutput = None,
    where: MemoryOptions,
) -> None:
    """Recall events by a cue; exit code 4 when nothing matches."""
    cue, cursor, form = wanted.read(), _cursor(after), event_format(output)
    if nearest is not None and (order is not None or after is not None):
        raise typer.BadParameter("the nearest come in no other order, and without --after", param_hint="--nearest")
    wanted_order: OrderName = (order or RecallOrder.BEGIN).value if nearest is None else nearest_to(nearest)
    if explain:
        from elm.cli.explaining import write_explanation

        with where.open() as memory:
            found = memory.recall(cue, order=wanted_order, limit=limit, after=cursor)
            write_explanation(found.explain(), form)
        return
    if limit is None and form is EventFormat.TABLE:
        limit = TABLE_LIMIT
    with where.open() as memory:
        # One more than asked for tells whether there are more.
        fetched = None if limit is None else limit + 1
        stream = iter(memory.recall(cue, order=wanted_order, limit=fetched, after=cursor))
        shown = Counted(islice(stream, limit))
        write_events(shown, form)
        if shown.last is None:
            say("nothing matched")
            raise typer.Exit(ExitCode.NOTHING_MATCHED)
        if limit is not None and next(stream, None) is not None:
            total = ""
            if form is EventFormat.TABLE and cursor is None:
                total = f" of {memory.recall(cue, order=wanted_order).count():,}"
            following = "" if nearest is not None else f", --after {_cursor_after(shown)} for the next"
            say(f"{'first' if cursor is None else 'next'} {shown.count:,}{total}; --limit N for more{following}")


def _cursor(after: str | None) -> Cursor | None:
    from elm.errors import InvalidValue
    from elm.query import Cursor

    try:
        return None if after is None else Cursor.parse(after)
    except InvalidValue as error:
        raise typer.BadParameter(str(error), param_hint="--after") from error


def _cursor_after(shown: Counted) -> Cursor:
    from elm.query import Cursor

    assert shown.last is not None  # noqa: S101 - asked for only when events were shown
    return Cursor.after(shown.last)
