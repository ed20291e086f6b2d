"""The statements that recall: for each shape of question one SQL text, compiled once and kept."""

from __future__ import annotations

from collections.abc import Callable
from threading import Lock
from typing import Any

from sqlalchemy import (
    ARRAY,
    BigInteger,
    Boolean,
    ColumnElement,
    FromClause,
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
    type_coerce,
)
from sqlalchemy.dialects.postgresql import psycopg

from elm.interval import Window
from elm.query import ByFeature, Grouping, Join, JoinRelation, Nearest, Query
from elm.storage.cue_compiler import CompiledCue
from elm.storage.row_order import begin, conditions, keys, order, ordered, row
from elm.storage.row_search import GLANCE_FACTOR, HANDFUL, WALK_FACTOR, WALK_FEWEST, found_rows, walks
from elm.storage.row_search import WALK_MOST as WALK_MOST
from elm.storage.rows import Column
from elm.storage.tables import event, part

DIALECT = psycopg.dialect()  # type: ignore[no-untyped-call]


class StatementCache:
    """SQL texts by shape: building one costs a hundred times what finding it does.

    Shapes have no end, for cues combine at will: beyond `MOST` texts the oldest goes, and is built anew if asked for.
    """

    MOST = 1_000

    def __init__(self) -> None:
        self._texts: dict[Any, str] = {}
        self._lock = Lock()

    def text(self, key: Any, build: Callable[[], Select[Any]]) -> str:
        """The SQL text of the statement that `key` stands for."""
        known = self._texts.get(key)
        if known is not None:
            return known
        with self._lock:
            # Another thread may have built it while this one waited.
            known = self._texts.get(key)
            if known is None:
                known = str(build().compile(dialect=DIALECT))
                if len(self._texts) >= self.MOST:
                    del self._texts[next(iter(self._texts))]
                self._texts[key] = known
        return known


def columns(e: FromClause) -> list[ColumnElement[Any]]:
    """What the decoders of `rows` read, where `Column` says."""
    links = part.alias("up")
    wholes = select(links.c.whole_uid).where(links.c.part_id == e.c.id).order_by(links.c.whole_id)
    values: dict[Column, ColumnElement[Any]] = {
        Column.ID: e.c.id,
        Column.UID: e.c.uid,
        Column.TYPE_ID: e.c.type_id,
        Column.PERIOD: e.c.period,
        Column.FRAME_ID: e.c.frame_id,
        # As it is stored: the geometry type would put a conversion around it.
        Column.REGION: type_coerce(e.c.region, LargeBinary),
        Column.SUBJECT_FRAME_ID: e.c.subject_frame_id,
        Column.SUBJECT: type_coerce(e.c.subject, LargeBinary),
        Column.FEATURES: e.c.features,
        Column.AGENT: e.c.agent,
        Column.MEDIA_TYPE: e.c.media_type,
        Column.PAYLOAD: e.c.payload,
        Column.PARTS: e.c.parts,
        Column.WHOLES: func.array(wholes.scalar_subquery()).label("wholes"),
        Column.RECORDED_AT: e.c.recorded_at,
    }
    return [values[each] for each in Column]


def only_id(e: FromClause) -> list[ColumnElement[Any]]:
    """The id alone."""
    return [e.c.id]


# Which events, in which order


def find(compiled: CompiledCue, query: Query, *, pinned: bool, near: Window, looked: bool = False) -> Select[Any]:
    """The rows a query asks for, in order; `looked` where a first look did not answer it."""
    found = found_rows(compiled, query, pinned=pinned, near=near, looked=looked)
    if found is None:
        return ordered(select(*columns(event)).where(*conditions(compiled, query, event)), query)
    # OFFSET 0 keeps the planner from joining in another way: what it takes for the cost of `found` may be far off.
    there = lateral(select(event).where(row(event) == found.c.row).offset(literal_column("0")), name="there")
    return select(*columns(there)).select_from(found.join(there, true())).order_by(*keys(query, found))


def find_ids(compiled: CompiledCue, query: Query, *, pinned: bool, near: Window, looked: bool = False) -> Select[Any]:
    """Their ids alone, in order."""
    found = found_rows(compiled, query, pinned=pinned, near=near, looked=looked)
    if found is None:
        return ordered(select(event.c.id).where(*conditions(compiled, query, event)), query)
    return select(found.c.id).order_by(*keys(query, found))


def shape(query: Query, *, pinned: bool, near: Window) -> tuple[Any, ...]:
    """What the SQL of a query depends on beside its cue."""
    by = ("nearest", query.order.place) if isinstance(query.order, Nearest) else query.order
    bounds = (near.begin is None, near.end is None) if walks(query, pinned=pinned) else None
    return by, query.limit is not None, query.after is not None, bounds


def parameters(query: Query, *, near: Window) -> dict[str, Any]:
    """The values of a query's own parameters."""
    given: dict[str, Any] = {}
    if query.limit is not None:
        given["limit"] = query.limit
        given["glance"] = query.limit * GLANCE_FACTOR
        given["handful"] = max(query.limit, HANDFUL)
        given["walk"] = min(max(query.limit * WALK_FACTOR, WALK_FEWEST), WALK_MOST)
        given["near_begin"], given["near_end"] = near.begin, near.end
    if query.after is not None:
        given["after_begin"], given["after_id"] = query.after.begin, query.after.id
    if isinstance(query.order, Nearest):
        given["to"], given["to_frame"] = query.order.to.wkb, query.order.to.frame
    return given


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
    # A numeric: a few events that lasted for ages are together more microseconds than a bigint holds.
    micros = func.coalesce(func.sum(lasted * literal_column("1000000")), literal_column("0"))
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
    fulfilled = [other.condition(n)]
    if wanted.relation is JoinRelation.BEFORE:
        # The second condition follows from the first; it lets the begin index end where the anchor begins.
        fulfilled += [func.upper(n.c.period) < begin(a), begin(n) < begin(a)]
        next_first: list[ColumnElement[Any]] = [begin(n).desc(), n.c.id.desc()]
    else:
        fulfilled.append(begin(n) > func.upper(a.c.period))
        next_first = [begin(n), n.c.id]
    if wanted.same_region:
        fulfilled += [n.c.frame_id == a.c.frame_id, func.ST_Intersects(n.c.region, a.c.region)]
    nearest = lateral(
        select(n.c.id).where(and_(*fulfilled)).order_by(*next_first).limit(literal_column("1")), name="nearest"
    )
    statement = select(a.c.id, nearest.c.id).select_from(ids.join(a, a.c.id == ids.c.id).outerjoin(nearest, true()))
    return statement.order_by(*order(wanted.anchors, a))


def removed(conditions: list[CompiledCue]) -> Select[Any]:
    """How many events there are, then for each condition how many it keeps alone and with those before it."""
    built = [each.condition(event) for each in conditions]
    counts: list[ColumnElement[Any]] = [func.count()]
    for index, condition in enumerate(built):
        counts.append(func.count().filter(condition))
        counts.append(func.count().filter(and_(*built[: index + 1])))
    return select(*counts).select_from(event)


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
        JOIN pg_namespace n ON n.oid = c.relnamespace WHERE n.nspname = %(memory)s AND c.relkind = 'r'),
       (SELECT coalesce(sum(events), 0)::bigint FROM forgetting) + (SELECT count(*) FROM tombstone),
       (SELECT count(*) FROM tombstone)
"""
