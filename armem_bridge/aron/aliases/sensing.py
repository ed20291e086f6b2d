"""Table A.1's colours, images, points, point clouds and laser scans as type objects."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.timing import DATE_TIME

COLOR_RGBA: Final = t.Object(name="ColorRGBA", members={"r": t.Int(), "g": t.Int(), "b": t.Int(), "a": t.Int()})
COLOR_HSV: Final = t.Object(name="ColorHSV", members={"h": t.Int(), "s": t.Int(), "v": t.Int()})


def image_rgb(width: int | None = None, height: int | None = None) -> t.NDArray:
    """An image of width x height pixels, in either order, with three channels of 8 bits; OpenCV's 16 is one too."""
    return t.NDArray(shape=(width, height, 3), element="uint8", either_order=width != height)


def image_depth(width: int | None = None, height: int | None = None) -> t.NDArray:
    """An image of width x height depths, in either order, as float32, with or without an extent of 1 for a channel."""
    return t.NDArray(shape=(width, height, 1), element="float32", either_order=width != height)


POINTS: Final = (
    "PointXYZ",
    "PointXYZI",
    "PointXYZL",
    "PointXYZRGB",
    "PointXYZRGBL",
    "PointXYZRGBA",
    "PointXYZHSV",
)
"""The kinds of points, by the names that PCL gives them."""


def point(kind: str) -> t.NDArray:
    """One point of such a kind."""
    return t.NDArray(shape=(1,), element=f"pcl::{kind}")


def point_cloud(kind: str) -> t.NDArray:
    """Any number of points of such a kind, in rows or not."""
    return t.NDArray(element=f"pcl::{kind}")


LASER_SCAN_HEADER: Final = t.Object(
    name="LaserScanHeader", members={"agent": t.String(), "frame": t.String(), "timestamp": DATE_TIME}
)
LASER_SCAN: Final = t.Object(
    name="LaserScan", members={"header": LASER_SCAN_HEADER, "timestamp": DATE_TIME, "data": t.NDArray()}
)

SENSING: Final[dict[str, t.TypeObject]] = {
    "LaserScanHeader": LASER_SCAN_HEADER,
    "LaserScan": LASER_SCAN,
    "ColorRGBA": COLOR_RGBA,
    "ColorHSV": COLOR_HSV,
    "ImageRGB": image_rgb(),
    "Image": image_rgb(),
    "ImageDepth": image_depth(),
    **{kind: point(kind) for kind in POINTS},
    **{kind.replace("Point", "PointCloud"): point_cloud(kind) for kind in POINTS},
}
