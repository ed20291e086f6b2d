"""Where: one polygon in metres of a named map frame, and the relations between two of them."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from enum import StrEnum
from itertools import chain, pairwise
from numbers import Real
from typing import Any, Self, cast

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Point, Polygon, box

from elm.errors import InvalidValue
from elm.text import check_short_name

LIMIT = 1e9
"""Greatest coordinate in metres, either way."""
DEFAULT_FRAME = "map"


class SpatialRelation(StrEnum):
    """Relations of an event's region (left) to a cue's; all are false across frames or without region."""

    EQUAL = "equal"
    SUBSET = "subset"
    SUPERSET = "superset"
    INTERSECTS = "intersects"
    DISJOINT = "disjoint"
    TOUCHES = "touches"
    WITHIN_DISTANCE = "within_distance"


class Region:
    """A valid, non-empty 2-D polygon (holes allowed) in metres of `frame`; immutable.

    Two regions are equal when frame and outline agree, whatever the ring's first corner or direction.
    """

    __slots__ = ("_outline", "_polygon", "frame", "wkb")

    frame: str
    wkb: bytes
    """The polygon as little-endian well-known binary."""
    _polygon: Polygon | None
    _outline: bytes | None

    def __init__(self, *, polygon: Polygon, frame: str = DEFAULT_FRAME) -> None:
        _check_polygon(polygon)
        object.__setattr__(self, "frame", check_short_name(frame, what="the frame of a region"))
        object.__setattr__(self, "_polygon", polygon)
        # Encoded at birth, not while a commit waits for it: what every store and every comparison needs.
        object.__setattr__(self, "wkb", shapely.to_wkb(polygon, byte_order=1, include_srid=False))
        object.__setattr__(self, "_outline", _outline(self.wkb))

    @classmethod
    def from_wkb(cls, wkb: bytes, *, frame: str) -> Self:
        """A region that a store already checked when it was born; decoded when first looked at."""
        region = cls.__new__(cls)
        object.__setattr__(region, "frame", frame)
        object.__setattr__(region, "_polygon", None)
        object.__setattr__(region, "wkb", wkb)
        object.__setattr__(region, "_outline", None)
        return region

    @classmethod
    def from_geojson(cls, geometry: Any, *, frame: str) -> Self:
        """The region of a GeoJSON `Polygon` object, in metres of `frame`."""
        if not isinstance(geometry, dict) or geometry.get("type") != "Polygon":
            raise InvalidValue(f'a polygon is a GeoJSON object {{"type": "Polygon", ...}}, not {geometry!r:.80}')
        if unknown := set(geometry) - {"type", "coordinates"}:
            raise InvalidValue(f"unknown keys in a GeoJSON polygon: {', '.join(map(repr, sorted(unknown)))}")
        rings = geometry.get("coordinates")
        if not isinstance(rings, list) or not rings:
            raise InvalidValue("the coordinates of a GeoJSON polygon are an array of rings, the outer one first")
        shell, *holes = map(_ring_of, rings)
        return cls(polygon=Polygon(shell, holes), frame=frame)

    @classmethod
    def box(cls, xmin: float, ymin: float, xmax: float, ymax: float, *, frame: str = DEFAULT_FRAME) -> Self:
        """The axis-parallel rectangle between two opposite corners."""
        _check_coordinates(xmin, ymin, xmax, ymax, what="the corners of a box")
        if xmin == xmax or ymin == ymax:
            raise InvalidValue(
                f"a box from ({xmin}, {ymin}) to ({xmax}, {ymax}) has no area: widen it, by what the robot covers"
            )
        return cls(polygon=box(xmin, ymin, xmax, ymax, ccw=True), frame=frame)

    @classmethod
    def around(cls, x: float, y: float, radius: float, *, frame: str = DEFAULT_FRAME) -> Self:
        """A regular 32-gon whose corners lie `radius` metres from (x, y): it lies inside the circle."""
        _check_coordinates(x, y, what="the middle of a region")
        _check_metres(radius, what="the radius of a region")
        polygon = Point(x, y).buffer(radius, quad_segs=8)
        if not polygon.area:
            raise InvalidValue(f"{radius} m around ({x}, {y}) are finer than the digits of these numbers: widen it")
        return cls(polygon=polygon, frame=frame)

    @classmethod
    def hull(cls, path: Iterable[Sequence[float]], *, footprint: float, frame: str = DEFAULT_FRAME) -> Self:
        """The convex hull of a path of (x, y) points, each widened by the robot's `footprint` radius in metres."""
        _check_metres(footprint, what="the footprint of a path")
        return cls(polygon=MultiPoint(_points(path)).convex_hull.buffer(footprint, quad_segs=2), frame=frame)

    @classmethod
    def swept(cls, path: Iterable[Sequence[float]], *, footprint: float, frame: str = DEFAULT_FRAME) -> Self:
        """The area that a round robot of radius `footprint` metres covers along a path of (x, y) points."""
        _check_metres(footprint, what="the footprint of a path")
        points = _points(path)
        line = LineString(points) if len(points) > 1 else Point(points[0])
        return cls(polygon=line.buffer(footprint, quad_segs=2), frame=frame)

    @property
    def polygon(self) -> Polygon:
        """The polygon, in metres of the frame."""
        if self._polygon is None:
            object.__setattr__(self, "_polygon", shapely.from_wkb(self.wkb))
        return self._polygon

    @property
    def outline(self) -> bytes:
        """The corners as bytes: the same for one place, whatever ring order, direction or repeated points say it.

        Nor does the sign of zero matter. Each ring begins at its smallest corner and goes on to the smaller of
        that corner's neighbours; holes are sorted. Read from the well-known binary, not normalised by GEOS:
        what is the same content must not depend on a library's version.
        """
        if self._outline is None:
            object.__setattr__(self, "_outline", _outline(self.wkb))
        return cast(bytes, self._outline)

    @property
    def geojson(self) -> dict[str, Any]:
        """The polygon as a GeoJSON object."""
        rings = [self.polygon.exterior, *self.polygon.interiors]
        return {"type": "Polygon", "coordinates": [[[x, y] for x, y in ring.coords] for ring in rings]}

    def distance(self, other: Region) -> float | None:
        """Shortest distance in metres; None when the frames differ."""
        return float(self.polygon.distance(other.polygon)) if self.frame == other.frame else None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Region):
            return NotImplemented
        return self.frame == other.frame and self.outline == other.outline

    def __hash__(self) -> int:
        return hash((self.frame, self.outline))

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a Region is immutable: make a new one instead of setting {name!r}")

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, (self.wkb, self.frame)

    def __repr__(self) -> str:
        xmin, ymin, xmax, ymax = self.polygon.bounds
        corners = len(self.polygon.exterior.coords) - 1
        return f"Region({self.frame!r}, {corners} corners in {xmin:g}..{xmax:g} x {ymin:g}..{ymax:g} m)"


