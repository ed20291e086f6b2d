"""Times as ArmarX has them: whole microseconds since 1970-01-01T00:00:00Z, and two marks for none."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from numbers import Integral
from typing import Final

from armem_bridge.errors import ArmemError

NOT_SET: Final = -1
"""No time given. Every negative number means this; the bridge itself writes -1."""

INVALID: Final = -(2**63)
"""What ArmarX writes for an invalid time: the least 64-bit integer."""

GREATEST: Final = 2**63 - 1
"""The last moment that 64 bits hold."""

Clock = Callable[[], int]
"""Whatever says what time it is, in microseconds: `now`, or the clock of a simulation."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)


class InvalidMoment(ArmemError, ValueError):
    """A value is no time. Give microseconds since 1970 as an integer, or a datetime with its zone."""


def now() -> int:
    """The computer's time."""
    return time.time_ns() // 1_000


def is_set(moment: int) -> bool:
    """Whether a time is one: 1970 itself is, everything below 0 is not."""
    return moment >= 0


def as_moment(value: int | datetime, *, what: str) -> int:
    """`value` in microseconds since 1970; integers that 64 bits hold are moments already, numpy's too.

    Raises `InvalidMoment`, naming `what`, for anything else: other kinds of values, datetimes without a
    zone, and datetimes before 1970, which negative numbers cannot say.
    """
    if type(value) is not int and isinstance(value, Integral) and not isinstance(value, bool):
        value = int(value)
    if type(value) is int:
        if not INVALID <= value <= GREATEST:
            raise InvalidMoment(f"{what} does not fit into 64 bits: {value}. Times are microseconds since 1970")
        return value
    if isinstance(value, datetime):
        return from_datetime(value, what=what)
    raise InvalidMoment(f"{what} is microseconds since 1970 or a datetime, not a {type(value).__name__}: {value!r:.80}")


def from_datetime(moment: datetime, *, what: str = "the time") -> int:
    """Microseconds since 1970, exactly."""
    if moment.utcoffset() is None:
        raise InvalidMoment(
            f"{what} is a datetime without a zone ({moment.isoformat()}): say which, for example tzinfo=datetime.UTC"
        )
    micros = (moment - _EPOCH) // _MICROSECOND
    if micros < 0:
        raise InvalidMoment(f"{what} is before 1970, where ArmarX's times begin: {moment.isoformat()}")
    return micros


def to_datetime(moment: int, *, what: str = "the time") -> datetime:
    """The UTC datetime of a moment. Raises `InvalidMoment` where it is not set or beyond the year 9999."""
    if moment < 0:
        raise InvalidMoment(f"{what} is not set ({moment}): no datetime can say so")
    try:
        return _EPOCH + timedelta(microseconds=moment)
    except OverflowError as error:
        raise InvalidMoment(f"{what} is beyond the year 9999: {moment} microseconds since 1970") from error
