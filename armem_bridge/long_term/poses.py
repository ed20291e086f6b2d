"""Poses and positions in ARON data: where they are said to be, in metres, in one global frame or in another."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Protocol, Self

import numpy as np

from armem_bridge.aron.arrays import to_numpy
from armem_bridge.aron.data import Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.errors import ArmemError
from armem_bridge.long_term.data_paths import DataPath
from armem_bridge.long_term.refusals import InvalidArchive
from armem_bridge.memory_id import MemoryID

GLOBAL_FRAME: Final = "Global"
"""What ArmarX calls the frame of the map in a FrameID. Poses without FrameID are taken to be in it."""

EVERYWHERE: Final = MemoryID()
"""The ID that contains all snapshots."""

Matrix = np.ndarray[Any, np.dtype[np.float64]]


class NoPose(ArmemError, ValueError):
    """What stands at the path of a pose is none, or one with numbers that are none. Correct the path or the data."""


class Unit(StrEnum):
    """The unit of the numbers of a pose. ArmarX has millimetres, unless somebody decided otherwise."""

    MILLIMETRES = "mm"
    METRES = "m"


@dataclass(frozen=True, slots=True, kw_only=True)
class PosePath:
    """Where in the data poses stand, in which unit, and in which snapshots: those that the ID `segment` contains."""

    path: DataPath
    unit: Unit = Unit.MILLIMETRES
    segment: MemoryID = EVERYWHERE

    @classmethod
    def at(cls, path: str, *, unit: str = Unit.MILLIMETRES, segment: MemoryID = EVERYWHERE) -> Self:
        """The poses at a path as text, in the unit "mm" or "m"."""
        if unit not in set(Unit):
            raise InvalidArchive(f"the unit of the pose {path!r:.80} is one of {', '.join(Unit)}, not {unit!r:.80}")
        return cls(path=DataPath(path), unit=Unit(unit), segment=segment)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A place as the data say it: in metres, relative to a frame, with an orientation or without."""

    position: tuple[float, float, float]
    rotation: Matrix | None
    """3 x 3; None for what is only a position."""

    frame: str = GLOBAL_FRAME
    agent: str = ""

    @property
    def is_global(self) -> bool:
        """Whether the frame is that of the map."""
        return self.frame == GLOBAL_FRAME


class FrameTransform(Protocol):
    """Where frames are: of a robot's hand, say, which its kinematics know."""

    def to_global(self, frame: str, agent: str, moment: int) -> Matrix | None:
        """The frame's pose in the map at a time: a 4 x 4 matrix, its translation in metres; None if unknown."""


def read_pose(data: Data, unit: Unit) -> Pose:
    """The pose or position that a data object is.

    A pose is an NDArray of 4 x 4, row by row, with 0 0 0 1 in its last row; a position an NDArray or a List
    of 3 numbers, or of 2 in the plane, or a Dict with x, y and perhaps z. Framed ones are Dicts with a
    `header` (frame and agent) and a `pose` or `position`. The bytes of arrays are not touched. Raises
    `NoPose` for anything else, and for numbers that are not finite.
    """
    if isinstance(data, Dict) and "header" in data.elements:
        return _framed(data.elements, unit)
    matrix = _numbers(data)
    if not np.isfinite(matrix).all():
        raise NoPose("a pose has a number that is none (NaN or infinite)")
    if matrix.shape == (4, 4):
        last = matrix[3].tolist()
        if any(abs(given - wanted) > 1e-5 for given, wanted in zip(last, (0, 0, 0, 1), strict=True)):
            raise NoPose(f"the last row of a pose is 0 0 0 1, not {last}: are rows and columns swapped?")
        return Pose(position=_position(matrix[:3, 3], unit), rotation=matrix[:3, :3])
    if matrix.size in (2, 3) and max(matrix.shape) == matrix.size:
        return Pose(position=_position(matrix.ravel(), unit), rotation=None)
    raise NoPose(f"an array of {' x '.join(map(str, matrix.shape))} is neither a pose (4 x 4) nor a position (3)")


def _framed(elements: dict[str, Data | None], unit: Unit) -> Pose:
    header = elements["header"]
    inner = elements.get("pose") or elements.get("position")
    if not isinstance(header, Dict) or inner is None:
        raise NoPose("a framed pose is a Dict with a header and a pose or position")
    frame, agent = header.elements.get("frame"), header.elements.get("agent")
    if not isinstance(frame, String):
        raise NoPose("the header of a framed pose names no frame")
    pose = read_pose(inner, unit)
    whose = agent.value if isinstance(agent, String) else ""
    return Pose(position=pose.position, rotation=pose.rotation, frame=frame.value, agent=whose)


def _numbers(data: Data) -> Matrix:
    if isinstance(data, NDArray):
        try:
            array = to_numpy(data)
        except ArmemError as error:
            raise NoPose(f"a pose cannot be read: {error}") from error
        if array.dtype.kind not in "fiu":
            raise NoPose(f"a pose is made of numbers, not of {data.type!r:.40}")
        return array.astype(np.float64)
    if isinstance(data, List):
        return np.array([_number(each) for each in data.elements])
    if isinstance(data, Dict) and {"x", "y"} <= data.elements.keys():
        return np.array([_number(data.elements[axis]) for axis in "xyz" if axis in data.elements])
    raise NoPose(f"a {type(data).__name__} is neither a pose nor a position")


def _number(data: Data | None) -> float:
    if isinstance(data, Int | Long | Float | Double):
        return float(data.value)
    raise NoPose(f"a coordinate is a number, not {type(data).__name__}")


def _position(numbers: Matrix, unit: Unit) -> tuple[float, float, float]:
    # Divided, not multiplied: 300 mm are 0.3 m to the last digit.
    x, y, *z = (numbers / 1000.0 if unit is Unit.MILLIMETRES else numbers).tolist()
    return x, y, z[0] if z else 0.0


def globally(pose: Pose, transform: FrameTransform | None, moment: int) -> Pose | None:
    """The same pose in the map; None where nobody knows where its frame was at that time."""
    if pose.is_global:
        return pose
    there = transform.to_global(pose.frame, pose.agent, moment) if transform is not None else None
    if there is None:
        return None
    x, y, z = (there[:3, :3] @ np.array(pose.position) + there[:3, 3]).tolist()
    rotation = None if pose.rotation is None else there[:3, :3] @ pose.rotation
    return Pose(position=(x, y, z), rotation=rotation)
