"""Conditions on time: windows as ranges that the index understands, Allen's relations literally, durations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import timedelta
from typing import Any, assert_never

from sqlalchemy import ColumnElement, FromClause, Interval, and_, false, func, literal_column, or_
from sqlalchemy.dialects.postgresql import TSTZRANGE
from sqlalchemy.types import TypeEngine

from elm.cues.algebra import DurationCue, TimeCue
from elm.cues.relations import SetRelation, TimeAxis
from elm.interval import AllenRelation
from elm.storage.conditions.compare import COMPARE
from elm.storage.conditions.rule import TIME, Bind, Rule, SqlCondition, exactly, indexed

_MINUS_INFINITY: Bind = literal_column("'-infinity'::timestamptz")
_PLUS_INFINITY: Bind = literal_column("'infinity'::timestamptz")


def time(cue: TimeCue) -> Rule:
    """When it happened, or when the memory learned of it, against a window."""
    bounds = (cue.window.begin, cue.window.end)
    key = ("time", cue.axis.value, cue.relation.value, *(bound is None for bound in bounds))
    values = tuple((bound, TIME) for bound in bounds if bound is not None)

    def edges(binds: Sequence[Bind]) -> tuple[Bind, Bind]:
        rest = iter(binds)
        begin = _MINUS_INFINITY if bounds[0] is None else next(rest)
        return begin, _PLUS_INFINITY if bounds[1] is None else next(rest)

    def build(e: FromClause, *binds: Bind) -> SqlCondition:
        c, d = edges(binds)
        if cue.axis is TimeAxis.RECORDED_AT:
            return _recorded(cue.relation, e.c.recorded_at, c, d)
        return _during(cue.relation, e.c.period, c, d)

    def look(e: FromClause, *binds: Bind) -> SqlCondition:
        c, d = edges(binds)
        if cue.axis is TimeAxis.RECORDED_AT:
            return e.c.recorded_at.between(c, d)
        return _looked(cue.relation, e.c.period, c, d)

    # What lies beyond the window may be half of the memory, and of one that is open the planner thinks as of that.
    is_near = cue.relation not in _BEYOND and (cue.axis is TimeAxis.TIME or None not in bounds)
    return indexed(key, values, build, look=look if is_near else None)


_BEYOND = frozenset({SetRelation.DISJOINT, AllenRelation.BEFORE, AllenRelation.AFTER})


def _range(begin: Bind, end: Bind) -> ColumnElement[Any]:
    # An unbounded side is NULL to a range; the value 'infinity' would be an instant like any other.
    lower = literal_column("NULL::timestamptz") if begin is _MINUS_INFINITY else begin
    upper = literal_column("NULL::timestamptz") if end is _PLUS_INFINITY else end
    return func.tstzrange(lower, upper, literal_column("'[]'"), type_=TSTZRANGE)


def _during(relation: SetRelation | AllenRelation, period: ColumnElement[Any], c: Bind, d: Bind) -> SqlCondition:
    a: ColumnElement[Any] = func.lower(period)
    b: ColumnElement[Any] = func.coalesce(func.upper(period), _PLUS_INFINITY)
    window = _range(c, d)
    touching = period.op("&&", is_comparison=True)
    match relation:
        case SetRelation.EQUAL:
            return period == window
        case SetRelation.SUBSET:
            return period.op("<@", is_comparison=True)(window)
        case SetRelation.SUPERSET:
            return period.op("@>", is_comparison=True)(window)
        case SetRelation.INTERSECTS:
            return touching(window)
        case SetRelation.DISJOINT:
            # Not NOT &&, which no index understands.
            return or_(period.op("<<", is_comparison=True)(window), period.op(">>", is_comparison=True)(window))
        # The range operators in front of Allen's comparisons are what the GiST index understands.
        case AllenRelation.BEFORE:
            return period.op("<<", is_comparison=True)(window)
        case AllenRelation.AFTER:
            return a > d
        case AllenRelation.MEETS:
            return and_(_at(touching, c), b == c)
        case AllenRelation.MET_BY:
            return a == d
        case AllenRelation.OVERLAPS:
            return and_(_at(touching, c), a < c, c < b, b < d)
        case AllenRelation.OVERLAPPED_BY:
            return and_(_at(touching, d), c < a, a < d, d < b)
        case AllenRelation.STARTS:
            return and_(a == c, b < d)
        case AllenRelation.STARTED_BY:
            return and_(a == c, b > d)
        case AllenRelation.DURING:
            return and_(period.op("<@", is_comparison=True)(window), c < a, b < d)
        case AllenRelation.CONTAINS:
            return and_(period.op("@>", is_comparison=True)(window), a < c, d < b)
        case AllenRelation.FINISHES:
            return and_(_at(touching, d), b == d, a > c)
        case AllenRelation.FINISHED_BY:
            return and_(_at(touching, d), b == d, a < c)
        case AllenRelation.EQUALS:
            return period == window
        case unknown:
            assert_never(unknown)


def _looked(relation: SetRelation | AllenRelation, period: ColumnElement[Any], c: Bind, d: Bind) -> SqlCondition:
    """What an index finds and stops at any number: no comparison that is judged on what it found."""
    window = _range(c, d)
    touching = period.op("&&", is_comparison=True)
    within = period.op("<@", is_comparison=True)(window)
    match relation:
        case SetRelation.EQUAL | AllenRelation.EQUALS:
            # Of a period that is the window the planner knows less than of one within it (`rule.exactly`).
            return and_(period == window, within)
        case SetRelation.SUBSET | AllenRelation.DURING:
            return within
        case SetRelation.SUPERSET | AllenRelation.CONTAINS:
            return period.op("@>", is_comparison=True)(window)
        case SetRelation.INTERSECTS:
            return touching(window)
        case AllenRelation.MEETS | AllenRelation.OVERLAPS:
            return _at(touching, c)
        case AllenRelation.OVERLAPPED_BY | AllenRelation.FINISHES | AllenRelation.FINISHED_BY:
            return _at(touching, d)
        case AllenRelation.STARTS | AllenRelation.STARTED_BY:
            return exactly(func.lower(period), c)
        case AllenRelation.MET_BY:
            return exactly(func.lower(period), d)
        case SetRelation.DISJOINT | AllenRelation.BEFORE | AllenRelation.AFTER:
            raise AssertionError("what lies beyond a window is not looked at by an index")
        case unknown:
            assert_never(unknown)


def _at(touching: Callable[[Any], SqlCondition], moment: Bind) -> SqlCondition:
    """The events that cover an instant: none the beginning of time, the open ones its end."""
    if moment is _MINUS_INFINITY:
        return false()
    # Here infinity is meant as an instant like any other: a range without upper bound covers it.
    return touching(func.tstzrange(moment, moment, literal_column("'[]'"), type_=TSTZRANGE))


def _recorded(relation: SetRelation | AllenRelation, t: ColumnElement[Any], c: Bind, d: Bind) -> SqlCondition:
    match relation:
        case SetRelation.EQUAL | SetRelation.SUPERSET | AllenRelation.EQUALS:
            return and_(t == c, t == d)
        case SetRelation.SUBSET | SetRelation.INTERSECTS:
            return and_(t >= c, t <= d)
        case SetRelation.DISJOINT:
            return or_(t < c, t > d)
        case AllenRelation.BEFORE:
            return t < c
        case AllenRelation.AFTER:
            return t > d
        case AllenRelation.MEETS:
            return t == c
        case AllenRelation.MET_BY:
            return t == d
        case AllenRelation.OVERLAPS | AllenRelation.OVERLAPPED_BY | AllenRelation.CONTAINS:
            # An instant has no inside: it neither reaches over an edge nor surrounds anything.
            return false()
        case AllenRelation.STARTS:
            return and_(t == c, t < d)
        case AllenRelation.STARTED_BY:
            return and_(t == c, t > d)
        case AllenRelation.DURING:
            return and_(t > c, t < d)
        case AllenRelation.FINISHES:
            return and_(t == d, t > c)
        case AllenRelation.FINISHED_BY:
            return and_(t == d, t < c)
        case unknown:
            assert_never(unknown)


def duration(cue: DurationCue) -> Rule:
    """How long it lasted against a given duration."""
    values: tuple[tuple[timedelta, TypeEngine[Any]], ...] = ((cue.duration, Interval()),)
    compare = COMPARE[cue.compare]
    # The upper bound of an open event is NULL: the comparison is not true, as it should be.
    return Rule(
        key=("duration", cue.compare.value),
        values=values,
        build=lambda e, p: compare(func.upper(e.c.period) - func.lower(e.c.period), p),
    )
