"""What can be asked of a memory: queries, pages, groups and neighbours in time, and what explains an answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any, Self

from elm.arguments import as_count
from elm.cues.algebra import And, Cue, is_cue
from elm.cues.relations import Place, named
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.geometry import Region
from elm.interval import as_utc, from_micros, to_micros
from elm.text import check_name

MOST_ID = 2**63 - 1
"""Greatest id of an event, and most events that can be asked for."""


class Order(StrEnum):
    """In which order results come: by (begin, id), by that reversed, or by id, which is parts before wholes."""

    BEGIN = "begin"
    BEGIN_REVERSED = "-begin"
    ID = "id"


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearest:
    """Order by distance in metres from `to`, then id; events without that place in that frame are left out."""

    to: Region
    place: Place = Place.REGION

    def __post_init__(self) -> None:
        if not isinstance(self.to, Region):
            raise InvalidValue(f"the nearest are those to a Region(polygon=...), not to {self.to!r:.80}")
        object.__setattr__(self, "place", named(self.place, Place, what="the place that is near"))


def as_order(given: object) -> Order | Nearest:
    """The order that `given` is or names."""
    if isinstance(given, Nearest):
        return given
    return named(given, Order, what="the order of a recall", also=", or elm.Nearest(to=...) for the nearest first")


@dataclass(frozen=True, slots=True, kw_only=True)
class Cursor:
    """Where a page ended: the begin and id of its last event, from which the next page goes on."""

    begin: datetime
    id: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "begin", as_utc(self.begin, what="the begin of a cursor"))
        object.__setattr__(self, "id", as_count(self.id, what="the id of a cursor", least=0, most=MOST_ID))

    @classmethod
    def after(cls, event: StoredEvent) -> Self:
        """The cursor of a page that ends with `event`."""
        if not isinstance(event, StoredEvent):
            raise InvalidValue(f"a cursor is that of a StoredEvent, not of {event!r:.80}")
        return cls(begin=event.interval.begin, id=event.id)

    def __str__(self) -> str:
        return f"{to_micros(self.begin)}.{self.id}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """The cursor that `str` wrote."""
        if not isinstance(text, str):
            raise InvalidValue(f"a cursor is read from text, not from {text!r:.80}")
        try:
            micros, number = map(int, text.split("."))
            return cls(begin=from_micros(micros), id=number)
        except (ValueError, OverflowError) as error:
            raise InvalidValue(f"not a cursor: {text!r}. Use the one a page of results ended with") from error


@dataclass(frozen=True, slots=True, kw_only=True)
class Query:
    """A cue, and which of its events in which order: the first `limit`, beginning after a cursor."""

    cue: Cue = field(default_factory=And)
    order: Order | Nearest = Order.BEGIN
    limit: int | None = None
    after: Cursor | None = None

    def __post_init__(self) -> None:
        _check_cue(self.cue, what="a recall goes by")
        object.__setattr__(self, "order", as_order(self.order))
        if self.limit is not None:
            object.__setattr__(self, "limit", as_count(self.limit, what="the limit of a recall", least=0, most=MOST_ID))
        if self.after is not None and not isinstance(self.after, Cursor):
            raise InvalidValue(
                f"what a page goes on after is the Cursor that the last one ended with, not {self.after!r:.80}: "
                f"of a cursor as text make Cursor.parse(text)"
            )
        if self.after is not None and isinstance(self.order, Nearest):
            raise InvalidValue("paging goes by begin or id; the nearest events are asked for with a limit")


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """Some events in order, and the cursor at which the next page begins; None after the last."""

    events: tuple[StoredEvent, ...]
    cursor: Cursor | None


class Grouping(StrEnum):
    """What events are grouped by, when it is not the values of a feature."""

    TYPE = "type"
    AGENT = "agent"
    FRAME = "frame"
    DAY = "day"
    HOUR = "hour"


@dataclass(frozen=True, slots=True, kw_only=True)
class ByFeature:
    """Group by the values of one feature; an event with several of them counts in each, without any in None."""

    name: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", check_name(self.name, what="the feature to group by"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """How many events share a key, how long they lasted together (open ones aside), the first begin, the last end.

    `last_end` is None when one of them is still going on.
    """

    key: Any
    count: int
    duration: timedelta
    first_begin: datetime
    last_end: datetime | None


class JoinRelation(StrEnum):
    """Which neighbour in time a temporal join looks for: the last one before, or the first one after."""

    BEFORE = "before"
    AFTER = "after"


@dataclass(frozen=True, slots=True, kw_only=True)
class Join:
    """For each event of `anchors`, the nearest event matching `cue` that lies before (or after) it, strictly.

    The last one before is the greatest by (begin, id) of those that end before the anchor begins; the
    first one after the smallest of those that begin after it ends. With `same_region` only events
    whose region intersects the anchor's, in one frame, count.
    """

    anchors: Query
    relation: JoinRelation
    cue: Cue
    same_region: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.anchors, Query):
            raise InvalidValue(f"the anchors of a join are those of a Query, not {self.anchors!r:.80}")
        object.__setattr__(self, "relation", named(self.relation, JoinRelation, what="the relation of a join"))
        _check_cue(self.cue, what="the neighbours in time are found by")
        if not isinstance(self.same_region, bool):
            raise InvalidValue(f"same_region is True or False, not {self.same_region!r:.80}")


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionRows:
    """How many events of the memory one condition keeps by itself, and together with those before it."""

    condition: str
    alone: int
    left: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """How a store answers a query: its statement and parameters, its plan as run, and what each condition removes.

    `events` is how many the whole memory holds.
    """

    sql: str
    parameters: dict[str, Any]
    plan: str
    events: int
    conditions: tuple[ConditionRows, ...]


def _check_cue(given: object, *, what: str) -> None:
    if not is_cue(given):
        raise InvalidValue(f"{what} a cue (elm.cues), not by {given!r:.80}")
