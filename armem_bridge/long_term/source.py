"""Long-term memory as queries see it: names and histories, found in elm by bounded cues."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from typing import Final, Literal, TypeVar

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.long_term.catalogue import Catalogue, names_below
from armem_bridge.long_term.mapping import CORE_SEGMENT, ENTITY, PROVIDER_SEGMENT, below, is_snapshot, snapshot_of
from armem_bridge.memory_id import Level, MemoryID
from armem_bridge.moments import to_datetime
from armem_bridge.working.history import History, read_index_range
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.versions import take_in
from elm.app import Memory
from elm.cues import time
from elm.cues.algebra import Cue
from elm.errors import MemoryMissing
from elm.interval import to_micros
from elm.query import ByFeature, Cursor, Group

PAGE: Final = 500
"""At most so many events are read at once."""

LAST: Final = to_micros(datetime.max.replace(tzinfo=UTC))
"""The last moment of the year 9999, beyond which elm has no times."""

_FEATURES: Final = {
    Level.MEMORY: CORE_SEGMENT,
    Level.CORE_SEGMENT: PROVIDER_SEGMENT,
    Level.PROVIDER_SEGMENT: ENTITY,
}

_T = TypeVar("_T")


def _unless_missing(ask: Callable[[], _T], nothing: _T) -> _T:
    """A memory that nothing was written to yet does not exist in the database, and is empty."""
    try:
        return ask()
    except MemoryMissing:
        return nothing


class LongTermSource:
    """A `Source` over the snapshots in an elm memory; each question is asked anew, so the answers are live.

    Types are not kept, so segments have none here. Of several versions of a snapshot that one is found
    which counts. With a catalogue the names come from there.
    """

    def __init__(self, memory: Memory, catalogue: Catalogue | None = None) -> None:
        self._memory = memory
        self._catalogue = catalogue

    def names(self, parent: MemoryID) -> Sequence[str]:
        """The names one level below `parent`, in order: from the catalogue, without one looked up in elm."""
        if self._catalogue is not None:
            return names_below(parent, self._catalogue.entities())
        by = ByFeature(name=_FEATURES[parent.level])
        groups = _unless_missing(lambda: self._memory.recall(below(parent)).groups(by), list[Group]())
        return sorted(group.key for group in groups if isinstance(group.key, str) and group.key)

    def knows(self, name: MemoryID) -> bool:
        """Whether elm has snapshots of this or of what is below it."""
        return _unless_missing(lambda: self._memory.recall(below(name)).exists(), False)

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        """None: types are not kept."""
        return None

    def history(self, entity: MemoryID) -> History:
        """The snapshots of an entity, each question asked in elm."""
        return LongTermHistory(self._memory, entity)


class LongTermHistory:
    """The `History` of one entity in an elm memory.

    Numbers of snapshots are those of reference times, of which each may have several versions: positions
    from the front or the back are counted by reading that many, all others by reading all.
    """

    def __init__(self, memory: Memory, entity: MemoryID) -> None:
        self._memory = memory
        self._cue = below(entity)

    def all(self) -> Sequence[Snapshot]:
        """Every snapshot."""
        return self._first(-1, None, None)

    def latest(self, count: int) -> Sequence[Snapshot]:
        """The `count` snapshots with the greatest reference times."""
        return self._last(count, None)

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` last snapshots strictly before `moment`."""
        return self._last(count, moment - 1) if moment > 0 else ()

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` first snapshots strictly after `moment`."""
        return self._first(count, moment + 1, None)

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        """The snapshots from `begin` to `end`, both included."""
        return self._first(-1, begin, end)

    def at(self, moment: int) -> Snapshot | None:
        """The snapshot with exactly this reference time."""
        return next(iter(self.between(moment, moment)), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        """The snapshots from position `first` to `last`, both included; all are read if one counts from each end."""
        return read_index_range(self, first, last)

    def _first(self, count: int, begin: int | None, end: int | None) -> Sequence[Snapshot]:
        """The `count` first ones from `begin` to `end`."""
        if begin is not None and (begin > LAST or (end is not None and end < begin)):
            return []
        return _unless_missing(lambda: self._found("begin", count, begin, end), [])

    def _last(self, count: int, end: int | None) -> Sequence[Snapshot]:
        """The `count` last ones up to `end`."""
        return _unless_missing(lambda: self._found("-begin", count, None, end)[::-1], [])

    def _found(
        self, order: Literal["begin", "-begin"], count: int, begin: int | None, end: int | None
    ) -> list[Snapshot]:
        """`count` snapshots (all where that is negative) in this order, of each the version that counts."""
        found: dict[int, Snapshot] = {}
        if count == 0:
            return []
        for snapshot in self._versions(order, count, begin, end):
            if len(found) == count and snapshot.referenced not in found:
                break
            take_in(found, snapshot)
        return list(found.values())

    def _versions(
        self, order: Literal["begin", "-begin"], count: int, begin: int | None, end: int | None
    ) -> Iterator[Snapshot]:
        """All versions in this order, read page by page; `count` says how many snapshots are wanted."""
        cue = self._cue
        if begin is not None or end is not None:
            cue = cue & _window(begin, end)
        recollection = self._memory.recall(cue, order=order)
        # One more than wanted, for only the next reference time tells that no further version is to come.
        size = PAGE if count < 0 else min(count + 1, PAGE)
        after: Cursor | None = None
        while True:
            page = recollection.page(size, after=after)
            yield from (snapshot_of(event) for event in page.events if is_snapshot(event))
            if page.cursor is None:
                return
            after, size = page.cursor, PAGE


def _window(begin: int | None, end: int | None) -> Cue:
    first = None if begin is None else to_datetime(begin)
    last = None if end is None or end > LAST else to_datetime(end)
    return time("subset", first, last)
