"""What `elm show --why` tells: which recognizer found an event, and from what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from uuid import UUID

from elm.cli.answers import EventFormat, write_records
from elm.cli.event_table import cell, event_table, lasting, moment, plain_table
from elm.cli.terminal import answers
from elm.event import StoredEvent
from elm.exchange import event_to_json
from elm.features import FeatureValue
from elm.recognizers.base import OUTPUT, RECOGNIZER, VERSION

_NOT_RECOGNIZED = "none: nobody recognized this event, it was committed as it is"


def write_reasons(events: Sequence[StoredEvent], parts: Mapping[UUID, StoredEvent], form: EventFormat) -> None:
    """Write why events are there: one JSON object each, or text for any other format; `parts` are by uid."""
    if form is EventFormat.JSONL:
        write_records(_record(event, parts) for event in events)
        return
    for number, event in enumerate(events):
        if number:
            answers().print()
        _print_reason(event, parts)


def _marks(event: StoredEvent) -> dict[str, FeatureValue | None]:
    names = {"recognizer": RECOGNIZER, "version": VERSION, "output": OUTPUT}
    return {name: event.value(feature) for name, feature in names.items()}


def _record(event: StoredEvent, parts: Mapping[UUID, StoredEvent]) -> dict[str, Any]:
    shown = event_to_json(event)
    told = {name: shown[name] for name in ("id", "uid", "type", "interval")}
    return {**told, **_marks(event), "parts": [event_to_json(parts[uid]) for uid in event.parts if uid in parts]}


def _print_reason(event: StoredEvent, parts: Mapping[UUID, StoredEvent]) -> None:
    card = plain_table("", "", show_header=False)
    card.add_row("event", cell(f"{event.id}  {event.uid}"))
    card.add_row("type", cell(event.type))
    card.add_row("begin", f"{moment(event.interval.begin)}  ({lasting(event.interval.duration)})")
    marks = _marks(event)
    if marks["recognizer"] is None:
        card.add_row("recognizer", _NOT_RECOGNIZED)
        answers().print(card)
        return
    for name, value in marks.items():
        card.add_row(name, cell("unknown" if value is None else str(value)))
    card.add_row("parts", "in the order in which they matched" if event.parts else "none")
    for uid in () if event.parts else event.wholes:
        # A deadline: it is there for what was found when it was over.
        card.add_row("a part of", cell(str(uid)))
    answers().print(card)
    if event.parts:
        answers().print(event_table(parts[uid] for uid in event.parts if uid in parts))
