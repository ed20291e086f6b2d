"""The numbers of a data object as one vector and back again: what forgetting compares (section 4.5).

Every Int, Long, Float, Double and element of an NDArray of plain numbers is one number of the vector, as
float64, in the order of their paths. What is not numeric (texts, truth values, null, arrays of points or
of unknown elements) is left out and named, so that nobody takes two objects for similar that differ there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from armem_bridge.aron.arrays import from_numpy, plain_dtype, to_numpy
from armem_bridge.aron.data import INT32, INT64, Data, Dict, Double, Float, Int, List, Long, NDArray
from armem_bridge.aron.realization import Path, show_path
from armem_bridge.errors import LayoutMismatch

Vector = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where some numbers of a vector come from: a path, the kind of data object there, an array's shape and type."""

    path: Path
    kind: str
    shape: tuple[int, ...] = ()
    element: str = ""

    @property
    def size(self) -> int:
        """How many numbers these are."""
        count = 1
        for extent in self.shape[:-1]:
            count *= extent
        return count

    def __str__(self) -> str:
        kind = f"{self.kind} of {list(self.shape[:-1])} {self.element}" if self.shape else self.kind
        return f"{show_path(self.path)} ({kind})"


@dataclass(frozen=True, slots=True)
class Layout:
    """The places of a vector's numbers, in order; vectors are of one space when their layouts are equal."""

    places: tuple[Place, ...]

    @property
    def size(self) -> int:
        """How many numbers a vector has."""
        return sum(place.size for place in self.places)

    def require(self, other: Layout, *, what: str) -> None:
        """Raise `LayoutMismatch`, with the first difference, when the other layout is not this one."""
        if self == other:
            return
        for mine, theirs in zip(self.places, other.places, strict=False):
            if mine != theirs:
                raise LayoutMismatch(f"{what} has {theirs} where {mine} is expected: compare data of one type only")
        longer, side = (self, "lacks") if len(self.places) > len(other.places) else (other, "also has")
        place = longer.places[min(len(self.places), len(other.places))]
        raise LayoutMismatch(f"{what} {side} {place}: compare data of one type only")


@dataclass(frozen=True, slots=True, kw_only=True)
class Vectorized:
    """A data object as numbers: the vector, where its numbers come from, and what has none."""

    vector: Vector
    layout: Layout
    left_out: tuple[Path, ...]


def vectorize(data: Data | None) -> Vectorized:
    """The numbers of a data object.

    A Long beyond 2^53 loses digits, as float64 has no more. Names of dicts come in the order of their code
    points, so that two dicts that are equal give one vector.
    """
    places: list[Place] = []
    chunks: list[Any] = []
    left_out: list[Path] = []
    _collect(data, (), places, chunks, left_out)
    # The bytes of an array may be NaN of the signalling sort.
    with np.errstate(invalid="ignore"):
        vector = np.concatenate(chunks, dtype=np.float64, casting="unsafe") if chunks else np.empty(0)
    return Vectorized(vector=vector, layout=Layout(tuple(places)), left_out=tuple(left_out))


def stack(data: Iterable[Data | None]) -> tuple[npt.NDArray[np.float64], Layout]:
    """Data objects of one layout as the rows of a matrix. Raises `LayoutMismatch` when they are of several."""
    rows = [vectorize(each) for each in data]
    if not rows:
        return np.empty((0, 0)), Layout(())
    for (index, before), (_, row) in pairwise(enumerate(rows)):
        before.layout.require(row.layout, what=f"data object {index + 1}")
    return np.stack([row.vector for row in rows]), rows[0].layout


def devectorize(vector: Vector, layout: Layout, template: Data | None) -> Data | None:
    """The data object with the numbers of `vector` at the places of `layout`, and all else as in `template`.

    Numbers of integer kinds are rounded, and cut to what the kind can hold. The template has the layout:
    it is a data object of that type, from which the names, texts and nulls are taken.

    Raises `LayoutMismatch` when the vector or the template is of another layout.
    """
    if vector.shape != (layout.size,):
        raise LayoutMismatch(f"a vector of shape {vector.shape} has not the {layout.size} numbers of its layout")
    layout.require(vectorize(template).layout, what="the template")
    numbers = dict(zip([place.path for place in layout.places], _split(vector, layout), strict=True))
    return _rebuild(template, (), numbers)


def _collect(data: Data | None, path: Path, places: list[Place], chunks: list[Any], left_out: list[Path]) -> None:
    match data:
        case Int() | Long() | Float() | Double():
            places.append(Place(path=path, kind=type(data).__name__))
            chunks.append((data.value,))
        case Dict():
            for name in sorted(data.elements):
                _collect(data.elements[name], (*path, name), places, chunks, left_out)
        case List():
            for index, element in enumerate(data.elements):
                _collect(element, (*path, index), places, chunks, left_out)
        case NDArray() if _is_numeric(data):
            places.append(Place(path=path, kind="NDArray", shape=data.shape, element=data.type))
            chunks.append(to_numpy(data).reshape(-1))
        case _:
            left_out.append(path)


def _is_numeric(array: NDArray) -> bool:
    dtype = plain_dtype(array.type)
    return bool(array.shape) and dtype is not None and dtype.kind in "iuf" and dtype.itemsize == array.shape[-1]


def _split(vector: Vector, layout: Layout) -> list[Vector]:
    ends = np.cumsum([place.size for place in layout.places])[:-1]
    return np.split(vector, ends) if layout.places else []


def _rebuild(data: Data | None, path: Path, numbers: dict[Path, Vector]) -> Data | None:
    match data:
        case Dict():
            return Dict({name: _rebuild(element, (*path, name), numbers) for name, element in data.elements.items()})
        case List():
            return List([_rebuild(element, (*path, index), numbers) for index, element in enumerate(data.elements)])
        case Int() | Long():
            low, high = INT32 if isinstance(data, Int) else INT64
            return type(data)(min(max(_rounded(numbers[path][0]), low), high))
        case Float():
            limit = float(np.finfo(np.float32).max)
            value = float(numbers[path][0])
            return Float(min(max(value, -limit), limit) if np.isfinite(value) else value)
        case Double():
            return Double(float(numbers[path][0]))
        case NDArray() if path in numbers:
            return _rebuild_array(data, numbers[path])
        case _:
            return data


def _rounded(value: float) -> int:
    return round(float(value)) if np.isfinite(value) else 0 if value != value else int(np.copysign(2**63, value))


def _rebuild_array(data: NDArray, numbers: Vector) -> NDArray:
    dtype = to_numpy(data).dtype
    with np.errstate(over="ignore", invalid="ignore"):
        if dtype.kind != "f":
            limits = np.iinfo(dtype)
            if dtype.itemsize < 8:
                numbers = np.clip(np.rint(np.nan_to_num(numbers)), limits.min, limits.max)
            else:
                # The limits of 64 bits are no float64.
                exact = [min(max(_rounded(value), int(limits.min)), int(limits.max)) for value in numbers.tolist()]
                return _like(data, np.array(exact, dtype))
        return _like(data, numbers.astype(dtype))


def _like(data: NDArray, numbers: npt.NDArray[Any]) -> NDArray:
    return NDArray(data.shape, data.type, from_numpy(numbers).data)
