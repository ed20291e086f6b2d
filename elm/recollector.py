"""Recalling by cue: what matches, streamed, paged, counted, grouped, joined in time, or as a table."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal
from uuid import UUID

from elm.arguments import as_count, as_uid_or_id
from elm.cues.algebra import And, Cue, UidCue
from elm.cues.relations import named
from elm.errors import InvalidValue, MissingPackage, UnknownEvent
from elm.event import StoredEvent
from elm.query import (
    MOST_ID,
    ByFeature,
    Cursor,
    Explanation,
    Group,
    Grouping,
    Join,
    JoinRelation,
    Nearest,
    Order,
    Page,
    Query,
    as_order,
)
from elm.store import Store

OrderName = Order | Nearest | Literal["begin", "-begin", "id"]
GroupingName = Grouping | ByFeature | Literal["type", "agent", "frame", "day", "hour"]

PAGE = 100
"""Events on a page unless asked otherwise."""


@dataclass(frozen=True, slots=True)
class Recollection:
    """The events a query asks for (Def 15): nothing is read before you iterate, count, or ask for a table."""

    store: Store
    query: Query

    def __iter__(self) -> Iterator[StoredEvent]:
        """The events in order, streamed from one consistent view of the memory."""
        return self.store.find(self.query)

    def first(self) -> StoredEvent | None:
        """The first event in order, or None."""
        return next(self.store.find(replace(self.query, limit=_least(1, self.query.limit))), None)

    def last(self) -> StoredEvent | None:
        """The last event in order `begin` or `-begin`, or None."""
        turned = {Order.BEGIN: Order.BEGIN_REVERSED, Order.BEGIN_REVERSED: Order.BEGIN}
        if self.query.order not in turned or self.query.limit is not None or self.query.after is not None:
            raise InvalidValue("last() goes by begin, without limit: use list(...)[-1] for other orders")
        return next(self.store.find(Query(cue=self.query.cue, order=turned[self.query.order], limit=1)), None)

    def count(self) -> int:
        """How many events there are; a limit counts."""
        if self.query.after is not None or isinstance(self.query.order, Nearest):
            return sum(1 for _ in self.ids())
        found = self.store.count(self.query.cue)
        return found if self.query.limit is None else min(found, self.query.limit)

    def exists(self) -> bool:
        """Whether there is any."""
        if self.query.after is not None or isinstance(self.query.order, Nearest) or self.query.limit == 0:
            return self.first() is not None
        return self.store.exists(self.query.cue)

    def __bool__(self) -> bool:
        """Whether there is any event, as `exists()` finds out; how many there are says `count()`."""
        return self.exists()

    def ids(self) -> Iterator[int]:
        """The ids in order, without the events."""
        return self.store.ids(self.query)

    def page(self, size: int = PAGE, *, after: Cursor | None = None) -> Page:
        """`size` events after a cursor, and the cursor of the next page.

        Keyset paging by (begin, id): events that are committed meanwhile neither repeat nor hide others.
        """
        if isinstance(self.query.order, Nearest) or self.query.limit is not None:
            raise InvalidValue("a page is one of a recollection by begin or id, without limit")
        size = as_count(size, what="the size of a page", least=1, most=MOST_ID - 1)
        behind = self.query.after if after is None else after
        found = list(self.store.find(replace(self.query, limit=size + 1, after=behind)))
        events = tuple(found[:size])
        return Page(events=events, cursor=Cursor.after(events[-1]) if len(found) > size else None)

    def groups(self, by: GroupingName) -> list[Group]:
        """Count, total duration, first begin and last end by type, agent, frame, UTC day or hour, or feature."""
        if self.query.limit is not None or self.query.after is not None or isinstance(self.query.order, Nearest):
            raise InvalidValue("groups are of all events that match: leave limit, cursor and nearest out")
        also = ", or elm.ByFeature(name=...) for the values of a feature"
        key = by if isinstance(by, ByFeature) else named(by, Grouping, what="what to group by", also=also)
        return self.store.groups(self.query.cue, key)

    def latest_before(self, cue: Cue, *, same_region: bool = False) -> Iterator[tuple[StoredEvent, StoredEvent | None]]:
        """Each event with the last one matching `cue` that ended before it began; None where there is none.

        With `same_region` only those count whose region intersects the event's.
        """
        join = Join(anchors=self.query, relation=JoinRelation.BEFORE, cue=cue, same_region=same_region)
        return self.store.join(join)

    def first_after(self, cue: Cue, *, same_region: bool = False) -> Iterator[tuple[StoredEvent, StoredEvent | None]]:
        """Each event with the first one matching `cue` that began after it ended; None where there is none."""
        join = Join(anchors=self.query, relation=JoinRelation.AFTER, cue=cue, same_region=same_region)
        return self.store.join(join)

    def explain(self) -> Explanation:
        """The statement, its plan as run, and how many events each condition removes."""
        return self.store.explain(self.query)

    def to_arrow(self) -> Any:
        """The events as a pyarrow.RecordBatchReader (it has `__arrow_c_stream__`); needs elm-memory[arrow].

        Places are GeoArrow WKB columns; the columns are listed in docs/formats.md.
        """
        return self.store.arrow(self.query)

    def to_geopandas(self) -> Any:
        """The events as a geopandas.GeoDataFrame with `region` as its geometry; needs elm-memory[geo]."""
        try:
            import geopandas
        except ImportError as error:
            raise MissingPackage("to_geopandas needs the package geopandas: pip install 'elm-memory[geo]'") from error
        from elm.columns import without_extensions

        table = without_extensions(self.to_arrow().read_all())
        frame = table.to_pandas(integer_object_nulls=True)
        for name in ("region", "subject"):
            frame[name] = geopandas.GeoSeries.from_wkb(frame[name])
        return geopandas.GeoDataFrame(frame, geometry="region")


class Recollector:
    """Recalls from one memory by cues (the paper's Recollector)."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def recall(
        self,
        cue: Cue | None = None,
        *,
        order: OrderName = Order.BEGIN,
        limit: int | None = None,
        after: Cursor | None = None,
    ) -> Recollection:
        """The events that match `cue` (all without one), by (begin, id) unless another order is asked for."""
        query = Query(cue=And() if cue is None else cue, order=as_order(order), limit=limit, after=after)
        return Recollection(self._store, query)

    def get(self, name: UUID | str | int) -> StoredEvent:
        """The event with this uid, which may be given as text, or this id."""
        wanted = as_uid_or_id(name, what="the event to get")
        if isinstance(wanted, UUID):
            found = next(self._store.find(Query(cue=UidCue(uids=(wanted,)), limit=1)), None)
        else:
            found = next(iter(self._store.get([wanted])), None)
        if found is None:
            raise UnknownEvent(f"no event {name} in memory {self._store.memory!r}")
        return found


def _least(count: int, limit: int | None) -> int:
    return count if limit is None else min(count, limit)
