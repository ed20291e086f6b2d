"""Where a snapshot is kept does not show: in working memory, waiting to be consolidated, or in elm."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Event as Flag
from threading import Thread

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from armem_bridge.long_term import Consolidation, LongTermMemory, LongTermSource, When, arrival_of
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import GREATEST
from armem_bridge.working import Commit, EntityUpdate, Query, QueryTarget, Snapshot
from armem_bridge.working.evaluation import evaluate
from armem_bridge.working.query import AllSnapshots, LatestSnapshots, SnapshotQuery, TimeRange
from elm.app import Memory
from elm.event import Event
from elm.interval import Interval, from_micros
from elm.storage.memory import MemoryStore
from elm.store import Arrival, BatchReport
from tests.armem.long_term.memories import QUICK, behind, in_process
from tests.armem.working.oracle import (
    about_the_cup,
    answer,
    histories,
    memories,
    queries,
    snapshot_queries,
    what_counts,
)
from tests.armem.working.scenes import CUP, MEMORY, NOW, commit, contents, moments, snapshot, update
from tests.conftest import StoreFactory

limits = st.fixed_dictionaries(
    {MEMORY: st.sampled_from([1, 2, 3, -1])},
    optional={CUP.with_core_segment("Instance"): st.sampled_from([1, 2, -1]), CUP: st.sampled_from([1, 4])},
)
some_queries = st.lists(snapshot_queries, min_size=1, max_size=3)


def as_update(given: Snapshot) -> EntityUpdate:
    """The update that makes this snapshot."""
    metadata = given.instances[0].metadata
    return EntityUpdate(
        entity=given.id.entity_id,
        instances=tuple(each.data for each in given.instances),
        referenced=given.referenced,
        sent=metadata.sent,
    )


def without_empty_cores(found: dict[str, object]) -> dict[str, object]:
    """Long-term memory knows no core segments but those that it has snapshots of."""
    return {core: providers for core, providers in found.items() if providers}


class HeldStore(MemoryStore):
    """A store that writes nothing before it is told to."""

    def __init__(self) -> None:
        super().__init__()
        self.go = Flag()

    def load(self, arrivals: Sequence[Arrival]) -> BatchReport:
        assert self.go.wait(timeout=30)
        return super().load(arrivals)


def ask(archive: LongTermMemory, versions: Sequence[Snapshot], wanted: Query, **options: object) -> None:
    """Commit these versions, and compare the answers to a query with those of the oracle, flushed and not."""
    with behind(archive, **options) as server:
        for each in versions:
            commit(server, as_update(each))
        both, beyond = (replace(wanted, target=target) for target in (QueryTarget.BOTH, QueryTarget.LTM))
        expected = answer(wanted, what_counts(versions))
        assert contents(server.query(both)) == expected
        assert archive.flush(timeout=30)
        assert contents(server.query(both)) == expected
        seen = contents(server.query(beyond))
        assert without_empty_cores(dict(seen)) == without_empty_cores(dict(expected))


@given(memories, limits, queries)
def test_the_split_does_not_show(versions: list[Snapshot], limited: dict[MemoryID, int], query: Query) -> None:
    ask(LongTermMemory(in_process(), QUICK), versions, query, limits=limited)


@given(histories, limits, some_queries)
def test_the_split_of_a_history_does_not_show(
    versions: list[Snapshot], limited: dict[MemoryID, int], wanted: list[SnapshotQuery]
) -> None:
    ask(LongTermMemory(in_process(), QUICK), versions, about_the_cup(*wanted), limits=limited)


@settings(max_examples=5)
@given(memories, limits, st.lists(queries, min_size=3, max_size=3))
def test_the_split_does_not_show_in_any_store(
    store_factory: StoreFactory, versions: list[Snapshot], limited: dict[MemoryID, int], wanted: list[Query]
) -> None:
    archive = LongTermMemory(Memory(store_factory()), QUICK)
    with behind(archive, limits=limited) as server:
        for each in versions:
            commit(server, as_update(each))
        for query in wanted:
            expected = answer(query, what_counts(versions))
            assert contents(server.query(replace(query, target=QueryTarget.BOTH))) == expected
        assert archive.flush(timeout=30)
        for query in wanted:
            expected = answer(query, what_counts(versions))
            assert contents(server.query(replace(query, target=QueryTarget.BOTH))) == expected


@settings(max_examples=5)
@given(histories, some_queries)
def test_histories_in_any_store(
    store_factory: StoreFactory, versions: list[Snapshot], wanted: list[SnapshotQuery]
) -> None:
    memory = Memory(store_factory())
    memory.add_type("Seen")
    memory.store.load([arrival_of(each, event_type="Seen") for each in versions])
    for query in wanted:
        asked = about_the_cup(query)
        found = contents(evaluate(asked, LongTermSource(memory), "Object"))
        assert without_empty_cores(dict(found)) == without_empty_cores(dict(answer(asked, what_counts(versions))))


@given(memories, limits, queries)
def test_what_waits_is_found(versions: list[Snapshot], limited: dict[MemoryID, int], query: Query) -> None:
    store = HeldStore()
    archive = LongTermMemory(Memory(store), Consolidation(batch=3))
    with behind(archive, limits=limited) as server:
        for each in versions:
            commit(server, as_update(each))
        assert len(list(store.types())) <= 4
        expected = answer(query, what_counts(versions))
        assert contents(server.query(replace(query, target=QueryTarget.BOTH))) == expected
        seen = contents(server.query(replace(query, target=QueryTarget.LTM)))
        assert without_empty_cores(dict(seen)) == without_empty_cores(dict(expected))
        store.go.set()


@given(memories, limits, queries)
def test_where_only_what_is_evicted_is_consolidated(
    versions: list[Snapshot], limited: dict[MemoryID, int], query: Query
) -> None:
    archive = LongTermMemory(in_process(), replace_when(QUICK))
    with behind(archive, limits=limited) as server:
        for each in versions:
            commit(server, as_update(each))
        assert archive.flush(timeout=30)
        expected = answer(query, what_counts(versions))
        assert contents(server.query(replace(query, target=QueryTarget.BOTH))) == expected


def replace_when(settings: Consolidation) -> Consolidation:
    """The same settings for what is evicted."""
    return Consolidation(when=When.ON_EVICTION, least_pause=settings.least_pause, patience=0.0)


def test_a_memory_that_nothing_was_written_to_is_empty(store_factory: StoreFactory) -> None:
    store_factory()
    source = LongTermSource(Memory(store_factory()))

    assert source.names(MEMORY) == []
    assert not source.knows(CUP)
    history = source.history(CUP)
    assert history.latest(1) == history.all() == history.after(-1, 5) == []
    assert history.at(3) is None


def test_histories_longer_than_a_page(store_factory: StoreFactory) -> None:
    memory = Memory(store_factory())
    memory.add_type("Seen")
    versions = [snapshot(moment, sent=sent) for moment in range(1500) for sent in (1, 2)]
    memory.store.load([arrival_of(each, event_type="Seen") for each in versions])
    history = LongTermSource(memory).history(CUP)

    assert history.all() == versions[1::2]
    assert history.latest(700) == versions[-1399::2]
    assert history.after(10, 600) == versions[23:1223:2]
    assert history.index_range(-3, -2) == versions[-5:-2:2]
    assert history.index_range(1, -1498) == versions[3:6:2]


def test_times_beyond_those_of_elm_are_asked_for_in_vain() -> None:
    memory = in_process()
    memory.add_type("Seen")
    memory.store.load([arrival_of(snapshot(7), event_type="Seen")])
    history = LongTermSource(memory).history(CUP)

    assert [each.referenced for each in history.before(GREATEST, 5)] == [7]
    assert [each.referenced for each in history.between(0, GREATEST)] == [7]
    assert history.after(GREATEST - 1, 5) == []
    assert history.at(GREATEST) is None
    assert history.between(9, 8) == []
    assert history.before(0, 5) == ()


def test_events_of_others_are_passed_over() -> None:
    memory = in_process()
    memory.add_type("Seen")
    given = snapshot(7)
    event = arrival_of(given, event_type="Seen").event
    memory.store.load([arrival_of(given, event_type="Seen")])
    memory.commit(Event(type="Seen", interval=Interval.at(from_micros(8)), features=event.features))

    assert LongTermSource(memory).history(CUP).all() == [given]


def test_two_memories_in_one_elm_memory_do_not_mix() -> None:
    archive = LongTermMemory(in_process(), QUICK)
    with behind(archive) as server:
        commit(server, update(1))
        other = CUP.with_timestamp(1)
        archive.consolidate([replace(snapshot(2), id=replace(other, memory="Grasp", timestamp=2))])
        assert archive.flush(timeout=30)
        query = replace(about_the_cup(AllSnapshots()), target=QueryTarget.LTM)
        assert moments(server.query(query)) == [1]
        source = archive.source("Grasp")
        assert source is not None
        assert source.names(MemoryID(memory="Grasp")) == ["Instance"]


def test_by_hand() -> None:
    archive = LongTermMemory(in_process(), QUICK)
    with behind(archive, limits={MEMORY: 2}) as server:
        server.commit(Commit(updates=[update(moment) for moment in (10, 20, 30, 40)]))
        assert archive.flush(timeout=30)

        def find(target: QueryTarget, query: SnapshotQuery) -> list[int]:
            return moments(server.query(replace(about_the_cup(query), target=target)))

        assert find(QueryTarget.WM, AllSnapshots()) == [30, 40]
        assert find(QueryTarget.LTM, AllSnapshots()) == [10, 20, 30, 40]
        assert find(QueryTarget.BOTH, LatestSnapshots(count=3)) == [20, 30, 40]
        assert find(QueryTarget.BOTH, TimeRange(min_timestamp=15, max_timestamp=35)) == [20, 30]
        earliest = server.get(CUP.with_timestamp(10), target=QueryTarget.LTM)
        assert earliest is not None
        assert earliest.instances == snapshot(10, sent=NOW).instances


@pytest.mark.parametrize("when", list(When))
def test_nothing_is_missed_while_it_moves(when: When) -> None:
    settings = Consolidation(when=when, batch=3, backlog=20, patience=0.0)
    query = replace(about_the_cup(AllSnapshots()), target=QueryTarget.BOTH)
    acknowledged: list[int] = []
    with behind(LongTermMemory(in_process(), settings), limits={MEMORY: 2}) as server:

        def write() -> None:
            for moment in range(200):
                commit(server, update(moment))
                acknowledged.append(moment)

        writer = Thread(target=write)
        writer.start()
        asked = 0
        while writer.is_alive():
            known = len(acknowledged)
            found = contents(server.query(query))["Instance"].get("ObjectLocalizer", {}).get("blue-cup", [])
            assert [each.referenced for each in found][:known] == list(range(known))
            asked += 1
        writer.join()
    assert len(acknowledged) == 200
    assert asked > 1
