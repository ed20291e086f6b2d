"""When: closed intervals of UTC time in microseconds, and Allen's thirteen relations between them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from typing import Self, assert_never

from elm.errors import InvalidValue

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)

MINUS_INFINITY = -(2**63)
"""Microseconds that stand for a window without begin: smaller than any datetime."""
PLUS_INFINITY = 2**63 - 1
"""Microseconds that stand for an end still to come: greater than any datetime, equal only to itself."""


def as_utc(moment: datetime, *, what: str) -> datetime:
    """`moment` in UTC; naive datetimes are refused, naming `what`, for nobody can know which instant they mean."""
    if not isinstance(moment, datetime):
        raise InvalidValue(
            f"{what} must be a datetime, not {type(moment).__name__}: {moment!r:.80}. "
            f"Make one of it, like datetime.fromtimestamp(seconds, UTC) or pandas.Timestamp(it, tz='UTC')"
        )
    if type(moment) is datetime and moment.tzinfo is UTC:
        return moment
    # pandas.NaT is a datetime, and the only one that is not equal to itself.
    if moment != moment:
        raise InvalidValue(f"{what} is {moment!r}, which is no time: leave out what has none")
    if moment.utcoffset() is None:
        raise InvalidValue(
            f"{what} is a naive datetime ({moment.isoformat()}): say which zone it is in, "
            f"as {moment.replace(tzinfo=UTC).isoformat()} does (in Python, tzinfo=datetime.UTC)"
        )
    # A plain datetime: a pandas Timestamp, say, has finer digits, which are cut.
    plain = datetime.combine(moment.date(), moment.time(), moment.tzinfo).replace(fold=moment.fold)
    try:
        return plain.astimezone(UTC)
    except OverflowError as error:
        raise InvalidValue(f"{what} is outside the years 1 to 9999 in UTC: {moment.isoformat()}") from error


def parse_time(text: str, *, what: str) -> datetime:
    """The instant an RFC 3339 text names; digits finer than a microsecond are cut, never rounded."""
    try:
        # RFC 3339 allows t and z; str.upper also refuses what is no text.
        moment = datetime.fromisoformat(str.upper(text))
    except (TypeError, ValueError) as error:
        raise InvalidValue(
            f"{what} is not a time: {text!r}. Write it like 2026-01-01T10:00:04.5Z (RFC 3339)"
        ) from error
    return as_utc(moment, what=what)


def to_micros(moment: datetime) -> int:
    """Microseconds since 1970-01-01T00:00:00Z, exactly."""
    return (moment - _EPOCH) // _MICROSECOND


def from_micros(micros: int) -> datetime:
    """The UTC datetime `micros` microseconds after 1970-01-01T00:00:00Z."""
    return _EPOCH + timedelta(microseconds=micros)


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """The closed interval [begin, end] in which an event happened (Def 3).

    `begin == end` is an instant; `end=None` means the event is still going on, which counts as plus
    infinity. Datetimes must be aware and are kept in UTC.
    """

    begin: datetime
    end: datetime | None

    def __post_init__(self) -> None:
        begin = as_utc(self.begin, what="the begin of an interval")
        end = None if self.end is None else as_utc(self.end, what="the end of an interval")
        if end is not None and end < begin:
            raise InvalidValue(
                f"the interval ends ({end.isoformat()}) before it begins ({begin.isoformat()}): swap the two"
            )
        object.__setattr__(self, "begin", begin)
        object.__setattr__(self, "end", end)

    @classmethod
    def at(cls, moment: datetime) -> Self:
        """The instant `[moment, moment]`."""
        return cls(begin=moment, end=moment)

    @classmethod
    def since(cls, begin: datetime) -> Self:
        """An interval that is still going on."""
        return cls(begin=begin, end=None)

    @property
    def is_open(self) -> bool:
        """Whether the event is still going on."""
        return self.end is None

    @property
    def is_instant(self) -> bool:
        """Whether begin and end are the same microsecond."""
        return self.begin == self.end

    @property
    def duration(self) -> timedelta | None:
        """End minus begin; None while the event is still going on."""
        return None if self.end is None else self.end - self.begin

    @property
    def micros(self) -> tuple[int, int]:
        """Begin and end as microseconds since 1970; an open end is `PLUS_INFINITY`."""
        return to_micros(self.begin), PLUS_INFINITY if self.end is None else to_micros(self.end)

    def __str__(self) -> str:
        end = "..." if self.end is None else self.end.isoformat()
        return f"[{self.begin.isoformat()}, {end}]"


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """The closed stretch of time a cue compares with: None is minus infinity as begin, plus infinity as end."""

    begin: datetime | None = None
    end: datetime | None = None

    def __post_init__(self) -> None:
        begin = None if self.begin is None else as_utc(self.begin, what="the begin of a window")
        end = None if self.end is None else as_utc(self.end, what="the end of a window")
        if begin is not None and end is not None and end < begin:
            raise InvalidValue(
                f"the window ends ({end.isoformat()}) before it begins ({begin.isoformat()}): swap the two"
            )
        object.__setattr__(self, "begin", begin)
        object.__setattr__(self, "end", end)

    @classmethod
    def of(cls, interval: Interval) -> Self:
        """The window that covers exactly `interval`."""
        return cls(begin=interval.begin, end=interval.end)

    @property
    def micros(self) -> tuple[int, int]:
        """Begin and end as microseconds since 1970, with `MINUS_INFINITY` and `PLUS_INFINITY` for None."""
        return (
            MINUS_INFINITY if self.begin is None else to_micros(self.begin),
            PLUS_INFINITY if self.end is None else to_micros(self.end),
        )


class AllenRelation(StrEnum):
    """Allen's relations of an event's [a, b] to a cue's [c, d], taken literally.

    With instants several may hold together (an instant at c both `starts` and `meets`). Names as in
    CQL2 and OWL-Time.
    """

    BEFORE = "before"
    AFTER = "after"
    MEETS = "meets"
    MET_BY = "met_by"
    OVERLAPS = "overlaps"
    OVERLAPPED_BY = "overlapped_by"
    STARTS = "starts"
    STARTED_BY = "started_by"
    DURING = "during"
    CONTAINS = "contains"
    FINISHES = "finishes"
    FINISHED_BY = "finished_by"
    EQUALS = "equals"

    def holds(self, event: tuple[int, int], window: tuple[int, int]) -> bool:
        """Whether `event` = (a, b) stands in this relation to `window` = (c, d), all in microseconds."""
        (a, b), (c, d) = event, window
        match self:
            case AllenRelation.BEFORE:
                return b < c
            case AllenRelation.AFTER:
                return a > d
            case AllenRelation.MEETS:
                return b == c
            case AllenRelation.MET_BY:
                return a == d
            case AllenRelation.OVERLAPS:
                return a < c < b < d
            case AllenRelation.OVERLAPPED_BY:
                return c < a < d < b
            case AllenRelation.STARTS:
                return a == c and b < d
            case AllenRelation.STARTED_BY:
                return a == c and b > d
            case AllenRelation.DURING:
                return c < a and b < d
            case AllenRelation.CONTAINS:
                return a < c and d < b
            case AllenRelation.FINISHES:
                return b == d and a > c
            case AllenRelation.FINISHED_BY:
                return b == d and a < c
            case AllenRelation.EQUALS:
                return a == c and b == d
            case _:
                assert_never(self)
