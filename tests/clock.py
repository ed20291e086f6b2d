"""The clock of the tests: instants, intervals and windows in seconds after one fixed moment."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from elm.interval import Interval, Window

ZERO = datetime(2026, 1, 1, 10, tzinfo=UTC)
"""Second 0 of the tests."""


def at(seconds: float) -> datetime:
    """The instant `seconds` after `ZERO`, to the microsecond."""
    return ZERO + timedelta(microseconds=round(seconds * 1_000_000))


def span(begin: float, end: float | None) -> Interval:
    """The interval between two seconds; without end it is still going on."""
    return Interval(begin=at(begin), end=None if end is None else at(end))


def window(begin: float | None, end: float | None) -> Window:
    """The window between two seconds, None being unbounded."""
    return Window(begin=None if begin is None else at(begin), end=None if end is None else at(end))
