"""The store in this process: the working memory of a robot without a database, and the judge of every other store."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import datetime
from itertools import chain, islice
from threading import Condition
from typing import Any
from uuid import UUID

from elm.columns import batches_of, reader_of
from elm.cues.algebra import And, Cue
from elm.cues.codec import cue_to_json
from elm.errors import StoreClosed
from elm.event import StoredEvent, content_hash
from elm.exchange import to_line
from elm.interval import as_utc
from elm.query import ByFeature, ConditionRows, Explanation, Group, Grouping, Join, Nearest, Order, Query
from elm.storage.forking import awaited_by_forks
from elm.storage.hints import conjuncts
from elm.storage.memory_answers import grouped, nearest_first, neighbours
from elm.storage.memory_changes import Changes
from elm.storage.memory_forgetting import Forgetting
from elm.storage.memory_index import EventIndex, View
from elm.storage.memory_log import MemoryLog
from elm.store import Arrival, BatchReport, Closed, Committed, ForgettingCount, Statistics, TypesAdded
from elm.taxonomy import EventType, Taxonomy
from elm.text import check_memory_name
from elm.tombstone import Forgotten, RunTombstone, Tombstone


class MemoryStore:
    """One memory in this process, behind the port `elm.store.Store`; nothing of it outlives the process.

    Every cue is judged by `elm.cues.match`; indexes only spare it events that cannot match. Threads may
    share a store. An answer is that of one moment, whatever is written while it is read. A forked process has
    a copy, which goes its own way.
    """

    def __init__(self, memory: str = "elm") -> None:
        self.memory = check_memory_name(memory)
        self._changed = Condition()
        awaited_by_forks(self._changed)
        self._is_open = True
        self._taxonomy = Taxonomy()
        self._is_a_links: set[tuple[str, str]] = set()
        self._index = EventIndex()
        self._changes = Changes(self._index, self._taxonomy)
        self._forgetting = Forgetting(self._index, self._changes.contents)
        self.log = MemoryLog(self._changes, self._index, self._locked, self._changed)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        with self._changed:
            if not self._is_open:
                raise StoreClosed(f"memory {self.memory!r} was closed: open it again with elm.connect")
            yield

    @contextmanager
    def _writing(self) -> Iterator[None]:
        with self._locked():
            yield
            self._changed.notify_all()

    def close(self) -> None:
        """Refuse further calls; closing again changes nothing."""
        with self._changed:
            self._is_open = False
            self._changed.notify_all()

    # Types

    def add_types(self, types: Sequence[EventType]) -> TypesAdded:
        """Add types and parents, in any order; cycles and unknown parents refuse the whole call."""
        with self._locked():
            known, links = len(self._taxonomy), len(self._is_a_links)
            closure = len(self._taxonomy.add(types))
            self._is_a_links.update((event_type.name, parent) for event_type in types for parent in event_type.parents)
            return TypesAdded(types=len(self._taxonomy) - known, links=len(self._is_a_links) - links, closure=closure)

    def types(self) -> Iterator[EventType]:
        """All types, parents first."""
        with self._locked():
            return iter(self._taxonomy)

    # Writing

    def commit(self, arrival: Arrival) -> Committed:
        """Keep one event whose parts are all in the memory."""
        return self.commit_all([arrival])[0]

    def commit_all(self, arrivals: Sequence[Arrival]) -> list[Committed]:
        """Keep all or none; events may be parts of each other in any order, and are numbered parts first."""
        contents = [content_hash(arrival.event) for arrival in arrivals]
        with self._writing():
            return self._changes.keep(arrivals, contents)

    def load(self, arrivals: Sequence[Arrival]) -> BatchReport:
        """Keep what can be kept of a batch whose parts come before their wholes or are in the memory."""
        contents = [content_hash(arrival.event) for arrival in arrivals]
        with self._writing():
            return self._changes.load(arrivals, contents)

    def finish_load(self) -> None:
        """Nothing is left to do after a load."""
        with self._locked():
            return

    def close_event(self, uid: UUID, end: datetime) -> Closed:
        """End an open event and recompute the extents of all its wholes; the same end again changes nothing."""
        end = as_utc(end, what="the end of an event")
        with self._writing():
            return self._changes.close(uid, end)

    # Forgetting

    def forget(self, ids: Sequence[int], *, run: UUID, at: datetime) -> Forgotten:
        """Forget those of these events that have ended, as a piece of the forgetting `run`."""
        with self._writing():
            return self._forgetting.forget(ids, run=run, at=as_utc(at, what="the time of a forgetting"))

    def would_forget(self, ids: Sequence[int]) -> Forgotten:
        """What forgetting these events would do; nothing is changed."""
        with self._locked():
            return self._forgetting.would_forget(ids)

    def tombstones(self, uids: Sequence[UUID] | None = None) -> Iterator[Tombstone]:
        """The tombstones of single events, by id; with `uids` those of these."""
        with self._locked():
            known = self._index.tombstones
            found = known.values() if uids is None else [known[uid] for uid in set(uids) if uid in known]
            return iter(sorted(found, key=lambda tombstone: tombstone.id))

    def run_tombstones(self) -> Iterator[RunTombstone]:
        """What is left of the rest of each forgetting, oldest first."""
        with self._locked():
            return iter(self._forgetting.runs)

    def forgetting_count(self) -> ForgettingCount:
        """How often this memory has forgotten, and how much."""
        with self._locked():
            return self._forgetting.count()

    def keep_tombstones(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory; of an event that this one has, nothing is kept."""
        with self._writing():
            return self._forgetting.keep(given)

    # Reading

    def _views(self, *queries: Query) -> list[View]:
        """The candidates for each query, all as of one moment."""
        with self._locked():
            return [self._index.view(query, self._taxonomy) for query in queries]

    def find(self, query: Query) -> Iterator[StoredEvent]:
        """The events a query asks for, as of this call; each is judged when it is asked for."""
        (view,) = self._views(query)
        return _answers(view, query)

    def with_parts(self, query: Query) -> Iterator[StoredEvent | Tombstone]:
        """The events a query asks for and all they are made of, by id, after the tombstones of forgotten parts."""
        with self._locked():
            view = self._index.view(query, self._taxonomy)
            events, ids, tombstones = self._index.events.copy(), self._index.ids.copy(), self._index.tombstones.copy()
        return _with_parts(_answers(view, query), events, ids, tombstones)

    def everything(self) -> Iterator[StoredEvent | Tombstone | RunTombstone]:
        """All that the memory holds, as of this call: tombstones of forgettings, those of events, events by id."""
        with self._locked():
            return chain(self.run_tombstones(), self.tombstones(), self.find(Query(order=Order.ID)))

    def ids(self, query: Query) -> Iterator[int]:
        """Their ids alone."""
        return (event.id for event in self.find(query))

    def count(self, cue: Cue) -> int:
        """How many events match."""
        return sum(1 for _ in self.find(Query(cue=cue)))

    def exists(self, cue: Cue) -> bool:
        """Whether any event matches."""
        return next(self.find(Query(cue=cue)), None) is not None

    def groups(self, cue: Cue, by: Grouping | ByFeature) -> list[Group]:
        """The matching events by key, keys in ascending order, None last."""
        return grouped(self.find(Query(cue=cue)), by)

    def join(self, join: Join) -> Iterator[tuple[StoredEvent, StoredEvent | None]]:
        """Each anchor, in order, with the neighbour found for it."""
        anchors, others = self._views(join.anchors, Query(cue=join.cue))
        return neighbours(_answers(anchors, join.anchors), iter(others), join.relation, same_region=join.same_region)

    def get(self, ids: Sequence[int]) -> list[StoredEvent]:
        """The events with these ids, in id order; unknown ids are left out."""
        with self._locked():
            return [self._index.events[number] for number in sorted(set(ids)) if number in self._index.events]

    def explain(self, query: Query) -> Explanation:
        """How many candidates were judged, and what each condition keeps."""
        parts = conjuncts(query.cue)
        alone = [Query(cue=part) for part in parts]
        first = [Query(cue=part) for part in parts[:1]]
        left = first + [Query(cue=And(args=parts[: count + 1])) for count in range(1, len(parts))]
        view, *views = self._views(query, *alone, *left)
        counts = [sum(1 for _ in each) for each in views]
        return Explanation(
            sql="",
            parameters={},
            plan=f"scan of {len(view.candidates)} candidates",
            events=len(self._index.events),
            conditions=tuple(
                ConditionRows(condition=to_line(cue_to_json(part)), alone=by_itself, left=together)
                for part, by_itself, together in zip(parts, counts[: len(parts)], counts[len(parts) :], strict=True)
            ),
        )

    def arrow(self, query: Query) -> Any:
        """The events as a pyarrow.RecordBatchReader in the schema of `elm.columns`."""
        return reader_of(batches_of(self.find(query)))

    def statistics(self) -> Statistics:
        """What the memory holds, in numbers."""
        with self._locked():
            events = [*self._index.events.values()]
            types, frames = len(self._taxonomy), len(self._index.frames)
            tombstones = len(self._index.tombstones)
            forgotten = tombstones + sum(run.events for run in self._forgetting.runs)
        begins = [event.interval.begin for event in events]
        return Statistics(
            events=len(events),
            complex_events=sum(event.is_complex for event in events),
            open_events=sum(event.interval.is_open for event in events),
            links=sum(len(event.parts) for event in events),
            types=types,
            frames=frames,
            agents=len({event.agent for event in events if event.agent is not None}),
            first_begin=min(begins, default=None),
            last_begin=max(begins, default=None),
            last_recorded_at=max((event.recorded_at for event in events), default=None),
            bytes=None,
            forgotten=forgotten,
            tombstones=tombstones,
        )


def _answers(view: View, query: Query) -> Iterator[StoredEvent]:
    candidates = view.candidates
    if isinstance(query.order, Nearest):
        candidates = nearest_first(candidates, query.order)
    return islice(view.matching(candidates), query.limit)


def _with_parts(
    found: Iterable[StoredEvent],
    events: Mapping[int, StoredEvent],
    ids: Mapping[UUID, int],
    tombstones: Mapping[UUID, Tombstone],
) -> Iterator[StoredEvent | Tombstone]:
    taken: dict[int, StoredEvent | Tombstone] = {}
    waiting: list[StoredEvent | Tombstone] = [*found]
    while waiting:
        each = waiting.pop()
        if each.id not in taken:
            taken[each.id] = each
            if isinstance(each, StoredEvent):
                waiting += [tombstones[uid] if uid in tombstones else events[ids[uid]] for uid in each.parts]
    in_order = [taken[number] for number in sorted(taken)]
    yield from (each for each in in_order if isinstance(each, Tombstone))
    yield from (each for each in in_order if isinstance(each, StoredEvent))
