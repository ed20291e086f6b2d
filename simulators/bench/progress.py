"""Progress bars on stderr while somebody watches, drawn between the timed calls and never during one."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

_REDRAWN_AFTER = 0.25


@contextmanager
def progress(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """A bar; tell the function it gives how many more are done."""
    if not sys.stderr.isatty():
        yield lambda more: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    drawn = 0.0
    # Rich's own thread would draw in the middle of timed calls.
    with Progress(*columns, console=Console(stderr=True), transient=True, auto_refresh=False) as bars:
        task = bars.add_task(what, total=total)

        def advance(more: int) -> None:
            nonlocal drawn
            bars.advance(task, more)
            if monotonic() - drawn > _REDRAWN_AFTER:
                bars.refresh()
                drawn = monotonic()

        yield advance
