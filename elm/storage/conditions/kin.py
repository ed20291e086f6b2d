"""Conditions on parts and wholes: the links between events, direct or all the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, assert_never

from sqlalchemy import (
    Boolean,
    FromClause,
    Select,
    Uuid,
    all_,
    and_,
    any_,
    exists,
    func,
    literal_column,
    not_,
    select,
    true,
    union_all,
)

from elm.cues.algebra import KinCue
from elm.cues.relations import Kin, SetRelation
from elm.storage.conditions.rule import UIDS, Bind, Rule, SqlCondition
from elm.storage.tables import event, part, tombstone


def kin(cue: KinCue) -> Rule:
    """The parts or wholes against a given set."""
    uids = (list(cue.uids), UIDS)
    if cue.kin is Kin.PARTS and not cue.transitive and cue.relation in _BY_ROW:
        return _own_parts(cue)
    key = (cue.kin.value, cue.relation.value, cue.transitive, bool(cue.uids))
    lines = _Lines(cue.kin, transitive=cue.transitive)

    def build(e: FromClause, p: Bind) -> SqlCondition:
        given = _ids(cue.kin, lambda e: e.c.uid == any_(p))
        match cue.relation:
            case SetRelation.INTERSECTS:
                return e.c.id.in_(lines.relatives_of(given))
            case SetRelation.DISJOINT:
                return e.c.id.not_in(lines.relatives_of(given))
            case SetRelation.SUPERSET:
                return lines.has_all(e, p, given) if cue.uids else true()
            case SetRelation.SUBSET:
                return not_(lines.has_other_than(e, p, given))
            case SetRelation.EQUAL if cue.uids:
                return and_(lines.has_all(e, p, given), not_(lines.has_other_than(e, p, given)))
            case SetRelation.EQUAL:
                return not_(lines.has_any(e))
            case unknown:
                assert_never(unknown)

    return Rule(key=key, values=(uids,), build=build)


def _own_parts(cue: KinCue) -> Rule:
    """The direct parts stand in the event's row; the links of one of the given find the few rows to look at."""
    values = ((list(cue.uids), UIDS), (cue.uids[0] if cue.uids else None, Uuid()))

    def build(e: FromClause, p: Bind, one: Bind) -> SqlCondition:
        within = e.c.parts.op("<@", is_comparison=True)(p)
        if cue.relation is SetRelation.SUBSET:
            return within
        if not cue.uids:
            return e.c.parts == p if cue.relation is SetRelation.EQUAL else true()
        other = _ids(Kin.PARTS, lambda e: e.c.uid == one).subquery("named")
        wholes = select(part.c.whole_id).join(other, other.c.id == part.c.part_id)
        covers = and_(e.c.id == any_(func.array(wholes.scalar_subquery())), e.c.parts.op("@>", is_comparison=True)(p))
        return and_(covers, within) if cue.relation is SetRelation.EQUAL else covers

    return Rule(key=(cue.kin.value, cue.relation.value, "own", bool(cue.uids)), values=values, build=build)


_BY_ROW = (SetRelation.EQUAL, SetRelation.SUPERSET, SetRelation.SUBSET)
_other = event.alias("other")


def _ids(kin: Kin, are_meant: Callable[[FromClause], SqlCondition]) -> Any:
    """The ids of some events; as parts also those of tombstones, which are wholes of nothing.

    What says that there are none is a constant to the planner: it costs nothing until there is the first.
    """
    events = select(_other.c.id).where(are_meant(_other))
    if kin is Kin.WHOLES:
        return events
    pristine = func.nothing_forgotten(type_=Boolean)
    return union_all(events, select(tombstone.c.id).where(not_(pristine), are_meant(tombstone)))


class _Lines:
    """The links from an event to its parts or wholes, direct ones or all of Def 4."""

    def __init__(self, kin: Kin, *, transitive: bool) -> None:
        self._transitive = transitive
        # An event's parts are found where it is the whole, and the other way round.
        self._own, self._kin = (
            (part.c.whole_id, part.c.part_id) if kin is Kin.PARTS else (part.c.part_id, part.c.whole_id)
        )

    def relatives_of(self, given: Any) -> Any:
        """The ids of the events that have one of the `given` among their kin."""
        return select(self._reached(given).c.own_id)

    def has_all(self, e: FromClause, uids: Bind, given: Any) -> SqlCondition:
        """Whether every one of `uids` is among the event's kin; one that does not exist never is."""
        reached = self._reached(given)
        every = (
            select(reached.c.own_id)
            .group_by(reached.c.own_id)
            .having(func.count(reached.c.start_id.distinct()) == func.cardinality(uids))
        )
        return e.c.id.in_(every)

    def has_any(self, e: FromClause) -> SqlCondition:
        """Whether the event has any kin."""
        return exists(select(literal_column("1")).where(self._own == e.c.id).correlate(e))

    def has_other_than(self, e: FromClause, uids: Bind, given: Any) -> SqlCondition:
        """Whether the event has kin that is not among `uids`, whose ids are `given`."""
        if not self._transitive:
            # Only of wholes: an event's direct parts are judged by its own row.
            link = part.alias("link")
            others: Select[Any] = select(literal_column("1")).where(
                link.c.part_id == e.c.id, link.c.whole_uid != all_(uids)
            )
            return exists(others.correlate(e))
        seen = (
            select(self._kin.label("id"))
            .where(self._own == e.c.id)
            .correlate(e)
            .cte("seen", recursive=True, nesting=True)
        )
        step = part.alias("step")
        seen = seen.union(select(step.c[self._kin.name]).join_from(step, seen, step.c[self._own.name] == seen.c.id))
        known = func.array(given.scalar_subquery())
        return exists(select(literal_column("1")).where(seen.c.id != all_(known)).correlate(e))

    def _reached(self, given: Any) -> Any:
        """Pairs (own_id, start_id): the event `own_id` has the given event `start_id` among its kin."""
        first = select(self._own.label("own_id"), self._kin.label("start_id")).where(self._kin.in_(given))
        if not self._transitive:
            return first.subquery("reached")
        reached = first.cte("reached", recursive=True, nesting=True)
        step = part.alias("step")
        return reached.union(
            select(step.c[self._own.name], reached.c.start_id).join_from(
                step, reached, step.c[self._kin.name] == reached.c.own_id
            )
        )
