"""The flat through the eyes of a robot that goes about and looks: poses and pictures, as a camera gives them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cache
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from elm.errors import InvalidValue
from simulators.worlds.household.floor_plan import FURNITURE, ROOMS, Point, Slot, route
from simulators.worlds.household.pictures import COLUMN, COLUMNS, FARTHEST, FIELD_OF_VIEW, NAMES, Picture, Polar, draw

RATE = 5.0
"""Views a second."""
BEGIN = datetime(2024, 1, 1, 8, tzinfo=UTC)
LOOKS = 25.0
"""Seconds that the robot looks one way, on average, when it stands."""
RESTS = 60.0
"""Seconds between two moves of things by people, on average."""
_SPEED = 0.5
_TURN = math.radians(60)


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """What the robot sees at one time, where from, and what is true of it.

    `heading` is in radians against the x axis, the position in metres of the frame `floor_plan.FRAME`. `picture` is
    read-only. `visible` are the things in the picture with their true bearings and distances, `places` where all are.
    """

    time: datetime
    x: float
    y: float
    heading: float
    picture: Picture
    visible: Mapping[str, Polar]
    places: Mapping[str, Slot]


class _Pose(NamedTuple):
    x: float
    y: float
    heading: float


OPEN_SLOTS = tuple(slot for piece in FURNITURE.values() if not piece.closed for slot in piece.slots)
"""Where things lie: all on furniture on which they can be seen."""
_SPOTS = tuple(dict.fromkeys(slot.furniture for slot in OPEN_SLOTS))


def views(seed: int, *, rate: float = RATE, noise: float = 0.0) -> Iterator[View]:
    """Views without end, `rate` a second, the same for the same seed.

    The robot drives from one piece of furniture to another, stands, and looks at it and beside it for long: then its
    views are the same, but for `noise` (the standard deviation of what is added to every value) and for what people
    move meanwhile, in the robot's view or behind its back.
    """
    if not rate > 0 or noise < 0:
        raise InvalidValue(f"views need a rate above 0 and noise from 0 on, not {rate} and {noise}")
    chance = np.random.default_rng(seed)
    slots = dict(zip(NAMES, chance.choice(np.array(OPEN_SLOTS, dtype=object), len(NAMES), replace=False), strict=True))
    flat = _Flat(slots)
    last: _Pose | None = None
    for number, pose in enumerate(_tour(chance, rate)):
        moved = chance.random() < 1 / (rate * RESTS)
        if moved:
            flat.move(chance)
        if moved or pose != last:
            picture, visible = flat.seen(pose)
            last = pose
        shown = picture
        if noise:
            shown = picture + chance.normal(0.0, noise, picture.shape).astype(np.float32)
            shown.setflags(write=False)
        time = BEGIN + timedelta(microseconds=round(number * 1e6 / rate))
        yield View(
            time=time,
            x=pose.x,
            y=pose.y,
            heading=pose.heading,
            picture=shown,
            visible=visible,
            places=flat.places,
        )


def last_seen(given: Iterable[View]) -> dict[str, tuple[datetime, Slot]]:
    """When each thing was in sight last, and where it lay then: the truth that a search in kept views is judged by."""
    seen: dict[str, tuple[datetime, Slot]] = {}
    for view in given:
        for name in view.visible:
            seen[name] = (view.time, view.places[name])
    return seen


class _Flat:
    """The rooms' walls and the things in them, and what is seen of them from a pose."""

    def __init__(self, slots: dict[str, Slot]) -> None:
        self.places: Mapping[str, Slot] = MappingProxyType(slots)
        self._free = sorted(set(OPEN_SLOTS) - set(slots.values()), key=lambda slot: slot.at)
        self._at = np.array([slots[name].at for name in NAMES])
        self._rooms = np.array([slots[name].room for name in NAMES])

    def move(self, chance: np.random.Generator) -> None:
        """Somebody takes a thing and puts it down elsewhere."""
        number, goal = int(chance.integers(len(NAMES))), int(chance.integers(len(self._free)))
        name = NAMES[number]
        slot, self._free[goal] = self._free[goal], self.places[name]
        self.places = MappingProxyType({**self.places, name: slot})
        self._at[number], self._rooms[number] = slot.at, slot.room

    def seen(self, pose: _Pose) -> tuple[Picture, Mapping[str, Polar]]:
        """The picture, and the things in it with their true bearings and distances."""
        room = _room_at(pose.x, pose.y)
        away = self._at - (pose.x, pose.y)
        distances = np.hypot(away[:, 0], away[:, 1])
        bearings = (np.arctan2(away[:, 1], away[:, 0]) - pose.heading + math.pi) % (2 * math.pi) - math.pi
        near = np.flatnonzero((abs(bearings) < FIELD_OF_VIEW / 2) & (distances < FARTHEST) & (self._rooms == room))
        walls = _walls(room, pose, np.concatenate([_BEARINGS, bearings[near]]))
        in_sight = near[distances[near] <= walls[COLUMNS:]]
        things = {int(number): Polar(float(bearings[number]), float(distances[number])) for number in in_sight}
        picture, drawn = draw(walls[:COLUMNS], things.items())
        picture.setflags(write=False)
        return picture, MappingProxyType({NAMES[number]: things[number] for number in drawn})


