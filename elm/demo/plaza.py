"""The mower's two runs as atomic events: drives, turns, stands and beacon contacts; episodes are recognized."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from uuid import NAMESPACE_URL, UUID, uuid5

import numpy as np

from elm.demo.motion import Kind, Motion, motions
from elm.demo.recording import RUNS, Oddities, Recording, moment, read, surveyed
from elm.event import Event, Payload
from elm.features import FeatureValue
from elm.geometry import Region
from elm.interval import Interval
from elm.taxonomy import EventType

AGENT = "mower"
FOOTPRINT = 0.6
"""Radius of the mower in metres: an assumption, the source does not say."""
BEACON_RADIUS = 0.1
"""Radius in metres of the place where a beacon stands."""
CONTACT_GAP = {"plaza1": 5_000, "plaza2": 1_250}
"""Milliseconds of silence that end a contact: in the run `plaza1` every beacon is asked within 5 s, in `plaza2`
every 0.84 s, so that a contact ends when a beacon leaves a round unanswered."""

TYPES = (
    EventType(name="Motion"),
    EventType(name="Drive", parents=("Motion",)),
    EventType(name="Turn", parents=("Motion",)),
    EventType(name="Stand", parents=("Motion",)),
    EventType(name="Perception"),
    EventType(name="BeaconContact", parents=("Perception",)),
    EventType(name="Episode"),
)

_NAMESPACE = uuid5(NAMESPACE_URL, "urn:elm:demo:plaza")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlazaRun:
    """One run as events, with what was odd in the files."""

    name: str
    motions: tuple[Event, ...]
    contacts: tuple[Event, ...]
    oddities: Oddities

    @property
    def events(self) -> Iterator[Event]:
        """Every event, in the order in which they ended."""
        atomic = [*self.motions, *self.contacts]
        yield from sorted(atomic, key=lambda event: (_interval(event).end, _interval(event).begin, event.uid))

    @property
    def end(self) -> datetime:
        """When the last of them ended."""
        return max(end for event in (*self.motions, *self.contacts) if (end := _interval(event).end) is not None)


def uid(run: str, kind: str, ordinal: int) -> UUID:
    """The uid of the `ordinal`-th event of its kind in a run: the same whenever the demo is loaded."""
    return uuid5(_NAMESPACE, f"{run}/{kind}/{ordinal}")


def load(name: str) -> PlazaRun:
    """The run `name` ("plaza1" or "plaza2") as events."""
    recording = read(name)
    beacons = beacon_places(name)
    moved = tuple(
        _motion(recording, motion, uid(name, "motion", ordinal))
        for ordinal, motion in enumerate(motions(recording), start=1)
    )
    heard = tuple(
        _contact(recording, beacons[beacon], readings, uid(name, "contact", ordinal))
        for ordinal, (beacon, readings) in enumerate(_merged(recording), start=1)
    )
    return PlazaRun(name=name, motions=moved, contacts=heard, oddities=recording.oddities)


def beacon_places(name: str) -> dict[int, Region]:
    """Where the beacons of the run `name` stand, by their numbers."""
    return {number: Region.around(x, y, BEACON_RADIUS, frame=name) for number, (x, y) in surveyed(name).items()}


def load_all() -> list[PlazaRun]:
    """Both runs, in the order of their clocks."""
    return [load(name) for name in RUNS]


def _motion(run: Recording, motion: Motion, name: UUID) -> Event:
    first, last = motion.first, motion.last
    begin, end = int(run.time[first]), int(run.time[last])
    distance = float(run.steps[first:last].sum())
    features: dict[str, FeatureValue] = {
        "distance": round(distance, 3),
        "speed": round(distance / (end - begin) * 1000, 3),
    }
    turned = float(run.heading[last] - run.heading[first])
    match motion.kind:
        case Kind.STAND:
            kind = "Stand"
        case Kind.DRIVE:
            kind = "Drive"
            course = math.atan2(run.y[last] - run.y[first], run.x[last] - run.x[first])
            features |= {"heading": round(math.degrees(course), 1) % 360, "turn": round(turned, 1)}
        case Kind.LEFT | Kind.RIGHT:
            kind = "Turn"
            features |= {"turn": round(turned, 1), "rate": round(abs(turned) / (end - begin) * 1000, 1)}
    return Event(
        type=kind,
        interval=Interval(begin=moment(begin), end=moment(end)),
        region=Region.swept(run.path(begin, end), footprint=FOOTPRINT, frame=run.name),
        features=features,
        agent=AGENT,
        uid=name,
    )


def _merged(run: Recording) -> list[tuple[int, list[int]]]:
    """The readings' indices, merged to contacts while one beacon's silence stays short, by time of the first."""
    contacts: list[tuple[int, list[int]]] = []
    latest: dict[int, list[int]] = {}
    for index, (time, beacon) in enumerate(zip(run.reading_time, run.reading_beacon, strict=True)):
        known = latest.get(int(beacon))
        if known is not None and time - run.reading_time[known[-1]] <= CONTACT_GAP[run.name]:
            known.append(index)
        else:
            latest[int(beacon)] = [index]
            contacts.append((int(beacon), latest[int(beacon)]))
    return contacts


def _contact(run: Recording, place: Region, readings: list[int], name: UUID) -> Event:
    begin, end = int(run.reading_time[readings[0]]), int(run.reading_time[readings[-1]])
    ranges = run.reading_range[readings]
    lines = [f"{time / 1000:.3f},{metres:.4f}" for time, metres in zip(run.reading_time[readings], ranges, strict=True)]
    return Event(
        type="BeaconContact",
        interval=Interval(begin=moment(begin), end=moment(end)),
        region=Region.swept(run.path(begin, end), footprint=FOOTPRINT, frame=run.name),
        subject=place,
        features={
            "beacon": int(run.reading_beacon[readings[0]]),
            "readings": len(readings),
            "min_range": float(ranges.min()),
            "mean_range": round(float(np.mean(ranges)), 3),
        },
        agent=AGENT,
        payload=Payload(data="\n".join(["t,range", *lines]).encode(), media_type="text/csv"),
        uid=name,
    )


def _interval(event: Event) -> Interval:
    assert event.interval is not None  # noqa: S101 - atomic events have one
    return event.interval
