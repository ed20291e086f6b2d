"""Activations: values by hand, the sign of the exponent, and Ebbinghaus's own table of 1885."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.forgetting import Activation, Ebbinghaus, Exponential, InvalidMechanism

ACTIVATIONS = [Exponential(), Exponential(60), Exponential(1e-3), Ebbinghaus(), Ebbinghaus(minute=1.0)]
SECONDS = st.floats(0, 1e9)


@pytest.mark.parametrize(
    ("tau", "seconds", "expected"),
    [
        (1, 0, 1.0),
        (1, 1, 0.36787944117144233),
        (1, 2, 0.1353352832366127),
        (10, 10 * math.log(2), 0.5),
        (0.5, 1, 0.1353352832366127),
    ],
)
def test_exponential_by_hand(tau: float, seconds: float, expected: float) -> None:
    assert Exponential(tau)(seconds) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("minutes", "per_cent"),
    [(20, 57.0), (64, 46.7), (526, 34.5), (1440, 30.4), (2 * 1440, 28.1), (6 * 1440, 24.9), (31 * 1440, 21.2)],
)
def test_ebbinghaus_gives_the_values_that_he_computed_himself(minutes: int, per_cent: float) -> None:
    # Section 29 of his book; he counts from one minute before the end of learning.
    assert Ebbinghaus()(60.0 * (minutes - 1)) * 100 == pytest.approx(per_cent, abs=0.1)


def test_ebbinghaus_by_hand() -> None:
    # 10 minutes on his count are 9 since the use: log10 10 = 1, whatever c is.
    assert Ebbinghaus()(540) == pytest.approx(1.84 / 2.84, rel=1e-12)
    assert Ebbinghaus(k=1, c=2)(99 * 60) == pytest.approx(1 / (2**2 + 1), rel=1e-12)
    assert Ebbinghaus(k=1, c=2, minute=1)(99) == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("activation", ACTIVATIONS, ids=repr)
def test_what_is_used_now_is_fully_active(activation: Activation) -> None:
    assert activation(0.0) == 1.0
    assert activation(-5.0) == 1.0, "a clock that was set back"


@pytest.mark.parametrize("activation", ACTIVATIONS, ids=repr)
@given(one=SECONDS, other=SECONDS)
def test_the_longer_ago_the_less_active(activation: Activation, one: float, other: float) -> None:
    sooner, later = sorted((one, other))
    assert 1.0 >= activation(sooner) >= activation(later) >= 0.0


def test_the_exponent_is_negative() -> None:
    assert Exponential()(1.0) < Exponential()(0.5) < 1.0


@pytest.mark.parametrize("tau", [0, -1, math.nan, math.inf, True, "1"])
def test_time_constants_that_are_none_are_refused(tau: float) -> None:
    with pytest.raises(InvalidMechanism, match="tau"):
        Exponential(tau)


@pytest.mark.parametrize("name", ["k", "c", "minute"])
def test_constants_of_the_curve_are_above_zero(name: str) -> None:
    with pytest.raises(InvalidMechanism, match="Ebbinghaus"):
        Ebbinghaus(**{name: 0.0})
