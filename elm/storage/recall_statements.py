"""The statements that recall: for each shape of question one SQL text, compiled once and kept."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any

from geoalchemy2 import Geometry
from sqlalchemy import (
    ARRAY,
    TIMESTAMP,
    BigInteger,
    Boolean,
    ColumnElement,
    FromClause,
    Integer,
    LargeBinary,
    Select,
    Text,
    and_,
    any_,
    bindparam,
    column,
    extract,
    func,
    lateral,
    literal_column,
    select,
    true,
    tuple_,
    type_coerce,
    union_all,
)
from sqlalchemy.dialects.postgresql import psycopg

from elm.cues.algebra import And, Cue, Place
from elm.interval import Window
from elm.storage.conditions.rule import Condition
from elm.storage.cue_compiler import CompiledCue
from elm.storage.tables import event, frame, part
from elm.store import ByFeature, Grouping, Join, JoinRelation, Nearest, Order, Query

DIALECT = psycopg.dialect()  # type: ignore[no-untyped-call]
_TIME = TIMESTAMP(timezone=True)


class StatementCache:
    """SQL texts by shape: building one costs a hundred times what finding it does."""

    def __init__(self) -> None:
        self._texts: dict[Any, str] = {}
        self._lock = Lock()

    def text(self, key: Any, build: Callable[[], Select[Any]]) -> str:
        """The SQL text of the statement that `key` stands for."""
        known = self._texts.get(key)
        if known is None:
            with self._lock:
                known = self._texts[key] = str(build().compile(dialect=DIALECT))
        return known


def begin(e: FromClause) -> ColumnElement[Any]:
    """When an event began."""
    return func.lower(e.c.period)


def columns(e: FromClause) -> list[ColumnElement[Any]]:
    """What the decoders of `rows` read, in their order."""
    links = part.alias("up")
    wholes = select(links.c.whole_uid).where(links.c.part_id == e.c.id).order_by(links.c.whole_id)
    return [
        e.c.id,
        e.c.uid,
        e.c.type_id,
        e.c.period,
        e.c.frame_id,
        # As it is stored: the geometry type would put a conversion around it.
        type_coerce(e.c.region, LargeBinary),
        e.c.subject_frame_id,
        type_coerce(e.c.subject, LargeBinary),
        e.c.features,
        e.c.agent,
        e.c.media_type,
        e.c.payload,
        e.c.parts,
        func.array(wholes.scalar_subquery()).label("wholes"),
        e.c.recorded_at,
    ]


# Which events, in which order

WALK_FEWEST, WALK_MOST, WALK_FACTOR = 500, 2_000, 20
"""How far the begin index is walked for a limited answer before the candidates are collected instead."""


def find(compiled: CompiledCue, query: Query, *, pinned: bool, near: Window) -> Select[Any]:
    """The rows a query asks for, in order."""
    ids = _few(compiled, query, pinned=pinned, near=near)
    if ids is None:
        return _ordered(select(*columns(event)).where(*_conditions(compiled, query, event)), query, event)
    return _ordered(select(*columns(event)).join(ids, ids.c.id == event.c.id), query, event, after=False)


def find_ids(compiled: CompiledCue, query: Query, *, pinned: bool, near: Window) -> Select[Any]:
    """Their ids alone, in order."""
    ids = _few(compiled, query, pinned=pinned, near=near)
    if ids is None:
        return _ordered(select(event.c.id).where(*_conditions(compiled, query, event)), query, event)
    return _ordered(select(event.c.id).join(ids, ids.c.id == event.c.id), query, event, after=False)


def shape(query: Query, *, pinned: bool, near: Window) -> tuple[Any, ...]:
    """What the SQL of a query depends on beside its cue."""
    order = ("nearest", query.order.place) if isinstance(query.order, Nearest) else query.order
    bounds = (near.begin is None, near.end is None) if _walks(query, pinned=pinned) else None
    return order, query.limit is not None, query.after is not None, bounds


def parameters(query: Query, *, near: Window) -> dict[str, Any]:
    """The values of a query's own parameters."""
    given: dict[str, Any] = {}
    if query.limit is not None:
        given["limit"] = query.limit
        given["walk"] = min(max(query.limit * WALK_FACTOR, WALK_FEWEST), WALK_MOST)
        given["near_begin"], given["near_end"] = near.begin, near.end
    if query.after is not None:
        given["after_begin"], given["after_id"] = query.after.begin, query.after.id
    if isinstance(query.order, Nearest):
        given["to"], given["to_frame"] = query.order.to.wkb, query.order.to.frame
    return given


def _few(compiled: CompiledCue, query: Query, *, pinned: bool, near: Window) -> Any:
    """The ids of a limited answer where it pays to find them first; None where the plain statement does."""
    # Of a cue that few match the index by distance would be walked to its end: then candidates are collected.
    if isinstance(query.order, Nearest) and query.limit is not None and query.cue == And():
        return _nearest(compiled, query)
    return _walked(compiled, query, near) if _walks(query, pinned=pinned) else None


