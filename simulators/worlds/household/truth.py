"""What is true in the household beside what the robot notices: where each thing is, and where it was last seen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime
from uuid import UUID

from elm.event import Event, StoredEvent
from elm.geometry import Region


@dataclass(frozen=True, slots=True, kw_only=True)
class Whereabouts:
    """Where a thing is: on or in furniture, with somebody who holds it (the robot too), or outside of the flat.

    `place` is the name of the one or the other; `room` and `region` are None while it is held or outside.
    """

    place: str
    room: str | None = None
    region: Region | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A thing came from one place to another, at an instant; nobody but whoever moved it need have seen it."""

    at: datetime
    thing: str
    by: str
    origin: Whereabouts
    goal: Whereabouts


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """What an event tells of a thing: where it was once the event was over, and the region it was seen at, if any."""

    place: str
    region: Region | None
    at: datetime
    uid: UUID
    began: datetime


def last_places(events: Iterable[Event | StoredEvent]) -> dict[str, Sighting]:
    """Where each thing was last seen, according to a household's events alone, in any order.

    What events tell is the feature `place`: where the thing `object` is once they are over. Since then somebody may
    have moved it unseen: where it really is tell `Household.places` and `Household.happenings`.
    """
    found: dict[str, Sighting] = {}
    for event in events:
        interval = event.interval
        if event.is_complex or interval is None or interval.end is None:
            continue
        thing, place = event.value("object"), event.value("place")
        if not isinstance(thing, str) or not isinstance(place, str):
            continue
        known = found.get(thing)
        if known is None or (known.at, known.began) < (interval.end, interval.begin):
            found[thing] = Sighting(
                place=place, region=event.subject, at=interval.end, uid=event.uid, began=interval.begin
            )
    return found
