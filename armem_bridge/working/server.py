"""A memory server: one memory that clients commit to, query, and listen to (section 4.4)."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import InvalidMemoryID, MemoryID
from armem_bridge.moments import Clock, now
from armem_bridge.working.access_statistics import Usage
from armem_bridge.working.admission import check_commit, check_wishes, why_no_segment, why_refused
from armem_bridge.working.archive import Archive, Evicted, NotKept
from armem_bridge.working.commit import Commit, CommitResult, EntityUpdate, UpdateResult
from armem_bridge.working.counters import Counters
from armem_bridge.working.door import Door
from armem_bridge.working.evaluation import evaluate
from armem_bridge.working.history import Source
from armem_bridge.working.limits import HistoryLimits
from armem_bridge.working.notifications import QUEUE_LIMIT, Listener, Notifier, Subscription
from armem_bridge.working.prior_knowledge import load_prior_knowledge
from armem_bridge.working.query import Query, QueryTarget, check_query
from armem_bridge.working.refusals import InvalidServer
from armem_bridge.working.segments import AddSegment, CoreSegmentDefinition, SegmentResult
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.status import ServerStatus
from armem_bridge.working.tree import Memory
from armem_bridge.working.union import UnionSource
from armem_bridge.working.versions import snapshot_of
from armem_bridge.working.working_memory import Provider, WorkingMemory

UPDATE_BYTES: Final = 256 * 1024 * 1024
"""How much data one update may have unless the server says otherwise."""

DELAY_THRESHOLD: Final = 1_000_000
"""Updates that take longer than so many microseconds from sent to arrived are warned of, unless it says otherwise."""

_EVERYTHING = MemoryID()
_logger = logging.getLogger(__name__)


class MemoryServer:
    """One memory with its core segments, in main memory, with an archive behind it or none.

    All methods may be called from any thread. `limits` are history limits by ID (`working.limits`),
    `prior_knowledge` files (`working.prior_knowledge`); `clock` says when something arrived and was used.
    """

    def __init__(
        self,
        name: str,
        core_segments: Iterable[CoreSegmentDefinition] = (),
        *,
        archive: Archive | None = None,
        limits: Mapping[MemoryID, int] | None = None,
        prior_knowledge: Iterable[Path] = (),
        clock: Clock = now,
        delay_threshold: int = DELAY_THRESHOLD,
        update_bytes: int = UPDATE_BYTES,
    ) -> None:
        if not isinstance(name, str) or not name:
            raise InvalidServer(f"a memory server has a name, which is text, not {name!r:.80}")
        self._memory = WorkingMemory(name, core_segments, HistoryLimits(limits or {}))
        for where in limits or {}:
            self._check_limited(where)
        self._archive = archive
        self._clock = clock
        self._update_bytes = update_bytes
        self._notifier = Notifier()
        self._counters = Counters(delay_threshold)
        self._door = Door(f"the memory server {name!r:.80} was closed: make a new one")
        for path in prior_knowledge:
            load_prior_knowledge(path, self._memory, arrived=clock())

    @property
    def name(self) -> str:
        """The name of the memory."""
        return self._memory.id.memory

    @property
    def id(self) -> MemoryID:
        """The ID of the memory."""
        return self._memory.id

    # Writing

    def add_segments(self, wishes: Sequence[AddSegment]) -> tuple[SegmentResult, ...]:
        """Add provider segments, or clear ones that exist; one result for each wish, in their order.

        Refused are: segments of core segments that the memory does not have, types that do not extend the
        core segment's, another type for a segment that has entities, and changes of prior knowledge. That
        the segment exists already is no fault. Commits that are going on are over before, and others wait.
        """
        check_wishes(wishes)
        with self._door.alone():
            return tuple(map(self._add_segment, wishes))

    def commit(self, commit: Commit) -> CommitResult:
        """Make the updates of a commit; one result for each, in their order.

        An update is refused by itself, with the reason in its result, and the others are made all the
        same: unknown core segments, data that are not of the segment's type, times that are none, too much
        data. What arrives late is inserted at its own reference time. Of two versions of one snapshot that
        one counts that `snapshot.supersedes` says; the update that brought the other one succeeds too, for
        the archive keeps both. Listeners get one message with the IDs of all updates that were made.
        """
        check_commit(commit)
        with self._door:
            return self._commit(commit)

    def _commit(self, commit: Commit) -> CommitResult:
        arrived = self._clock()
        outcomes = [self._admit(update, arrived) for update in commit.updates]
        outcomes = self._consolidate(outcomes)
        left: list[Evicted] = []
        with self._memory.lock:
            made = [outcome for outcome in outcomes if isinstance(outcome, Snapshot)]
            for snapshot in made:
                left += self._memory.put(snapshot)
            self._let_go(left)
        self._counters.note_commit(made=made, refused=len(outcomes) - len(made), evicted=len(left), arrived=arrived)
        self._notifier.publish([snapshot.id for snapshot in made])
        return CommitResult(results=tuple([_result(outcome, arrived) for outcome in outcomes]))

    # Reading

    def query(self, query: Query) -> Memory:
        """What the memory has of what a query asks for; what it has not is simply not in the result.

        Without an archive long-term memory is empty. The snapshots in the result are shared, not copied.
        """
        check_query(query)
        result = evaluate(query, self._source(query.target), self.name)
        moment = self._clock()
        with self._memory.lock:
            self._memory.note_use(result, moment)
        self._counters.note_query()
        return result

    def get(self, wanted: MemoryID, *, target: QueryTarget = QueryTarget.WM) -> Snapshot | None:
        """The snapshot that an ID names, the latest one for the ID of an entity; None where there is none.

        For the ID of an instance it is the snapshot which that instance is in. Unlike a query this does not
        count as a use.
        """
        if not isinstance(wanted, MemoryID):
            raise InvalidMemoryID(
                f"a snapshot is asked for by a MemoryID, not by {wanted!r:.80}: make text one with MemoryID.parse"
            )
        if wanted.memory != self.name or not wanted.entity:
            return None
        history = self._source(target).history(wanted.entity_id)
        found = history.at(wanted.timestamp) if wanted.timestamp >= 0 else next(iter(history.latest(1)), None)
        return found if found is not None and wanted.instance < len(found.instances) else None

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        """The type of a core or provider segment; None where it has none, or is not there."""
        return self._memory.segment_type(segment)

    def usage(self, snapshot: MemoryID) -> Usage:
        """How often and when last queries returned a snapshot that is in working memory."""
        return self._memory.usage(snapshot)

    def held(self) -> list[Evicted]:
        """All that is in working memory but prior knowledge, as if it left now; of each entity the oldest first.

        This does not count as a use.
        """
        return self._memory.held()

    def subscribe(
        self, listener: Listener, subscribed: MemoryID = _EVERYTHING, *, queue_limit: int = QUEUE_LIMIT
    ) -> Subscription:
        """Call `listener` with the IDs of updated snapshots that `subscribed` contains, one message a commit.

        It is called in a thread of its own, after the commit. Where it is too slow the oldest messages of
        its queue are dropped; where it raises, the status says so, and it is called again the next time.
        Raises `InvalidSubscription` for an ID that is none and for a queue that nothing fits into.
        """
        with self._door:
            return self._notifier.subscribe(listener, subscribed, queue_limit)

    # Looking after it

    def status(self) -> ServerStatus:
        """What the server holds and what it did so far."""
        providers, entities, snapshots = self._memory.size()
        counted = self._counters
        return ServerStatus(
            name=self.name,
            core_segments=len(self._memory.names(self.id)),
            provider_segments=providers,
            entities=entities,
            snapshots=snapshots,
            commits=counted.commits,
            updates=counted.updates,
            refused=counted.refused,
            evicted=counted.evicted,
            queries=counted.queries,
            delayed=counted.delayed,
            greatest_delay=counted.greatest_delay,
            archive_failures=counted.archive_failures,
            listeners=self._notifier.status(),
            archive=self._archive.status() if self._archive is not None else {},
        )

    def close(self) -> None:
        """Take no more commits, and end all subscriptions; what is there can still be read.

        Returns when the commits that are going on are over, so that an archive may be closed next.
        """
        self._door.close()
        self._notifier.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # Inside

    def _check_limited(self, where: MemoryID) -> None:
        if where.memory not in ("", self.name) or (
            where.core_segment and self._memory.core(where.core_segment) is None
        ):
            raise InvalidServer(
                f"the history limit of {where} is for nothing that the memory {self.name!r:.80} will have: "
                f"correct its memory and core segment"
            )

    def _source(self, target: QueryTarget) -> Source:
        if target == QueryTarget.WM:
            return self._memory
        archived = self._archive.source(self.name) if self._archive is not None else None
        beyond = () if archived is None else (archived,)
        return UnionSource(self._memory, *beyond) if target == QueryTarget.BOTH else UnionSource(*beyond)

    def _admit(self, update: EntityUpdate, arrived: int) -> Snapshot | str:
        """The snapshot that an update makes, or why it is refused."""
        return why_refused(update, self._memory, self._update_bytes) or snapshot_of(update, arrived=arrived)

    def _consolidate(self, outcomes: list[Snapshot | str]) -> list[Snapshot | str]:
        """Hand the new snapshots to the archive; if it cannot take them, they are refused."""
        snapshots = [outcome for outcome in outcomes if isinstance(outcome, Snapshot)]
        if not snapshots or self._archive is None:
            return outcomes
        try:
            self._archive.consolidate(snapshots)
        except NotKept as error:
            places = [place for place, outcome in enumerate(outcomes) if isinstance(outcome, Snapshot)]
            corrected = list(outcomes)
            for index, why in error.refused.items():
                corrected[places[index]] = f"{snapshots[index].id} cannot be kept: {why}"
            return self._consolidate(corrected)
        except Exception as error:
            # A memory that promises to keep what it acknowledges does not acknowledge what it cannot keep.
            _logger.exception("the archive of the memory %s did not take %d snapshots", self.name, len(snapshots))
            why = f"the archive of the memory {self.name!r:.80} did not take it: {type(error).__name__}: {error}"
            return [why if isinstance(outcome, Snapshot) else outcome for outcome in outcomes]
        return outcomes

    def _let_go(self, evicted: Sequence[Evicted]) -> None:
        """Hand what left working memory to the archive, before anybody can look again."""
        if not evicted or self._archive is None:
            return
        try:
            self._archive.on_eviction(evicted)
        except Exception:
            _logger.exception("the archive of the memory %s did not take %d evicted snapshots", self.name, len(evicted))
            self._counters.note_archive_failure()

    def _add_segment(self, wish: AddSegment) -> SegmentResult:
        memory = self._memory
        with memory.lock:
            why = why_no_segment(wish, memory)
            if why:
                return SegmentResult(success=False, error=why)
            known = memory.provider(wish.core_segment, wish.provider_segment)
            left: list[Evicted] = []
            if known is None:
                memory.put_provider(wish.core_segment, wish.provider_segment, Provider(wish.aron_type))
            else:
                if wish.clear_when_exists:
                    left = memory.clear(wish.core_segment, wish.provider_segment)
                    self._let_go(left)
                if wish.aron_type is not None:
                    memory.retype(known, wish.aron_type)
        self._counters.note_cleared(len(left))
        segment = self.id.with_core_segment(wish.core_segment).with_provider_segment(wish.provider_segment)
        return SegmentResult(success=True, segment=segment)


def _result(outcome: Snapshot | str, arrived: int) -> UpdateResult:
    if isinstance(outcome, str):
        return UpdateResult(success=False, error=outcome, arrived=arrived)
    return UpdateResult(success=True, snapshot=outcome.id, arrived=arrived)
