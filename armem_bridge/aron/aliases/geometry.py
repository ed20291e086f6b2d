"""Table A.1's vectors, matrices, rotations, frames and boxes as type objects."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t


def vector(size: int, element: str) -> t.NDArray:
    """A vector of so many numbers; a matrix of one column or row is one too."""
    return t.NDArray(shape=(size,), element=element)


def matrix(rows: int | None, columns: int | None, element: str) -> t.NDArray:
    """A matrix; None stands for any number of rows or columns."""
    return t.NDArray(shape=(rows, columns), element=element)


VECTOR_2F: Final = vector(2, "float32")
VECTOR_3F: Final = vector(3, "float32")
VECTOR_2D: Final = vector(2, "float64")
VECTOR_3D: Final = vector(3, "float64")

MATRIX_2F: Final = matrix(2, 2, "float32")
MATRIX_3F: Final = matrix(3, 3, "float32")
MATRIX_4F: Final = matrix(4, 4, "float32")
MATRIX_2D: Final = matrix(2, 2, "float64")
MATRIX_3D: Final = matrix(3, 3, "float64")
MATRIX_4D: Final = matrix(4, 4, "float64")

QUATERNION_F: Final = vector(4, "float32")
QUATERNION_D: Final = vector(4, "float64")

POSITION: Final = VECTOR_3F
ORIENTATION: Final = QUATERNION_F
POSE: Final = MATRIX_4F

FRAME_ID: Final = t.Object(name="FrameID", members={"frame": t.String(), "agent": t.String()})


def framed(name: str, part: str, spatial: t.NDArray) -> t.Object:
    """A position, pose or orientation together with the frame that it is relative to."""
    return t.Object(name=name, members={"header": FRAME_ID, part: spatial})


FRAMED_POSITION: Final = framed("FramedPosition", "position", POSITION)
FRAMED_POSE: Final = framed("FramedPose", "pose", POSE)
FRAMED_ORIENTATION: Final = framed("FramedOrientation", "orientation", ORIENTATION)

BOUNDING_BOX: Final = t.Object(name="BoundingBox", members={"center": VECTOR_3F, "extents": VECTOR_3F})
ORIENTED_BOX: Final = t.Object(
    name="OrientedBox", members={"center": VECTOR_3F, "extents": VECTOR_3F, "orientation": ORIENTATION}
)

GEOMETRY: Final[dict[str, t.TypeObject]] = {
    "Vector2f": VECTOR_2F,
    "Vector3f": VECTOR_3F,
    "Position": POSITION,
    "Vector2d": VECTOR_2D,
    "Vector3d": VECTOR_3D,
    "Matrix2f": MATRIX_2F,
    "Matrix3f": MATRIX_3F,
    "Matrix4f": MATRIX_4F,
    "Pose": POSE,
    "Matrix2d": MATRIX_2D,
    "Matrix3d": MATRIX_3D,
    "Matrix4d": MATRIX_4D,
    "Quaternionf": QUATERNION_F,
    "Orientation": ORIENTATION,
    "Quaterniond": QUATERNION_D,
    "FrameID": FRAME_ID,
    "FramedPosition": FRAMED_POSITION,
    "FramedPose": FRAMED_POSE,
    "FramedOrientation": FRAMED_ORIENTATION,
    "BoundingBox": BOUNDING_BOX,
    "OrientedBox": ORIENTED_BOX,
}
