"""First looks: what few events match, or most, is found by bounded statements, before the memory is searched."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import Enum
from typing import Any, assert_never

from sqlalchemy import (
    BigInteger,
    ColumnElement,
    FromClause,
    Select,
    and_,
    bindparam,
    case,
    false,
    literal_column,
    null,
    or_,
    select,
    true,
    union_all,
)

from elm.interval import Window
from elm.query import Nearest, Order, Query
from elm.storage.conditions.rule import SqlCondition
from elm.storage.cue_compiler import CompiledCue
from elm.storage.hints import gathers_kin, is_in_order, is_pinned, names_features
from elm.storage.planning import Planning
from elm.storage.row_order import conditions, keys, ordered, place
from elm.storage.row_search import GLANCE_FACTOR, counted, judged, walked, walks
from elm.storage.tables import event

AT_ONCE = 100
"""So many rows of an answer are held in this process at a time: their payloads may be images."""
FEW = 100
"""Up to so many candidates that one index finds are judged at once: to read them takes less than to plan for them."""
SOME, MANY = 400, 2_000
"""Up to so many where a few of them are wanted, first in order, at once and when it is in vain to look in order."""
PEEK = 20
"""Up to so many events, if no more are wanted, may well be the next ones in order: that is seen first."""
GLANCE, WALK, FAR = 200, 2_000, 40
"""So many events are looked at first in order, and so many if they are dense enough, or `FAR` for each one wanted."""

Wanted = Callable[[FromClause], Sequence[ColumnElement[Any]]]
"""The columns of an answer, of an event or what stands for it."""


class Look(Enum):
    """A statement that answers a query, or says at little cost that it cannot (docs/adr/0014).

    The last column of each row is NULL in an answer; where nothing matches there is one row at most, without values.
    Otherwise it says how many matched at a glance. Every step is bounded, so that it does little harm to a cue that
    it does not suit.
    """

    ALONG_INDEX = "along index"
    """One index has what matches in the order of the answer."""
    AT_FEW = "at few"
    """For each condition of the cue that an index knows, as many places as are cheap to judge are read from it.

    If there are no more, all that match are among them. Where only a few events are wanted, those next in order are
    judged before, for they may all match.
    """
    IN_ORDER = "in order"
    """The next events in order are judged; if there is too little among them, more places are read from indexes."""
    BY_PLAN = "by plan"
    """As at few, but by what index the planner chooses for the values."""
    BY_LISTS = "by lists"
    """Likewise for features, whose index has a list of events for each, to be read whole."""

    @property
    def planning(self) -> Planning:
        """How it is planned: but for the last two, one plan is good for all values."""
        return _PLANNING.get(self, Planning.BY_INDEX)


_PLANNING = {Look.BY_PLAN: Planning.BY_ANY_INDEX, Look.BY_LISTS: Planning.BY_LISTS}


def looks(compiled: CompiledCue, query: Query) -> list[Look]:
    """Those that may answer a query, to be taken in turn until one does."""
    if is_small(query) and is_in_order(query.cue) and query.order in (Order.BEGIN, Order.BEGIN_REVERSED):
        return [Look.ALONG_INDEX]
    found = [Look.AT_FEW] if compiled.looks else []
    if _may_walk(query):
        found.append(Look.IN_ORDER)
        if not compiled.looks and compiled.search is not None:
            found.append(Look.BY_LISTS if names_features(query.cue) else Look.BY_PLAN)
    return found


def is_worth(look: Look, seen: int) -> bool:
    """Whether to take a look after others, when so many matched at a glance."""
    # Where some are seen at once there are more in all than one would read in no order.
    return look not in _PLANNING or seen == 0


def parameters(query: Query) -> dict[str, int]:
    """The values of the looks' own parameters."""
    limit = query.limit
    if limit is None or not is_small(query):
        return {"few": FEW}
    return {
        "few": SOME,
        "many": MANY,
        "peek": limit * GLANCE_FACTOR if limit <= PEEK else 0,
        "glance": max(limit * GLANCE_FACTOR, GLANCE),
        "walk": max(limit * FAR, WALK),
    }


def is_small(query: Query) -> bool:
    """Whether so few events are wanted that they are held at once: on this too depends the statement of a look."""
    return query.limit is not None and query.limit <= AT_ONCE


def _may_walk(query: Query) -> bool:
    return is_small(query) and walks(query, pinned=is_pinned(query.cue)) and not gathers_kin(query.cue)


