"""Talking to whoever runs a command: answers on stdout, everything else on stderr, progress where somebody watches."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

import typer

if TYPE_CHECKING:
    from rich.console import Console


def say(text: str) -> None:
    """One line on stderr."""
    typer.echo(visible(text), err=True)


def visible(text: str) -> str:
    """`text` with control characters as their codes: what a memory holds must not steer the terminal."""
    return "".join(character if character.isprintable() else _code(character) for character in text)


def _code(character: str) -> str:
    return character.encode("unicode_escape").decode()


def write(chunks: Iterable[bytes]) -> None:
    """Answers on stdout, in UTF-8 whatever the locale."""
    sys.stdout.flush()
    for chunk in chunks:
        sys.stdout.buffer.write(chunk)
    # Before any remark on stderr that follows.
    sys.stdout.buffer.flush()


def answers(*, markup: bool = False) -> Console:
    """A console on stdout for tables and trees; `markup` is for texts of elm's own, never of a memory."""
    from rich.console import Console

    class Answers(Console):
        def on_broken_pipe(self) -> None:
            # Rich would exit with 1: a closed pipe ends all our commands alike.
            raise BrokenPipeError

    # Without a terminal rich would cut to 80 columns what `less -S` or a file holds easily.
    return Answers(highlight=False, markup=markup, width=None if sys.stdout.isatty() else 200)


def remarks() -> Console:
    """A console on stderr."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, markup=False)


@contextmanager
def progress(
    what: str, *, total: int | None, unit: Literal["bytes", "events", ""] = "events"
) -> Iterator[Callable[[int], None]]:
    """A bar on stderr while somebody watches; tell the function it gives how much is done."""
    if not sys.stderr.isatty():
        yield lambda done: None
        return
    from rich.progress import (
        BarColumn,
        DownloadColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )

    amounts: dict[str, list[ProgressColumn]] = {"bytes": [DownloadColumn()], "events": [MofNCompleteColumn()], "": []}
    columns = (TextColumn("{task.description}"), BarColumn(), *amounts[unit], TimeElapsedColumn())
    with Progress(*columns, console=remarks(), transient=True) as bars:
        task = bars.add_task(what, total=total)
        yield lambda done: bars.update(task, completed=done)
