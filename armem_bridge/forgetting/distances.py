"""Distances between snapshots: by the numbers in their data, and infinite where these cannot tell (section 4.5.1)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from armem_bridge.aron.content import content_hash
from armem_bridge.aron.data import Data, Dict, Int, List, String
from armem_bridge.aron.realization import Path
from armem_bridge.aron.vectors import Layout, Vector, vectorize

Matrix = npt.NDArray[np.float64]
"""One vector a row."""

Distance = Callable[[Matrix, Vector], Vector]
"""From each row of a matrix to a vector: 0 for what is the same, never negative, never NaN; see `DISTANCES`."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Compared:
    """What of a snapshot is compared: the numbers of its data, where they are from, and what is no number.

    `layouts` are those of the instances, one after another. `rest` is a hash over everything without
    numbers (texts, truth values, nulls, arrays of unknown elements) and where it stands, empty if there is
    nothing. Containers without content do not count.
    """

    vector: Vector
    layouts: tuple[Layout, ...]
    rest: bytes

    @classmethod
    def of(cls, data: Iterable[Data | None]) -> Compared:
        """What is compared of the data of a snapshot's instances, all in one."""
        instances = list(data)
        found = [vectorize(each) for each in instances]
        rest = [
            List([Int(index), String(repr(path)), _element(instance, path)])
            for index, (instance, each) in enumerate(zip(instances, found, strict=True))
            for path in each.left_out
        ]
        return cls(
            vector=np.concatenate([each.vector for each in found]) if found else np.empty(0),
            layouts=tuple(each.layout for each in found),
            rest=content_hash(List(rest)) if rest else b"",
        )

    def comparable(self, other: Compared) -> bool:
        """Whether numbers tell how far the two are apart: there are some, in the same places, the rest being equal."""
        return self.vector.size > 0 and self.rest == other.rest and self.layouts == other.layouts


def mse(rows: Matrix, vector: Vector) -> Vector:
    """Mean squared error: the mean over all numbers of the squared difference."""
    return _bounded(lambda ones, other: np.square(ones - other).mean(axis=1), rows, vector)


def mae(rows: Matrix, vector: Vector) -> Vector:
    """Mean absolute error: the mean over all numbers of the absolute difference."""
    return _bounded(lambda ones, other: np.abs(ones - other).mean(axis=1), rows, vector)


def cosine(rows: Matrix, vector: Vector) -> Vector:
    """Cosine distance, 1 - cosine similarity, from 0 (same direction) over 1 (orthogonal) to 2 (opposite).

    A vector of zeros has no direction: to another one of zeros it is 0, to all others 1.
    """
    return _bounded(_cosine, rows, vector)


DISTANCES: Mapping[str, Distance] = MappingProxyType({"mse": mse, "mae": mae, "cosine": cosine})
"""The distances by their names."""


def distances(one: Compared, others: Sequence[Compared], distance: Distance) -> Vector:
    """How far `one` is from each of the others; infinitely from those that it cannot be compared with."""
    found = np.full(len(others), np.inf)
    places = [place for place, other in enumerate(others) if one.comparable(other)]
    if places:
        found[places] = distance(np.stack([others[place].vector for place in places]), one.vector)
    return found


def mean_distance(one: Compared, others: Sequence[Compared], distance: Distance) -> float:
    """The mean distance of `one` from the others: D of Algorithm 1, with the others as the last n consolidated ones.

    Infinite if there are none, and if one of them cannot be compared with it.
    """
    return float(distances(one, others, distance).mean()) if others else math.inf


def _bounded(formula: Callable[[Matrix, Vector], Vector], rows: Matrix, vector: Vector) -> Vector:
    """The formula, where all is finite.

    NaN and infinities that stand in both at the same place are no difference; in one only, they are an
    infinite one. So is a sum beyond float64.
    """
    if not rows.shape[1]:
        return np.zeros(len(rows))
    odd = ~(np.isfinite(rows) & np.isfinite(vector))
    if not odd.any():
        with np.errstate(over="ignore"):
            return formula(rows, vector)
    same = odd & ((rows == vector) | (np.isnan(rows) & np.isnan(vector)))
    differs = (odd & ~same).any(axis=1)
    found = np.full(len(rows), np.inf)
    for row in np.flatnonzero(~differs):
        ones, other = np.where(same[row], 0.0, rows[row]), np.where(same[row], 0.0, vector)
        found[row] = _bounded(formula, ones[None, :], other)[0]
    return found


def _cosine(rows: Matrix, vector: Vector) -> Vector:
    # Scaled first: the squares of large numbers are beyond float64, and those of small ones nothing.
    units, empty = _units(rows)
    (unit,), (nothing,) = _units(vector[None, :])
    found = np.clip(1.0 - units @ unit, 0.0, 2.0)
    found[(units == unit).all(axis=1)] = 0.0
    return np.where(empty != nothing, 1.0, found)


def _units(rows: Matrix) -> tuple[Matrix, npt.NDArray[np.bool_]]:
    """The rows at length 1, and which of them have none."""
    greatest = np.abs(rows).max(axis=1, keepdims=True)
    scaled = rows / np.where(greatest == 0.0, 1.0, greatest)
    lengths = np.sqrt(np.square(scaled).sum(axis=1, keepdims=True))
    return scaled / np.where(lengths == 0.0, 1.0, lengths), greatest[:, 0] == 0.0


def _element(data: Data | None, path: Path) -> Data | None:
    for step in path:
        match data:
            case Dict() if isinstance(step, str):
                data = data.elements[step]
            case List() if isinstance(step, int):
                data = data.elements[step]
    return data
