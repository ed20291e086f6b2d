"""What the store in this process makes of matching events: groups, neighbours in time, the nearest in space."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any, assert_never

import numpy as np
import shapely

from elm.cues.relations import Place
from elm.event import StoredEvent
from elm.features import FeatureValue, kind_of
from elm.geometry import Region
from elm.query import ByFeature, Group, Grouping, JoinRelation, Nearest

_Key = tuple[str, Any]
"""Kind and value: kinds never compare with each other, and Python's True == 1 must not merge two keys."""
_INT64 = range(-(2**63), 2**63)


@dataclass(slots=True)
class _Members:
    events: list[StoredEvent] = field(default_factory=list)

    def group(self, key: object) -> Group:
        intervals = [event.interval for event in self.events]
        ends = [interval.end for interval in intervals if interval.end is not None]
        return Group(
            key=key,
            count=len(intervals),
            duration=sum((lasted for i in intervals if (lasted := i.duration) is not None), timedelta()),
            first_begin=min(interval.begin for interval in intervals),
            last_end=max(ends) if len(ends) == len(intervals) else None,
        )


def grouped(events: Iterable[StoredEvent], by: Grouping | ByFeature) -> list[Group]:
    """The events by key, keys ascending (of a feature: bools, then numbers, then texts), None last."""
    keyed: dict[_Key, _Members] = {}
    others = _Members()
    for event in events:
        keys = _keys(event, by)
        for key in keys:
            keyed.setdefault(key, _Members()).events.append(event)
        if not keys:
            others.events.append(event)
    # The kinds b, n, s are in the order of the alphabet, and keys of one kind compare.
    found = [keyed[key].group(key[1]) for key in sorted(keyed)]
    return [*found, others.group(None)] if others.events else found


def _keys(event: StoredEvent, by: Grouping | ByFeature) -> list[_Key]:
    begin = event.interval.begin
    match by:
        case ByFeature(name=name):
            return [(kind_of(value), _plain(value)) for value in event.values(name)]
        case Grouping.TYPE:
            return [("s", event.type)]
        case Grouping.AGENT:
            return [] if event.agent is None else [("s", event.agent)]
        case Grouping.FRAME:
            return [] if event.region is None else [("s", event.region.frame)]
        case Grouping.DAY:
            return [("t", begin.replace(hour=0, minute=0, second=0, microsecond=0))]
        case Grouping.HOUR:
            return [("t", begin.replace(minute=0, second=0, microsecond=0))]
        case _:
            assert_never(by)


def _plain(value: FeatureValue) -> FeatureValue:
    """Whole numbers as int, so that the key does not depend on which of 1 and 1.0 came first."""
    whole = isinstance(value, float) and value.is_integer() and int(value) in _INT64
    return int(value) if whole else value


def neighbours(
    anchors: Iterable[StoredEvent], others: Iterable[StoredEvent], relation: JoinRelation, *, same_region: bool
) -> Iterator[tuple[StoredEvent, StoredEvent | None]]:
    """Each anchor with the nearest of `others`, which come by (begin, id), strictly before or after it."""
    events = list(others)
    begins = [event.interval.begin for event in events]
    for anchor in anchors:
        begin, end = anchor.interval.begin, anchor.interval.end
        found: Iterator[StoredEvent]
        if relation is JoinRelation.BEFORE:
            earlier = (events[i] for i in range(bisect_left(begins, begin) - 1, -1, -1))
            found = (event for event in earlier if event.interval.end is not None and event.interval.end < begin)
        elif end is None:
            found = iter(())
        else:
            found = (events[i] for i in range(bisect_right(begins, end), len(events)))
        if same_region:
            found = _meeting(anchor, found)
        yield anchor, next(found, None)


def _meeting(anchor: StoredEvent, events: Iterator[StoredEvent]) -> Iterator[StoredEvent]:
    here = anchor.region
    if here is None:
        return iter(())
    return (
        event
        for event in events
        if (there := event.region) is not None
        and here.frame == there.frame
        and bool(here.polygon.intersects(there.polygon))
    )


def nearest_first(events: Iterable[StoredEvent], nearest: Nearest) -> list[StoredEvent]:
    """The events that have the place in the frame asked for, by distance, then id."""
    placed = [(event, place) for event in events if (place := _place(event, nearest)) is not None]
    polygons = np.array([place.polygon for _, place in placed], dtype=object)
    distances = shapely.distance(polygons, nearest.to.polygon)
    ids = np.array([event.id for event, _ in placed], dtype=np.int64)
    return [placed[i][0] for i in np.lexsort((ids, distances))]


def _place(event: StoredEvent, nearest: Nearest) -> Region | None:
    place = event.region if nearest.place is Place.REGION else event.subject
    return place if place is not None and place.frame == nearest.to.frame else None
