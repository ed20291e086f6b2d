"""A real mower's runs as episodes: ranges to radio beacons with the poses, and where the beacons stand by them."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Collection
from functools import partial

import numpy as np

from armem_bridge.aron.vectors import Vector
from armem_bridge.forgetting.distances import Matrix
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import from_datetime
from elm.demo.recording import Recording, moment, read, surveyed
from simulators.armem.episodes import Episode, recorded, update_of

BEACONS = MemoryID(memory="Radio", core_segment="Range", provider_segment="Mower")
IN_WORKING_MEMORY = 20
"""Readings of each beacon in working memory."""
NEAR = 0.5
"""Metres by which a beacon's place may differ from the surveyed one; by all readings it does by less than 0.1."""
AGAIN = 2.0
"""Metres within which the robot is where it was before: the reading of the beacon from there is used then."""
_STEPS = 30

Row = Vector
"""Where the robot was, x and y, and the range."""


def plaza_episode(name: str) -> Episode:
    """The run `name` ("plaza1" or "plaza2"): each beacon is an entity, each of its readings a snapshot.

    The data of a reading are where the robot was (x and y in metres, between the rows of the path) and the
    range as measured. (The runs' headings point against the travel in one of them, and are left out.)
    """
    run = read(name)
    readings = np.column_stack(
        [
            np.interp(run.reading_time, run.time, run.x),
            np.interp(run.reading_time, run.time, run.y),
            run.reading_range,
        ]
    )
    ids = _ids(run)
    updates = [
        update_of(each.entity_id, each.timestamp, position=row[:2].tolist(), range=float(row[2]))
        for each, row in zip(ids, readings, strict=True)
    ]
    known = dict(zip(ids, readings, strict=True))
    places = {str(number): place for number, place in surveyed(name).items()}
    return Episode(
        name=name,
        left=tuple(recorded("Radio", updates, limit=IN_WORKING_MEMORY)),
        used=partial(_used, readings=known),
        end=max(each.timestamp for each in ids),
        found=partial(_share_found, readings=known, places=places, excess=run.oddities.range_excess),
    )


def _ids(run: Recording) -> list[MemoryID]:
    """The snapshots of the readings; of two of one beacon at one time the second is a microsecond later."""
    ids: dict[MemoryID, None] = {}
    for time, beacon in zip(run.reading_time, run.reading_beacon, strict=True):
        each = BEACONS.with_entity(str(beacon)).with_timestamp(from_datetime(moment(int(time))))
        while each in ids:
            each = each.with_timestamp(each.timestamp + 1)
        ids[each] = None
    return list(ids)


def _used(kept: Collection[MemoryID], *, readings: dict[MemoryID, Row]) -> dict[MemoryID, int]:
    """When each reading was used last: whenever the robot hears the beacon again, nearest to where it was heard so."""
    used: dict[MemoryID, int] = {}
    entities: dict[MemoryID, list[MemoryID]] = {}
    for each in readings:
        entities.setdefault(each.entity_id, []).append(each)
    for heard in entities.values():
        remembered = [each for each in heard if each in kept]
        at = np.array([readings[each][:2] for each in remembered]).reshape(-1, 2)
        moments = [each.timestamp for each in remembered]
        for each in heard:
            before = bisect_left(moments, each.timestamp)
            if before:
                away = np.hypot(*(at[:before] - readings[each][:2]).T)
                nearest = int(away.argmin())
                if away[nearest] <= AGAIN:
                    used[remembered[nearest]] = each.timestamp
    return used


def _share_found(
    kept: Collection[MemoryID],
    *,
    readings: dict[MemoryID, Row],
    places: dict[str, tuple[float, float]],
    excess: float,
) -> float:
    """The share of the beacons whose place follows from the readings that were kept."""
    right = 0
    for beacon, place in places.items():
        rows = [readings[each] for each in sorted(kept, reverse=True) if each.entity == beacon]
        if len(rows) >= 3:
            right += math.dist(_located(np.array(rows), excess), place) <= NEAR
    return right / len(places)


def _located(rows: Matrix, excess: float) -> tuple[float, float]:
    """Where a beacon is by ranges to it from known places: least squares, of squares first and of ranges then.

    All ranges of a run are too long by the share `excess`, which the recording tells.
    """
    at, metres = rows[:, :2], rows[:, 2] / (1 + excess)
    centre = at.mean(axis=0)
    near = at - centre
    linear = np.column_stack([2 * near, np.ones(len(near))])
    guess = np.linalg.lstsq(linear, np.square(near).sum(axis=1) - np.square(metres), rcond=None)[0][:2]
    for _ in range(_STEPS):
        away = guess - near
        lengths = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
        step = np.linalg.lstsq(away / lengths[:, None], metres - lengths, rcond=None)[0]
        guess = guess + np.clip(step, -10, 10)
        if np.abs(step).max() < 1e-4:
            break
    x, y = (guess + centre).tolist()
    return x, y
