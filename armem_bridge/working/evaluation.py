"""What a query means: the one evaluation, over whatever stands behind the ports of a memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import assert_never

from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import GREATEST
from armem_bridge.working.history import History, Source
from armem_bridge.working.patterns import name_matcher
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
    Names,
    ProviderSegmentQuery,
    Query,
    RegexNames,
    SingleName,
    SingleSnapshot,
    SnapshotQuery,
    TimeRange,
)
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.tree import CoreSegment, Entity, Memory, ProviderSegment


def evaluate(query: Query, source: Source, memory: str) -> Memory:
    """What the memory of that name has of what `query` asks for.

    Selections at one level give their union. Only what was selected is in the result; a segment or entity
    that was selected and exists is there even if nothing below it was found. The target of the query is
    not looked at: `source` is what answers.
    """
    root = MemoryID(memory=memory)
    found: dict[str, CoreSegment] = {}
    for wanted in query.memories:
        if selects(wanted.names, memory):
            _core_segments(wanted.core_segments, root, source, found)
    result = Memory(id=root, core_segments=found)
    for entity in result.entities():
        _finish(entity.history, query.with_data)
    return result


def selects(names: Names, name: str) -> bool:
    """Whether a name is among those selected."""
    return name in _selected(names, (name,))


def _core_segments(
    queries: Iterable[CoreSegmentQuery], memory: MemoryID, source: Source, found: dict[str, CoreSegment]
) -> None:
    for query in queries:
        for name in _names(query.names, memory, source):
            segment = found.get(name)
            if segment is None:
                own = memory.with_core_segment(name)
                if isinstance(query.names, SingleName) and not source.knows(own):
                    continue
                segment = CoreSegment(id=own, aron_type=source.segment_type(own), provider_segments={})
                found[name] = segment
            _provider_segments(query.provider_segments, segment.id, source, segment.provider_segments)


def _provider_segments(
    queries: Iterable[ProviderSegmentQuery], core: MemoryID, source: Source, found: dict[str, ProviderSegment]
) -> None:
    for query in queries:
        for name in _names(query.names, core, source):
            segment = found.get(name)
            if segment is None:
                own = core.with_provider_segment(name)
                if isinstance(query.names, SingleName) and not source.knows(own):
                    continue
                segment = ProviderSegment(id=own, aron_type=source.segment_type(own), entities={})
                found[name] = segment
            _entities(query.entities, segment.id, source, segment.entities)


def _entities(queries: Iterable[EntityQuery], provider: MemoryID, source: Source, found: dict[str, Entity]) -> None:
    for query in queries:
        for name in _names(query.names, provider, source):
            entity = found.get(name)
            if entity is None:
                own = provider.with_entity(name)
                if isinstance(query.names, SingleName) and not source.knows(own):
                    continue
                entity = Entity(id=own, history={})
                found[name] = entity
            if query.snapshots:
                history = source.history(entity.id)
                for wanted in query.snapshots:
                    for snapshot in _snapshots(wanted, history):
                        entity.history[snapshot.id.timestamp] = snapshot


def _names(names: Names, parent: MemoryID, source: Source) -> Iterable[str]:
    """The names to look at: a single one without asking what else there is."""
    return (names.name,) if isinstance(names, SingleName) else _selected(names, source.names(parent))


def _selected(names: Names, known: Sequence[str]) -> Iterable[str]:
    match names:
        case AllNames():
            return known
        case SingleName(name=name):
            return (name,) if name in known else ()
        case RegexNames(pattern=pattern):
            return filter(name_matcher(pattern), known)
        case _:
            assert_never(names)


def _snapshots(query: SnapshotQuery, history: History) -> Iterable[Snapshot]:
    match query:
        case AllSnapshots():
            return history.all()
        case LatestSnapshots(count=count):
            return history.latest(count)
        case SingleSnapshot(timestamp=moment):
            return history.latest(1) if moment < 0 else _at(history, moment)
        case IndexRange(first=first, last=last):
            return history.index_range(first, last)
        case BeforeTime(timestamp=moment, max_entries=count):
            return history.before(moment, count)
        case AtOrBefore(timestamp=moment):
            return _at(history, moment) or history.before(moment, 1)
        case TimeRange(min_timestamp=begin, max_timestamp=end):
            return history.between(max(begin, 0), end if end >= 0 else GREATEST)
        case Approximate(timestamp=moment, eps=eps):
            return _at(history, moment) or _neighbours(history, moment, eps)
        case _:
            assert_never(query)


def _at(history: History, moment: int) -> tuple[Snapshot, ...]:
    snapshot = history.at(moment)
    return () if snapshot is None else (snapshot,)


def _neighbours(history: History, moment: int, eps: int) -> list[Snapshot]:
    around = (*history.before(moment, 1), *history.after(moment, 1))
    return [each for each in around if eps < 0 or abs(each.id.timestamp - moment) <= eps]


def _finish(history: dict[int, Snapshot], with_data: bool) -> None:
    """Bring snapshots that several selections gave into order of time, and leave the data out where asked to."""
    moments = sorted(history)
    if moments != list(history):
        ordered = [(moment, history[moment]) for moment in moments]
        history.clear()
        history.update(ordered)
    if not with_data:
        for moment, snapshot in history.items():
            history[moment] = snapshot.without_data()
