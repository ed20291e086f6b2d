"""`elm export`: events in files for other memories and programs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, BinaryIO, Generic, TypeVar

import typer

from elm.cli.cue_options import CueOptions
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import progress, say

if TYPE_CHECKING:
    from elm.exporting import Exported
    from elm.recollector import Recollection


class ExportFormat(StrEnum):
    """Formats of files."""

    JSONL = "jsonl"
    GEOJSON = "geojson"
    PARQUET = "parquet"


@takes_groups
def export(
    *,
    wanted: CueOptions,
    to: Annotated[
        Path | None, typer.Option("--to", metavar="FILE", dir_okay=False, help="The file to write. Default: stdout.")
    ] = None,
    output: Annotated[ExportFormat, typer.Option("--output", "-o", help="The format.")] = ExportFormat.JSONL,
    where: MemoryOptions,
) -> None:
    """Export the events that match a cue, by default all of them.

    JSON Lines come in id order with all parts of what matches, so that `elm load` reads them into another memory.
    """
    cue = wanted.read()
    if output is ExportFormat.PARQUET and to is None and sys.stdout.isatty():
        raise typer.BadParameter("parquet is no text for a terminal: name a file", param_hint="--to")
    with where.open() as memory:
        found = memory.recall(cue, order="id")
        total = found.count()
        with progress("exporting", total=total) as done, _opened(to) as sink:
            written, tombstones = _write(found, output, sink, done)
    added = f", {written - total:,} of them parts of what matched" if written > total else ""
    forgotten = f", and {tombstones:,} tombstones" if tombstones else ""
    say(f"{written:,} events exported{added}{forgotten}")


def _write(found: Recollection, form: ExportFormat, sink: BinaryIO, done: Callable[[int], None]) -> tuple[int, int]:
    """Write what was found; how many events and tombstones that were."""
    from elm import exporting

    match form:
        case ExportFormat.PARQUET:
            return exporting.write_parquet(found, sink, progress=done), 0
        case ExportFormat.JSONL:
            lines = _Watched(exporting.with_parts(found), done)
            for chunk in exporting.jsonl(lines):
                sink.write(chunk)
            return lines.count, lines.tombstones
        case ExportFormat.GEOJSON:
            events = _Watched(found, done)
            for chunk in exporting.geojson(events):
                sink.write(chunk)
            return events.count, 0


_Exported = TypeVar("_Exported", bound="Exported")


class _Watched(Generic[_Exported]):
    """Events, and tombstones, on their way to a file, counted for the bar."""

    def __init__(self, events: Iterable[_Exported], done: Callable[[int], None]) -> None:
        self._events = events
        self._done = done
        self.count = self.tombstones = 0

    def __iter__(self) -> Iterator[_Exported]:
        from elm.event import StoredEvent

        for event in self._events:
            if not isinstance(event, StoredEvent):
                self.tombstones += 1
            else:
                self.count += 1
                if self.count % 1_000 == 0:
                    self._done(self.count)
            yield event


@contextmanager
def _opened(to: Path | None) -> Iterator[BinaryIO]:
    """The file to write, or stdout; a file is there under its name only when it is whole."""
    if to is None:
        yield sys.stdout.buffer
    elif to.exists() and not to.is_file():
        with _blamed(to), to.open("wb") as device:
            yield device
    else:
        target = to.resolve()
        if not target.parent.is_dir():
            raise typer.BadParameter(f"there is no directory {target.parent}: make it first", param_hint="--to")
        unfinished = target.with_name(f"{target.name}.part")
        try:
            with _blamed(to), unfinished.open("wb") as file:
                yield file
            unfinished.replace(target)
        except BaseException:
            unfinished.unlink(missing_ok=True)
            raise


@contextmanager
def _blamed(file: Path) -> Iterator[None]:
    """Errors of writing name the file that the user did: a full disk names none, and the unfinished one is ours."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(file)) from error
