"""The questions of the comparison as a user of elm asks them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from uuid import UUID

from shapely.geometry import Polygon

import elm
from elm import cues
from elm.cues.algebra import Cue
from elm.geometry import Region
from elm.interval import Interval, from_micros
from elm.query import Nearest
from elm.recollector import Recollection
from simulators.opponents.protocol import Question

POINT = 1e-7
"""Half a side, in metres, of the square that stands for a point: elm's places are polygons."""


def recollection(memory: elm.Memory, asked: Question) -> Recollection:
    """What answers a question; nothing is read yet."""
    match asked.kind:
        case "type.latest":
            return memory.recall(cues.exactly(asked.value), order="-begin", limit=asked.limit)
        case "nearest":
            return memory.recall(order=Nearest(to=_point(asked.value)), limit=asked.limit)
        case _:
            return memory.recall(cue_of(asked.kind, asked.value), limit=asked.limit)


def cue_of(kind: str, value: Any) -> Cue:
    """The cue of a question that is one without an order of its own."""
    field, _, relation = kind.partition(".")
    match field, relation:
        case "type", "exactly":
            return cues.exactly(value)
        case "type", "is_a":
            return cues.is_a(value)
        case "payload", _:
            return cues.payload(bytes.fromhex(value))
        case "time", _:
            return cues.time(relation, _interval(value))  # type: ignore[arg-type]
        case "window", _:
            return cues.time("intersects", _interval(value))
        case "region", _:
            return cues.region(relation, Region(polygon=Polygon(value)))  # type: ignore[arg-type]
        case "features", _:
            return cues.features(relation, map(tuple, value))  # type: ignore[arg-type]
        case "feature_names", _:
            return cues.feature_names(relation, value)  # type: ignore[arg-type]
        case "parts", _:
            return cues.parts(relation, _uids(value))  # type: ignore[arg-type]
        case "wholes", _:
            return cues.wholes(relation, _uids(value))  # type: ignore[arg-type]
        case "near", "":
            return _near(value)
        case "near", "lately":
            return _near(value) & cues.time("intersects", _interval(value))
        case "near", "type":
            return _near(value) & cues.is_a(value["type"])
        case _:
            raise ValueError(f"elm is not told how to ask for {kind!r}")


def _near(value: Any) -> Cue:
    return cues.within(value["metres"], _point(value))


def _point(value: Any) -> Region:
    x, y = value["x"], value["y"]
    return Region.box(x - POINT, y - POINT, x + POINT, y + POINT)


def _interval(value: Any) -> Interval:
    return Interval(begin=from_micros(value["begin"]), end=from_micros(value["end"]))


def _uids(value: Iterable[str]) -> list[UUID]:
    return [UUID(hex=uid) for uid in value]
