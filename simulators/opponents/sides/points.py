"""How a store of points and moments is asked about regions and intervals: where candidates must lie to be looked at.

A region is kept as its centroid, an interval as its begin. Whoever searches for regions by their centroids must
search as far as the largest of them reaches, so small and large ones are kept apart: in planes, since such stores
have a third coordinate that a robot on the ground does not need. The largest extents are noted as events come.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import shapely

from simulators.opponents.protocol import Question, Record, Ring

MARGIN = 1e-3
"""Metres by which circles are larger than they need be, for stores that round coordinates."""
_SIZES = (1.0, 4.0, 16.0, 64.0)
"""Metres from its centroid up to which a region belongs to the first plane, the second, and so on."""
_BETWEEN = 1e6
"""Metres between planes: more than any circle's radius, and exact in 32 bits."""


class Point(NamedTuple):
    """A place in a plane."""

    x: float
    y: float
    z: float


NOWHERE = Point(0.0, 0.0, -_BETWEEN)
"""Where a store that insists on a place is told that something was whose region is unknown."""


class Circle(NamedTuple):
    """Where the centroids of candidates lie."""

    centre: Point
    radius: float


class Search(NamedTuple):
    """What a question is about, before it is known how large regions are."""

    x: float
    y: float
    metres: float
    reaches: bool
    """Whether centroids outside count whose region may reach in."""


class Extents:
    """How far regions reach from their centroids, plane by plane, and how long intervals are."""

    def __init__(self) -> None:
        self._reach: dict[float, float] = {}
        self._longest = 0

    def note(self, record: Record) -> Point | None:
        """Take an event into account; the point that stands for its region."""
        self._longest = max(self._longest, record.end - record.begin)
        if record.ring is None:
            return None
        x, y, reach = _disc(record.ring)
        z = _BETWEEN * sum(reach > size for size in _SIZES)
        self._reach[z] = max(self._reach.get(z, 0.0), reach)
        return Point(x, y, z)

    def points(self, x: float, y: float) -> Iterator[Point]:
        """The place in each plane that has regions."""
        return (Point(x, y, z) for z in self._reach)

    def circles(self, search: Search) -> Iterator[Circle]:
        """Where to search, one circle for each plane that has regions."""
        for z, reach in self._reach.items():
            radius = search.metres + (reach if search.reaches else 0.0) + MARGIN
            yield Circle(Point(search.x, search.y, z), radius)

    def begins(self, question: Question) -> tuple[int, int] | None:
        """Bounds, both included, of when an interval began that answers the question; None: no matter when."""
        if question.kind not in ("window", "near.lately") and not question.kind.startswith("time."):
            return None
        begin, end = int(question.value["begin"]), int(question.value["end"])
        bounds = {
            "time.equal": (begin, begin),
            "time.subset": (begin, end),
            "time.superset": (end - self._longest, begin),
        }
        return bounds.get(question.kind, (begin - self._longest, end))


def search_of(question: Question) -> Search:
    """Where the regions are that a question about places asks for.

    A region covered by another has its centroid within that one's hull, and one that covers another has the
    other's centroid within its own.
    """
    if not question.kind.startswith("region."):
        value = question.value
        return Search(value["x"], value["y"], value.get("metres", 0.0), reaches=True)
    x, y, reach = _disc(question.value)
    return {
        "region.equal": Search(x, y, 0.0, reaches=False),
        "region.subset": Search(x, y, reach, reaches=False),
        "region.superset": Search(x, y, 0.0, reaches=True),
        "region.intersects": Search(x, y, reach, reaches=True),
    }[question.kind]


def _disc(ring: Ring) -> tuple[float, float, float]:
    """The centroid of a region, and how far it reaches from there."""
    centroid = shapely.Polygon(ring).centroid
    corners = shapely.points(ring)
    return centroid.x, centroid.y, float(shapely.distance(corners, centroid).max())
