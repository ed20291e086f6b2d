"""Rows that are no events: a table, JSON Lines or CSV of them."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Annotated, Any

import typer

from elm.cli.answers import chosen, write_records
from elm.cli.terminal import answers, write


class RowFormat(StrEnum):
    """How rows are written."""

    TABLE = "table"
    JSONL = "jsonl"
    CSV = "csv"


RowOutput = Annotated[
    RowFormat | None,
    typer.Option(
        "--output",
        "-o",
        help="The format of the answer. Default: a table on a terminal, JSON Lines elsewhere.",
        show_default=False,
    ),
]


def row_format(given: RowFormat | None) -> RowFormat:
    """The format in which rows are written."""
    return chosen(given, RowFormat.TABLE, RowFormat.JSONL)


def write_rows(
    names: Sequence[str], rows: Iterable[Sequence[Any]], form: RowFormat, *, right: Iterable[str] = ()
) -> None:
    """Write rows of named values on stdout; in a table those named in `right` are numbers."""
    match form:
        case RowFormat.JSONL:
            write_records(dict(zip(names, row, strict=True)) for row in rows)
        case RowFormat.CSV:
            write([_comma_separated(names, rows)])
        case RowFormat.TABLE:
            from elm.cli.event_table import cell, plain_table

            table = plain_table(*map(_header, names), right=[*map(_header, right)])
            for row in rows:
                table.add_row(*(cell(_shown(value)) for value in row))
            if table.row_count:
                answers().print(table)


def _header(name: str) -> str:
    return name.replace("_", " ")


def _comma_separated(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(names)
    writer.writerows(map(_plain, row) for row in rows)
    return text.getvalue().encode()


def _plain(value: Any) -> str:
    match value:
        case None:
            return ""
        case bool():
            return str(value).lower()
        case list():
            return " ".join(map(str, value))
        case _:
            return str(value)


def _shown(value: Any) -> str:
    match value:
        case bool():
            return "yes" if value else "no"
        case int() | float():
            return f"{value:,}"
        case _:
            return _plain(value)