def look_for(look: Look, compiled: CompiledCue, query: Query, wanted: Wanted, *, near: Window) -> Select[Any]:
    """The statement of a look: the wanted columns of what a query asks for, in order, then whether it is the answer."""
    steady = replace(compiled, condition=compiled.judge)
    match look:
        case Look.ALONG_INDEX:
            known = [each(event) for each in compiled.looks]
            along = select(*wanted(event), null()).where(*known, *conditions(steady, query, event))
            return ordered(along, query)
        case Look.AT_FEW:
            next_ones, filled = _by_peeking(steady, query, near) if _may_walk(query) else ([], false())
            few, found = _by_indexes(query, compiled.looks, "few", [~filled])
            return _answer(steady, query, wanted, [*next_ones, *few], or_(filled, found), seen=_NOTHING)
        case Look.IN_ORDER:
            walk, filled, seen = _by_walking(steady, query, near)
            many, found = _by_indexes(query, compiled.looks, "many", [~filled])
            return _answer(steady, query, wanted, [*walk, *many], or_(filled, found), seen=seen)
        case Look.BY_PLAN | Look.BY_LISTS:
            search = compiled.alone or compiled.search
            assert search is not None  # noqa: S101 - or there is no such look
            return _answer(compiled, query, wanted, *_by_indexes(query, [search], "many", []), seen=_NOTHING)
        case unknown:
            assert_never(unknown)


_Steps = list[Select[Any]]
_NOTHING: ColumnElement[Any] = literal_column("0")


def _by_indexes(
    query: Query, searches: Sequence[Callable[[FromClause], SqlCondition]], name: str, when: Sequence[SqlCondition]
) -> tuple[_Steps, SqlCondition]:
    """What each search finds until one finds no more than parameter `name` says, and whether one does."""
    most = bindparam(name, type_=BigInteger)
    steps: _Steps = []
    solved: SqlCondition = false()
    unsolved = [*when]
    for number, search in enumerate(searches):
        places = select(*place(query), event.c.id).where(*unsolved, search(event))
        found = places.limit(most + literal_column("1")).cte(f"{name}{number}").prefix_with("MATERIALIZED")
        enough = counted(found) <= most
        steps.append(select(found, false().label("judged")).where(enough))
        solved = or_(solved, enough)
        unsolved.append(~enough)
    return steps, solved


def _by_peeking(compiled: CompiledCue, query: Query, near: Window) -> tuple[_Steps, SqlCondition]:
    """What matches of the very next events in order, if that is as much as is wanted, and whether it is."""
    peek = walked(compiled, query, near, "peek", [])
    filled = counted(peek) >= bindparam("limit", type_=BigInteger)
    return [select(peek, true().label("judged")).where(filled)], filled


def _by_walking(compiled: CompiledCue, query: Query, near: Window) -> tuple[_Steps, SqlCondition, ColumnElement[Any]]:
    """What matches of the next events in order, whether that is as much as is wanted, and how many at a glance."""
    limit, glanced, ahead = (bindparam(name, type_=BigInteger) for name in ("limit", "glance", "walk"))
    glance = walked(compiled, query, near, "glance", [])
    seen = counted(glance)
    # Farther only if there will be enough, should they go on as densely.
    walk = walked(compiled, query, near, "walk", [seen < limit, seen * ahead >= limit * glanced])
    steps: _Steps = []
    filled: SqlCondition = false()
    for each in (glance, walk):
        is_full = counted(each) >= limit
        steps.append(select(each, true().label("judged")).where(is_full))
        filled = or_(filled, is_full)
    return steps, filled, seen


def _answer(
    compiled: CompiledCue,
    query: Query,
    wanted: Wanted,
    steps: _Steps,
    solved: SqlCondition,
    *,
    seen: ColumnElement[Any],
) -> Select[Any]:
    """What matches in the places that the steps found, in order; one row at least, for the last column to stand in."""
    candidates, there = judged(
        query,
        union_all(*steps).subquery("places"),
        lambda candidate: [or_(candidate.c.judged, and_(*conditions(compiled, query, event)))],
    )
    by = candidates.c.distance if isinstance(query.order, Nearest) else candidates.c.begin
    first = select(there, by).select_from(candidates.join(there, true())).order_by(*keys(query, candidates))
    if query.limit is not None:
        first = first.limit(bindparam("limit", type_=BigInteger))
    rows = first.subquery("rows")
    answer = select(case((~solved, seen)).label("seen")).subquery("answer")
    found_or_not = select(*wanted(rows), answer.c.seen).select_from(answer.outerjoin(rows, true()))
    return found_or_not.order_by(*keys(query, rows))
