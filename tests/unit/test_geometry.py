"""Tests of regions: what is refused at birth, when two are the same, and how new ones are made."""

from __future__ import annotations

import copy
import math
import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import LineString, MultiPolygon, Point, Polygon

from elm.errors import InvalidValue
from elm.geometry import EXTENT_TOLERANCE, LIMIT, Region, derived_region, same_extent

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
HOLE = [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0)]
OTHER_HOLE = [(3.0, 3.0), (3.5, 3.0), (3.5, 3.5)]


def quietly(shell: Sequence[tuple[float, ...]], *holes: Sequence[tuple[float, ...]]) -> Polygon:
    """A polygon with coordinates that numpy would warn about."""
    with np.errstate(invalid="ignore"):
        return Polygon(shell, holes)


def region(shell: list[tuple[float, float]], *holes: list[tuple[float, float]], frame: str = "map") -> Region:
    return Region(polygon=Polygon(shell, holes), frame=frame)


# Refused at birth


@pytest.mark.parametrize(
    ("polygon", "complaint"),
    [
        (Polygon([(0, 0), (2, 2), (2, 0), (0, 2)]), "not valid.*Self-intersection"),
        (Polygon([(0, 0), (1, 1), (2, 2)]), "not valid"),
        (Polygon([(0, 0), (0, 0), (0, 0)]), "not valid"),
        (Polygon(SQUARE, [[(5, 5), (6, 5), (6, 6)]]), "not valid.*[Hh]ole"),
        (Polygon(SQUARE, [HOLE, [(1.5, 1), (2.5, 1), (2.5, 2), (1.5, 2)]]), "not valid"),
        (Polygon(), "empty"),
        (Polygon([(0, 0, 1), (1, 0, 1), (1, 1, 1)]), "no Z"),
        (quietly([(0, 0, math.nan), (1, 0, math.nan), (1, 1, math.nan)]), "no Z"),
        (shapely.from_wkt("POLYGON M ((0 0 1, 1 0 1, 1 1 1, 0 0 1))"), "no M"),
        (Polygon([(1e-300, 2e-300), (3e-300, -1e-300), (-2e-300, 1e-300)]), "area is 0"),
        (quietly([(0, 0), (1, 0), (math.nan, 1)]), "not a number"),
        (quietly([(0, 0), (1, 0), (1, math.inf)]), "not a number"),
        (quietly([(0, 0), (1, 0), (1, -math.inf)]), "not a number"),
        (quietly(SQUARE, [(1, 1), (2, 1), (2, math.nan)]), "not a number"),
        (quietly([(0, 0), (np.nextafter(LIMIT, math.inf), 0), (1, 1)]), "beyond 1e\\+09 m"),
        (Polygon([(0, 0), (1, 0), (1, -1.1e9)]), "beyond 1e\\+09 m"),
        (MultiPolygon([Polygon(SQUARE)]), "one shapely Polygon, not a MultiPolygon"),
        (Point(0, 0), "one shapely Polygon, not a Point"),
        (LineString([(0, 0), (1, 1)]), "one shapely Polygon"),
        (None, "one shapely Polygon, not a NoneType"),
        (SQUARE, "one shapely Polygon, not a list"),
    ],
)
def test_what_is_no_valid_flat_polygon_is_refused_saying_why(polygon: Any, complaint: str) -> None:
    with pytest.raises(InvalidValue, match=complaint):
        Region(polygon=polygon)


def test_coordinates_up_to_the_limit_are_accepted() -> None:
    assert Region.box(-LIMIT, -LIMIT, LIMIT, LIMIT).polygon.bounds == (-1e9, -1e9, 1e9, 1e9)


@pytest.mark.parametrize("frame", ["", "a\x00b", "a\x1fb", "\ud800", "f" * 501, "é" * 251])
def test_frames_that_no_store_could_keep_are_refused(frame: str) -> None:
    with pytest.raises(InvalidValue, match="the frame of a region"):
        Region.box(0, 0, 1, 1, frame=frame)


@pytest.mark.parametrize("frame", [None, 5, b"map"])
def test_frames_that_are_no_text_are_refused(frame: Any) -> None:
    with pytest.raises(InvalidValue, match="the frame of a region"):
        Region.box(0, 0, 1, 1, frame=frame)


