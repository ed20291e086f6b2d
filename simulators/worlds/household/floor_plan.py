"""A flat of six rooms with doors, furniture that things lie on or in, and the ways between them, in metres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

from shapely import union_all
from shapely.geometry import Polygon

from elm.geometry import Region

FRAME = "flat"
FOOTPRINT = 0.3
"""Radius of the robot."""
BODY = 0.25
"""Radius of a person."""
THING = 0.04
"""Radius of the place where a thing lies."""

_REACH = 0.55
"""From a piece of furniture to the robot that stands in front of it."""
_OPEN_GRID, _CLOSED_GRID = 0.2, 0.1
_ASIDE = 0.6


class Point(NamedTuple):
    """A place on the floor."""

    x: float
    y: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """A room and its outline."""

    name: str
    region: Region


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """A door between two rooms: its middle, and on either side the place from which one goes straight through."""

    rooms: tuple[str, str]
    middle: Point
    sides: tuple[Point, Point]

    def side(self, room: str) -> Point:
        """The place in front of the door in one of its rooms."""
        return self.sides[self.rooms.index(room)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """A place on or in a piece of furniture for one thing."""

    furniture: str
    room: str
    at: Point
    region: Region


@dataclass(frozen=True, slots=True, kw_only=True)
class Furniture:
    """What stands in a room: the robot uses it from `spot`, a person stands at `seat`; `closed` hides what is in it."""

    name: str
    room: str
    region: Region
    spot: Point
    heading: float
    """Radians, against the x axis, in which the robot looks at it from its spot."""
    seat: Point
    closed: bool
    slots: tuple[Slot, ...]


def _outline(*corners: tuple[float, float]) -> Region:
    return Region(polygon=Polygon(corners), frame=FRAME)


def _box(xmin: float, ymin: float, xmax: float, ymax: float) -> Region:
    return Region.box(xmin, ymin, xmax, ymax, frame=FRAME)


HALL, KITCHEN, LIVING_ROOM, BEDROOM, STUDY, BATHROOM = (
    *("hall", "kitchen", "living room", "bedroom", "study", "bathroom"),
)
ROOMS = MappingProxyType(
    {
        name: Room(name=name, region=region)
        for name, region in (
            (HALL, _outline((0, 3), (2.6, 3), (2.6, 3.6), (12, 3.6), (12, 5.1), (0, 5.1))),
            (KITCHEN, _box(0, 5.1, 4.4, 9)),
            (LIVING_ROOM, _box(4.4, 5.1, 12, 9)),
            (BEDROOM, _box(2.6, 0, 7.4, 3.6)),
            (STUDY, _box(7.4, 0, 12, 3.6)),
            (BATHROOM, _box(0, 0, 2.6, 3)),
        )
    }
)
FLAT = _box(0, 0, 12, 9)
"""All of the rooms together."""

DOORS = tuple(
    Door(rooms=rooms, middle=Point(*middle), sides=(Point(*first), Point(*second)))
    for rooms, middle, first, second in (
        ((HALL, KITCHEN), (2.2, 5.1), (2.2, 4.6), (2.2, 5.6)),
        ((HALL, LIVING_ROOM), (8.0, 5.1), (8.0, 4.6), (8.0, 5.6)),
        ((HALL, BEDROOM), (5.0, 3.6), (5.0, 4.1), (5.0, 3.1)),
        ((HALL, STUDY), (9.6, 3.6), (9.6, 4.1), (9.6, 3.1)),
        ((HALL, BATHROOM), (1.3, 3.0), (1.3, 3.9), (1.3, 2.5)),
        ((KITCHEN, LIVING_ROOM), (4.4, 6.8), (3.9, 6.8), (4.9, 6.8)),
    )
)
FRONT_DOOR = Point(11.7, 4.2)
"""Where one stands who comes into the flat."""

_FRONTS = MappingProxyType({"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)})
"""Which way from the middle of a piece of furniture its front is."""

DOCK = "charging station"
_PIECES: tuple[tuple[str, str, tuple[float, float, float, float], str, bool], ...] = (
    (DOCK, HALL, (0.0, 4.0, 0.3, 4.6), "east", False),
    ("hall table", HALL, (10.2, 4.75, 11.4, 5.1), "south", False),
    ("coat rack", HALL, (6.0, 4.8, 7.0, 5.1), "south", False),
    ("shoe rack", HALL, (1.9, 3.0, 2.5, 3.3), "north", False),
    ("counter", KITCHEN, (0.8, 8.4, 2.8, 9.0), "south", False),
    ("fridge", KITCHEN, (0.0, 7.6, 0.7, 8.3), "east", True),
    ("cupboard", KITCHEN, (2.9, 8.4, 4.1, 9.0), "south", True),
    ("dishwasher", KITCHEN, (0.0, 6.7, 0.6, 7.3), "east", True),
    ("kitchen table", KITCHEN, (0.2, 5.4, 1.3, 6.3), "east", False),
    ("dining table", LIVING_ROOM, (4.9, 7.7, 6.7, 8.7), "south", False),
    ("sofa", LIVING_ROOM, (8.4, 8.2, 10.4, 9.0), "south", False),
    ("coffee table", LIVING_ROOM, (10.2, 6.1, 11.2, 6.7), "west", False),
    ("bookshelf", LIVING_ROOM, (11.6, 7.4, 12.0, 8.8), "west", False),
    ("sideboard", LIVING_ROOM, (5.2, 5.1, 7.0, 5.5), "north", False),
    ("bed", BEDROOM, (2.8, 0.0, 4.4, 1.9), "north", False),
    ("nightstand", BEDROOM, (5.7, 0.0, 6.3, 0.5), "north", False),
    ("wardrobe", BEDROOM, (6.8, 0.4, 7.4, 2.4), "west", True),
    ("desk", STUDY, (8.2, 0.0, 9.8, 0.8), "north", False),
    ("shelf", STUDY, (11.6, 0.6, 12.0, 2.0), "west", False),
    ("armchair", STUDY, (7.5, 2.4, 8.3, 3.2), "east", False),
    ("washbasin", BATHROOM, (0.0, 1.2, 0.5, 2.0), "east", False),
    ("washing machine", BATHROOM, (2.0, 0.2, 2.6, 0.8), "west", True),
)

_BLOCKED = union_all([_box(*corners).polygon.buffer(BODY) for _, _, corners, _, _ in _PIECES])


def _furniture(name: str, room: str, corners: tuple[float, float, float, float], front: str, closed: bool) -> Furniture:
    xmin, ymin, xmax, ymax = corners
    x, y = (xmin + xmax) / 2, (ymin + ymax) / 2
    right, up = _FRONTS[front]
    out = (xmax - xmin if right else ymax - ymin) / 2 + _REACH
    spot = Point(x + right * out, y + up * out)
    aside = [Point(spot.x + way * up * _ASIDE, spot.y + way * right * _ASIDE) for way in (1, -1)]
    free = ROOMS[room].region.polygon.buffer(-BODY - 0.01).difference(_BLOCKED)
    seat = next(place for place in aside if free.covers(around(place, THING).polygon))
    return Furniture(
        name=name,
        room=room,
        region=_box(*corners),
        spot=spot,
        heading=math.atan2(-up, -right),
        seat=seat,
        closed=closed,
        slots=() if name == DOCK else _slots(name, room, corners, _CLOSED_GRID if closed else _OPEN_GRID),
    )


def _slots(name: str, room: str, corners: tuple[float, float, float, float], grid: float) -> tuple[Slot, ...]:
    xmin, ymin, xmax, ymax = corners
    columns, rows = (max(1, int((length - 0.1) / grid + 1e-9)) for length in (xmax - xmin, ymax - ymin))
    places = [
        Point(
            round((xmin + xmax) / 2 + (column - (columns - 1) / 2) * grid, 6),
            round((ymin + ymax) / 2 + (row - (rows - 1) / 2) * grid, 6),
        )
        for row in range(rows)
        for column in range(columns)
    ]
    return tuple(Slot(furniture=name, room=room, at=place, region=around(place, THING)) for place in places)


def around(place: Point, radius: float) -> Region:
    """What a round thing covers: an octagon, to a tenth of a millimetre."""
    turns = [math.pi * corner / 4 for corner in range(8)]
    return _outline(
        *((round(place.x + radius * math.cos(turn), 4), round(place.y + radius * math.sin(turn), 4)) for turn in turns)
    )


FURNITURE = MappingProxyType({piece[0]: _furniture(*piece) for piece in _PIECES})


def pieces(room: str, *, open_only: bool = False) -> tuple[Furniture, ...]:
    """The furniture of a room that things can lie on or in."""
    return tuple(
        piece for piece in FURNITURE.values() if piece.room == room and piece.slots and not (open_only and piece.closed)
    )


@cache
def doors_between(room: str, other: str) -> tuple[Door, ...]:
    """The doors on the way from one room to another, by the fewest."""
    ways: list[tuple[str, tuple[Door, ...]]] = [(room, ())]
    for at, passed in ways:
        if at == other:
            return passed
        ways += [
            (door.rooms[1 - door.rooms.index(at)], (*passed, door))
            for door in DOORS
            if at in door.rooms and door not in passed
        ]
    raise AssertionError(f"no way leads from {room} to {other}")


@cache
def route(start: str, goal: str) -> tuple[Point, ...]:
    """The corners of the way from the spot of one piece of furniture to that of another, through doors."""
    at = FURNITURE[start].room
    way = [FURNITURE[start].spot]
    for door in doors_between(at, FURNITURE[goal].room):
        beyond = door.rooms[1 - door.rooms.index(at)]
        way += [door.side(at), door.side(beyond)]
        at = beyond
    return (*way, FURNITURE[goal].spot)


@cache
def length(start: str, goal: str) -> float:
    """Metres of the way between two pieces of furniture."""
    return sum(math.dist(here, there) for here, there in pairwise(route(start, goal)))


@cache
def swept(start: str, goal: str) -> Region:
    """What the robot covers on its way between two pieces of furniture."""
    return Region.swept(route(start, goal), footprint=FOOTPRINT, frame=FRAME)
