"""What `elm recall --explain` shows: the statement, its plan as run, and the events each condition leaves."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import msgspec

from elm.cli.answers import EventFormat
from elm.cli.event_table import cell, plain_table
from elm.cli.terminal import answers, visible, write

if TYPE_CHECKING:
    from elm.query import Explanation


def write_explanation(explanation: Explanation, form: EventFormat) -> None:
    """Write an explanation on stdout: one JSON object, or text for any other format."""
    if form is EventFormat.JSONL:
        write([msgspec.json.encode(asdict(explanation), enc_hook=repr) + b"\n"])
        return
    parameters = [f"  {name} = {value!r}" for name, value in explanation.parameters.items()]
    for paragraph in (explanation.sql, "\n".join(parameters), explanation.plan):
        if paragraph:
            write([f"{_plain(paragraph)}\n\n".encode()])
    table = plain_table("condition", "events alone", "events left", right=("events alone", "events left"))
    table.add_row("(the whole memory)", "", f"{explanation.events:,}")
    for condition in explanation.conditions:
        table.add_row(cell(condition.condition), f"{condition.alone:,}", f"{condition.left:,}")
    answers().print(table)


def _plain(text: str) -> str:
    return "\n".join(map(visible, text.splitlines()))