def _nearest(compiled: CompiledCue, query: Query) -> Any:
    """The nearest events, and all that are as far as the last: by distance alone, for so the index has them."""
    distance, _ = _order(query, event)
    found = select(event.c.id).where(*_conditions(compiled, query, event)).order_by(distance)
    return found.fetch(bindparam("limit", type_=BigInteger), with_ties=True).subquery("nearest")


def _walks(query: Query, *, pinned: bool) -> bool:
    if query.limit is None or pinned or query.limit >= WALK_MOST:
        return False
    return not isinstance(query.order, Nearest)


def _walked(compiled: CompiledCue, query: Query, near: Window) -> Any:
    """The ids of a limited answer at a cost bounded by its hits, however the cue correlates with time.

    The planner takes a cue's hits to be spread evenly over time; where they are not, it walks the begin
    index to its far end (377 ms where 6 would do). So: walk a bounded number of rows, and only where they
    do not fill the limit collect all candidates and sort them.
    """
    limit = bindparam("limit", type_=BigInteger)
    bounds: list[Condition] = []
    # Only where the walk goes along the begins do these bound it.
    along_begin = query.order is not Order.ID
    if along_begin and near.begin is not None:
        bounds.append(begin(event) >= bindparam("near_begin", type_=_TIME))
    if along_begin and near.end is not None:
        bounds.append(begin(event) <= bindparam("near_end", type_=_TIME))
    rows = select(event).where(*bounds, *_after(query, event)).order_by(*_order(query, event))
    walk = rows.limit(bindparam("walk", type_=Integer)).subquery("walk")
    close = (
        select(walk.c.id, walk.c.period)
        .where(compiled.condition(walk))
        .order_by(*_order(query, walk))
        .limit(limit)
        .cte("close")
        .prefix_with("MATERIALIZED")
    )
    filled = select(func.count()).select_from(close).scalar_subquery() >= limit
    candidates = (
        select(event.c.id, event.c.period)
        .where(~filled, *_conditions(compiled, query, event))
        .cte("candidates")
        .prefix_with("MATERIALIZED")
    )
    sorted_candidates = select(candidates).order_by(*_order(query, candidates)).limit(limit).subquery("sorted")
    return union_all(select(close).where(filled), select(sorted_candidates)).subquery("ids")


def _conditions(compiled: CompiledCue, query: Query, e: FromClause) -> list[Condition]:
    return [compiled.condition(e), *_after(query, e), *_placed(query, e)]


def _after(query: Query, e: FromClause) -> list[Condition]:
    if query.after is None:
        return []
    number = bindparam("after_id", type_=BigInteger)
    if query.order is Order.ID:
        return [e.c.id > number]
    here = tuple_(begin(e), e.c.id)
    there = tuple_(bindparam("after_begin", type_=_TIME), number)
    return [here > there if query.order is Order.BEGIN else here < there]


def _placed(query: Query, e: FromClause) -> list[Condition]:
    if not isinstance(query.order, Nearest):
        return []
    # The frame by name: a nearest order has no cue whose frame number would be at hand.
    name = bindparam("to_frame", type_=Text)
    numbers = select(frame.c.id).where(frame.c.name == name).scalar_subquery()
    return [e.c["frame_id" if query.order.place is Place.REGION else "subject_frame_id"] == numbers]


def _order(query: Query, e: FromClause) -> list[ColumnElement[Any]]:
    match query.order:
        case Order.BEGIN:
            return [begin(e), e.c.id]
        case Order.BEGIN_REVERSED:
            return [begin(e).desc(), e.c.id.desc()]
        case Order.ID:
            return [e.c.id]
        case Nearest(place=place):
            to = func.ST_GeomFromWKB(bindparam("to", type_=LargeBinary), type_=Geometry)
            return [e.c[place.value].op("<->")(to), e.c.id]


def _ordered(statement: Select[Any], query: Query, e: FromClause, *, after: bool = True) -> Select[Any]:
    ordered = statement.order_by(*_order(query, e))
    # What was walked is limited already; of the nearest there may be more, all as far as the last.
    limited = query.limit is not None and (after or isinstance(query.order, Nearest))
    return ordered.limit(bindparam("limit", type_=BigInteger)) if limited else ordered


# Sums over what matches


def count(compiled: CompiledCue) -> Select[Any]:
    """How many events match."""
    return select(func.count()).select_from(event).where(compiled.condition(event))


def any_match(compiled: CompiledCue) -> Select[Any]:
    """One row if any event matches."""
    return select(literal_column("1")).select_from(event).where(compiled.condition(event)).limit(literal_column("1"))


