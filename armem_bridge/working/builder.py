"""Builds queries level by level, as in ArmarX (listing 4.9)."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from typing import Generic, TypeVar

from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET, as_moment
from armem_bridge.working.query import (
    AllNames,
    AllSnapshots,
    Approximate,
    AtOrBefore,
    BeforeTime,
    CoreSegmentQuery,
    EntityQuery,
    IndexRange,
    LatestSnapshots,
    MemoryQuery,
    Names,
    ProviderSegmentQuery,
    Query,
    QueryTarget,
    RegexNames,
    SingleName,
    SingleSnapshot,
    SnapshotQuery,
    TimeRange,
)
from armem_bridge.working.refusals import InvalidQuery

_Selection = TypeVar("_Selection")


class NamesSelector(Generic[_Selection]):
    """The selections made at one level that has names. Each gives the selection to go on from, a level deeper."""

    def __init__(self, select: Callable[[Names], _Selection]) -> None:
        self._select = select
        self.selections: list[_Selection] = []

    def _add(self, names: Names) -> _Selection:
        selection = self._select(names)
        self.selections.append(selection)
        return selection

    def all(self) -> _Selection:
        """Everything at this level."""
        return self._add(AllNames())

    def name(self, name: str) -> _Selection:
        """What has this name. Call it again, or another one, to select more at this level."""
        return self._add(SingleName(name=name))

    def regex(self, pattern: str) -> _Selection:
        """What has a name that the expression matches as a whole (see `armem_bridge.working.patterns`)."""
        return self._add(RegexNames(pattern=pattern))


class SnapshotsSelector:
    """The selections of snapshots of the entities above. Times are microseconds since 1970, or datetimes."""

    def __init__(self) -> None:
        self.selections: list[SnapshotQuery] = []

    def all(self) -> None:
        """The whole history."""
        self.selections.append(AllSnapshots())

    def latest(self) -> None:
        """The current state."""
        self.selections.append(LatestSnapshots(count=1))

    def latest_n(self, count: int) -> None:
        """The last `count` snapshots by reference time."""
        self.selections.append(LatestSnapshots(count=count))

    def at(self, time: int | datetime) -> None:
        """The snapshot with exactly this reference time."""
        self.selections.append(SingleSnapshot(timestamp=as_moment(time, what="the time of a snapshot")))

    def before(self, time: int | datetime, *, max_entries: int = 1) -> None:
        """The last snapshots strictly before a time."""
        moment = as_moment(time, what="the time before which to look")
        self.selections.append(BeforeTime(timestamp=moment, max_entries=max_entries))

    def at_or_before(self, time: int | datetime) -> None:
        """The snapshot that was the latest at a time."""
        self.selections.append(AtOrBefore(timestamp=as_moment(time, what="the time of a snapshot")))

    def time_range(self, begin: int | datetime = NOT_SET, end: int | datetime = NOT_SET) -> None:
        """The snapshots from `begin` to `end`, both included; a side left out is open."""
        self.selections.append(
            TimeRange(
                min_timestamp=as_moment(begin, what="the begin of a time range"),
                max_timestamp=as_moment(end, what="the end of a time range"),
            )
        )

    def index_range(self, first: int = 0, last: int = -1) -> None:
        """The snapshots from one position to another, both included; -1 is the latest."""
        self.selections.append(IndexRange(first=first, last=last))

    def approximate(self, time: int | datetime, *, eps: int | timedelta = NOT_SET) -> None:
        """The snapshot at a time, or else its neighbours that are at most `eps` away, in microseconds if a number."""
        moment = as_moment(time, what="the time around which to look")
        tolerance = eps // timedelta(microseconds=1) if isinstance(eps, timedelta) else eps
        self.selections.append(Approximate(timestamp=moment, eps=tolerance))


class EntitiesSelection:
    """Selected entities: say which of their `snapshots`. Without, they are found with empty histories."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self.snapshots = SnapshotsSelector()

    def build(self) -> EntityQuery:
        """This part of the query."""
        return EntityQuery(names=self._names, snapshots=self.snapshots.selections)


class ProviderSegmentsSelection:
    """Selected provider segments: say which of their `entities`."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self.entities = NamesSelector(EntitiesSelection)

    def build(self) -> ProviderSegmentQuery:
        """This part of the query."""
        return ProviderSegmentQuery(names=self._names, entities=[each.build() for each in self.entities.selections])


class CoreSegmentsSelection:
    """Selected core segments: say which of their `provider_segments`."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self.provider_segments = NamesSelector(ProviderSegmentsSelection)

    def build(self) -> CoreSegmentQuery:
        """This part of the query."""
        below = [each.build() for each in self.provider_segments.selections]
        return CoreSegmentQuery(names=self._names, provider_segments=below)


class MemoriesSelection:
    """Selected memories: say which of their `core_segments`."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self.core_segments = NamesSelector(CoreSegmentsSelection)

    def build(self) -> MemoryQuery:
        """This part of the query."""
        return MemoryQuery(names=self._names, core_segments=[each.build() for each in self.core_segments.selections])


class QueryBuilder:
    """Collects selections, level by level, and makes them one query.

    `builder.memories.name("Object").core_segments.name("Instance")` ... goes down one branch; what each
    call returns can be kept and gone on from more than once. A level at which nothing is selected is
    found empty: so one asks which segments there are.
    """

    def __init__(self) -> None:
        self.memories = NamesSelector(MemoriesSelection)

    @property
    def core_segments(self) -> NamesSelector[CoreSegmentsSelection]:
        """The core segments of whichever memory is asked."""
        return self.memories.all().core_segments

    def select(self, wanted: MemoryID) -> None:
        """Everything that an ID contains, down to whole snapshots: what is not set in it selects all.

        Queries know no instances, as in ArmarX: the ID of one selects the snapshot that it would be in.
        """
        if not isinstance(wanted, MemoryID):
            raise InvalidQuery(f"what is selected is a MemoryID, not {wanted!r:.80}: make text one with MemoryID.parse")

        def pick(selector: NamesSelector[_Selection], name: str) -> _Selection:
            return selector.name(name) if name else selector.all()

        core = pick(pick(self.memories, wanted.memory).core_segments, wanted.core_segment)
        entity = pick(pick(core.provider_segments, wanted.provider_segment).entities, wanted.entity)
        if wanted.timestamp < 0:
            entity.snapshots.all()
        else:
            entity.snapshots.at(wanted.timestamp)

    def build(self, *, target: QueryTarget = QueryTarget.WM, with_data: bool = True) -> Query:
        """The query: which memory answers it, and whether with the data or with null in their place."""
        return Query(memories=[each.build() for each in self.memories.selections], target=target, with_data=with_data)