def test_the_longest_frame_is_accepted() -> None:
    assert Region.box(0, 0, 1, 1, frame="é" * 250).frame == "é" * 250


# When two regions are the same


@pytest.mark.parametrize(
    ("why", "same"),
    [
        ("another first corner", region([*SQUARE[2:], *SQUARE[:2]])),
        ("the other direction", region(SQUARE[::-1])),
        ("a repeated point", region([SQUARE[0], *SQUARE])),
        ("a point repeated twice", region([*SQUARE[:2], SQUARE[1], SQUARE[1], *SQUARE[2:]])),
        ("negative zeros", region([(-0.0, -0.0), (4.0, -0.0), (4.0, 4.0), (-0.0, 4.0)])),
        ("a zero repeated with the other sign", region([(0.0, 0.0), (-0.0, 0.0), *SQUARE[1:]])),
        ("integers", region([(0, 0), (4, 0), (4, 4), (0, 4)])),
    ],
)
def test_the_same_outline_is_the_same_region(why: str, same: Region) -> None:
    assert same == region(SQUARE), why
    assert hash(same) == hash(region(SQUARE)), why
    assert same.outline == region(SQUARE).outline, why


@pytest.mark.parametrize(
    ("why", "other"),
    [
        ("another frame", region(SQUARE, frame="odom")),
        ("another corner", region([(0, 0), (4, 0), (4, 4), (0, 4.000001)])),
        ("a corner off by one bit", region([(0, 0), (4, 0), (4, 4), (0, math.nextafter(4.0, 5.0))])),
        ("a hole", region(SQUARE, HOLE)),
        ("mirrored", region([(0, 0), (-4, 0), (-4, 4), (0, 4)])),
    ],
)
def test_another_outline_or_frame_is_another_region(why: str, other: Region) -> None:
    assert other != region(SQUARE), why
    assert (other.frame, other.outline) != ("map", region(SQUARE).outline), why


def test_holes_count_as_a_set_in_any_order_and_direction() -> None:
    assert region(SQUARE, HOLE, OTHER_HOLE) == region(SQUARE[::-1], OTHER_HOLE[::-1], [*HOLE[1:], HOLE[0]])
    assert region(SQUARE, HOLE) != region(SQUARE, OTHER_HOLE)


def test_a_region_is_no_other_thing() -> None:
    assert region(SQUARE) != Polygon(SQUARE)
    assert region(SQUARE) != "map"


