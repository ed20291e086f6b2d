"""Distances: values by hand that tell them apart, what is infinitely far, and the mean over the last n."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.aron.data import Dict, List, NDArray
from armem_bridge.forgetting.distances import DISTANCES, Compared, cosine, distances, mae, mean_distance, mse
from tests.armem.forgetting.scenes import snapshot

INF = math.inf
NAN = math.nan


def compared(*instances: object) -> Compared:
    return Compared.of(each.data for each in snapshot(0, *instances).instances)


@pytest.mark.parametrize(
    ("one", "other", "squared", "absolute", "angular"),
    [
        ([1, 2], [1, 2], 0, 0, 0),
        ([0, 0], [3, 4], 12.5, 3.5, 1),
        ([0, 0], [0, 0], 0, 0, 0),
        # Signed errors would cancel out.
        ([1, 3], [3, 1], 4, 2, 0.4),
        # The same direction, another length.
        ([1, 1], [3, 3], 4, 2, 0),
        ([1, 0], [0, 1], 1, 1, 1),
        ([1, 0], [-1, 0], 2, 1, 2),
        # One great difference or two small ones: equal to MAE, not to MSE.
        ([0, 0], [2, 0], 2, 1, 1),
        ([0, 0], [1, 1], 1, 1, 1),
    ],
)
def test_by_hand(one: list[float], other: list[float], squared: float, absolute: float, angular: float) -> None:
    rows, vector = np.array([one], dtype=float), np.array(other, dtype=float)
    assert mse(rows, vector).tolist() == [squared]
    assert mae(rows, vector).tolist() == [absolute]
    assert cosine(rows, vector).tolist() == [pytest.approx(angular, abs=1e-15)]


def test_what_is_alike_is_near_and_not_far() -> None:
    # Cosine similarity itself would call the first pair 1 and the second 0.
    (same, orthogonal) = cosine(np.array([[2.0, 0.0], [0.0, 2.0]]), np.array([5.0, 0.0]))
    assert same == 0 < orthogonal == 1


@pytest.mark.parametrize("name", DISTANCES)
@pytest.mark.parametrize(
    ("one", "other", "near"),
    [
        ([NAN, 1], [NAN, 1], True),
        ([INF, 1], [INF, 1], True),
        ([NAN, 1], [2, 1], False),
        ([INF, 1], [-INF, 1], False),
        ([INF, 1], [2, 1], False),
        ([NAN, INF], [INF, NAN], False),
    ],
)
def test_numbers_that_are_none_differ_from_all_but_themselves(
    name: str, one: list[float], other: list[float], near: bool
) -> None:
    rows = np.array([one, [7, 7]], dtype=float)
    assert DISTANCES[name](rows, np.array(other, dtype=float))[0] == (0 if near else INF)


@pytest.mark.parametrize("scale", [1e200, 1e-200, 5e-324])
def test_huge_and_tiny_numbers(scale: float) -> None:
    rows = np.array([[scale, 0.0]])
    assert cosine(rows, np.array([0.0, scale])).tolist() == [1]
    assert cosine(rows, np.array([scale, 0.0])).tolist() == [0]
    assert mse(rows, np.array([-scale, 0.0])).tolist() == [INF if scale > 1 else 0]


NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False).map(lambda value: round(value, 3))


@given(st.integers(1, 5).flatmap(lambda width: st.tuples(*[st.lists(NUMBERS, min_size=width, max_size=width)] * 2)))
def test_against_plain_python(pair: tuple[list[float], list[float]]) -> None:
    one, other = pair
    rows, vector = np.array([one]), np.array(other)
    differences = [a - b for a, b in zip(one, other, strict=True)]
    assert mse(rows, vector)[0] == pytest.approx(sum(d * d for d in differences) / len(differences))
    assert mae(rows, vector)[0] == pytest.approx(sum(map(abs, differences)) / len(differences))
    lengths = math.hypot(*one) * math.hypot(*other)
    if lengths:
        similarity = sum(a * b for a, b in zip(one, other, strict=True)) / lengths
        assert cosine(rows, vector)[0] == pytest.approx(1 - similarity, abs=1e-9)
    for distance in DISTANCES.values():
        assert distance(rows, vector) == pytest.approx(distance(vector[None, :], rows[0]), abs=1e-12)
        assert distance(rows, rows[0])[0] == 0


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ([1.0], [1.0, 2.0]),
        ({"x": 1.0}, {"y": 1.0}),
        (1, 1.0),
        ({"x": 1.0, "name": "cup"}, {"x": 1.0, "name": "mug"}),
        ({"x": 1.0, "seen": True}, {"x": 1.0, "seen": False}),
        ({"x": 1.0, "name": None}, {"x": 1.0, "name": "mug"}),
        ({"x": 1.0, "a": "cup"}, {"x": 1.0, "b": "cup"}),
        ("cup", "cup"),
        ({}, {}),
        (np.zeros((2, 2)), np.zeros(4)),
        (np.zeros(2, np.float32), np.zeros(2)),
    ],
)
def test_what_cannot_be_compared_is_infinitely_far(one: Any, other: Any) -> None:
    assert distances(compared(one), [compared(other)], mse).tolist() == [INF]


def test_what_is_no_number_and_the_same_does_no_harm() -> None:
    one, other = compared({"x": 1.0, "name": "cup"}), compared({"x": 3.0, "name": "cup"})
    assert distances(one, [other], mae).tolist() == [2]


def test_all_instances_count() -> None:
    assert distances(compared(1.0, 2.0), [compared(1.0, 4.0)], mae).tolist() == [1]
    assert distances(compared(1.0, 2.0), [compared(1.0)], mae).tolist() == [INF]
    assert distances(compared(), [compared()], mae).tolist() == [INF]


def test_data_as_deep_as_data_may_be_are_compared() -> None:
    deep: Any = NDArray((1, 8), "float64", bytes(8))
    for _ in range(198):
        deep = List([deep])
    one = Compared.of([Dict({"deep": deep})])
    assert distances(one, [one], mse).tolist() == [0]


def test_the_mean_over_the_last_n() -> None:
    last = [compared(0.0), compared(4.0)]
    assert mean_distance(compared(1.0), last, mae) == 2
    assert mean_distance(compared(1.0), last, mse) == 5
    assert mean_distance(compared(1.0), last[-1:], mae) == 3
    assert mean_distance(compared(1.0), [], mae) == INF
    assert mean_distance(compared(1.0), [*last, compared("cup")], mae) == INF
