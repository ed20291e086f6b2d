"""The history of an entity over versions of snapshots in any order: what counts of each, sorted by time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence

from armem_bridge.working.history import index_slice
from armem_bridge.working.snapshot import Snapshot, supersedes


def what_counts(versions: Iterable[Snapshot]) -> list[Snapshot]:
    """Of the versions of an entity's snapshots those that count, one for each reference time, ascending."""
    found: dict[int, Snapshot] = {}
    for snapshot in versions:
        known = found.get(snapshot.referenced)
        if known is None or supersedes(snapshot, known):
            found[snapshot.referenced] = snapshot
    return [found[moment] for moment in sorted(found)]


class ListedHistory:
    """A `History` of some versions, given once."""

    def __init__(self, versions: Iterable[Snapshot]) -> None:
        self._snapshots = what_counts(versions)
        self._moments = [snapshot.referenced for snapshot in self._snapshots]

    def all(self) -> Sequence[Snapshot]:
        return self._snapshots

    def latest(self, count: int) -> Sequence[Snapshot]:
        return _last(self._snapshots, count)

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        return _last(self._snapshots[: bisect_left(self._moments, moment)], count)

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        later = self._snapshots[bisect_right(self._moments, moment) :]
        return later[:count] if count >= 0 else later

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        return self._snapshots[bisect_left(self._moments, begin) : bisect_right(self._moments, end)]

    def at(self, moment: int) -> Snapshot | None:
        return next(iter(self.between(moment, moment)), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        return self._snapshots[index_slice(first, last, len(self._snapshots))]


def _last(snapshots: list[Snapshot], count: int) -> list[Snapshot]:
    return snapshots[max(len(snapshots) - count, 0) :] if count >= 0 else snapshots