def _around_their_centre(corners: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Corners so ordered that the ring rarely crosses itself."""
    x, y = (sum(values) / len(corners) for values in zip(*corners, strict=True))
    return sorted(corners, key=lambda corner: math.atan2(corner[1] - y, corner[0] - x))


CORNERS = st.tuples(st.integers(-2, 2).map(float), st.integers(-2, 2).map(float))
RINGS = st.lists(CORNERS, min_size=3, max_size=6, unique=True).map(_around_their_centre)
POLYGONS = RINGS.map(Polygon).filter(lambda polygon: bool(polygon.is_valid))
TRIANGLE = [(-0.5, 0.0), (0.5, 0.0), (0.0, 0.5)]


def _rewritten(draw: st.DrawFn, ring: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The same ring from another corner, perhaps turned round, with a point repeated and other signs of zero."""
    turn, repeat = draw(st.integers(0, len(ring) - 1)), draw(st.integers(0, len(ring) - 1))
    turned = ring[turn:] + ring[:turn]
    repeated = [*turned[: repeat + 1], turned[repeat], *turned[repeat + 1 :]]
    signed = [(x or draw(st.sampled_from([0.0, -0.0])), y) for x, y in repeated]
    return signed[::-1] if draw(st.booleans()) else signed


@given(st.data())
def test_however_a_polygon_is_written_it_is_the_same_region(data: st.DataObject) -> None:
    draw: Any = data.draw
    shell = list(draw(POLYGONS).exterior.coords)[:-1]
    holes = [TRIANGLE] if Polygon(shell, [TRIANGLE]).is_valid else []

    one = Region(polygon=Polygon(shell, holes))
    other = Region(polygon=Polygon(_rewritten(draw, shell), [_rewritten(draw, hole) for hole in holes]))
    assert one == other
    assert hash(one) == hash(other)
    assert one.outline == other.outline


@given(POLYGONS, POLYGONS)
def test_two_regions_are_equal_exactly_when_their_normal_forms_are(one: Polygon, other: Polygon) -> None:
    def normal(polygon: Polygon) -> bytes:
        unsigned = shapely.transform(polygon, lambda coordinates: coordinates + 0.0)
        return bytes(shapely.to_wkb(shapely.normalize(unsigned)))

    same = normal(one) == normal(other)
    assert (Region(polygon=one) == Region(polygon=other)) == same
    assert (Region(polygon=one).outline == Region(polygon=other).outline) == same


# What a region is to others


def test_a_region_is_immutable_and_copies_to_an_equal_one() -> None:
    given_region = region(SQUARE, HOLE, frame="odom")
    with pytest.raises(AttributeError, match="immutable"):
        given_region.frame = "map"

    for twin in (pickle.loads(pickle.dumps(given_region)), copy.deepcopy(given_region)):  # noqa: S301 - our own bytes
        assert twin == given_region
        assert twin.frame == "odom"


def test_a_region_goes_through_wkb_and_geojson_unchanged() -> None:
    given_region = region(SQUARE, HOLE, frame="odom")

    assert Region.from_wkb(given_region.wkb, frame="odom") == given_region
    assert Region.from_geojson(given_region.geojson, frame="odom") == given_region
    assert Region.from_wkb(given_region.wkb, frame="odom").polygon.area == 15.0


def test_wkb_is_little_endian_plain_and_geojson_closes_its_rings() -> None:
    triangle = region([(0, 0), (1, 0), (0, 1)])

    assert triangle.wkb == shapely.to_wkb(Polygon([(0, 0), (1, 0), (0, 1)]), byte_order=1, include_srid=False)
    assert triangle.wkb[:5] == b"\x01\x03\x00\x00\x00"
    assert triangle.geojson == {
        "type": "Polygon",
        "coordinates": [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]],
    }


def test_distance_is_metres_in_one_frame_and_unknown_across_frames() -> None:
    near, far = Region.box(0, 0, 1, 1), Region.box(4, 5, 6, 7)

    assert near.distance(far) == 5.0
    assert near.distance(near) == 0.0
    assert near.distance(Region.box(4, 5, 6, 7, frame="odom")) is None


# Making regions


def test_a_box_spans_two_corners() -> None:
    assert Region.box(1, 2, 5, 4).polygon.bounds == (1.0, 2.0, 5.0, 4.0)
    assert Region.box(1, 2, 5, 4).polygon.area == 8.0
    for flat in ((0, 0, 0, 4), (0, 0, 4, 0)):
        with pytest.raises(InvalidValue):
            Region.box(*flat)


def test_around_has_32_corners_on_the_circle_and_lies_inside_it() -> None:
    corners = list(Region.around(3, -2, 5, frame="odom").polygon.exterior.coords)[:-1]

    assert len(corners) == 32
    assert [math.hypot(x - 3, y + 2) for x, y in corners] == pytest.approx([5.0] * 32)
    # The area of a regular 32-gon in a circle of radius 5.
    assert Region.around(3, -2, 5).polygon.area == pytest.approx(16 * 25 * math.sin(math.tau / 32))
    assert Region.around(3, -2, 5, frame="odom").frame == "odom"


@pytest.mark.parametrize("metres", [0, -1, -0.0, math.nan, math.inf, 1.1e9])
def test_a_radius_or_footprint_must_be_a_length(metres: float) -> None:
    with pytest.raises(InvalidValue, match="the radius of a region"):
        Region.around(0, 0, metres)
    for made in (Region.hull, Region.swept):
        with pytest.raises(InvalidValue, match="the footprint of a path"):
            made([(0, 0), (1, 1)], footprint=metres)


