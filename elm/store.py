"""The port every store implements: what writing, recalling and typing need of a memory, and nothing of SQL."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Any, Protocol, Self
from uuid import UUID

from elm.cues.algebra import And, Cue, Place
from elm.errors import InvalidValue
from elm.event import Event, StoredEvent
from elm.geometry import Region
from elm.interval import as_utc, from_micros, to_micros
from elm.taxonomy import EventType
from elm.tombstone import Forgotten, RunTombstone, Tombstone

MOST_ID = 2**63 - 1
"""Greatest id of an event, and most events that can be asked for."""

# Reading


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Cursor:
    """Where a page ended: the begin and id of its last event, from which the next page goes on."""

    begin: datetime
    id: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "begin", as_utc(self.begin, what="the begin of a cursor"))
        if not 0 <= self.id <= MOST_ID:
            raise InvalidValue(f"the id of a cursor is a number from 0 to {MOST_ID}, not {self.id!r}")

    @classmethod
    def after(cls, event: StoredEvent) -> Self:
        """The cursor of a page that ends with `event`."""
        return cls(begin=event.interval.begin, id=event.id)

    def __str__(self) -> str:
        return f"{to_micros(self.begin)}.{self.id}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """The cursor that `str` wrote."""
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
        if self.limit is not None and (isinstance(self.limit, bool) or not 0 <= self.limit <= MOST_ID):
            raise InvalidValue(f"a limit is a number of events, 0 to {MOST_ID}, not {self.limit!r}")
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


# Writing


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """An event on its way into a memory, and when the memory learns of it (None: now)."""

    event: Event
    recorded_at: datetime | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Committed:
    """The id and uid of a committed event, and whether it is new or was there already with the same content."""

    id: int
    uid: UUID
    new: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """What closing an event changed: whether it was open, and the wholes that thereby closed, parts first."""

    new: bool
    wholes: tuple[UUID, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Refusal:
    """Why the arrival at `index` of a batch was not stored."""

    index: int
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchReport:
    """What became of a batch: how many events are new, how many were there already, and which were refused."""

    new: int
    existing: int
    refused: tuple[Refusal, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class TypesAdded:
    """How many types, is-a links and closure rows a call added."""

    types: int
    links: int
    closure: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistics:
    """What a memory holds, in numbers; `bytes` is None where the store has no size.

    `forgotten` is how many events it has forgotten, `tombstones` how many of these still count as parts.
    """

    events: int
    complex_events: int
    open_events: int
    links: int
    types: int
    frames: int
    agents: int
    first_begin: datetime | None
    last_begin: datetime | None
    last_recorded_at: datetime | None
    bytes: int | None
    forgotten: int = 0
    tombstones: int = 0


class EventSink(Protocol):
    """Where events go: all that an event source needs to know of a memory."""

    def commit(self, event: Event) -> Committed:
        """Keep one event."""


class Store(Protocol):
    """One memory (Def 5). Every call is a transaction of its own: it happens whole or not at all."""

    memory: str

    def add_types(self, types: Sequence[EventType]) -> TypesAdded:
        """Add types and parents, in any order; cycles and unknown parents refuse the whole call."""

    def types(self) -> Iterator[EventType]:
        """All types, parents first."""

    def commit(self, arrival: Arrival) -> Committed:
        """Keep one event whose parts are all in the memory."""

    def commit_all(self, arrivals: Sequence[Arrival]) -> list[Committed]:
        """Keep all or none; events may be parts of each other in any order, and are numbered parts first."""

    def load(self, arrivals: Sequence[Arrival]) -> BatchReport:
        """Keep what can be kept of a batch whose parts come before their wholes or are in the memory."""

    def finish_load(self) -> None:
        """Bring the store's statistics up to date after a load."""

    def close_event(self, uid: UUID, end: datetime) -> Closed:
        """End an open event and recompute the extents of all its wholes; the same end again changes nothing."""

    def forget(self, ids: Sequence[int], *, run: UUID, at: datetime) -> Forgotten:
        """Forget those of these events that have ended, in one transaction, as a piece of the forgetting `run`.

        `at` is when that began. Unknown ids are passed over.
        """

    def would_forget(self, ids: Sequence[int]) -> Forgotten:
        """What forgetting these events would do; nothing is changed."""

    def tombstones(self, uids: Sequence[UUID] | None = None) -> Iterator[Tombstone]:
        """The tombstones of single events, by id; with `uids` those of these."""

    def run_tombstones(self) -> Iterator[RunTombstone]:
        """What is left of the rest of each forgetting, oldest first."""

    def keep_tombstones(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory; of an event that this one has, nothing is kept."""

    def find(self, query: Query) -> Iterator[StoredEvent]:
        """The events a query asks for, streamed from one consistent view."""

    def ids(self, query: Query) -> Iterator[int]:
        """Their ids alone."""

    def count(self, cue: Cue) -> int:
        """How many events match."""

    def exists(self, cue: Cue) -> bool:
        """Whether any event matches."""

    def groups(self, cue: Cue, by: Grouping | ByFeature) -> list[Group]:
        """The matching events by key, keys in ascending order, None last."""

    def join(self, join: Join) -> Iterator[tuple[StoredEvent, StoredEvent | None]]:
        """Each anchor, in order, with the neighbour found for it."""

    def get(self, ids: Sequence[int]) -> list[StoredEvent]:
        """The events with these ids, in id order; unknown ids are left out."""

    def explain(self, query: Query) -> Explanation:
        """How the query is answered; it is run for that."""

    def arrow(self, query: Query) -> Any:
        """The events as a pyarrow.RecordBatchReader in the schema of `elm.columns`."""

    def statistics(self) -> Statistics:
        """What the memory holds, in numbers."""

    def close(self) -> None:
        """Let go of connections; further calls are refused."""
