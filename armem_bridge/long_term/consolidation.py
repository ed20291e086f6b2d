"""Long-term memory behind memory servers: the archive that consolidates snapshots into elm (section 4.5.1)."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from types import TracebackType
from typing import Final, Self

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.long_term.backlog import Backlog, Waiting
from armem_bridge.long_term.backlog_worker import BacklogWorker
from armem_bridge.long_term.catalogue import Catalogue
from armem_bridge.long_term.event_types import SegmentTypes, types_of
from armem_bridge.long_term.gate import Gate
from armem_bridge.long_term.health import Health
from armem_bridge.long_term.refusals import ArchiveClosed, NotConsolidated
from armem_bridge.long_term.robot_place import LocationPort, PoseListener
from armem_bridge.long_term.settings import Consolidation, When
from armem_bridge.long_term.source import LAST, LongTermSource
from armem_bridge.long_term.subjects import SubjectFinder
from armem_bridge.long_term.writing import UNAVAILABLE, EventWriter, SetAside
from armem_bridge.memory_id import Level
from armem_bridge.moments import Clock, now
from armem_bridge.working.archive import Evicted, NotKept
from armem_bridge.working.history import Source
from armem_bridge.working.server import MemoryServer
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.union import UnionSource
from elm.app import Memory
from elm.errors import StoreFailure
from elm.text import check_short_name

STOP_TIMEOUT: Final = 30.0
"""So many seconds `close` waits for anything of what still waits to become durable, unless told otherwise."""

_BEYOND: Final = (
    "its reference time is beyond the year 9999, where long-term memory has no times: "
    "give the time that the data are about, in microseconds since 1970"
)


class LongTermMemory:
    """An `Archive` over one elm memory, for as many memory servers as there are.

    With the usual settings a commit is acknowledged when it waits in the backlog, which a thread empties
    into elm in batches; then it is durable. `agent` is the robot, `location` says where it was, `subjects`
    where the things are that the data are about; `gate` decides what is kept of what leaves working memory,
    where only that is consolidated. A `location` that is a `PoseListener` is told of all that is committed
    to those servers, and so of the robot's own poses. `on_set_aside` is told of every snapshot that cannot be kept.

    Tell it which servers it is behind (`serve`), and `close` it after them: that empties the backlog. Where only what
    leaves working memory is consolidated, what those servers still hold leaves then.
    """

    def __init__(
        self,
        memory: Memory,
        settings: Consolidation | None = None,
        *,
        agent: str | None = None,
        location: LocationPort | None = None,
        subjects: SubjectFinder | None = None,
        gate: Gate | None = None,
        on_set_aside: Callable[[SetAside], None] | None = None,
        clock: Clock = now,
    ) -> None:
        self.memory = memory
        self.settings = settings if settings is not None else Consolidation()
        self._poses = location if isinstance(location, PoseListener) else None
        self._clock = clock
        self._types: dict[str, SegmentTypes] = {}
        self._holding: list[MemoryServer] = []
        self._catalogue = Catalogue(memory)
        if agent is not None:
            check_short_name(agent, what="the agent of a long-term memory, which is the robot,")
        self._writer = EventWriter(memory, self._catalogue, agent=agent, location=location, subjects=subjects)
        self._backlog = Backlog(self.settings.backlog, self.settings.backlog_bytes)
        self._health = Health(memory.name)
        self._closed = False
        self._worker = BacklogWorker(
            self._backlog,
            self._writer,
            memory=memory,
            settings=self.settings,
            health=self._health,
            gate=gate,
            type_of=self._type_of,
            waits_for_poses=location is not None,
            on_set_aside=on_set_aside,
        )

    def serve(self, server: MemoryServer) -> None:
        """Ask this server for the types of its segments, which its snapshots have in elm too, and for what it holds."""
        self._types[server.name] = types_of(server)
        if self.settings.when is When.ON_EVICTION and self.settings.at_stop:
            self._holding.append(server)

    # The port `Archive`

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        """Take every version that a commit brought.

        `NotKept` where elm has no times for some of them. `BacklogFull` after `wait` seconds without room.
        Durable ones are in elm when this returns; `NotConsolidated` where that cannot be had in time, and
        other errors where one of them cannot be kept.
        """
        self._check_open()
        beyond = {index: _BEYOND for index, snapshot in enumerate(snapshots) if snapshot.referenced > LAST}
        if beyond:
            raise NotKept.because(beyond)
        if self._poses is not None:
            # Before anything is consolidated that came after them, also where working memory keeps none for long.
            self._poses.note(snapshots)
        if self.settings.when is When.ON_EVICTION:
            self._backlog.wait_for_room(len(snapshots), self.settings.wait, self._health.why_slow)
        elif self.settings.durable:
            self._write_through([(snapshot, self._type_of(snapshot)) for snapshot in snapshots])
        else:
            moment = self._clock()
            waiting = [
                Waiting(snapshot=snapshot, aron_type=self._type_of(snapshot), moment=moment) for snapshot in snapshots
            ]
            self._backlog.put_in_time(waiting, self.settings.wait, self._health.why_slow)

    def on_eviction(self, evicted: Sequence[Evicted]) -> None:
        """Take what leaves working memory, where that is what is consolidated; written through it is here already."""
        if self.settings.when is When.ON_EVICTION:
            self._check_open()
            self._take(evicted)

    def source(self, memory: str) -> Source | None:
        """The long-term memory of that name, what still waits included."""
        return UnionSource(self._backlog.source(), LongTermSource(self.memory, self._catalogue))

    def status(self) -> Mapping[str, object]:
        """What waits, what was consolidated, what was set aside and why, and how the database is."""
        oldest = self._backlog.oldest()
        return {
            "elm_memory": self.memory.name,
            "when": str(self.settings.when),
            "durable": self.settings.durable,
            "backlog": len(self._backlog),
            "backlog_limit": self._backlog.limit,
            "backlog_bytes": self._backlog.bytes,
            "backlog_seconds": 0.0 if oldest is None else time.monotonic() - oldest.since,
            **self._writer.status(),
            **self._worker.status(),
            **self._health.status(),
        }

    # Looking after it

    @property
    def set_aside(self) -> tuple[SetAside, ...]:
        """The last snapshots that could not be kept, with the reasons."""
        return self._worker.set_aside

    def flush(self, timeout: float | None = None) -> bool:
        """Wait until what waits now is durable, forgotten or set aside; whether that was within `timeout` seconds."""
        last = self._backlog.last
        self._worker.hurry(last)
        return self._backlog.wait_until_done(last, timeout)

    def close(self, timeout: float = STOP_TIMEOUT) -> None:
        """Take nothing more, make durable what waits, and stop; closing again changes nothing.

        `NotConsolidated` where for `timeout` seconds nothing of it becomes so: it is tried on until the process
        ends, and what waits then is lost to long-term memory. Closing can be tried again meanwhile.
        """
        self._closed = True
        while self._holding:
            self._take(self._holding.pop().held())
        self._backlog.close()
        left = len(self._backlog)
        while not self.flush(timeout):
            if len(self._backlog) >= left:
                raise NotConsolidated(
                    f"{left:,} snapshots are not durable after {timeout:g} s ({self._health.why_slow()}): "
                    f"they are lost if this process ends now. Look after the database and close again"
                )
            left = len(self._backlog)
        self._worker.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # Inside

    def _check_open(self) -> None:
        if self._closed:
            raise ArchiveClosed(f"the long-term memory {self.memory.name!r:.80} was closed: make a new one")

    def _take(self, evicted: Sequence[Evicted]) -> None:
        moment = self._clock()
        self._backlog.put(
            [Waiting(snapshot=each.snapshot, aron_type=None, evicted=each, moment=moment) for each in evicted]
        )

    def _type_of(self, snapshot: Snapshot) -> TypeObject | None:
        find = self._types.get(snapshot.id.memory)
        return find(snapshot.id.cut(Level.PROVIDER_SEGMENT)) if find is not None else None

    def _write_through(self, given: Sequence[tuple[Snapshot, TypeObject | None]]) -> None:
        deadline = time.monotonic() + self.settings.wait
        pause = self.settings.least_pause
        while True:
            try:
                self._writer.write_all(given)
                self._health.worked()
                return
            except (*UNAVAILABLE, StoreFailure) as error:
                self._health.failed(error)
                if time.monotonic() + pause > deadline:
                    raise NotConsolidated(
                        f"{len(given)} snapshots could not be made durable within {self.settings.wait:g} s: {error}"
                    ) from error
            time.sleep(pause)
            pause = min(2 * pause, self.settings.most_pause)