@pytest.mark.parametrize(
    ("made", "named"),
    [
        (lambda: Region.box(0, 0, math.nan, 0), "nan"),
        (lambda: Region.box(0, 0, 1, 0), "no area"),
        (lambda: Region.box(2, 0, 2, 5), "no area"),
        (lambda: Region.box("0", 0, 1, 1), "'0'"),  # type: ignore[arg-type]
        (lambda: Region.box(0, 0, 1, 2e9), "2000000000.0"),
        (lambda: Region.around(None, 0, 1), "None"),  # type: ignore[arg-type]
        (lambda: Region.around(1, 0, "1"), "'1'"),  # type: ignore[arg-type]
        (lambda: Region.around(1e8, 0, 1e-9), "1e-09 m around"),
    ],
)
def test_a_box_or_circle_of_what_is_no_number_or_has_no_area_is_refused(made: Callable[[], Region], named: str) -> None:
    with pytest.raises(InvalidValue, match=named):
        made()


def test_numbers_of_numpy_make_boxes_and_circles() -> None:
    of_numpy: list[Any] = [np.float32(0), np.int64(0), np.float64(1), np.int16(1)]

    assert Region.box(*of_numpy) == Region.box(0, 0, 1, 1)
    assert Region.around(*of_numpy[:3]) == Region.around(0, 0, 1)


@pytest.mark.parametrize(("x", "y"), [(math.nan, 0), (0, math.inf), (1e9, 0)])
def test_around_no_place_is_refused(x: float, y: float) -> None:
    with pytest.raises(InvalidValue):
        Region.around(x, y, 1)


MAKERS: list[Callable[..., Region]] = [Region.hull, Region.swept]


@pytest.mark.parametrize("made", MAKERS)
@pytest.mark.parametrize(
    ("path", "complaint"),
    [
        ([], "without points"),
        ([(0, 0), (math.nan, 1)], "not a number"),
        ([(0, 0), (1, math.inf)], "not a number"),
        ([(0, 0, 0)], "sequence of"),
        ([(0,)], "sequence of"),
        ([0, 1], "sequence of"),
        ([("a", "b")], "sequence of"),
        ([(None, 1)], "sequence of"),
    ],
)
def test_a_path_that_is_none_is_refused(made: Callable[..., Region], path: list[Any], complaint: str) -> None:
    with pytest.raises(InvalidValue, match=complaint):
        made(path, footprint=1)


@pytest.mark.parametrize("made", MAKERS)
@pytest.mark.parametrize(
    "path",
    [
        [(1, 1)],
        [(1, 1), (1, 1)],
        [(1, 1), (1, 1), (1, 1)],
        [(0, 0), (4, 0)],
        [(0, 0), (4, 0), (0, 0)],
        [(0, 0), (10, 0), (10, 10)],
        [(0, 0), (10, 10), (10, 0), (0, 10)],
        [(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)],
    ],
)
def test_a_path_with_a_footprint_is_a_region_that_holds_every_point_of_it(
    made: Callable[..., Region], path: list[tuple[float, float]]
) -> None:
    found = made(iter(path), footprint=0.5, frame="odom")

    assert found.frame == "odom"
    assert all(found.polygon.contains(Point(x, y)) for x, y in path)
    assert all(found.polygon.distance(Point(x, y)) <= 0.5 for x, y in found.polygon.exterior.coords)


def test_the_hull_of_a_bent_path_is_convex_and_holds_the_bend_the_swept_area_does_not() -> None:
    bent = [(0, 0), (10, 0), (10, 10)]
    inside_of_the_bend = Point(6, 4)

    hull, swept = Region.hull(bent, footprint=0.5).polygon, Region.swept(bent, footprint=0.5).polygon
    assert hull.area == pytest.approx(hull.convex_hull.area)
    assert hull.contains(inside_of_the_bend)
    assert not swept.contains(inside_of_the_bend)
    assert swept.contains(Point(5, 0))
    assert swept.contains(Point(10, 5))


def test_a_closed_loop_sweeps_a_ring_with_a_hole() -> None:
    loop = Region.swept([(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)], footprint=0.5)

    assert len(loop.polygon.interiors) == 1
    assert not loop.polygon.contains(Point(5, 5))


# Derived regions of complex events


def test_the_derived_region_is_the_convex_hull_of_all_corners() -> None:
    left, right = Region.box(0, 0, 1, 1), Region.box(3, 0, 4, 1)

    assert derived_region([left, right]) == Region.box(0, 0, 4, 1)
    assert derived_region([right, left]) == Region.box(0, 0, 4, 1)


