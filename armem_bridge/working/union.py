"""Several memories of the same things, answering as one: where a snapshot is kept does not show."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.history import History, Source, read_index_range
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.versions import last_of, what_counts


class UnionSource:
    """The union of several sources; of none, what is empty.

    A snapshot that several have counts once; of different versions that one which counts
    (`snapshot.supersedes`). The sources are asked in the order given: what moves from one to another
    while a query runs is missed by neither if it moves in this order too, so working memory comes first.
    """

    def __init__(self, *sources: Source) -> None:
        self._sources = sources

    def names(self, parent: MemoryID) -> Sequence[str]:
        """The names one level below `parent` in any of the sources, in order."""
        return sorted({name for source in self._sources for name in source.names(parent)})

    def knows(self, name: MemoryID) -> bool:
        """Whether any of the sources has this."""
        return any(source.knows(name) for source in self._sources)

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        """The type of a segment in the first source that has one."""
        types = (source.segment_type(segment) for source in self._sources)
        return next((found for found in types if found is not None), None)

    def history(self, entity: MemoryID) -> History:
        """The snapshots of an entity in all sources; of several versions of one that which counts."""
        return _UnionHistory(self._sources, entity)


class _UnionHistory:
    """The union of the histories of one entity.

    The last n of a union are among the last n of each history, and so for the first n: nobody has to
    give more than the query asks for, but for an index range from the front to the back.

    A source is not asked for its history before the sources ahead of it have answered: it may copy then what it has.
    """

    def __init__(self, sources: Sequence[Source], entity: MemoryID) -> None:
        self._sources = sources
        self._entity = entity

    def all(self) -> Sequence[Snapshot]:
        return self._merged(lambda history: history.all())

    def latest(self, count: int) -> Sequence[Snapshot]:
        return last_of(self._merged(lambda history: history.latest(count)), count)

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        return last_of(self._merged(lambda history: history.before(moment, count)), count)

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        found = self._merged(lambda history: history.after(moment, count))
        return found[:count] if count >= 0 else found

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        return self._merged(lambda history: history.between(begin, end))

    def at(self, moment: int) -> Snapshot | None:
        found = [source.history(self._entity).at(moment) for source in self._sources]
        return next(iter(what_counts(each for each in found if each is not None)), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        return read_index_range(self, first, last)

    def _merged(self, ask: Callable[[History], Sequence[Snapshot]]) -> list[Snapshot]:
        return what_counts(snapshot for source in self._sources for snapshot in ask(source.history(self._entity)))