def groups(compiled: CompiledCue, by: Grouping | ByFeature) -> Select[Any]:
    """Key, count, microseconds together, first begin, last end and whether one is open, for each key."""
    match by:
        case Grouping.TYPE:
            key: ColumnElement[Any] = event.c.type_id
        case Grouping.AGENT:
            key = event.c.agent
        case Grouping.FRAME:
            key = event.c.frame_id
        case Grouping.DAY | Grouping.HOUR:
            key = func.date_trunc(literal_column(f"'{by.value}'"), begin(event))
        case ByFeature():
            return _sums(*_feature_values(), compiled)
    return _sums([key], event, compiled)


def _feature_values() -> tuple[list[ColumnElement[Any]], Any]:
    """Kind and text of an event's values of one feature, and the join that finds them; NULL where it has none."""
    pair = func.json_array_elements(event.c.features).table_valued(column("value"), name="pair").render_derived()
    named = pair.c.value.op("->>")(literal_column("0")) == bindparam("feature_name", type_=Text)
    found = lateral(select(pair.c.value.op("->")(literal_column("1")).label("value")).where(named), name="v")
    text = found.c.value.op("#>>")(literal_column("'{}'"))
    return [func.json_typeof(found.c.value), type_coerce(text, Text)], event.outerjoin(found, true())


def _sums(keys: list[ColumnElement[Any]], source: Any, compiled: CompiledCue) -> Select[Any]:
    lasted = extract("epoch", func.upper(event.c.period) - begin(event))
    micros = func.coalesce(func.sum(lasted * literal_column("1000000")), literal_column("0")).cast(BigInteger)
    return (
        select(
            *keys,
            func.count(),
            micros,
            func.min(begin(event)),
            func.max(func.upper(event.c.period)),
            func.bool_or(func.upper_inf(event.c.period), type_=Boolean),
        )
        .select_from(source)
        .where(compiled.condition(event))
        .group_by(*keys)
    )


# Neighbours in time


def join(anchors: CompiledCue, other: CompiledCue, wanted: Join, *, pinned: bool, near: Window) -> Select[Any]:
    """The ids of each anchor and of its neighbour, in the anchors' order."""
    a = event.alias("a")
    ids = find_ids(anchors, wanted.anchors, pinned=pinned, near=near).subquery("anchor")
    n = event.alias("n")
    conditions = [other.condition(n)]
    if wanted.relation is JoinRelation.BEFORE:
        # The second condition follows from the first; it lets the begin index end where the anchor begins.
        conditions += [func.upper(n.c.period) < begin(a), begin(n) < begin(a)]
        order: list[ColumnElement[Any]] = [begin(n).desc(), n.c.id.desc()]
    else:
        conditions.append(begin(n) > func.upper(a.c.period))
        order = [begin(n), n.c.id]
    if wanted.same_region:
        conditions += [n.c.frame_id == a.c.frame_id, func.ST_Intersects(n.c.region, a.c.region)]
    nearest = lateral(
        select(n.c.id).where(and_(*conditions)).order_by(*order).limit(literal_column("1")), name="nearest"
    )
    statement = select(a.c.id, nearest.c.id).select_from(ids.join(a, a.c.id == ids.c.id).outerjoin(nearest, true()))
    return statement.order_by(*_order(wanted.anchors, a))


def removed(conditions: list[CompiledCue]) -> Select[Any]:
    """How many events there are, then for each condition how many it keeps alone and with those before it."""
    built = [each.condition(event) for each in conditions]
    counts: list[ColumnElement[Any]] = [func.count()]
    for index, condition in enumerate(built):
        counts.append(func.count().filter(condition))
        counts.append(func.count().filter(and_(*built[: index + 1])))
    return select(*counts).select_from(event)


def conditions_of(cue: Cue) -> tuple[Cue, ...]:
    """The conditions that a cue asks for together."""
    return cue.args if isinstance(cue, And) else (cue,)


def by_ids() -> Select[Any]:
    """The events of a list of ids, in id order."""
    ids = bindparam("ids", type_=ARRAY(BigInteger))
    return select(*columns(event)).where(event.c.id == any_(ids)).order_by(event.c.id)


STATISTICS = """
SELECT (SELECT count(*) FROM event), (SELECT count(*) FROM event WHERE parts <> '{}'),
       (SELECT count(*) FROM event WHERE upper_inf(period)), (SELECT count(*) FROM part),
       (SELECT count(*) FROM event_type),
       (SELECT count(*) FROM frame f WHERE EXISTS (SELECT FROM event WHERE frame_id = f.id)
        OR EXISTS (SELECT FROM event WHERE subject_frame_id = f.id AND subject IS NOT NULL)),
       (SELECT count(DISTINCT agent) FROM event), (SELECT min(lower(period)) FROM event),
       (SELECT max(lower(period)) FROM event), (SELECT max(recorded_at) FROM event),
       (SELECT coalesce(sum(pg_total_relation_size(c.oid)), 0)::bigint FROM pg_class c
        JOIN pg_namespace n ON n.oid = c.relnamespace WHERE n.nspname = %(memory)s AND c.relkind = 'r')
"""
