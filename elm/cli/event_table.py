"""Events for the eyes: a table of many, a card of one, and the words for times, places and features in both."""

from __future__ import annotations

import json
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from elm.cli.cue_options import feature_value
from elm.cli.terminal import visible
from elm.event import Payload, StoredEvent

if TYPE_CHECKING:
    from elm.features import Feature
    from elm.geometry import Region
    from elm.tombstone import Tombstone

_PREVIEW = 400
"""Characters of a text payload that a card shows."""
_RELATIVES = 20
"""Parts or wholes that a card lists."""


def plain_table(*headers: str, right: Iterable[str] = (), show_header: bool = True) -> Table:
    """An empty table in the one style of all our tables; columns named in `right` are numbers."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold", show_header=show_header)
    for header in headers:
        table.add_column(header, justify="right" if header in right else "left", overflow="fold")
    return table


def event_table(events: Iterable[StoredEvent]) -> Table:
    """One event a row."""
    table = plain_table(
        "id",
        "type",
        "begin (UTC)",
        "duration",
        "where",
        "agent",
        "features",
        "parts",
        right=("id", "duration", "parts"),
    )
    for event in events:
        table.add_row(
            str(event.id),
            cell(event.type),
            moment(event.interval.begin),
            lasting(event.interval.duration),
            cell(place(event.region)),
            cell(event.agent or ""),
            cell("  ".join(map(feature, event.features))),
            str(len(event.parts)) if event.parts else "",
        )
    return table


def event_card(event: StoredEvent) -> Table:
    """Everything there is to one event."""
    card = Table.grid(padding=(0, 2, 0, 0))
    card.add_column(style="bold")
    card.add_column(overflow="fold")

    def row(name: str, *lines: str) -> None:
        for number, line in enumerate(lines):
            card.add_row("" if number else name, cell(line))

    row("event", f"{event.id}  {event.uid}")
    row("type", event.type)
    end = event.interval.end
    row("begin", moment(event.interval.begin))
    row("end", "still going on" if end is None else f"{moment(end)}  ({lasting(event.interval.duration)})")
    row("region", *outline(event.region))
    row("subject", *outline(event.subject))
    row("agent", event.agent or "none")
    row("features", *(map(feature, event.features) if event.features else ["none"]))
    row("payload", *contents(event.payload))
    row("parts", *_relatives(list(map(str, event.parts))))
    row("wholes", *_relatives(list(map(str, event.wholes))))
    row("recorded at", moment(event.recorded_at))
    return card


def event_line(event: StoredEvent, remark: str = "") -> Text:
    """One event in one line."""
    shown = [str(event.id), event.type, moment(event.interval.begin), lasting(event.interval.duration)]
    shown += map(feature, event.features)
    return cell("  ".join([*shown, remark] if remark else shown))


def tombstone_line(tombstone: Tombstone) -> Text:
    """A forgotten event in one line."""
    interval = tombstone.interval
    return cell("  ".join([str(tombstone.uid), "forgotten", moment(interval.begin), lasting(interval.duration)]))


def cell(text: str) -> Text:
    """Text of a memory as a cell: neither markup nor control characters have an effect."""
    return Text(visible(text))


def moment(at: datetime) -> str:
    """A UTC time to the microseconds it has."""
    return at.astimezone(UTC).replace(tzinfo=None).isoformat(sep=" ")


def lasting(duration: timedelta | None) -> str:
    """A duration in seconds below a minute, else in days, hours, minutes and seconds."""
    if duration is None:
        return "open"
    if duration < timedelta(minutes=1):
        return f"{duration.total_seconds():g} s"
    return str(duration - timedelta(microseconds=duration.microseconds))


def place(region: Region | None) -> str:
    """Where a region is, in short: its frame and centre."""
    if region is None:
        return ""
    centre = region.polygon.centroid
    return f"{region.frame} {centre.x:.1f}, {centre.y:.1f}"


def outline(region: Region | None) -> list[str]:
    """Where a region is and how large."""
    if region is None:
        return ["unknown"]
    xmin, ymin, xmax, ymax = region.polygon.bounds
    corners = sum(len(ring.coords) - 1 for ring in (region.polygon.exterior, *region.polygon.interiors))
    return [
        f"{place(region)} m (centre)",
        f"{xmin:g} .. {xmax:g} m, {ymin:g} .. {ymax:g} m; {region.polygon.area:,.2f} m2, {corners} corners",
    ]


def feature(given: Feature) -> str:
    """A feature as --feature takes it; text that reads as a number or a truth value stands in quotes."""
    name, value = given
    if isinstance(value, bool):
        return f"{name}={str(value).lower()}"
    if isinstance(value, str) and feature_value(value) != value:
        return f"{name}={json.dumps(value, ensure_ascii=False)}"
    return f"{name}={value}"


def contents(payload: Payload | None) -> list[str]:
    """What a payload is, and its beginning when that is text."""
    if payload is None:
        return ["none"]
    described = [f"{payload.media_type}, {len(payload.data):,} bytes"]
    try:
        text = payload.data.decode()
    except UnicodeDecodeError:
        return described
    if payload.data:
        described.append(text[:_PREVIEW] + (" ..." if len(text) > _PREVIEW else ""))
    return described


def _relatives(uids: list[str]) -> list[str]:
    if not uids:
        return ["none"]
    more = len(uids) - _RELATIVES
    return uids if more <= 0 else [*uids[:_RELATIVES], f"and {more:,} more"]
