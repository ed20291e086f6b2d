"""How the store in this process makes stored events of given ones: extents and agent derived."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from elm.errors import ExtentRefused
from elm.event import Event, StoredEvent
from elm.extents import common_agent, in_uid_order, span
from elm.geometry import Region, derived_region, same_extent
from elm.tombstone import Tombstone


def as_stored(
    event: Event, parts: Sequence[StoredEvent | Tombstone], *, number: int, recorded_at: datetime
) -> StoredEvent:
    """The event as a memory keeps it; `parts` are its stored parts, from which its extents derive."""
    interval, region, subject, agent = event.interval, event.region, event.subject, event.agent
    if parts:
        interval = span(part.interval for part in parts)
        if event.interval not in (None, interval):
            raise ExtentRefused(
                f"event {event.uid} cannot have the interval {event.interval}: that of its parts is {interval}. "
                f"Leave the interval out, or commit an instant for the bound and make it a part"
            )
        ordered = in_uid_order(parts)
        region = _derived(event, "region", event.region, [part.region for part in ordered])
        subject = _derived(event, "subject", event.subject, [part.subject for part in ordered])
        agent = common_agent(parts) if agent is None else agent
    assert interval is not None  # noqa: S101 - an event without parts has one from birth
    return StoredEvent(
        id=number,
        uid=event.uid,
        type=event.type,
        interval=interval,
        recorded_at=recorded_at,
        region=region,
        subject=subject,
        features=event.features,
        agent=agent,
        payload=event.payload,
        parts=event.parts,
    )


def _derived(event: Event, name: str, given: Region | None, parts: list[Region | None]) -> Region | None:
    derived = derived_region(parts)
    if given is not None and not same_extent(given, derived):
        raise ExtentRefused(
            f"event {event.uid} cannot have the {name} {given!r}: that of its parts is {derived!r}. "
            f"Leave the {name} out: it derives"
        )
    return derived


def changed(event: StoredEvent, **fields: Any) -> StoredEvent:
    """The stored event with some fields of new value."""
    return StoredEvent(**{name: getattr(event, name) for name in StoredEvent.FIELDS} | fields)
