"""Arrays: what the bytes of an NDArray mean, between ARON's names of element types and numpy's.

ARON keeps bytes, extents and a name. Which names there are depends on who wrote them: C++ and newer Python
clients say "float" and "double", older ones numpy's names, images of OpenCV its number for three channels
of 8 bits, "16", and point clouds the name of their PCL point, which pads its fields. Names that nobody
here knows are kept as they are and not guessed at.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

import numpy as np

from armem_bridge.aron.data import NDArray
from armem_bridge.errors import NotConvertible

SYNONYMS: Final = {"float": "float32", "double": "float64"}
"""Names of C++ and numpy's name of the same."""

PLAIN: Final = frozenset(
    {"bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"}
    | {"float16", "float32", "float64", "complex64", "complex128"}
)
"""Element types of one number each, by numpy's name: those that are the same on every machine."""

RGB: Final = np.dtype([("r", "u1"), ("g", "u1"), ("b", "u1")])
"""One pixel of OpenCV's type 16, 8UC3."""

_XYZ: Final = (("x", "<f4", 0), ("y", "<f4", 4), ("z", "<f4", 8))


def _padded(size: int, *fields: tuple[str, str, int]) -> np.dtype[np.void]:
    return np.dtype(
        {
            "names": [name for name, _, _ in fields],
            "formats": [form for _, form, _ in fields],
            "offsets": [offset for _, _, offset in fields],
            "itemsize": size,
        }
    )


STRUCTURED: Final[dict[str, np.dtype[np.void]]] = {
    "16": RGB,
    "pcl::PointXYZRGBA": _padded(32, *_XYZ, ("rgba", "<u4", 16)),
    "pcl::PointXYZRGBL": _padded(32, *_XYZ, ("rgba", "<u4", 16), ("label", "<u4", 20)),
}
"""Element types of several fields, with the padding PCL gives them; the colour is one number, as PCL packs it."""


@lru_cache(maxsize=256)
def element_name(name: str) -> str:
    """One name for each element type: numpy's where there is one, else the name itself."""
    return SYNONYMS.get(name, name)


def element_of(array: NDArray) -> str:
    """The element type of the array by its one name; of OpenCV's images the type of a channel."""
    return "uint8" if array.type == "16" else element_name(array.type)


def extents_of(array: NDArray) -> tuple[int, ...]:
    """The extents without the bytes per element; OpenCV's images have an extent of 3 for their channels."""
    if array.type == "16" and array.shape and array.shape[-1] == RGB.itemsize:
        return array.shape
    return array.shape[:-1]


@lru_cache(maxsize=256)
def plain_dtype(name: str) -> np.dtype[Any] | None:
    """How numpy reads elements of this name that are one number each; None where they are not, or not known."""
    name = element_name(name)
    return np.dtype(name).newbyteorder("<") if name in PLAIN else None


@lru_cache(maxsize=256)
def dtype_of(name: str, size: int) -> np.dtype[Any] | None:
    """How numpy reads elements of this name that have `size` bytes each; None where the name is not known."""
    if name == "16" and size == 1:
        return np.dtype("u1")
    dtype = STRUCTURED.get(name, plain_dtype(name))
    return dtype if dtype is not None and dtype.itemsize == size else None


def to_numpy(array: NDArray) -> np.ndarray[Any, Any]:
    """The array as numpy reads it, a read-only view of the same bytes.

    Points of PCL become structured elements, pixels of OpenCV elements of the fields r, g, b (`channels`
    makes an extent of them). Raises `NotConvertible` where the name of the element type is not known.
    """
    dtype = dtype_of(array.type, array.shape[-1]) if array.shape else np.dtype("u1")
    if dtype is None:
        raise NotConvertible(
            f"an NDArray with elements of type {array.type!r} and {array.shape[-1]} bytes cannot be read: "
            f"take its bytes (`.data`) and read them as what they are"
        )
    return np.frombuffer(array.data, dtype=dtype).reshape(array.shape[:-1] or (() if array.shape else (0,)))


def channels(array: NDArray) -> np.ndarray[Any, Any]:
    """As `to_numpy`, the pixels of OpenCV's images as an extent of 3 numbers instead of three fields."""
    numbers = to_numpy(array)
    if numbers.dtype == RGB:
        return np.frombuffer(array.data, dtype=np.uint8).reshape(*numbers.shape, 3)
    return numbers


def from_numpy(array: np.ndarray[Any, Any] | np.generic) -> NDArray:
    """The array as ARON has it; its bytes are copied once, in C order and little-endian.

    Raises `NotConvertible` for elements that have no name in ARON: objects, text, dates, structures other
    than those of `STRUCTURED`, numbers whose size depends on the machine.
    """
    dtype = array.dtype
    if dtype.names is None:
        name = dtype.name
        if name not in PLAIN:
            raise NotConvertible(f"numpy's elements of type {dtype} have no ARON form: convert them to one of numbers")
        if dtype != plain_dtype(name):
            array = array.astype(dtype.newbyteorder("<"))
    else:
        known = [name for name, structured in STRUCTURED.items() if structured == dtype]
        if not known:
            raise NotConvertible(
                f"numpy's structured elements {dtype.names} have no ARON form: take one of "
                f"{sorted(STRUCTURED)} (armem_bridge.aron.arrays.STRUCTURED), or a dict of arrays"
            )
        (name,) = known
    return NDArray((*array.shape, dtype.itemsize), name, array.tobytes())
