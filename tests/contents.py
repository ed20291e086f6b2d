"""One full event, the many ways of writing it again, and the many events that differ from it in one thing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import timedelta, timezone
from types import MappingProxyType
from typing import Any
from uuid import UUID

from shapely.geometry import Polygon

from elm.event import Event, Payload
from elm.geometry import Region
from elm.interval import Interval
from tests.clock import at, span

ONE, TWO, THREE = UUID(int=1), UUID(int=2), UUID(int=3)
HERE, THERE = Region.box(0, 0, 4, 4), Region.box(5, 0, 9, 4)
_EAST = timezone(timedelta(hours=2))


def grasp(**changes: Any) -> Event:
    """An event with every component of an atomic one."""
    given_fields: dict[str, Any] = {
        "type": "Grasp",
        "interval": span(0, 4.5),
        "region": HERE,
        "subject": THERE,
        "features": [("object", "cup"), ("force", 3.2), ("force", 4)],
        "agent": "armar7",
        "payload": Payload(data=b"{}", media_type="application/json"),
        "uid": ONE,
    }
    return Event(**{**given_fields, **changes})


def _outlined(*corners: tuple[float, float]) -> Event:
    return grasp(region=Region(polygon=Polygon(corners)))


def _featured(*pairs: tuple[str, Any]) -> Event:
    return grasp(features=pairs)


SAME_CONTENT: Mapping[str, Callable[[], Event]] = MappingProxyType(
    {
        "again": grasp,
        "features in another order": lambda: _featured(("force", 4), ("force", 3.2), ("object", "cup")),
        "a feature twice": lambda: _featured(("object", "cup"), ("force", 3.2), ("force", 4), ("object", "cup")),
        "an integer as float": lambda: _featured(("object", "cup"), ("force", 3.2), ("force", 4.0)),
        "another zone": lambda: grasp(interval=Interval(begin=at(0).astimezone(_EAST), end=at(4.5).astimezone(_EAST))),
        "another first corner": lambda: _outlined((4, 4), (0, 4), (0, 0), (4, 0)),
        "the other direction": lambda: _outlined((0, 0), (0, 4), (4, 4), (4, 0)),
        "a repeated point": lambda: _outlined((0, 0), (0, 0), (4, 0), (4, 4), (0, 4)),
        "negative zeros": lambda: _outlined((-0.0, -0.0), (4, -0.0), (4, 4), (-0.0, 4)),
        "a region read from a store": lambda: grasp(region=Region.from_wkb(HERE.wkb, frame="map")),
        "payload as bytearray": lambda: grasp(
            payload=Payload(data=bytearray(b"{}"), media_type="application/json")  # type: ignore[arg-type]
        ),
    }
)
"""The event of `grasp()`, written otherwise."""

OTHER_CONTENT: Mapping[str, Callable[[], Event]] = MappingProxyType(
    {
        "type": lambda: grasp(type="Grip"),
        "type, by case": lambda: grasp(type="grasp"),
        "begin": lambda: grasp(interval=span(0.000001, 4.5)),
        "end": lambda: grasp(interval=span(0, 4.500001)),
        "open end": lambda: grasp(interval=span(0, None)),
        "no region": lambda: grasp(region=None),
        "region's frame": lambda: grasp(region=Region.box(0, 0, 4, 4, frame="odom")),
        "region's outline": lambda: grasp(region=Region.box(0, 0, 4, 4.000001)),
        "region's hole": lambda: grasp(
            region=Region(polygon=Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (2, 1), (2, 2)]]))
        ),
        "no subject": lambda: grasp(subject=None),
        "subject's frame": lambda: grasp(subject=Region.box(5, 0, 9, 4, frame="odom")),
        "subject's outline": lambda: grasp(subject=Region.box(5, 0, 9, 5)),
        "region and subject swapped": lambda: grasp(region=THERE, subject=HERE),
        "region as subject only": lambda: grasp(region=None, subject=HERE),
        "subject as region only": lambda: grasp(region=THERE, subject=None),
        "no features": lambda: _featured(),
        "one feature less": lambda: _featured(("object", "cup"), ("force", 3.2)),
        "one feature more": lambda: _featured(("object", "cup"), ("force", 3.2), ("force", 4), ("force", 5)),
        "feature value": lambda: _featured(("object", "mug"), ("force", 3.2), ("force", 4)),
        "feature value, by case": lambda: _featured(("object", "Cup"), ("force", 3.2), ("force", 4)),
        "feature name": lambda: _featured(("thing", "cup"), ("force", 3.2), ("force", 4)),
        "feature value's kind, text": lambda: _featured(("object", "cup"), ("force", 3.2), ("force", "4")),
        "feature value's kind, bool": lambda: _featured(("object", "cup"), ("force", 3.2), ("force", True)),
        "feature values swapped": lambda: _featured(("force", "cup"), ("object", 3.2), ("object", 4)),
        "no agent": lambda: grasp(agent=None),
        "agent": lambda: grasp(agent="armar6"),
        "type and agent swapped": lambda: grasp(type="armar7", agent="Grasp"),
        "no payload": lambda: grasp(payload=None),
        "empty payload": lambda: grasp(payload=Payload(data=b"", media_type="application/json")),
        "payload's bytes": lambda: grasp(payload=Payload(data=b"{} ", media_type="application/json")),
        "payload's media type": lambda: grasp(payload=Payload(data=b"{}", media_type="text/plain")),
        "parts": lambda: grasp(parts=[TWO], interval=None, region=None, subject=None),
        "other parts": lambda: grasp(parts=[THREE], interval=None, region=None, subject=None),
        "more parts": lambda: grasp(parts=[TWO, THREE], interval=None, region=None, subject=None),
    }
)
"""Other events than that of `grasp()`, all with its uid; their types and parts are `CONTENT_TYPES`, TWO and THREE."""

CONTENT_TYPES = ("Grasp", "Grip", "grasp", "armar7")
