"""What the robot did from row to row of its path: drive, turn or stand, as docs/glossary.md defines them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from elm.demo.recording import Numbers, Recording

WINDOW = 1.0
"""Seconds over which speed and rate of turn are taken."""
STAND_SPEED = 0.15
"""Metres a second below which the robot stands: the path fidgets by some centimetres while it does."""
STAND_SECONDS = 3.0
"""A shorter halt is part of what goes on around it."""
MOVE_SECONDS = 1.5
"""A shorter move within a stand is fidgeting."""
TURN_RATE = 6.0
"""Degrees a second from which the robot turns."""
TURN_PAUSE = 1.0
"""Seconds for which a turn may slacken and still be one."""
TURN_DEGREES = 20.0
"""A smaller change of heading is steering, and part of a drive."""
DRIVE_SECONDS = 2.5
"""A shorter drive beside a turn is part of the turn: at a row's end the mower swings out and then round."""

Doing = npt.NDArray[np.int64]


class Kind(IntEnum):
    """What the robot does over one step of the path."""

    DRIVE = 0
    LEFT = 1
    RIGHT = 2
    STAND = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """A longest run of steps of one kind: from path row `first` to path row `last`."""

    kind: Kind
    first: int
    last: int


def motions(run: Recording) -> list[Motion]:
    """The run cut into drives, turns and stands; each ends at the row at which the next one begins."""
    speed, rate = _speed_and_rate(run)
    doing = np.select([rate >= TURN_RATE, rate <= -TURN_RATE], [Kind.LEFT, Kind.RIGHT], Kind.DRIVE)
    still = _still(run, speed)
    doing[still] = Kind.STAND
    _bridge_slack_turns(run, doing)
    _drop_steering(run, doing)
    _widen_turns(run, doing)
    return [Motion(kind=Kind(doing[first]), first=first, last=last) for first, last in _stretches(doing)]


def _speed_and_rate(run: Recording) -> tuple[Numbers, Numbers]:
    """Speed (m/s) and rate of turn (degrees/s) at the middle of each step, over a window around it."""
    time = run.time / 1000
    middle = (time[1:] + time[:-1]) / 2
    begin, end = np.maximum(middle - WINDOW / 2, time[0]), np.minimum(middle + WINDOW / 2, time[-1])

    def change(values: Numbers) -> Numbers:
        return np.asarray((np.interp(end, time, values) - np.interp(begin, time, values)) / (end - begin))

    return np.hypot(change(run.x), change(run.y)), change(run.heading)


def _still(run: Recording, speed: Numbers) -> npt.NDArray[np.bool_]:
    still = speed < STAND_SPEED
    for first, last in _stretches(still):
        if not still[first] and first > 0 and last < len(still) and _seconds(run, first, last) < MOVE_SECONDS:
            still[first:last] = True
    for first, last in _stretches(still):
        if still[first] and _seconds(run, first, last) < STAND_SECONDS:
            still[first:last] = False
    return still


def _bridge_slack_turns(run: Recording, doing: Doing) -> None:
    for first, last in _inner(doing, Kind.DRIVE):
        before, after = doing[first - 1], doing[last]
        if before == after != Kind.STAND and _seconds(run, first, last) < TURN_PAUSE:
            doing[first:last] = before


def _drop_steering(run: Recording, doing: Doing) -> None:
    for first, last in _stretches(doing):
        turned = abs(run.heading[last] - run.heading[first])
        if doing[first] in (Kind.LEFT, Kind.RIGHT) and turned < TURN_DEGREES:
            doing[first:last] = Kind.DRIVE


def _widen_turns(run: Recording, doing: Doing) -> None:
    for first, last in _inner(doing, Kind.DRIVE):
        before, after = doing[first - 1], doing[last]
        if _seconds(run, first, last) >= DRIVE_SECONDS or before == after == Kind.STAND:
            continue
        half = last if after == Kind.STAND else first if before == Kind.STAND else (first + last) // 2
        doing[first:half] = before
        doing[half:last] = after


def _inner(doing: Doing, kind: Kind) -> Iterator[tuple[int, int]]:
    """The stretches of `kind` with something else on both sides."""
    for first, last in _stretches(doing):
        if doing[first] == kind and first > 0 and last < len(doing):
            yield first, last


def _stretches(values: npt.NDArray[np.generic]) -> list[tuple[int, int]]:
    """The longest stretches of one value, as (first, one beyond the last)."""
    cuts = np.flatnonzero(values[1:] != values[:-1]) + 1
    bounds = [0, *map(int, cuts), len(values)]
    return list(pairwise(bounds))


def _seconds(run: Recording, first: int, last: int) -> float:
    return float(run.time[last] - run.time[first]) / 1000
