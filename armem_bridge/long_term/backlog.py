"""The backlog: what was handed over to long-term memory and is not durable yet, bounded, and readable meanwhile."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import count, islice, takewhile
from threading import Condition

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.long_term.catalogue import names_below
from armem_bridge.long_term.listed_history import ListedHistory
from armem_bridge.long_term.refusals import ArchiveClosed, BacklogFull
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.admission import size_of
from armem_bridge.working.archive import Evicted
from armem_bridge.working.history import History
from armem_bridge.working.snapshot import Snapshot


@dataclass(slots=True, kw_only=True, eq=False)
class Waiting:
    """A version of a snapshot that waits, and what is to be known when its turn comes."""

    snapshot: Snapshot
    aron_type: TypeObject | None
    """The type of its segment when it came."""

    evicted: Evicted | None = None
    """How it left working memory, until it is decided that it is kept; None for what was just committed."""

    moment: int = 0
    """When it was handed over, by the clock of the archive."""

    since: float = field(default_factory=time.monotonic)
    attempts: int = 0
    """So often the database refused it by itself."""

    number: int = 0
    size: int = field(init=False)
    """About how many bytes its data have."""

    def __post_init__(self) -> None:
        self.size = sum(size_of(instance.data) for instance in self.snapshot.instances)


class Backlog:
    """What waits, oldest first, at most `limit` snapshots with `byte_limit` bytes of data; any thread may use it."""

    def __init__(self, limit: int, byte_limit: int) -> None:
        self.limit = limit
        self.byte_limit = byte_limit
        self.bytes = 0
        self._closed = False
        self._changed = Condition()
        self._numbers = count(1)
        self._waiting: dict[int, Waiting] = {}
        self._entities: dict[MemoryID, dict[int, Waiting]] = {}

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def is_half_full(self) -> bool:
        """Whether there is reason to hurry."""
        return 2 * len(self._waiting) >= self.limit or 2 * self.bytes >= self.byte_limit

    @property
    def last(self) -> int:
        """The number of the last one that came; they count upwards."""
        with self._changed:
            return next(reversed(self._waiting), 0)

    def oldest(self) -> Waiting | None:
        """The one that has waited longest."""
        with self._changed:
            return next(iter(self._waiting.values()), None)

    # Coming

    def put(self, given: Sequence[Waiting]) -> None:
        """Take these in, over the limit too. `ArchiveClosed` once it was closed: nobody would empty it any more."""
        with self._changed:
            if self._closed:
                raise ArchiveClosed("long-term memory was closed meanwhile and takes nothing more: make a new one")
            for each in given:
                each.number = next(self._numbers)
                self._waiting[each.number] = each
                self._entities.setdefault(each.snapshot.id.entity_id, {})[each.number] = each
                self.bytes += each.size
            self._changed.notify_all()

    def put_in_time(self, given: Sequence[Waiting], timeout: float, why: Callable[[], str]) -> None:
        """Take these in as soon as they fit, and nobody between; `BacklogFull` when that takes too long."""
        with self._changed:
            self.wait_for_room(len(given), timeout, why)
            self.put(given)

    def close(self) -> None:
        """Take nothing more; what waits goes on waiting."""
        with self._changed:
            self._closed = True

    def wait_for_room(self, number: int, timeout: float, why: Callable[[], str]) -> None:
        """Wait until `number` more fit in, or nothing else waits; `BacklogFull` when that takes too long."""
        with self._changed:
            if not self._changed.wait_for(lambda: self._has_room(number), timeout):
                raise BacklogFull(
                    f"long-term memory takes no more for now: {len(self._waiting):,} snapshots with {self.bytes:,} "
                    f"bytes wait to be consolidated, after {timeout:g} s still ({why()}). Look after the database, "
                    f"commit less at once, or raise the limits of the backlog"
                )

    def _has_room(self, number: int) -> bool:
        return not self._waiting or (len(self._waiting) + number <= self.limit and self.bytes < self.byte_limit)

    # Going

    def take(self, number: int, is_ready: Callable[[Waiting], bool], timeout: float) -> list[Waiting]:
        """The oldest ones, at most `number`, up to the first that is not ready; they stay until they are `done`.

        Where nothing waits at all this waits until something comes, at most `timeout` seconds.
        """
        with self._changed:
            if not self._waiting:
                self._changed.wait(timeout)
            return list(takewhile(is_ready, islice(self._waiting.values(), number)))

    def done(self, given: Iterable[Waiting]) -> None:
        """These wait no longer: they are durable, forgotten or set aside."""
        with self._changed:
            for each in given:
                if self._waiting.pop(each.number, None) is None:
                    continue
                entity = each.snapshot.id.entity_id
                self._entities[entity].pop(each.number)
                if not self._entities[entity]:
                    del self._entities[entity]
                self.bytes -= each.size
            self._changed.notify_all()

    def wake(self) -> None:
        """Have those who wait look again."""
        with self._changed:
            self._changed.notify_all()

    def wait_until_done(self, last: int, timeout: float | None) -> bool:
        """Wait until nothing waits that came up to number `last`; whether that was in time."""

        def is_done() -> bool:
            return next(iter(self._waiting), last + 1) > last

        with self._changed:
            return self._changed.wait_for(is_done, timeout)

    # Reading

    def source(self) -> BacklogSource:
        """What waits, as a memory."""
        return BacklogSource(self)

    def let_in(self) -> BacklogSource:
        """What only waits to be written, as a memory: it is decided that it is kept."""
        return BacklogSource(self, decided=True)

    def entities(self, *, decided: bool = False) -> list[MemoryID]:
        """The entities that something waits of; with `decided` only of what is kept in any case."""
        with self._changed:
            if not decided:
                return list(self._entities)
            return [
                entity
                for entity, waiting in self._entities.items()
                if any(each.evicted is None for each in waiting.values())
            ]

    def versions(self, entity: MemoryID, *, decided: bool = False) -> list[Snapshot]:
        """What waits of an entity; with `decided` only what is kept in any case."""
        with self._changed:
            waiting = self._entities.get(entity, {}).values()
            return [each.snapshot for each in waiting if not decided or each.evicted is None]


class BacklogSource:
    """A `Source` over what waits in a backlog at the moment of each question."""

    def __init__(self, backlog: Backlog, *, decided: bool = False) -> None:
        self._backlog = backlog
        self._decided = decided

    def names(self, parent: MemoryID) -> Sequence[str]:
        """The names one level below `parent` that something waits of, in order."""
        return names_below(parent, self._backlog.entities(decided=self._decided))

    def knows(self, name: MemoryID) -> bool:
        """Whether something waits of this or of what is below it."""
        return any(map(name.contains, self._backlog.entities(decided=self._decided)))

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        """None: types are not kept."""
        return None

    def history(self, entity: MemoryID) -> History:
        """What waits of an entity now; what comes later is not in it."""
        return ListedHistory(self._backlog.versions(entity, decided=self._decided))
