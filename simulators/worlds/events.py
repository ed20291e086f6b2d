"""The event simulator of the paper (VI-B): the endless life of a robot that moves about a bounded map, from a seed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any
from uuid import UUID

import numpy as np
import shapely
from numpy.typing import NDArray

from elm.event import Event, Payload
from elm.geometry import DEFAULT_FRAME, Region
from elm.interval import Interval, from_micros, to_micros
from simulators.worlds import hierarchy, vocabulary

PARTS = 9
"""Atomic events before each complex one, which has them as its parts."""
FEATURES = 5
PAYLOAD_BYTES = (180, 220)
"""Shortest and longest payload; all lengths between are equally likely."""

_GROUPS = 200
"""Complex events drawn at once: arrays of this size are fast, and small."""
_ATOMIC = _GROUPS * PARTS
_EVENTS = _GROUPS * (PARTS + 1)
_OCTAGON = np.deg2rad([112.5, 157.5, 202.5, 247.5, 292.5, 337.5, 22.5, 67.5, 112.5])
"""Corners of the footprint against the heading: four at the back, four at the front, the first again."""

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """A square map with sides of `side` metres, and a round robot in it that is `footprint` metres in radius."""

    side: float = 200.0
    footprint: float = 0.3
    top_speed: float = 1.0
    frame: str = DEFAULT_FRAME
    agent: str = "robot"
    begin: datetime = datetime(2026, 1, 1, tzinfo=UTC)


DEFAULT_WORLD = World()


def simulate(seed: int, world: World = DEFAULT_WORLD) -> Iterator[Event]:
    """Events without end, the same for the same seed, uids included; every tenth has the nine before it as parts.

    Types are drawn uniformly from all of `hierarchy`, five features from `vocabulary`; begins ascend,
    about two seconds apart, and one event in ten is an instant. Complex events leave their extents to
    be derived.
    """
    chance = np.random.default_rng(seed)
    robot = _Robot(chance, world)
    types = np.array([name for level in hierarchy.levels() for name in level], dtype=object)
    features = _as_objects(vocabulary.table())
    while True:
        begins, ends, polygons = robot.drive(_ATOMIC)
        names = iter(types[chance.integers(len(types), size=_EVENTS)].tolist())
        described = iter(_features(chance, features))
        payloads = iter(_payloads(chance))
        uids = _uids(chance, begins)
        intervals = _intervals(begins, ends)
        regions = (Region(polygon=polygon, frame=world.frame) for polygon in polygons)
        for group in range(_GROUPS):
            own = uids[group * (PARTS + 1) : (group + 1) * (PARTS + 1)]
            for uid in own[:PARTS]:
                yield Event(
                    type=next(names),
                    interval=next(intervals),
                    region=next(regions),
                    features=next(described),
                    agent=world.agent,
                    payload=next(payloads),
                    uid=uid,
                )
            yield Event(
                type=next(names),
                features=next(described),
                agent=world.agent,
                payload=next(payloads),
                parts=own[:PARTS],
                uid=own[PARTS],
            )


class _Robot:
    """Drives straight for a while, turns a little, and is thrown back by the walls like light by a mirror."""

    def __init__(self, chance: np.random.Generator, world: World) -> None:
        self._chance = chance
        self._world = world
        self._clock = to_micros(world.begin)
        self._heading = 0.0
        # Walls are left out at first: the plane is folded onto the map afterwards.
        self._place = np.full(2, world.side / 2)

    def drive(self, steps: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[Any]]:
        """Begins and ends in microseconds, and the polygons swept, of the next `steps` events."""
        chance = self._chance
        pauses = chance.exponential(2.0, steps) + 0.05
        lengths = np.where(chance.random(steps) < 0.1, 0.0, chance.lognormal(0.4, 0.8, steps).clip(0.01, 60.0))
        headings = self._heading + np.cumsum(chance.normal(0.0, 0.5, steps))
        ways = pauses * chance.uniform(0.0, self._world.top_speed, steps)
        moves = ways[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)
        track = self._place + np.concatenate([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
        clock = np.concatenate([[0.0], np.cumsum(pauses)])
        ended = np.minimum(clock[:-1] + lengths, clock[-1])
        arrived = np.stack([np.interp(ended, clock, track[:, axis]) for axis in (0, 1)], axis=1)
        begins = self._clock + np.round(clock * 1e6).astype(np.int64)
        ends = begins[:-1] + np.round(lengths * 1e6).astype(np.int64)
        polygons = self._swept(self._folded(track[:-1]), self._folded(arrived), headings)
        self._clock, self._place, self._heading = int(begins[-1]), track[-1], float(headings[-1] % (2 * np.pi))
        return begins[:-1], ends, polygons

    def _folded(self, places: Floats) -> Floats:
        """Places in the plane as their mirror images on the map, with the robot's whole footprint on it."""
        room = self._world.side - 2 * self._world.footprint
        folded: Floats = room - np.abs((places - self._world.footprint) % (2 * room) - room) + self._world.footprint
        return folded

    def _swept(self, starts: Floats, stops: Floats, headings: Floats) -> NDArray[Any]:
        """The octagonal footprint, swept straight from start to stop."""
        way = stops - starts
        moved = np.hypot(way[:, 0], way[:, 1]) > 0
        headings = np.where(moved, np.arctan2(way[:, 1], way[:, 0]), headings)
        angles = headings[:, None] + _OCTAGON
        corners = self._world.footprint * np.stack([np.cos(angles), np.sin(angles)], axis=2)
        corners[:, [0, 1, 2, 3, 8]] += starts[:, None]
        corners[:, 4:8] += stops[:, None]
        corners[:, 8] = corners[:, 0]
        polygons: NDArray[Any] = shapely.polygons(corners)
        return polygons


