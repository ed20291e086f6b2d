"""Settings and wiring: from a DSN to a memory that can be written to and recalled from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from datetime import datetime
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypedDict, Unpack
from uuid import UUID

from elm.arguments import check_several
from elm.cues.algebra import Cue
from elm.errors import InvalidValue
from elm.event import Event, StoredEvent
from elm.log import Log, LoggedStore, LogKind, Tick
from elm.query import Cursor, Order
from elm.recollector import OrderName, Recollection, Recollector
from elm.store import Arrival, Closed, Committed, Statistics, TypesAdded
from elm.subscription import subscribe
from elm.taxonomy import EventType
from elm.writer import LOAD_BATCH, LoadReport, Writer

if TYPE_CHECKING:
    from elm.forgetting import ForgettingReport
    from elm.recognition import RecognitionManager, Replay, Timing
    from elm.recognizers import Recognizer


class RecognitionSettings(TypedDict, total=False):
    """How a `RecognitionManager` works, where it differs from the usual."""

    consumer: str
    timing: Timing | None
    since: int
    batch: int


class Memory:
    """One episodic memory: a writer, a recollector and the types, over one store.

    Use it as a context manager, or call `close()`.
    """

    def __init__(self, store: LoggedStore) -> None:
        self.store = store
        self.writer = Writer(store)
        self.recollector = Recollector(store)

    @property
    def name(self) -> str:
        """The memory's name."""
        return self.store.memory

    def add_types(self, types: Iterable[EventType]) -> TypesAdded:
        """Add event types and parents, in any order, at any time; a repeated type gains parents."""
        given = list(check_several(types, what="event types"))
        for each in given:
            if not isinstance(each, EventType):
                raise InvalidValue(f"event types are given as EventType(name=...), not as {each!r:.80}")
        return self.store.add_types(given)

    def add_type(self, name: str, *parents: str) -> TypesAdded:
        """Add one event type below its parents."""
        return self.store.add_types([EventType(name=name, parents=parents)])

    def types(self) -> Iterator[EventType]:
        """All types, parents first."""
        return self.store.types()

    def commit(self, event: Event, *, recorded_at: datetime | None = None) -> Committed:
        """Keep one event; see `Writer.commit`."""
        return self.writer.commit(event, recorded_at=recorded_at)

    def commit_all(self, events: Iterable[Event], *, recorded_at: datetime | None = None) -> list[Committed]:
        """Keep all of these events or none; see `Writer.commit_all`."""
        return self.writer.commit_all(events, recorded_at=recorded_at)

    def close_event(self, uid: UUID | str | int, end: datetime) -> Closed:
        """End an event that is still going on; see `Writer.close`."""
        return self.writer.close(uid, end)

    def load(
        self,
        events: Iterable[Event | StoredEvent | Arrival],
        *,
        progress: Callable[[int], None] | None = None,
        refused: Callable[[Arrival, str], None] | None = None,
        batch: int = LOAD_BATCH,
    ) -> LoadReport:
        """Keep a long stream of events; see `Writer.load`."""
        return self.writer.load(events, progress=progress, refused=refused, batch=batch)

    def forget(
        self,
        what: Cue | Iterable[UUID | str],
        *,
        dry_run: bool = False,
        progress: Callable[[int], None] | None = None,
    ) -> ForgettingReport:
        """Forget the events that match a cue or have these uids, or say what would go; see `elm.forgetting.forget`."""
        from elm.forgetting import forget

        if not isinstance(dry_run, bool):
            raise InvalidValue(f"dry_run is True or False, not {dry_run!r:.80}")
        return forget(self.store, what, dry_run=dry_run, progress=progress)

    def recall(
        self,
        cue: Cue | None = None,
        *,
        order: OrderName = Order.BEGIN,
        limit: int | None = None,
        after: Cursor | None = None,
    ) -> Recollection:
        """The events that match a cue; see `Recollector.recall`."""
        return self.recollector.recall(cue, order=order, limit=limit, after=after)

    def get(self, name: UUID | str | int) -> StoredEvent:
        """The event with this uid or id; see `Recollector.get`."""
        return self.recollector.get(name)

    @property
    def log(self) -> Log:
        """What was committed, in order, and the consumers that read it."""
        return self.store.log

    def subscribe(
        self,
        cue: Cue | None = None,
        *,
        since: int | None = None,
        name: str | None = None,
        timeout: float | None = None,
    ) -> Iterator[StoredEvent]:
        """The events that match a cue, as they are committed and closed; see `elm.subscription.subscribe`."""
        return subscribe(self.store, cue, since=since, name=name, timeout=timeout)

    def punctuate(self, until: datetime, agent: str | None = None) -> None:
        """Promise that nothing of this agent (None: of no agent) that ended before `until` is to come."""
        self.store.log.write([Tick(agent=agent, deadline=until, kind=LogKind.PUNCTUATION)])

    def recognition(
        self, recognizers: Iterable[Recognizer], **settings: Unpack[RecognitionSettings]
    ) -> RecognitionManager:
        """What finds complex events as the log grows, once it is started; see `RecognitionManager`."""
        from elm.recognition import RecognitionManager

        return RecognitionManager(self.store, tuple(check_several(recognizers, what="recognizers")), **settings)

    def recognize(
        self,
        recognizers: Iterable[Recognizer],
        *,
        since: int = 0,
        complete: bool = False,
        timing: Timing | None = None,
        commit: bool = True,
    ) -> Replay:
        """Find complex events in the log as it stands (the paper's R*); see `elm.recognition.replay`."""
        from elm.recognition import replay

        found = tuple(check_several(recognizers, what="recognizers"))
        return replay(self.store, found, since=since, complete=complete, timing=timing, commit=commit)

    def statistics(self) -> Statistics:
        """What the memory holds, in numbers."""
        return self.store.statistics()

    def close(self) -> None:
        """Let go of the store's connections."""
        self.store.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def connect(dsn: str | None = None, memory: str = "elm") -> Memory:
    """Open a memory.

    `dsn` is a PostgreSQL DSN, or "memory://" for a store in this process; without one the environment's
    ELM_DSN, else the private cluster, which is created and started on first use. A memory that does not
    exist is created by its first write.
    """
    from elm.storage import open_store

    if dsn is not None and not isinstance(dsn, str):
        raise InvalidValue(f"the DSN of a memory is text such as 'host=... dbname=...', not {dsn!r:.80}")
    return Memory(open_store(dsn, memory))
