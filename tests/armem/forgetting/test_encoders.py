"""Encoders: what they keep and lose, by hand and against each other, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from armem_bridge.forgetting import PCA, Encoder, InvalidEncoder, RandomProjection
from armem_bridge.forgetting.distances import Matrix

RANDOM = np.random.default_rng(7)
CLOUD = RANDOM.normal(size=(60, 3)) @ RANDOM.normal(size=(3, 10)) + RANDOM.normal(0, 0.05, (60, 10)) + 5


def lost(encoder: Encoder, vectors: Matrix = CLOUD) -> float:
    encoding = encoder.fit(vectors)
    return float(np.square(encoding.decode(encoding.encode(vectors)) - vectors).mean())


def test_principal_components_by_hand() -> None:
    encoding = PCA(1).fit(np.array([[0.0, 0.0], [3.0, 4.0], [6.0, 8.0]]))
    assert encoding.encode(np.array([[0.0, 0.0], [3.0, 4.0], [6.0, 8.0]])) == pytest.approx(
        np.array([[-5.0], [0.0], [5.0]])
    )
    # Across the line nothing is kept.
    assert encoding.decode(encoding.encode(np.array([[3.0 - 4, 4.0 + 3]]))) == pytest.approx(np.array([[3.0, 4.0]]))


def test_no_more_components_than_the_vectors_vary_in() -> None:
    line = np.array([[1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [5.0, 5.0, 5.0]])
    assert PCA(3).fit(line).size == 1
    assert lost(PCA(3), line) == pytest.approx(0, abs=1e-25)
    alike = PCA(2).fit(np.ones((4, 3)))
    assert alike.size == 0
    assert alike.decode(alike.encode(np.ones((1, 3)))).tolist() == [[1.0, 1.0, 1.0]]


def test_principal_components_lose_least() -> None:
    for size in (1, 2, 3, 5, 9):
        assert lost(PCA(size)) < min(lost(RandomProjection(size, seed)) for seed in range(5))
        assert lost(PCA(size + 1)) < lost(PCA(size))
    singular = np.linalg.svd(CLOUD - CLOUD.mean(axis=0), compute_uv=False)
    assert lost(PCA(3)) == pytest.approx(np.square(singular[3:]).sum() / CLOUD.size)


@pytest.mark.parametrize("encoder", [PCA(10), RandomProjection(10), RandomProjection(99)])
def test_codes_as_long_as_the_vectors_lose_nothing(encoder: Encoder) -> None:
    assert lost(encoder) == pytest.approx(0, abs=1e-20)
    assert encoder.fit(CLOUD).size == 10


def test_random_projections_keep_lengths_on_average() -> None:
    difference = np.zeros((1, 10))
    difference[0, 4] = 2.0
    squares = []
    for seed in range(400):
        encoding = RandomProjection(4, seed).fit(CLOUD)
        codes = encoding.encode(np.vstack([CLOUD[:1], CLOUD[:1] + difference]))
        squares.append(float(np.square(codes[1] - codes[0]).sum()))
    assert np.mean(squares) == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("encoder", [PCA(3), RandomProjection(3, seed=5)])
def test_the_same_vectors_give_the_same_codes(encoder: Encoder) -> None:
    assert (encoder.fit(CLOUD).encode(CLOUD) == encoder.fit(CLOUD.copy()).encode(CLOUD)).all()


def test_another_seed_gives_other_codes() -> None:
    one, other = RandomProjection(3, seed=0).fit(CLOUD), RandomProjection(3, seed=1).fit(CLOUD)
    assert (one.encode(CLOUD) != other.encode(CLOUD)).all()


@pytest.mark.parametrize("make", [lambda: PCA(0), lambda: RandomProjection(-1), lambda: RandomProjection(3, seed=-1)])
def test_encoders_that_cannot_be(make: object) -> None:
    assert callable(make)
    with pytest.raises(InvalidEncoder):
        make()


@pytest.mark.parametrize("vectors", [np.empty((0, 3)), np.empty((3, 0)), np.zeros(3), np.array([[1.0, math.nan]])])
@pytest.mark.parametrize("encoder", [PCA(1), RandomProjection(1)])
def test_vectors_that_nothing_is_learned_from(encoder: Encoder, vectors: Matrix) -> None:
    with pytest.raises(InvalidEncoder, match="learns from"):
        encoder.fit(vectors)


def test_vectors_of_another_layout() -> None:
    encoding = PCA(2).fit(CLOUD)
    with pytest.raises(InvalidEncoder, match="rows of 10 numbers"):
        encoding.encode(np.zeros((1, 9)))
    with pytest.raises(InvalidEncoder, match="rows of 2 numbers"):
        encoding.decode(np.zeros((1, 3)))
