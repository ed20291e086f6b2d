"""Pictures of what a robot sees: small arrays in which each thing is a pattern of its own, and is found again."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from simulators.worlds.household.floor_plan import Point
from simulators.worlds.household.things import THINGS

Picture = NDArray[np.float32]

ROWS, COLUMNS = 24, 32
FIELD_OF_VIEW = math.radians(90)
"""Bearings from half of it to the left, in the first column, to half of it to the right, in the last one."""
NEAREST, FARTHEST = 0.2, 5.0
"""Distances in metres from the first row to the last one."""
COLUMN = FIELD_OF_VIEW / COLUMNS
"""Radians that a column is wide."""
ROW = (FARTHEST - NEAREST) / ROWS
"""Metres that a row is deep."""
WALL = 0.1
"""What stands in the picture behind a wall; before it there is 0."""
TOLERANCE = 0.12
"""Greatest root mean square difference between a pattern and what is taken for it."""

_SIZE = 2
_LEVELS = (0.4, 0.6, 0.8, 1.0)


class Polar(NamedTuple):
    """Where something is as seen from the robot: radians to the left of its heading, and metres."""

    bearing: float
    distance: float


def _patterns() -> Picture:
    """Two by two values a thing; two patterns differ in two places at least, for the levels' ranks add up to one."""
    ranks = (ranks for ranks in product(range(len(_LEVELS)), repeat=_SIZE**2) if sum(ranks) % len(_LEVELS) == 0)
    chosen = [[_LEVELS[rank] for rank in each] for each, _ in zip(ranks, THINGS, strict=False)]
    return np.array(chosen, dtype=np.float32).reshape(len(THINGS), _SIZE, _SIZE)


NAMES = tuple(THINGS)
PATTERNS = _patterns()
"""The pattern of each thing of `NAMES`."""
_FLAT = PATTERNS.reshape(len(NAMES), -1)
_SQUARES = (_FLAT**2).sum(axis=1)


def cell_of(polar: Polar) -> tuple[int, int] | None:
    """The row and column of the first corner of a pattern that shows what is there; None if it is not in sight."""
    row = round((polar.distance - NEAREST) / ROW) - 1
    column = round((FIELD_OF_VIEW / 2 - polar.bearing) / COLUMN) - 1
    inside = 0 <= row <= ROWS - _SIZE and 0 <= column <= COLUMNS - _SIZE
    return (row, column) if inside else None


def polar_of(row: int, column: int) -> Polar:
    """What a pattern there shows, to half a `ROW` and half a `COLUMN`."""
    return Polar(FIELD_OF_VIEW / 2 - (column + 1) * COLUMN, NEAREST + (row + 1) * ROW)


def draw(walls: NDArray[np.float64], things: Iterable[tuple[int, Polar]]) -> tuple[Picture, list[int]]:
    """A picture of the walls, metres away in each column, and of the things given, by their numbers in `NAMES`.

    The nearest is drawn first; what would overlap or touch the pattern of another is hidden by it. The
    numbers of those drawn are returned too.
    """
    depths = NEAREST + (np.arange(ROWS) + 0.5) * ROW
    picture = np.where(depths[:, None] > walls, np.float32(WALL), np.float32(0.0))
    taken = np.zeros((ROWS, COLUMNS), dtype=bool)
    drawn: list[int] = []
    for number, polar in sorted(things, key=lambda thing: thing[1].distance):
        cell = cell_of(polar)
        if cell is None or taken[cell]:
            continue
        row, column = cell
        picture[row : row + _SIZE, column : column + _SIZE] = PATTERNS[number]
        taken[max(0, row - _SIZE) : row + _SIZE + 1, max(0, column - _SIZE) : column + _SIZE + 1] = True
        drawn.append(number)
    return picture, drawn


def found(picture: NDArray[np.floating], tolerance: float = TOLERANCE) -> dict[str, Polar]:
    """The things in a picture and where they are, by matching their patterns, the best match first.

    Without noise they are exactly those that were drawn, each in its cell (`polar_of`). With noise of a standard
    deviation of 0.03 fewer than one in a thousand is missed, of 0.05 about one in a hundred. Of a thing that seems
    to be there twice the better match counts.
    """
    windows = sliding_window_view(np.asarray(picture, dtype=np.float32), (_SIZE, _SIZE)).reshape(-1, _SIZE**2)
    near = np.flatnonzero(windows.min(axis=1) > _LEVELS[0] - 2.5 * tolerance)
    if not len(near):
        return {}
    candidates = windows[near]
    squares = (candidates**2).sum(axis=1)[:, None] - 2 * candidates @ _FLAT.T + _SQUARES
    squares[squares > tolerance**2 * _SIZE**2] = np.inf
    things: dict[str, Polar] = {}
    columns = picture.shape[1] - _SIZE + 1
    # One window shows one thing, and nothing else touches it.
    while np.isfinite(squares).any():
        at, number = divmod(int(squares.argmin()), len(NAMES))
        row, column = divmod(int(near[at]), columns)
        things[NAMES[number]] = polar_of(row, column)
        beside = (abs(near // columns - row) <= _SIZE) & (abs(near % columns - column) <= _SIZE)
        squares[beside] = np.inf
        squares[:, number] = np.inf
    return things


def point_at(x: float, y: float, heading: float, polar: Polar) -> Point:
    """Where on the floor something is that is seen from a pose."""
    angle = heading + polar.bearing
    return Point(x + polar.distance * math.cos(angle), y + polar.distance * math.sin(angle))
