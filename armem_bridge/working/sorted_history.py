"""The history of one entity in working memory: snapshots and their use, sorted by reference time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from threading import Lock

from sortedcontainers import SortedDict

from armem_bridge.working.access_statistics import UNUSED, Usage
from armem_bridge.working.archive import Evicted
from armem_bridge.working.history import index_slice
from armem_bridge.working.snapshot import Snapshot, supersedes


class SortedHistory:
    """A `History` in main memory.

    Reading takes the lock for as long as references are copied; `at` only where it finds nothing without, `usage`
    never. `put`, `clear`, `note_use` and `held` are called by who holds the lock already.
    """

    def __init__(self, lock: Lock, limit: int | None) -> None:
        self._lock = lock
        self._limit = limit
        self._snapshots: SortedDict = SortedDict()
        self._usage: dict[int, Usage] = {}

    def __len__(self) -> int:
        return len(self._snapshots)

    # Changing, by who holds the lock

    def put(self, snapshot: Snapshot) -> list[Evicted]:
        """Insert a snapshot at its reference time, and say what left: an older version, or what the limit drops.

        When the version that is here counts, the new one is what left.
        """
        moment = snapshot.id.timestamp
        known = self._snapshots.get(moment)
        if known is None:
            self._snapshots[moment] = snapshot
            if self._limit is None or len(self._snapshots) <= self._limit:
                return []
            return [self._drop_oldest()]
        if supersedes(snapshot, known):
            self._snapshots[moment] = snapshot
            return [Evicted(snapshot=known, usage=self._usage.pop(moment, UNUSED), superseded=True)]
        if supersedes(known, snapshot):
            return [Evicted(snapshot=snapshot, usage=UNUSED, superseded=True)]
        return []

    def clear(self) -> list[Evicted]:
        """Drop everything, and say what it was."""
        return [self._drop_oldest() for _ in range(len(self._snapshots))]

    def note_use(self, moments: Iterable[int], now: int) -> None:
        """A query returned the snapshots of these moments, as far as they are here."""
        usage, snapshots = self._usage, self._snapshots
        for moment in moments:
            if moment in snapshots:
                usage[moment] = usage.get(moment, UNUSED).again(now)

    def held(self) -> list[Evicted]:
        """What would leave if everything did, the oldest reference time first."""
        usage = self._usage
        return [
            Evicted(snapshot=snapshot, usage=usage.get(moment, UNUSED)) for moment, snapshot in self._snapshots.items()
        ]

    def _drop_oldest(self) -> Evicted:
        moment, snapshot = self._snapshots.popitem(0)
        return Evicted(snapshot=snapshot, usage=self._usage.pop(moment, UNUSED))

    # Reading

    def usage(self, moment: int) -> Usage:
        """How the snapshot of a moment was used; unused where there is none."""
        return self._usage.get(moment, UNUSED)

    def all(self) -> Sequence[Snapshot]:
        """Every snapshot."""
        with self._lock:
            return list(self._snapshots.values())

    def latest(self, count: int) -> Sequence[Snapshot]:
        """The `count` snapshots with the greatest reference times."""
        with self._lock:
            if count == 1 and self._snapshots:
                return [self._snapshots.peekitem(-1)[1]]
            return self._slice(_last(len(self._snapshots), count))

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` last snapshots strictly before `moment`."""
        with self._lock:
            return self._slice(_last(self._snapshots.bisect_left(moment), count))

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` first snapshots strictly after `moment`."""
        with self._lock:
            begin = self._snapshots.bisect_right(moment)
            return self._slice(slice(begin, begin + count if count >= 0 else None))

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        """The snapshots from `begin` to `end`, both included."""
        with self._lock:
            return self._slice(slice(self._snapshots.bisect_left(begin), self._snapshots.bisect_right(end)))

    def at(self, moment: int) -> Snapshot | None:
        """The snapshot with exactly this reference time."""
        found: Snapshot | None = self._snapshots.get(moment)
        if found is None:
            # It may be leaving just now: nobody is told that it is not here before the archive has it.
            with self._lock:
                found = self._snapshots.get(moment)
        return found

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        """The snapshots from position `first` to `last`, both included."""
        with self._lock:
            return self._slice(index_slice(first, last, len(self._snapshots)))

    def _slice(self, positions: slice) -> list[Snapshot]:
        snapshots = self._snapshots
        return [snapshots[moment] for moment in snapshots.keys()[positions]]


def _last(end: int, count: int) -> slice:
    """The last `count` positions before `end`; all when it is negative."""
    return slice(max(end - count, 0) if count >= 0 else 0, end)
