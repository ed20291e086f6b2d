"""Queries on the wire, in both directions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from armem_bridge.ice.making import blank, maker
from armem_bridge.ice.refusals import MalformedMessage, NotExpressible
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire.identifiers import IdentifierWire
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

_ALL = AllNames()


class QueryWire:
    """Queries to and from those of the loaded slice files.

    A level on the wire selects names and has the queries of the level below: `memory.Single` names a core
    segment. Which memory is asked is said by the proxy, so a query that is read selects all memories, and one
    that is written is only a server's own part. A class that the bridge does not know is refused by its name.
    """

    def __init__(self, words: Vocabulary, identifiers: IdentifierWire) -> None:
        self._words, self._ids = words, identifiers
        query = words.query
        self._input = maker(words.member(query, "Input"), "memoryQueries", "withData")
        self._cores = _NamesWire(words, "memory", "coreSegmentName", "coreSegmentQueries")
        self._providers = _NamesWire(words, "core", "providerSegmentName", "providerSegmentQueries")
        self._entities = _NamesWire(words, "provider", "entityName", "entityQueries")
        self._snapshots = words.inner(query, "entity")
        self._snapshot_readers = self._readers_of_snapshots()
        self._makers: dict[str, Callable[..., Any]] = {}
        target = words.inner(query, "QueryTarget")
        targets = getattr(target, "QueryTargetEnum", None)
        self._targets = {} if targets is None else {each: _target(str(each)) for each in targets._enumerators.values()}

    # Reading

    def read(self, wire: Any) -> Query:
        """The query. Raises `MalformedMessage` for unknown classes and null, `InvalidQuery` for all else."""
        read_core = self._read_core
        memories = MemoryQuery(names=_ALL, core_segments=[read_core(each) for each in wire.memoryQueries])
        return Query(memories=(memories,), target=self._read_target(wire.memoryQueries), with_data=wire.withData)

    def _read_core(self, wire: Any) -> CoreSegmentQuery:
        names, inner = self._cores.read(wire)
        return CoreSegmentQuery(names=names, provider_segments=[self._read_provider(each) for each in inner])

    def _read_provider(self, wire: Any) -> ProviderSegmentQuery:
        names, inner = self._providers.read(wire)
        return ProviderSegmentQuery(names=names, entities=[self._read_entity(each) for each in inner])

    def _read_entity(self, wire: Any) -> EntityQuery:
        names, inner = self._entities.read(wire)
        return EntityQuery(names=names, snapshots=[self._read_snapshots(each) for each in inner])

    def _read_snapshots(self, wire: Any) -> SnapshotQuery:
        reader = self._snapshot_readers.get(type(wire))
        if reader is None:
            raise _unknown(wire, "entity", self._snapshot_readers)
        return reader(wire)

    def _read_target(self, wires: Iterable[Any]) -> QueryTarget:
        """Where the slice files know targets: that of the memory queries, both where they differ."""
        if not self._targets:
            return QueryTarget.WM
        found = {self._targets[wire.target] for wire in wires if hasattr(wire, "target")} or {QueryTarget.WM}
        return found.pop() if len(found) == 1 else QueryTarget.BOTH

    def _readers_of_snapshots(self) -> dict[Any, Callable[[Any], SnapshotQuery]]:
        time, duration = self._ids.read_time, self._ids.read_duration
        readers: dict[str, Callable[[Any], SnapshotQuery]] = {
            "All": lambda _: AllSnapshots(),
            "Single": lambda wire: SingleSnapshot(timestamp=time(wire.timestamp)),
            "TimeRange": lambda wire: TimeRange(
                min_timestamp=time(wire.minTimestamp), max_timestamp=time(wire.maxTimestamp)
            ),
            "IndexRange": lambda wire: IndexRange(first=wire.first, last=wire.last),
            "BeforeTime": lambda wire: BeforeTime(timestamp=time(wire.timestamp), max_entries=wire.maxEntries),
            "BeforeOrAtTime": lambda wire: AtOrBefore(timestamp=time(wire.timestamp)),
            "TimeApprox": lambda wire: Approximate(timestamp=time(wire.timestamp), eps=duration(wire.eps)),
        }
        found = {name: getattr(self._snapshots, name, None) for name in readers}
        return {cls: readers[name] for name, cls in found.items() if cls is not None}

    # Writing

    def write(self, query: Query) -> Any:
        """The query as the slice files have it. Raises `NotExpressible` where they have no class for a part of it."""
        queries = [
            self._aim(self._write_core(core), query.target)
            for memory in query.memories
            for core in memory.core_segments
        ]
        return self._input(memoryQueries=queries, withData=query.with_data)

    def _aim(self, wire: Any, target: QueryTarget) -> Any:
        """Set the target of a query, unless it has it from birth."""
        known = hasattr(wire, "target")
        if self._targets.get(wire.target, QueryTarget.WM) == target if known else target == QueryTarget.WM:
            return wire
        for each, meaning in self._targets.items():
            if known and meaning == target:
                wire.target = each
                return wire
        raise NotExpressible(f"the slice files in {self._words.origin} have no target {target} of a query")

    def _write_core(self, query: CoreSegmentQuery) -> Any:
        return self._cores.write(query.names, [self._write_provider(each) for each in query.provider_segments])

    def _write_provider(self, query: ProviderSegmentQuery) -> Any:
        return self._providers.write(query.names, [self._write_entity(each) for each in query.entities])

    def _write_entity(self, query: EntityQuery) -> Any:
        return self._entities.write(query.names, [self._write_snapshots(each) for each in query.snapshots])

    def _write_snapshots(self, query: SnapshotQuery) -> Any:
        ids = self._ids
        match query:
            case AllSnapshots():
                return self._make("All")
            case SingleSnapshot(timestamp=moment):
                return self._make("Single", timestamp=ids.write_time(moment))
            case LatestSnapshots(count=1):
                return self._make("Single", timestamp=ids.write_time(-1))
            case LatestSnapshots(count=0):
                # What is after the latest one.
                return self._make("IndexRange", first=0, last=-(2**63))
            case LatestSnapshots(count=count):
                return self._make("IndexRange", first=-count, last=-1)
            case IndexRange(first=first, last=last):
                return self._make("IndexRange", first=first, last=last)
            case TimeRange(min_timestamp=begin, max_timestamp=end):
                return self._make("TimeRange", minTimestamp=ids.write_time(begin), maxTimestamp=ids.write_time(end))
            case BeforeTime(timestamp=moment, max_entries=count):
                return self._make("BeforeTime", timestamp=ids.write_time(moment), maxEntries=count)
            case AtOrBefore(timestamp=moment):
                return self._make("BeforeOrAtTime", timestamp=ids.write_time(moment))
            case Approximate(timestamp=moment, eps=eps):
                return self._make("TimeApprox", timestamp=ids.write_time(moment), eps=ids.write_duration(eps))

    def _make(self, name: str, **members: Any) -> Any:
        make = self._makers.get(name)
        if make is None:
            cls = getattr(self._snapshots, name, None)
            if cls is None:
                raise NotExpressible(f"the slice files in {self._words.origin} have no query entity::{name}")
            make = self._makers[name] = maker(cls, *members)
        return make(**members)


class _NamesWire:
    """One level of the query tree that has names: its classes All, Single and Regex."""

    def __init__(self, words: Vocabulary, level: str, name: str, inner: str) -> None:
        self._level, self._name, self._inner, self._origin = level, name, inner, words.origin
        module = words.inner(words.query, level)
        regex = f"{name}Regex"
        kinds: tuple[tuple[type[Names], str, tuple[str, ...], Callable[[Any], Names]], ...] = (
            (AllNames, "All", (), lambda _: _ALL),
            (SingleName, "Single", (name,), lambda wire: SingleName(name=getattr(wire, name))),
            (RegexNames, "Regex", (regex,), lambda wire: RegexNames(pattern=getattr(wire, regex))),
        )
        self._readers: dict[Any, Callable[[Any], Names]] = {}
        self._blanks: dict[type, Callable[[], Any]] = {}
        for kind, cls_name, members, reader in kinds:
            cls = getattr(module, cls_name, None)
            if cls is not None:
                self._readers[cls] = reader
                self._blanks[kind] = blank(cls, inner, *members)

    def read(self, wire: Any) -> tuple[Names, Iterable[Any]]:
        """Which names are selected, and the queries below."""
        reader = self._readers.get(type(wire))
        if reader is None:
            raise _unknown(wire, self._level, self._readers)
        return reader(wire), getattr(wire, self._inner)

    def write(self, names: Names, inner: list[Any]) -> Any:
        """The query of this level. Raises `NotExpressible` where the slice files have no class for it."""
        new = self._blanks.get(type(names))
        if new is None:
            raise NotExpressible(
                f"the slice files in {self._origin} have no query of {self._level} for {type(names).__name__}"
            )
        made = new()
        setattr(made, self._inner, inner)
        if type(names) is SingleName:
            setattr(made, self._name, names.name)
        elif type(names) is RegexNames:
            setattr(made, f"{self._name}Regex", names.pattern)
        return made


def _target(name: str) -> QueryTarget:
    """The meaning of a target by its name."""
    word = name.lower()
    if "wm" in word and "ltm" in word:
        return QueryTarget.BOTH
    return QueryTarget.LTM if "ltm" in word or "disk" in word else QueryTarget.WM


def _unknown(wire: Any, level: str, readers: dict[Any, Any]) -> MalformedMessage:
    if wire is None:
        return MalformedMessage(f"a query of the level {level} is null: leave it out")
    known = ", ".join(cls.__name__ for cls in readers)
    return MalformedMessage(f"a query {level}::{type(wire).__name__} is unknown here: the bridge knows {known}")
