"""Where the robot was: the port that gives the region of a consolidated snapshot, and one fed by a robot's state."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from threading import Lock
from typing import Final, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon
from sortedcontainers import SortedDict

from armem_bridge.long_term.poses import NoPose, Pose, PosePath, read_pose
from armem_bridge.long_term.refusals import InvalidArchive
from armem_bridge.working.snapshot import Snapshot, snapshot_hash
from elm.errors import InvalidValue
from elm.geometry import DEFAULT_FRAME, Region

FOOTPRINT: Final = 0.3
"""The radius of a robot in metres unless told otherwise."""

MAX_AGE: Final = 1_000_000
"""How many microseconds a pose holds for unless told otherwise."""

POSES: Final = 100_000
"""How many poses are remembered unless told otherwise: at 100 a second, of more than a quarter of an hour."""


class LocationPort(Protocol):
    """Where the robot was; any thread may ask."""

    def region(self, moment: int) -> Region | None:
        """The robot's footprint at a time, None where it is not known; that is never the same as at (0, 0)."""


@runtime_checkable
class PoseListener(Protocol):
    """A location that learns where the robot was from snapshots of its state; any thread may tell it."""

    def note(self, snapshots: Iterable[Snapshot]) -> None:
        """These versions were committed; whether long-term memory takes them is not decided yet."""


def check_footprint(footprint: float | Sequence[Sequence[float]]) -> None:
    """Raise `InvalidArchive` unless this is a radius above 0, or the corners of a polygon, in metres."""
    try:
        if isinstance(footprint, int | float):
            Region.around(0.0, 0.0, footprint)
        else:
            Region(polygon=Polygon(_corners(footprint)))
    except InvalidValue as error:
        raise InvalidArchive(f"the footprint of a robot cannot be this: {error}") from error


def _corners(footprint: Sequence[Sequence[float]]) -> npt.NDArray[np.float64]:
    try:
        corners = np.array(footprint, dtype=np.float64)
    except (TypeError, ValueError):
        corners = np.empty(0)
    if corners.ndim != 2 or corners.shape[0] < 3 or corners.shape[1] != 2 or not np.isfinite(corners).all():
        raise InvalidValue(f"a polygon has three or more corners, each a finite x and y, not {footprint!r:.80}")
    return corners


class RobotPlaces:
    """A `LocationPort` over the poses that snapshots of a robot's state have.

    The robot is where its last pose at or before a time said, if that is at most `max_age` microseconds
    older. `pose` says where it stands in the data and in which unit, and with `pose.segment` in which
    snapshots; `note` tells of them, which `LongTermMemory` does. `footprint` is a radius in metres, or the
    corners of a polygon around the robot's origin with x ahead. The last `limit` poses by time are
    remembered.
    """

    def __init__(
        self,
        pose: PosePath,
        *,
        footprint: float | Sequence[tuple[float, float]] = FOOTPRINT,
        frame: str = DEFAULT_FRAME,
        max_age: int = MAX_AGE,
        limit: int = POSES,
    ) -> None:
        if max_age < 0 or limit < 1:
            raise InvalidArchive(f"poses hold for 0 µs or more, and 1 or more are kept: not {max_age} µs and {limit}")
        self._path = pose
        check_footprint(footprint)
        self._footprint = footprint if isinstance(footprint, int | float) else _corners(footprint)
        self._frame = frame
        self._max_age = max_age
        self._limit = limit
        self._lock = Lock()
        self._places: SortedDict = SortedDict()
        self.unreadable = 0
        """So many poses of the robot could not be read, or were not in the map."""
        self._region_of(Pose(position=(0.0, 0.0, 0.0), rotation=np.eye(3)))

    def note(self, snapshots: Iterable[Snapshot]) -> None:
        """Remember the poses of these snapshots, as far as they are of the robot's state; in any order."""
        for snapshot in snapshots:
            if not self._path.segment.contains(snapshot.id):
                continue
            data = (each for instance in snapshot.instances for each in self._path.path.find(instance.data))
            found = next(data, None)
            if found is None:
                continue
            try:
                pose = read_pose(found, self._path.unit)
                region = self._region_of(pose) if pose.is_global else None
            except (NoPose, InvalidValue):
                region = None
            with self._lock:
                if region is None:
                    self.unreadable += 1
                    continue
                version = (snapshot.sent, snapshot_hash(snapshot))
                known = self._places.get(snapshot.referenced)
                if known is None or version > known[0]:
                    self._places[snapshot.referenced] = (version, region)
                if len(self._places) > self._limit:
                    self._places.popitem(0)

    def region(self, moment: int) -> Region | None:
        """The footprint at the last pose at or before a moment, None where that is too old or there is none."""
        with self._lock:
            index = self._places.bisect_right(moment) - 1
            if index < 0:
                return None
            known, (_, region) = self._places.peekitem(index)
        found: Region | None = region if moment - known <= self._max_age else None
        return found

    def _region_of(self, pose: Pose) -> Region:
        x, y, _ = pose.position
        if isinstance(self._footprint, int | float):
            return Region.around(x, y, self._footprint, frame=self._frame)
        if pose.rotation is None:
            raise NoPose("a footprint with corners needs a pose with an orientation")
        turned = self._footprint @ pose.rotation[:2, :2].T + (x, y)
        return Region(polygon=Polygon(turned), frame=self._frame)
