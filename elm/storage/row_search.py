"""Where the rows of an answer stand: found first, in order, where reading them as they are found would cost more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from sqlalchemy import (
    BigInteger,
    ColumnElement,
    Double,
    FromClause,
    Integer,
    Select,
    and_,
    bindparam,
    case,
    extract,
    func,
    lateral,
    literal_column,
    select,
    true,
    union_all,
)

from elm.cues.algebra import And
from elm.interval import Window
from elm.query import Nearest, Order, Query
from elm.storage.conditions.rule import TIME, Bind, SqlCondition
from elm.storage.cue_compiler import CompiledCue
from elm.storage.hints import is_guess, is_in_order
from elm.storage.row_order import begin, coming_after, conditions, keys, order, place, row
from elm.storage.tables import event

WALK_FEWEST, WALK_MOST, WALK_FACTOR = 500, 2_000, 20
"""How far the begin index is walked for a limited answer before the candidates are collected instead."""
GLANCE_FACTOR = 2
"""How many rows for each one wanted are looked at first: a cue that most events match needs no more."""
HANDFUL = 50
"""Up to so many candidates, or as many as are wanted, are sorted at once; of more the begin index tells the first."""


def found_rows(compiled: CompiledCue, query: Query, *, pinned: bool, near: Window, looked: bool = False) -> Any:
    """Where the rows of an answer stand, in order, if it pays to find that first; None where one plain scan does.

    With `looked` it is known that neither a few match nor most (`elm.storage.first_look`).
    """
    if walks(query, pinned=pinned):
        return _first(compiled, query, near, looked=looked)
    if isinstance(query.order, Nearest):
        # Of a cue that few match the index by distance would be walked to its end: then candidates are collected.
        return _nearest(compiled, query) if query.limit is not None and query.cue == And() else None
    if query.limit is None and query.order is not Order.ID and compiled.search is None and is_guess(query.cue):
        return _scanned(compiled, query)
    return None


def _nearest(compiled: CompiledCue, query: Query) -> Any:
    """The nearest events, and all that are as far as the last: by distance alone, for so the index has them.

    Where they stand is asked afterwards by their ids: of rows that an index scan by distance had to put
    right in order, PostgreSQL gives the ctid of another row.
    """
    distance, _ = order(query)
    limit = bindparam("limit", type_=BigInteger)
    standing_at = select(distance.label("distance"), event.c.id).where(*conditions(compiled, query, event))
    ties = standing_at.order_by(distance).fetch(limit, with_ties=True)
    near = ties.subquery("ties")
    first = select(near).order_by(*keys(query, near)).limit(limit).subquery("first")
    standing = event.alias("standing")
    where = select(row(standing)).where(standing.c.id == first.c.id).scalar_subquery()
    return select(where.label("row"), first).subquery("nearest")


def _scanned(compiled: CompiledCue, query: Query) -> Any:
    """All rows of an answer that no index finds: the table is read from end to end, and little of it is sorted.

    Left alone the planner reads the table along the begin index to save the sort: two and a half times its pages.
    """
    found = _collected(compiled, query, []).cte("found").prefix_with("MATERIALIZED")
    return select(found).order_by(*keys(query, found)).offset(literal_column("0")).subquery("sorted")


def walks(query: Query, *, pinned: bool) -> bool:
    """Whether the first rows may be found by walking the begin index: an answer that can only be small is sorted.

    And one that an index has in order already is read from there.
    """
    if query.limit is None or pinned or query.limit >= WALK_MOST:
        return False
    if is_in_order(query.cue) and query.order is not Order.ID:
        return False
    return not isinstance(query.order, Nearest)


def _first(compiled: CompiledCue, query: Query, near: Window, *, looked: bool) -> Any:
    """Where the rows of a limited answer are, at a cost bounded by its hits, however the cue correlates with time.

    The planner takes a cue's hits to be spread evenly over time; where they are not, it walks the begin
    index to its far end (377 ms where 6 would do). So, each step only where those before it did not do:
    glance at the next rows; search for a handful by an index; walk a bounded number of rows; search by an index
    as far as it takes by what the walk found; collect all candidates and sort them (docs/adr/0009).
    """
    limit = bindparam("limit", type_=BigInteger)
    steps: list[Select[Any]] = []
    unsolved: list[SqlCondition] = []
    if compiled.search is not None and not looked:
        glance = walked(compiled, query, near, "glance", [])
        short = counted(glance) < limit
        most = bindparam("handful", type_=BigInteger)
        handful = _searched(compiled, compiled.search, query, short, most)
        too_many = counted(handful) > most
        all_of_them = select(handful.c.row, handful.c.begin, handful.c.id).where(~too_many)
        if not compiled.is_search:
            all_of_them = all_of_them.where(compiled.condition(handful))
        steps += [select(glance).where(~short), all_of_them]
        unsolved.append(too_many)
    walk = walked(compiled, query, near, "walk", unsolved)
    filled = counted(walk) >= limit
    steps.append(select(walk).where(filled))
    unsolved.append(~filled)
    if compiled.search is not None and query.order is not Order.ID:
        stretch = _stretch(compiled, query, walk, limit, unsolved)
        filled = counted(stretch) >= limit
        steps.append(select(stretch).where(filled))
        unsolved.append(~filled)
    last = _collected if compiled.outline is None else _judged_in_order
    steps.append(last(compiled, query, unsolved))
    found = union_all(*steps).subquery("found")
    return select(found).order_by(*keys(query, found)).limit(limit).subquery("ids")


def walked(compiled: CompiledCue, query: Query, near: Window, name: str, when: Sequence[SqlCondition]) -> Any:
    """What matches among the next rows in order, of which parameter `name` says how many, up to the limit."""
    bounds: list[SqlCondition] = []
    # Only where the walk goes along the begins do these bound it.
    along_begin = query.order is not Order.ID
    if along_begin and near.begin is not None:
        bounds.append(begin(event) >= bindparam("near_begin", type_=TIME))
    if along_begin and near.end is not None:
        bounds.append(begin(event) <= bindparam("near_end", type_=TIME))
    # The begin as a column: by it the planner knows that the rows are in order, and stops at the limit.
    rows = select(event, *place(query)).where(*bounds, *coming_after(query, event)).order_by(*order(query))
    rows_near = rows.limit(bindparam(name, type_=Integer)).subquery("near")
    matching = select(rows_near.c.row, rows_near.c.begin, rows_near.c.id)
    glimpse = [] if compiled.glimpse is None else [compiled.glimpse(rows_near)]
    ordered = matching.where(*when, *glimpse, compiled.condition(rows_near)).order_by(*keys(query, rows_near))
    return ordered.limit(bindparam("limit", type_=BigInteger)).cte(name).prefix_with("MATERIALIZED")


def _stretch(compiled: CompiledCue, query: Query, walk: Any, limit: Bind, when: list[SqlCondition]) -> Any:
    """All that match within the time in which enough should, if they go on as densely as on the walk.

    Types have an index that knows begins too: a type below many others costs a probe there, and not all it ever
    had. Of other cues the planner intersects what two indexes find, before it reads a row: worth it unless the
    stretch has many times as many events as match in all.
    """
    number: ColumnElement[int] = func.count()
    factor: ColumnElement[Any] = literal_column(_STRETCH_FACTOR)
    first, last = func.min(walk.c.begin), func.max(walk.c.begin)
    lasts = extract("epoch", last - first) / (number - literal_column("1")) * limit * factor
    # Bounded, for a time beyond the calendar would be an error.
    bounds: tuple[ColumnElement[Any], ColumnElement[Any]] = (
        (first, func.to_timestamp(func.least(extract("epoch", first) + lasts, literal_column("1e11"))))
        if query.order is Order.BEGIN
        else (func.to_timestamp(func.greatest(extract("epoch", last) - lasts, literal_column("-1e11"))), last)
    )
    enough = number >= literal_column(_STRETCH_FEWEST)
    least, most = (select(case((enough, bound))).select_from(walk).scalar_subquery() for bound in bounds)
    between = [begin(event) >= least, begin(event) <= most]
    if compiled.narrow is not None:
        worth, search = enough, [compiled.narrow(event)]
    else:
        looked_at = bindparam("walk", type_=Integer)
        share = looked_at * looked_at * limit * literal_column(_STRETCH_SHARE)
        worth, search = and_(enough, number * number * _events() > share), []
    when = [*when, select(worth).select_from(walk).scalar_subquery()]
    return _collected(compiled, query, [*when, *search, *between]).cte("stretch").prefix_with("MATERIALIZED")


_STRETCH_FEWEST, _STRETCH_FACTOR = "5", "1.5"
"""How many events the walk must have found to tell how dense they are, and what is added for chance."""
_STRETCH_SHARE = "0.05"
"""What it takes to find an event of the stretch in the index, of what it takes to read one that matches."""


def _events() -> ColumnElement[Any]:
    """About how many events there are, as far as the server knows without counting."""
    return literal_column("(SELECT reltuples FROM pg_class WHERE oid = 'event'::regclass)", type_=Double)


def _searched(
    compiled: CompiledCue, search: Callable[[FromClause], SqlCondition], query: Query, when: SqlCondition, most: Bind
) -> Any:
    """What an index finds for the cue, in no order, and one more than `most` if there are more."""
    wanted = [event.c.id] if compiled.is_search else [event]
    found = select(*wanted, *place(query)).where(when, search(event), *coming_after(query, event))
    return found.limit(most + literal_column("1")).cte("handful").prefix_with("MATERIALIZED")


def _collected(compiled: CompiledCue, query: Query, when: list[SqlCondition]) -> Select[Any]:
    return select(*place(query), event.c.id).where(*when, *conditions(compiled, query, event))


def _judged_in_order(compiled: CompiledCue, query: Query, when: list[SqlCondition]) -> Select[Any]:
    """The first that match of what their boxes let through: no more polygons are judged than it takes."""
    assert compiled.outline is not None  # noqa: S101 - the caller has looked
    boxes = select(*place(query), event.c.id).where(*when, compiled.outline(event), *coming_after(query, event))
    candidates = boxes.cte("candidates").prefix_with("MATERIALIZED")
    ordered, there = judged(query, candidates, lambda _: [compiled.condition(event)])
    found = select(ordered).select_from(ordered.join(there, true())).order_by(*keys(query, ordered))
    return select(found.limit(bindparam("limit", type_=BigInteger)).subquery("judged"))


def judged(
    query: Query, candidates: FromClause, fulfilled: Callable[[FromClause], list[SqlCondition]]
) -> tuple[FromClause, Any]:
    """Candidates in order and, laterally, the event of each that fulfils this: read as far as somebody reads."""
    ordered = select(candidates).order_by(*keys(query, candidates)).offset(literal_column("0")).subquery("ordered")
    standing = select(event).where(row(event) == ordered.c.row, *fulfilled(ordered))
    return ordered, lateral(standing.offset(literal_column("0")), name="there")


def counted(found: FromClause) -> ColumnElement[Any]:
    """How many rows were found."""
    return select(func.count()).select_from(found).scalar_subquery()