def _room_at(x: float, y: float) -> str:
    return next(name for name, room in ROOMS.items() if shapely.intersects_xy(room.region.polygon, x, y))


@cache
def _sides(room: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The corners of a room, and the sides from each to the next."""
    corners = shapely.get_coordinates(ROOMS[room].region.polygon)
    return corners[:-1], np.diff(corners, axis=0)


_BEARINGS = FIELD_OF_VIEW / 2 - (np.arange(COLUMNS) + 0.5) * COLUMN


def _walls(room: str, pose: _Pose, bearings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Metres to the wall by bearing; doors are closed."""
    corners, sides = _sides(room)
    angles = pose.heading + bearings
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None]
    to_corner = corners - (pose.x, pose.y)
    cross = rays[..., 0] * sides[:, 1] - rays[..., 1] * sides[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        metres = (to_corner[:, 0] * sides[:, 1] - to_corner[:, 1] * sides[:, 0]) / cross
        along = (to_corner[:, 0] * rays[..., 1] - to_corner[:, 1] * rays[..., 0]) / cross
    hit = (metres >= 0) & (along >= -1e-9) & (along <= 1 + 1e-9)
    found: NDArray[np.float64] = np.where(hit, metres, np.inf).min(axis=1)
    return found


def _tour(chance: np.random.Generator, rate: float) -> Iterator[_Pose]:
    """The poses of a robot that goes from one piece of furniture to another and stands there for a while."""
    at = _SPOTS[int(chance.integers(len(_SPOTS)))]
    heading = FURNITURE[at].heading
    while True:
        x, y = FURNITURE[at].spot
        for side in (0.0, *chance.choice([-0.6, 0.6], size=int(chance.integers(3)))):
            goal = FURNITURE[at].heading + float(side)
            yield from _turning(Point(x, y), heading, goal, rate)
            heading = goal
            for _ in range(1 + round(rate * (5 + float(chance.exponential(LOOKS - 5))))):
                yield _Pose(x, y, heading)
        other = [spot for spot in _SPOTS if spot != at]
        following = other[int(chance.integers(len(other)))]
        for here, there in pairwise(route(at, following)):
            course = math.atan2(there.y - here.y, there.x - here.x)
            yield from _turning(here, heading, course, rate)
            heading = course
            steps = max(1, math.ceil(math.dist(here, there) / _SPEED * rate))
            for step in range(1, steps + 1):
                share = step / steps
                yield _Pose(here.x + (there.x - here.x) * share, here.y + (there.y - here.y) * share, heading)
        at = following


def _turning(at: Point, start: float, goal: float, rate: float) -> Iterator[_Pose]:
    """Turn on the spot, the shorter way."""
    turn = (goal - start + math.pi) % (2 * math.pi) - math.pi
    steps = math.ceil(abs(turn) / _TURN * rate)
    for step in range(1, steps + 1):
        yield _Pose(at.x, at.y, start + turn * step / steps)
