"""Encoders: from the vectors of an entity to shorter codes and back, learned from the vectors (section 4.5.3)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from armem_bridge.forgetting.distances import Matrix
from armem_bridge.forgetting.refusals import InvalidEncoder

_EPSILON = float(np.finfo(np.float64).eps)


class Encoding(Protocol):
    """A way to encode vectors of one layout that has been learned; what is lost on the way depends on it."""

    @property
    def size(self) -> int:
        """How many numbers a code has."""

    def encode(self, vectors: Matrix) -> Matrix:
        """The codes of vectors, one a row."""

    def decode(self, codes: Matrix) -> Matrix:
        """Vectors that have about these codes."""


class Encoder(Protocol):
    """What learns an encoding, one for each entity (Algorithm 2): here linear ones, elsewhere a trained network."""

    def fit(self, vectors: Matrix) -> Encoding:
        """The encoding learned from vectors, one a row. Raises `InvalidEncoder` unless they are finite numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Linear:
    """A linear encoding about the mean of the vectors that it was learned from."""

    mean: Matrix
    """One row."""
    encoding: Matrix
    """A column for each number of a code."""
    decoding: Matrix
    """A row for each number of a code."""

    @property
    def size(self) -> int:
        """How many numbers a code has."""
        return int(self.encoding.shape[1])

    def encode(self, vectors: Matrix) -> Matrix:
        """The codes of vectors, one a row. Raises `InvalidEncoder` for rows of another width."""
        return np.asarray((_checked(vectors, self.encoding.shape[0]) - self.mean) @ self.encoding)

    def decode(self, codes: Matrix) -> Matrix:
        """Vectors that have about these codes. Raises `InvalidEncoder` for rows of another width."""
        return np.asarray(_checked(codes, self.size) @ self.decoding + self.mean)


@dataclass(frozen=True, slots=True)
class PCA:
    """Principal components: the `size` directions in which the vectors vary most, or as many as they vary in at all.

    Of all linear encodings of that size it loses least on the vectors that it was learned from.
    """

    size: int

    def __post_init__(self) -> None:
        _require_size(self.size)

    def fit(self, vectors: Matrix) -> Linear:
        """The encoding by the principal components of vectors, one a row. Raises `InvalidEncoder`."""
        vectors = _learned_from(vectors)
        mean = vectors.mean(axis=0, keepdims=True)
        _, strengths, directions = np.linalg.svd(vectors - mean, full_matrices=False)
        negligible = max(vectors.shape) * _EPSILON * strengths[0] if strengths.size else 0.0
        directions = directions[: min(self.size, int((strengths > negligible).sum()))]
        # A direction and its opposite are equally principal: the one is taken whose greatest number is positive.
        greatest = np.abs(directions).argmax(axis=1)
        directions = directions * np.sign(directions[np.arange(len(directions)), greatest])[:, None]
        return Linear(mean=mean, encoding=directions.T, decoding=directions)


@dataclass(frozen=True, slots=True)
class RandomProjection:
    """`size` random directions, the same for the same seed: nothing is learned but the mean.

    Numbers are drawn from a normal distribution of variance 1 / `size`, so that the squared length of a
    difference is kept on average (Johnson and Lindenstrauss). Codes as long as the vectors lose nothing.
    """

    size: int
    seed: int = 0

    def __post_init__(self) -> None:
        _require_size(self.size)
        if type(self.seed) is not int or self.seed < 0:
            raise InvalidEncoder(f"the seed of a random projection is an integer from 0 on, not {self.seed!r:.80}")

    def fit(self, vectors: Matrix) -> Linear:
        """The encoding by random directions about the mean of vectors, one a row. Raises `InvalidEncoder`."""
        vectors = _learned_from(vectors)
        width = vectors.shape[1]
        size = min(self.size, width)
        directions = np.random.default_rng(self.seed).normal(0.0, 1 / math.sqrt(size), (width, size))
        return Linear(
            mean=vectors.mean(axis=0, keepdims=True),
            encoding=directions,
            decoding=np.asarray(np.linalg.pinv(directions), dtype=np.float64),
        )


def _require_size(size: object) -> None:
    if type(size) is not int or size < 1:
        raise InvalidEncoder(f"a code has one number at least, not {size!r:.80}")


def _checked(rows: Matrix, width: int) -> Matrix:
    if rows.ndim != 2 or rows.shape[1] != width:
        raise InvalidEncoder(f"this encoding takes rows of {width} numbers, not an array of the shape {rows.shape}")
    return rows


def _learned_from(vectors: Matrix) -> Matrix:
    if vectors.ndim != 2 or not vectors.size:
        raise InvalidEncoder(
            f"an encoder learns from vectors, one a row, not from an array of the shape {vectors.shape}"
        )
    if not np.isfinite(vectors).all():
        raise InvalidEncoder("an encoder learns from finite numbers: leave out vectors with NaN or infinities")
    return vectors
