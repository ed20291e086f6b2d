"""The formats of answers (-o), and events written in each of them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from elm.cli.terminal import answers, write

if TYPE_CHECKING:
    from elm.event import StoredEvent


class EventFormat(StrEnum):
    """How events are written."""

    TABLE = "table"
    JSONL = "jsonl"
    GEOJSON = "geojson"
    CSV = "csv"


class RecordFormat(StrEnum):
    """How anything else is written."""

    TABLE = "table"
    JSONL = "jsonl"


_HELP = "The format of the answer. Default: a table on a terminal, JSON Lines elsewhere."
EventOutput = Annotated[EventFormat | None, typer.Option("--output", "-o", help=_HELP, show_default=False)]
RecordOutput = Annotated[RecordFormat | None, typer.Option("--output", "-o", help=_HELP, show_default=False)]

_Format = TypeVar("_Format", bound=StrEnum)


def chosen(given: _Format | None, table: _Format, jsonl: _Format) -> _Format:
    """The format asked for; else a table for a person and JSON Lines for a program."""
    if given is not None:
        return given
    return table if sys.stdout.isatty() else jsonl


def event_format(given: EventFormat | None) -> EventFormat:
    """The format in which events are written."""
    return chosen(given, EventFormat.TABLE, EventFormat.JSONL)


def record_format(given: RecordFormat | None) -> RecordFormat:
    """The format in which anything else is written."""
    return chosen(given, RecordFormat.TABLE, RecordFormat.JSONL)


def write_events(events: Iterable[StoredEvent], form: EventFormat) -> int:
    """Write the events on stdout as they come; returns how many there were."""
    from elm import exporting

    counted = Counted(events)
    writers: Mapping[EventFormat, Callable[[Iterable[StoredEvent]], Iterator[bytes]]] = {
        EventFormat.JSONL: exporting.jsonl,
        EventFormat.GEOJSON: exporting.geojson,
        EventFormat.CSV: exporting.comma_separated,
    }
    if form is EventFormat.TABLE:
        from elm.cli.event_table import event_table

        shown = list(counted)
        if shown:
            answers().print(event_table(shown))
    else:
        write(writers[form](counted))
    return counted.count


def write_records(records: Iterable[dict[str, Any]]) -> None:
    """Write each record as one line of JSON."""
    from elm.exchange import to_line

    write(to_line(record).encode() + b"\n" for record in records)


class Counted:
    """Events on their way through, and how many there were."""

    def __init__(self, events: Iterable[StoredEvent]) -> None:
        self._events = events
        self.count = 0
        self.last: StoredEvent | None = None

    def __iter__(self) -> Iterator[StoredEvent]:
        for event in self._events:
            self.count += 1
            self.last = event
            yield event