def test_a_single_part_gives_its_own_hull_without_holes_or_bays() -> None:
    horseshoe = region([(0, 0), (4, 0), (4, 4), (3, 4), (3, 1), (1, 1), (1, 4), (0, 4)])

    assert derived_region([horseshoe]) == region(SQUARE)
    assert derived_region([region(SQUARE, HOLE)]) == region(SQUARE)


def test_parts_without_region_are_ignored() -> None:
    assert derived_region([None, region(SQUARE), None]) == region(SQUARE)
    assert derived_region([None, None]) is None
    assert derived_region([]) is None


def test_parts_in_several_frames_have_no_region_together() -> None:
    here, there = region(SQUARE), region(SQUARE, frame="odom")

    assert derived_region([here, there]) is None
    assert derived_region([there, None, there]) == there


def test_a_given_extent_is_the_derived_one_within_a_micrometre() -> None:
    derived = region(SQUARE)

    def off_by(metres: float) -> Region:
        return region([(0, 0), (4, 0), (4, 4), (0, 4 + metres)])

    assert EXTENT_TOLERANCE == 1e-6
    assert same_extent(derived, derived)
    assert same_extent(region(SQUARE[::-1]), derived)
    assert same_extent(off_by(0.9e-6), derived)
    assert not same_extent(off_by(1.1e-6), derived)
    assert not same_extent(derived, None)
    assert not same_extent(region(SQUARE, frame="odom"), derived)


# GeoJSON


@pytest.mark.parametrize(
    "geometry",
    [
        None,
        [],
        "POLYGON((0 0, 1 0, 1 1, 0 0))",
        5,
        {},
        {"type": "Polygon"},
        {"coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]},
        {"type": "polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]},
        {"type": "Point", "coordinates": [0, 0]},
        {"type": "MultiPolygon", "coordinates": [[[[0, 0], [1, 0], [1, 1], [0, 0]]]]},
        {"type": ["Polygon"], "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]], "crs": "EPSG:4326"},
        {"type": "Polygon", "coordinates": None},
        {"type": "Polygon", "coordinates": 5},
        {"type": "Polygon", "coordinates": "ring"},
        {"type": "Polygon", "coordinates": {}},
        {"type": "Polygon", "coordinates": {"0": [[0, 0], [1, 0], [1, 1], [0, 0]]}},
        {"type": "Polygon", "coordinates": []},
        {"type": "Polygon", "coordinates": [[]]},
        {"type": "Polygon", "coordinates": [None]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]], []]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]], None]},
        {"type": "Polygon", "coordinates": [[[0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 0]]]},
        {"type": "Polygon", "coordinates": [[0, 0], [1, 0], [1, 1], [0, 0]]},
        {"type": "Polygon", "coordinates": [[[[0, 0], [1, 0], [1, 1], [0, 0]]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 4], [0, 0]], [[2, 1], [3, 1], [3, 2]]]},
        {"type": "Polygon", "coordinates": [[[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0, 5], [1, 1], [0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0], [1], [1], [0]]]},
        {"type": "Polygon", "coordinates": [[["a", 0], [1, 0], [1, 1], ["a", 0]]]},
        {"type": "Polygon", "coordinates": [[["0", "0"], ["1", "0"], ["1", "1"], ["0", "0"]]]},
        {"type": "Polygon", "coordinates": [[[None, 0], [1, 0], [1, 1], [None, 0]]]},
        {"type": "Polygon", "coordinates": [[[False, False], [True, False], [True, True], [False, False]]]},
        {"type": "Polygon", "coordinates": [[[{}, 0], [1, 0], [1, 1], [{}, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, math.nan], [0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 10**400], [0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 2e9], [0, 0]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [2, 2], [2, 0], [0, 2], [0, 0]]]},
        {"type": "Polygon", "coordinates": ["0000"]},
    ],
)
def test_what_is_no_geojson_polygon_is_refused(geometry: Any) -> None:
    with pytest.raises(InvalidValue):
        Region.from_geojson(geometry, frame="map")


def test_a_geojson_polygon_in_either_direction_is_read() -> None:
    ring = [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]

    for written in (ring, ring[::-1]):
        assert Region.from_geojson({"type": "Polygon", "coordinates": [written]}, frame="map") == region(SQUARE)
