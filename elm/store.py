"""The port every store implements: what writing, recalling and typing need of a memory, and nothing of SQL."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol
from uuid import UUID

from elm.cues.algebra import Cue
from elm.event import Event, StoredEvent
from elm.query import ByFeature, Explanation, Group, Grouping, Join, Query
from elm.taxonomy import EventType
from elm.tombstone import Forgotten, RunTombstone, Tombstone


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


@dataclass(frozen=True, slots=True, kw_only=True)
class ForgettingCount:
    """How many forgetting runs a memory has seen, and how many events it forgot in them without a tombstone of each.

    Every new run changes it, and every event that goes without leaving a tombstone.
    """

    runs: int
    events: int


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

    def forgetting_count(self) -> ForgettingCount:
        """How often this memory has forgotten, and how much; cheap enough to ask again and again."""

    def keep_tombstones(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory; of an event that this one has, nothing is kept."""

    def find(self, query: Query) -> Iterator[StoredEvent]:
        """The events a query asks for, streamed from one consistent view."""

    def with_parts(self, query: Query) -> Iterator[StoredEvent | Tombstone]:
        """The events a query asks for and all they are made of, by id, after the tombstones of forgotten parts.

        All are as of one moment, whatever is written or forgotten while they are read: each part comes before its
        wholes, as an event or as a tombstone.
        """

    def everything(self) -> Iterator[StoredEvent | Tombstone | RunTombstone]:
        """All that the memory holds, as of one moment: tombstones of forgettings, those of events, events by id."""

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