def _outline(wkb: bytes) -> bytes:
    (rings,) = _COUNT.unpack_from(wkb, 5)
    at, outlines = 9, []
    for _ in range(rings):
        (corners,) = _COUNT.unpack_from(wkb, at)
        numbers = [number + 0.0 for number in struct.unpack_from(f"<{2 * corners}d", wkb, at + 4)]
        at += 4 + 16 * corners
        outlines.append(_ring(list(zip(numbers[::2], numbers[1::2], strict=True))))
    shell, *holes = outlines
    return b"".join([shell, *sorted(holes)])


def _ring(closed: list[tuple[float, float]]) -> bytes:
    corners = [corner for corner, after in pairwise(closed) if corner != after]
    start = corners.index(min(corners))
    corners = corners[start:] + corners[:start]
    if corners[-1] < corners[1]:
        corners[1:] = corners[:0:-1]
    return struct.pack(f"<I{2 * len(corners)}d", len(corners), *chain.from_iterable(corners))


_COUNT = struct.Struct("<I")


def derived_region(parts: Iterable[Region | None]) -> Region | None:
    """Where a complex event was (Def 10): the convex hull of the corners of its parts' regions.

    Parts without region are ignored; none left, or several frames: no region. Pass them in uid order,
    so that every store finds the same digits.
    """
    known = [part for part in parts if part is not None]
    if len({part.frame for part in known}) != 1:
        return None
    hull = shapely.GeometryCollection([part.polygon for part in known]).convex_hull
    return Region(polygon=hull, frame=known[0].frame)


