"""Several memories of the same things, answering as one: where a snapshot is kept does not show."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.history import History, Source, read_index_range
from armem_bridge.working.snapshot import Snapshot, supersedes


class UnionSource:
    """The union of several sources; of none, what is empty.

    A snapshot that several have counts once; of different versions that one which counts
    (`snapshot.supersedes`). The sources are asked in the order given: what moves from one to another
    while a query runs is missed by neither if it moves in this order too, so working memory comes first.
    """

    def __init__(self, *sources: Source) -> None:
        self._sources = sources

    def names(self, parent: MemoryID) -> Sequence[str]:
        return sorted({name for source in self._sources for name in source.names(parent)})

    def knows(self, name: MemoryID) -> bool:
        return any(source.knows(name) for source in self._sources)

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        types = (source.segment_type(segment) for source in self._sources)
        return next((found for found in types if found is not None), None)

    def history(self, entity: MemoryID) -> History:
        return _UnionHistory([source.history(entity) for source in self._sources])


class _UnionHistory:
    """The union of the histories of one entity.

    The last n of a union are among the last n of each history, and so for the first n: nobody has to
    give more than the query asks for, but for an index range from the front to the back.
    """

    def __init__(self, histories: Sequence[History]) -> None:
        self._histories = histories

    def all(self) -> Sequence[Snapshot]:
        return self._merged(lambda history: history.all())

    def latest(self, count: int) -> Sequence[Snapshot]:
        return _last(self._merged(lambda history: history.latest(count)), count)

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        return _last(self._merged(lambda history: history.before(moment, count)), count)

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        found = self._merged(lambda history: history.after(moment, count))
        return found[:count] if count >= 0 else found

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        return self._merged(lambda history: history.between(begin, end))

    def at(self, moment: int) -> Snapshot | None:
        found = [history.at(moment) for history in self._histories]
        return next(iter(_merge([[each] for each in found if each is not None])), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        return read_index_range(self, first, last)

    def _merged(self, ask: Callable[[History], Sequence[Snapshot]]) -> list[Snapshot]:
        return _merge(ask(history) for history in self._histories)


def _merge(parts: Iterable[Sequence[Snapshot]]) -> list[Snapshot]:
    """Snapshots of one entity in order of time, one for each moment: of equal versions the first one found."""
    found: dict[int, Snapshot] = {}
    for part in parts:
        for snapshot in part:
            moment = snapshot.id.timestamp
            known = found.get(moment)
            if known is None or supersedes(snapshot, known):
                found[moment] = snapshot
    return [found[moment] for moment in sorted(found)]


def _last(snapshots: list[Snapshot], count: int) -> list[Snapshot]:
    return snapshots[max(len(snapshots) - count, 0) :] if count >= 0 else snapshots
