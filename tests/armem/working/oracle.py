"""What queries mean, by the documents and by brute force, over a flat list of snapshots; and random ones of both."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TypeVar

from hypothesis import strategies as st

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID
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
    RegexNames,
    SingleName,
    SingleSnapshot,
    SnapshotQuery,
    TimeRange,
)
from armem_bridge.working.snapshot import Snapshot, snapshot_hash
from tests.armem.working.scenes import CORES, CUP, snapshot

Node = TypeVar("Node")
Nested = dict[str, dict[str, dict[str, list[Snapshot]]]]


def what_counts(versions: Iterable[Snapshot]) -> list[Snapshot]:
    """Of all versions of a snapshot the one sent last, then the one with the greater hash."""
    best: dict[MemoryID, Snapshot] = {}
    for each in sorted(versions, key=lambda one: (one.sent, snapshot_hash(one)), reverse=True):
        best.setdefault(each.id, each)
    return sorted(best.values(), key=lambda one: one.id)


def means(query: SnapshotQuery, h: Sequence[Snapshot]) -> list[Snapshot]:
    """The snapshots that a query selects of a history that ascends by time."""
    match query:
        case AllSnapshots():
            return list(h)
        case SingleSnapshot(timestamp=t):
            return [s for s in h if s.referenced == t] if t >= 0 else [s for s in h if s is h[-1]]
        case LatestSnapshots(count=n):
            return [s for i, s in enumerate(h) if len(h) - i <= n]
        case IndexRange(first=a, last=b):
            positive = [i if i >= 0 else len(h) + i for i in (a, b)]
            return [s for i, s in enumerate(h) if positive[0] <= i <= positive[1]]
        case BeforeTime(timestamp=t, max_entries=n):
            return [s for s in h if s.referenced < t and (n < 0 or sum(s.referenced < o.referenced < t for o in h) < n)]
        case AtOrBefore(timestamp=t):
            return [s for s in h if s.referenced == max(o.referenced for o in h if o.referenced <= t or o is s) <= t]
        case TimeRange(min_timestamp=a, max_timestamp=b):
            return [s for s in h if (a < 0 or s.referenced >= a) and (b < 0 or s.referenced <= b)]
        case Approximate(timestamp=t, eps=e):
            exact = [s for s in h if s.referenced == t]
            around = [s for s in h if not any(o.referenced in between(s.referenced, t) for o in h)]
            return exact or [s for s in around if e < 0 or abs(s.referenced - t) <= e]


def between(one: int, other: int) -> range:
    """The moments strictly between two."""
    return range(min(one, other) + 1, max(one, other))


def named(names: Names, name: str) -> bool:
    """Whether a name is selected."""
    match names:
        case AllNames():
            return True
        case SingleName(name=wanted):
            return name == wanted
        case RegexNames(pattern=pattern):
            return re.fullmatch(pattern, name) is not None


def answer(query: Query, flat: Sequence[Snapshot], cores: Sequence[str] = CORES) -> Nested:
    """What a query finds in a memory that has these core segments and snapshots."""
    found: dict[str, dict[str, dict[str, dict[int, Snapshot]]]] = {}
    ids = {each.id for each in flat}
    for one in (m for m in query.memories if named(m.names, "Object")):
        for two, core in ((c, name) for c in one.core_segments for name in cores if named(c.names, name)):
            providers = found.setdefault(core, {})
            known = {i.provider_segment for i in ids if i.core_segment == core}
            for three, provider in ((p, name) for p in two.provider_segments for name in known if named(p.names, name)):
                entities = providers.setdefault(provider, {})
                there = {i.entity for i in ids if (i.core_segment, i.provider_segment) == (core, provider)}
                for four, entity in ((e, name) for e in three.entities for name in there if named(e.names, name)):
                    history = [s for s in flat if s.id.names == ("Object", core, provider, entity)]
                    selected = [s for wanted in four.snapshots for s in means(wanted, history)]
                    entities.setdefault(entity, {}).update((s.referenced, s) for s in selected)
    return {
        core: {
            provider: {entity: [history[t] for t in sorted(history)] for entity, history in entities.items()}
            for provider, entities in providers.items()
        }
        for core, providers in found.items()
    }


class NaiveSource:
    """A memory that looks through a list at every question: a source of its own making, to stand for any other."""

    def __init__(self, flat: Iterable[Snapshot], cores: Iterable[str] = CORES) -> None:
        self.flat = flat
        self.cores = list(cores)

    def names(self, parent: MemoryID) -> Sequence[str]:
        if parent.provider_segment:
            return sorted({s.id.entity for s in self.flat if parent.contains(s.id)})
        if parent.core_segment:
            return sorted({s.id.provider_segment for s in self.flat if parent.contains(s.id)})
        return self.cores

    def knows(self, name: MemoryID) -> bool:
        return any(name.contains(s.id) for s in self.flat) or (not name.provider_segment and name.core_segment in CORES)

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        return None

    def history(self, entity: MemoryID) -> NaiveHistory:
        return NaiveHistory(what_counts(s for s in list(self.flat) if s.id.entity_id == entity))


class NaiveHistory:
    """One history of a `NaiveSource`."""

    def __init__(self, history: list[Snapshot]) -> None:
        self.h = history

    def all(self) -> Sequence[Snapshot]:
        return self.h

    def latest(self, count: int) -> Sequence[Snapshot]:
        return [s for i, s in enumerate(self.h) if count < 0 or len(self.h) - i <= count]

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        return NaiveHistory([s for s in self.h if s.referenced < moment]).latest(count)

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        later = [s for s in self.h if s.referenced > moment]
        return [s for i, s in enumerate(later) if count < 0 or i < count]

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        return [s for s in self.h if begin <= s.referenced <= end]

    def at(self, moment: int) -> Snapshot | None:
        return next((s for s in self.h if s.referenced == moment), None)

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        return means(IndexRange(first=first, last=last), self.h)


# Random memories and queries: few names and few moments, so that they meet

NAMES = ["cup", "blue-cup", "Cup", "a/b", "ü'\"", "50%", ".*"]
PATTERNS = [".*", "cup", ".*cup", "[Cc]up", "(cup|50%)", r"\.\*", ".*[/%].*", "", r"\w+", "(a+)+"]

times = st.integers(0, 9)
names = st.sampled_from(NAMES)
versions = st.builds(
    lambda core, provider, entity, moment, value, sent: snapshot(
        moment,
        value,
        entity=CUP.with_core_segment(core).with_provider_segment(provider).with_entity(entity),
        sent=sent,
    ),
    st.sampled_from(CORES[:2]),
    st.sampled_from(NAMES[:2]),
    names,
    times,
    st.integers(0, 2),
    st.integers(0, 3),
)
histories = st.lists(
    st.builds(
        lambda moment, value, sent: snapshot(moment, value, sent=sent), times, st.integers(0, 2), st.integers(0, 3)
    ),
    max_size=12,
)
memories = st.lists(versions, min_size=8, max_size=25) | st.lists(versions, max_size=25)


def selecting(known: Sequence[str], patterns: Sequence[str]) -> st.SearchStrategy[Names]:
    """Selections of names, most of which find something."""
    single, regex = st.sampled_from([*known, "nothing"]), st.sampled_from(patterns)
    ways: list[st.SearchStrategy[Names]] = [st.builds(SingleName, name=single), st.builds(RegexNames, pattern=regex)]
    return st.one_of(st.just(AllNames()), st.just(AllNames()), *ways)


some_time = st.integers(-1, 10)
snapshot_queries: st.SearchStrategy[SnapshotQuery] = st.one_of(
    st.just(AllSnapshots()),
    st.builds(SingleSnapshot, timestamp=some_time),
    st.builds(LatestSnapshots, count=st.integers(0, 12)),
    st.builds(IndexRange, first=st.integers(-13, 12), last=st.integers(-13, 12)),
    st.builds(BeforeTime, timestamp=times, max_entries=st.integers(-1, 4)),
    st.builds(AtOrBefore, timestamp=times),
    st.builds(TimeRange, min_timestamp=some_time, max_timestamp=some_time),
    st.builds(Approximate, timestamp=times, eps=st.integers(-1, 4)),
)


def some(what: st.SearchStrategy[Node]) -> st.SearchStrategy[list[Node]]:
    """One or two, seldom none."""
    return st.lists(what, min_size=1, max_size=2) | st.lists(what, max_size=2)


entity_queries = st.builds(
    EntityQuery, names=selecting(NAMES, PATTERNS), snapshots=st.lists(snapshot_queries, max_size=3)
)
provider_queries = st.builds(
    ProviderSegmentQuery, names=selecting(NAMES[:2], [".*cup", "cup", "c"]), entities=some(entity_queries)
)
core_queries = st.builds(
    CoreSegmentQuery, names=selecting(CORES, [".*a.*", "Class|x", "n"]), provider_segments=some(provider_queries)
)
memory_queries = st.builds(
    MemoryQuery, names=selecting(["Object", "Object", "Object"], ["Obj.*", ".*"]), core_segments=some(core_queries)
)
queries = st.builds(Query, memories=some(memory_queries))


def about_the_cup(*wanted: SnapshotQuery) -> Query:
    """A query for snapshots of the blue cup."""
    entities = [EntityQuery(names=SingleName(name="blue-cup"), snapshots=wanted)]
    providers = [ProviderSegmentQuery(names=SingleName(name="ObjectLocalizer"), entities=entities)]
    cores = [CoreSegmentQuery(names=SingleName(name="Instance"), provider_segments=providers)]
    return Query(memories=[MemoryQuery(names=SingleName(name="Object"), core_segments=cores)])
