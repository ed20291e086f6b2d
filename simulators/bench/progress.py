"""Progress bars on stderr while somebody watches, drawn between the timed calls and never during one."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

_REDRAWN_AFTER = 0.25
_REMEMBERED = 3600.0
"""Seconds of the past from which the remaining time is told: calls that get slower come again in the next run."""


@contextmanager
def progress(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar; tell the function it gives how many more are done."""
    if not sys.stderr.isatty():
        yield lambda more: None
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    drawn, waiting = 0.0, 0
    # Rich's own thread would draw in the middle of timed calls.
    with Progress(
        *columns,
        console=Console(stderr=True),
        transient=True,
        auto_refresh=False,
        speed_estimate_period=_REMEMBERED,
    ) as bars:
        task = bars.add_task(what, total=total)

        def advance(more: int) -> None:
            nonlocal drawn, waiting
            waiting += more
            if monotonic() - drawn > _REDRAWN_AFTER:
                # Rich remembers a thousand steps: single ones would soon push the past out.
                bars.advance(task, waiting)
                bars.refresh()
                drawn, waiting = monotonic(), 0

        yield advance
