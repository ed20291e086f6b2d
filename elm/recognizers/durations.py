"""Durations in definitions: checked, and counted in whole microseconds as processes compare them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from elm.errors import InvalidValue
from elm.interval import to_micros

_MICROSECOND = timedelta(microseconds=1)
_LATEST = to_micros(datetime.max.replace(tzinfo=UTC))


def check_duration(duration: timedelta, *, what: str) -> None:
    """Refuse what is no stretch of time, or a negative one."""
    if not isinstance(duration, timedelta) or duration < timedelta(0):
        raise InvalidValue(f"{what} is a timedelta, not negative, not {duration!r:.80}")


def micros_of(duration: timedelta) -> int:
    """A duration in microseconds, exactly."""
    return duration // _MICROSECOND


def later(moment: int, micros: int) -> int:
    """`micros` after a moment, but no later than a datetime can say: time never passes beyond that."""
    return min(moment + micros, _LATEST)
