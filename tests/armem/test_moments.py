"""Times go to datetimes and back exactly, and what is no time is refused."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.moments import INVALID, NOT_SET, InvalidMoment, as_moment, from_datetime, is_set, now, to_datetime


@given(st.integers(min_value=0, max_value=253_402_300_799_999_999))
def test_moments_are_datetimes(moment: int) -> None:
    assert from_datetime(to_datetime(moment)) == moment


def test_zones_count() -> None:
    moment = datetime(2026, 1, 1, 12, tzinfo=timezone(timedelta(hours=2)))

    assert from_datetime(moment) == from_datetime(datetime(2026, 1, 1, 10, tzinfo=UTC))
    assert as_moment(moment, what="it") == 1_767_261_600_000_000


def test_the_clock_is_the_computers() -> None:
    assert abs(to_datetime(now()) - datetime.now(UTC)) < timedelta(seconds=5)


def test_negative_is_not_set() -> None:
    assert not is_set(NOT_SET)
    assert not is_set(INVALID)
    assert is_set(0)
    assert as_moment(INVALID, what="it") == INVALID


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (datetime(2026, 1, 1), "without a zone"),  # noqa: DTZ001 - that is what is refused
        (datetime(1969, 12, 31, tzinfo=UTC), "before 1970"),
        (2**63, "64 bits"),
        (1.5, "a float"),
        (True, "a bool"),
        ("now", "a str"),
    ],
)
def test_what_is_no_time_is_refused(value: int | datetime, words: str) -> None:
    with pytest.raises(InvalidMoment, match=f"the begin.*{words}"):
        as_moment(value, what="the begin")


@pytest.mark.parametrize(("moment", "words"), [(-1, "not set"), (2**62, "year 9999")])
def test_what_no_datetime_says_is_refused(moment: int, words: str) -> None:
    with pytest.raises(InvalidMoment, match=words):
        to_datetime(moment)


def test_integers_of_numpy_are_moments() -> None:
    moment = as_moment(np.int64(5), what="the time")  # type: ignore[arg-type]

    assert (moment, type(moment)) == (5, int)