def _as_objects(rows: list[list[Any]]) -> NDArray[Any]:
    """A table whose entries numpy must not take apart."""
    array = np.empty((len(rows), len(rows[0])), dtype=object)
    for number, row in enumerate(rows):
        for column, entry in enumerate(row):
            array[number, column] = entry
    return array


def _features(chance: np.random.Generator, table: NDArray[Any]) -> list[Any]:
    """For each event `FEATURES` features of different names."""
    names = chance.random((_EVENTS, len(table))).argpartition(FEATURES, axis=1)[:, :FEATURES]
    chosen: list[Any] = table[names, chance.integers(table.shape[1], size=names.shape)].tolist()
    return chosen


def _payloads(chance: np.random.Generator) -> Iterator[Payload]:
    shortest, longest = PAYLOAD_BYTES
    bounds = np.cumsum(chance.integers(shortest, longest + 1, size=_EVENTS)).tolist()
    data = chance.bytes(bounds[-1])
    return (Payload(data=data[begin:end]) for begin, end in zip([0, *bounds], bounds, strict=False))


def _uids(chance: np.random.Generator, begins: NDArray[np.int64]) -> list[UUID]:
    """UUIDs of version 7 in order of time, of the atomic events and, after nine of them, of the complex one."""
    millis = np.repeat(begins.reshape(_GROUPS, PARTS) // 1000, [1] * (PARTS - 1) + [2], axis=1).ravel()
    upper = (millis << 16) | 0x7000 | chance.integers(1 << 12, size=_EVENTS)
    lower = chance.integers(1 << 62, size=_EVENTS)
    variant = 0b10 << 62
    return [UUID(int=high << 64 | variant | low) for high, low in zip(upper.tolist(), lower.tolist(), strict=True)]


def _intervals(begins: NDArray[np.int64], ends: NDArray[np.int64]) -> Iterator[Interval]:
    return (
        Interval(begin=from_micros(begin), end=from_micros(end))
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
    )
