"""In which order the rows of an answer come, by which columns, and what a row of it fulfils."""

from __future__ import annotations

from typing import Any

from geoalchemy2 import Geometry
from sqlalchemy import (
    BigInteger,
    ColumnElement,
    FromClause,
    LargeBinary,
    Select,
    Text,
    bindparam,
    func,
    literal_column,
    select,
    tuple_,
)

from elm.cues.relations import Place
from elm.query import Nearest, Order, Query
from elm.storage.conditions.rule import TIME, SqlCondition
from elm.storage.cue_compiler import CompiledCue
from elm.storage.tables import event, frame


def begin(e: FromClause) -> ColumnElement[Any]:
    """When an event began."""
    return func.lower(e.c.period)


def row(e: FromClause) -> ColumnElement[Any]:
    """Where a row stands: to read it again from there is one page, by its id three."""
    return literal_column(f"{e.name}.ctid")  # type: ignore[attr-defined]


def place(query: Query) -> list[ColumnElement[Any]]:
    """Where an event stands and, but for its id, by what it is sorted."""
    by = order(query)[0].label("distance") if isinstance(query.order, Nearest) else begin(event).label("begin")
    return [row(event).label("row"), by]


def keys(query: Query, found: FromClause) -> list[ColumnElement[Any]]:
    """The order of a query by the columns of what was found."""
    if isinstance(query.order, Nearest):
        return [found.c.distance, found.c.id]
    if query.order is Order.ID:
        return [found.c.id]
    if query.order is Order.BEGIN_REVERSED:
        return [found.c.begin.desc(), found.c.id.desc()]
    return [found.c.begin, found.c.id]


def conditions(compiled: CompiledCue, query: Query, e: FromClause) -> list[SqlCondition]:
    """What a row of an answer fulfils: the cue, to come after a cursor, to be in the frame of a distance."""
    return [compiled.condition(e), *coming_after(query, e), *_placed(query, e)]


def coming_after(query: Query, e: FromClause) -> list[SqlCondition]:
    """To come after the cursor of a query, if it has one."""
    if query.after is None:
        return []
    number = bindparam("after_id", type_=BigInteger)
    if query.order is Order.ID:
        return [e.c.id > number]
    here = tuple_(begin(e), e.c.id)
    there = tuple_(bindparam("after_begin", type_=TIME), number)
    return [here > there if query.order is Order.BEGIN else here < there]


def _placed(query: Query, e: FromClause) -> list[SqlCondition]:
    if not isinstance(query.order, Nearest):
        return []
    # The frame by name: a nearest order has no cue whose frame number would be at hand.
    name = bindparam("to_frame", type_=Text)
    numbers = select(frame.c.id).where(frame.c.name == name).scalar_subquery()
    return [e.c["frame_id" if query.order.place is Place.REGION else "subject_frame_id"] == numbers]


def order(query: Query, e: FromClause = event) -> list[ColumnElement[Any]]:
    """The order of a query by the columns of an event."""
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


def ordered(statement: Select[Any], query: Query) -> Select[Any]:
    """A statement on events in the order of a query, and with its limit."""
    sorted_rows = statement.order_by(*order(query))
    return sorted_rows if query.limit is None else sorted_rows.limit(bindparam("limit", type_=BigInteger))