EXTENT_TOLERANCE = 1e-6
"""Metres by which a given extent of a complex event may differ from the derived one."""


def same_extent(given: Region, derived: Region | None) -> bool:
    """Whether two outlines agree within `EXTENT_TOLERANCE` metres, in one frame."""
    if derived is None or given.frame != derived.frame:
        return False
    return bool(shapely.hausdorff_distance(given.polygon, derived.polygon) <= EXTENT_TOLERANCE)


def _ring_of(ring: Any) -> list[tuple[float, float]]:
    if not isinstance(ring, list) or len(ring) < 4:
        raise InvalidValue("a ring of a GeoJSON polygon is an array of at least four points, the last like the first")
    corners = [tuple(corner) if isinstance(corner, list) else () for corner in ring]
    for corner in corners:
        if len(corner) != 2 or not all(type(number) in (int, float) and abs(number) <= LIMIT for number in corner):
            raise InvalidValue(
                f"a point of a GeoJSON polygon is [x, y], numbers of metres up to {LIMIT:g}: not {list(corner)!r:.80}"
            )
    if corners[0] != corners[-1]:
        raise InvalidValue("a ring of a GeoJSON polygon must end where it begins: repeat its first point")
    return corners


def _restore(wkb: bytes, frame: str) -> Region:
    return Region.from_wkb(wkb, frame=frame)


def _points(path: Iterable[Sequence[float]]) -> list[tuple[float, float]]:
    try:
        points = [(float(x), float(y)) for x, y in path]
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"a path is a sequence of (x, y) points in metres: {error}") from error
    if not points:
        raise InvalidValue("a path without points has no region: leave the region out")
    if not np.isfinite(points).all():
        raise InvalidValue("a path has a coordinate that is not a number: drop such points first")
    return points


def _check_coordinates(*given: float, what: str) -> None:
    if not all(isinstance(number, Real) and abs(number) <= LIMIT for number in given):
        raise InvalidValue(f"{what} must be numbers of metres up to {LIMIT:g} either way, not {given!r:.200}")


def _check_metres(value: float, *, what: str) -> None:
    if not isinstance(value, Real) or not 0 < value <= LIMIT:
        raise InvalidValue(f"{what} must be greater than 0 and at most {LIMIT:g} metres, not {value!r}")


def _check_polygon(polygon: Polygon) -> None:
    if not isinstance(polygon, Polygon):
        raise InvalidValue(f"a region is one shapely Polygon, not a {type(polygon).__name__}")
    if polygon.is_empty:
        raise InvalidValue("an empty polygon is no place: leave the region out when it is unknown")
    if polygon.has_z or getattr(polygon, "has_m", False):
        raise InvalidValue("a region has no Z and no M coordinate: drop it with shapely.force_2d")
    # The method, not shapely.is_valid: that switches warnings off and on around each call, for all threads.
    if not polygon.is_valid:
        if not np.isfinite(shapely.get_coordinates(polygon)).all():
            raise InvalidValue("a polygon has a coordinate that is not a number (NaN or infinite)")
        raise InvalidValue(
            f"the polygon is not valid: {shapely.is_valid_reason(polygon)}. "
            f"Repair it first (shapely.make_valid) and count what you repaired"
        )
    if not polygon.area > 0:
        # So thin that its hull is a line: then no whole could have it as a part.
        raise InvalidValue("a polygon is so small that its area is 0: widen it, by what the robot covers")
    if max(map(abs, polygon.bounds)) > LIMIT:
        raise InvalidValue(f"a polygon has a coordinate beyond {LIMIT:g} m: is its unit really the metre?")
