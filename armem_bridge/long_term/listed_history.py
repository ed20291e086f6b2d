"""The history of an entity over versions of snapshots in any order: what counts of each, sorted by time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence

from armem_bridge.working.history import index_slice
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.versions import last_of, what_counts


class ListedHistory:
    """A `History` of some versions, given once."""

    def __init__(self, versions: Iterable[Snapshot]) -> None:
        self._snapshots = what_counts(versions)
        self._moments = [snapshot.referenced for snapshot in self._snapshots]

    def all(self) -> Sequence[Snapshot]:
        """Every snapshot."""
        return self._snapshots

    def latest(self, count: int) -> Sequence[Snapshot]:
        """The `count` snapshots with the greatest reference times."""
        return last_of(self._snapshots, count)

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` last snapshots strictly before `moment`."""
        return last_of(self._snapshots[: bisect_left(self._moments, moment)], count)

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` first snapshots strictly after `moment`."""
        later = self._snapshots[bisect_right(self._moments, moment) :]
        return later[:count] if count >= 0 else later

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        """The snapshots from `begin` to `end`, both included."""
        return self._snapshots[bisect_left(self._moments, begin) : bisect_right(self._moments, end)]

    def at(self, moment: int) -> Snapshot | None:
        """The snapshot with exactly this reference time."""
        return next(iter(self.between(moment, moment)), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        """The snapshots from position `first` to `last`, both included."""
        return self._snapshots[index_slice(first, last, len(self._snapshots))]
