"""The household's views as an episode: 40 things in a robot's pictures, and the search for where each was last."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from itertools import islice

import numpy as np

from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import from_datetime
from armem_bridge.working import EntityUpdate
from elm.errors import ElmError
from simulators.armem.episodes import Episode, recorded, update_of
from simulators.worlds.household.floor_plan import Point
from simulators.worlds.household.pictures import found, point_at
from simulators.worlds.household.views import RATE, View, views

CAMERA = MemoryID(memory="Vision", core_segment="Image", provider_segment="Household", entity="camera")
NOISE = 0.02
"""Standard deviation of the noise in the pictures: pictures of one thing differ, as those of a real camera do."""
IN_WORKING_MEMORY = 100
"""Pictures in working memory: 20 s."""
RECALLS = 2.0
"""Seconds between two searches of the robot for a thing that it has seen: the picture that answers is used then."""
STEADY = 1.0
"""Seconds that a thing is in sight before it counts as seen: one that shows up in a single picture of a robot that is
turning is looked for by nobody."""
NEAR = 0.3
"""Metres by which a place may differ from the true one; a cell of the pictures is up to 0.2 m wide."""


def household_episode(seed: int, *, seconds: float) -> Episode:
    """So many seconds in the life of a robot that goes about the flat and looks, the same for the same seed.

    Only pictures are forgotten. The robot's poses, three numbers for the 768 of a picture, are all kept:
    the search takes from them where the robot stood when it saw a thing.
    """
    taken = list(islice(views(seed, noise=NOISE), round(seconds * RATE)))
    left = recorded("Vision", map(_update, taken), limit=IN_WORKING_MEMORY)
    sightings = {_id(view): _sightings(view) for view in taken}
    truth = _truth(taken)
    if not truth:
        raise ElmError(f"in {seconds:g} s of the household {seed} nothing is seen that could be looked for: take more")
    return Episode(
        name=f"household {seed}",
        left=tuple(left),
        used=partial(_used, sightings=sightings, wishes=_wishes(seed, sightings)),
        end=from_datetime(taken[-1].time),
        found=partial(_share_found, sightings=sightings, truth=truth),
    )


def _id(view: View) -> MemoryID:
    return CAMERA.with_timestamp(from_datetime(view.time))


def _update(view: View) -> EntityUpdate:
    return update_of(CAMERA, from_datetime(view.time), picture=view.picture)


def _sightings(view: View) -> dict[str, Point]:
    """The things that a picture shows and where they are."""
    return {thing: point_at(view.x, view.y, view.heading, polar) for thing, polar in found(view.picture).items()}


def _wishes(seed: int, sightings: Mapping[MemoryID, Mapping[str, Point]]) -> dict[MemoryID, str]:
    """Now and then the robot looks for one of the things it has seen so far: at the time of a picture, the thing."""
    chance = np.random.default_rng([seed, 1])
    seen: set[str] = set()
    wishes: dict[MemoryID, str] = {}
    for picture, things in sightings.items():
        seen |= things.keys()
        if seen and chance.random() < 1 / (RATE * RECALLS):
            wishes[picture] = sorted(seen)[int(chance.integers(len(seen)))]
    return wishes


def _used(
    kept: Collection[MemoryID],
    *,
    sightings: Mapping[MemoryID, Mapping[str, Point]],
    wishes: Mapping[MemoryID, str],
) -> dict[MemoryID, int]:
    """When each picture was used last: it is when it is the latest one that shows what the robot looks for."""
    latest: dict[str, MemoryID] = {}
    used: dict[MemoryID, int] = {}
    for picture, things in sightings.items():
        if picture in kept:
            latest |= dict.fromkeys(things, picture)
        if (wanted := wishes.get(picture)) in latest:
            used[latest[wanted]] = picture.timestamp
    return used


def _truth(taken: Sequence[View]) -> dict[str, set[Point]]:
    """Where each thing was seen last for `STEADY` seconds; what was seen of it later for less may be answered too."""
    steady = round(STEADY * RATE)
    places: dict[str, set[Point]] = {}
    since: dict[str, tuple[int, Point]] = {}
    for number, view in enumerate(taken, start=1):
        since = {
            thing: since[thing] if thing in since and since[thing][1] == view.places[thing].at else (number, at)
            for thing, at in ((thing, view.places[thing].at) for thing in view.visible)
        }
        for thing, (first, at) in since.items():
            if number - first + 1 >= steady:
                places[thing] = {at}
            elif thing in places:
                places[thing].add(at)
    return places


def _share_found(
    kept: Collection[MemoryID], *, sightings: dict[MemoryID, dict[str, Point]], truth: dict[str, set[Point]]
) -> float:
    """Iterating backward in time through the pictures that were kept until a thing is seen (section 5.4.1)."""
    right = set()
    missing = dict(truth)
    for picture in sorted(kept, reverse=True):
        for thing in sightings[picture].keys() & missing.keys():
            if any(math.dist(sightings[picture][thing], at) <= NEAR for at in missing.pop(thing)):
                right.add(thing)
        if not missing:
            break
    return len(right) / len(truth)
