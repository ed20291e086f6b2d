"""History limits, what leaves working memory by them, and how it was used."""

from __future__ import annotations

from itertools import permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from armem_bridge.memory_id import MemoryID
from armem_bridge.working import QueryTarget
from armem_bridge.working.limits import UNLIMITED, HistoryLimits
from armem_bridge.working.query import AllSnapshots, LatestSnapshots, SingleSnapshot
from armem_bridge.working.refusals import InvalidServer
from tests.armem.working.archives import ForgetfulArchive, ListArchive
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import CUP, MEMORY, commit, moments, object_memory, update

CUPS = about_the_cup(AllSnapshots())
INSTANCE = MEMORY.with_core_segment("Instance")
LOCALIZER = INSTANCE.with_provider_segment("ObjectLocalizer")


@pytest.mark.parametrize("order", list(permutations([10, 20, 30, 40])))
def test_the_oldest_reference_time_goes_first(order: tuple[int, ...]) -> None:
    archive = ListArchive()
    server = object_memory(limits={MEMORY: 2}, archive=archive)
    for moment in order:
        commit(server, update(moment))

    assert moments(server.query(CUPS)) == [30, 40]
    assert sorted(each.snapshot.referenced for each in archive.evicted) == [10, 20]
    assert server.status().evicted == 2


def test_what_comes_late_into_a_full_history_leaves_at_once() -> None:
    archive = ListArchive(on_eviction_only=True)
    server = object_memory(limits={CUP: 2}, archive=archive)
    commit(server, update(30), update(40), update(10))

    assert moments(server.query(CUPS)) == [30, 40]
    assert [each.snapshot.referenced for each in archive.evicted] == [10]


def test_the_closest_limit_holds() -> None:
    limits = HistoryLimits({MemoryID(): 9, MEMORY: 5, INSTANCE: 4, LOCALIZER: UNLIMITED, CUP: 2})

    assert limits.of(CUP) == 2
    assert limits.of(CUP.with_entity("mug")) is None
    assert limits.of(INSTANCE.with_provider_segment("Simox").with_entity("mug")) == 4
    assert limits.of(MEMORY.with_core_segment("Class").with_provider_segment("P").with_entity("e")) == 5
    assert limits.of(MemoryID(memory="Grasp", core_segment="C", provider_segment="P", entity="e")) == 9
    assert HistoryLimits({}).of(CUP) is None


@pytest.mark.parametrize("limit", [0, -2, 1.5, True, None])
def test_limits_that_are_none(limit: int) -> None:
    with pytest.raises(InvalidServer, match="history limit of Object is 1 or more"):
        object_memory(limits={MEMORY: limit})


@pytest.mark.parametrize("where", [CUP.with_timestamp(3), MemoryID(memory="Object", entity="cup")])
def test_limits_are_set_for_what_holds_snapshots(where: MemoryID) -> None:
    with pytest.raises(InvalidServer, match="set for an entity"):
        object_memory(limits={where: 3})


@pytest.mark.parametrize("where", [MemoryID(memory="Grasp"), MEMORY.with_core_segment("Grasp")])
def test_limits_are_set_for_what_the_memory_has(where: MemoryID) -> None:
    with pytest.raises(InvalidServer, match="correct its memory and core segment"):
        object_memory(limits={where: 3})
    object_memory(limits={MemoryID(): 3, CUP: 4})


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 2)), max_size=15), st.integers(1, 4))
def test_a_limited_memory_with_its_archive_is_an_unlimited_one(given_: list[tuple[int, int]], limit: int) -> None:
    limited = object_memory(limits={INSTANCE: limit}, archive=ListArchive(on_eviction_only=True))
    unlimited = object_memory()
    commit(unlimited, update(0, "first"))
    commit(limited, update(0, "first"))
    for moment, sent in given_:
        commit(unlimited, update(moment, sent, sent=sent))
        commit(limited, update(moment, sent, sent=sent))

    both = about_the_cup(AllSnapshots())
    found = list(limited.query(replace(both, target=QueryTarget.BOTH)).snapshots())
    assert found == list(unlimited.query(both).snapshots())
    assert len(moments(limited.query(both))) == min(limit, len(found))


def test_snapshots_are_used_when_a_query_returns_them() -> None:
    time = [100]
    archive = ListArchive()
    server = object_memory(limits={MEMORY: 2}, archive=archive, clock=lambda: time[0])
    commit(server, update(1), update(2))
    first, second = CUP.with_timestamp(1), CUP.with_timestamp(2)
    assert (server.usage(first).count, server.usage(first).last) == (0, -1)

    server.query(CUPS)
    time[0] = 200
    server.query(about_the_cup(LatestSnapshots(), SingleSnapshot(timestamp=2)))
    server.query(about_the_cup(SingleSnapshot(timestamp=7)))
    server.get(first)
    assert (server.usage(first).count, server.usage(first).last) == (1, 100)
    assert (server.usage(second).count, server.usage(second).last) == (2, 200)
    time[0] = 150
    server.query(CUPS)
    assert (server.usage(second).count, server.usage(second).last) == (3, 200), "clocks are set back at times"

    commit(server, update(3))
    (gone,) = archive.evicted
    assert (gone.snapshot.id, gone.usage.count, gone.usage.last) == (first, 2, 150)
    assert server.usage(first).count == 0
    assert server.usage(CUP.with_entity("mug").with_timestamp(1)).count == 0


def test_an_archive_that_fails_does_not_stop_the_memory(caplog: pytest.LogCaptureFixture) -> None:
    server = object_memory(limits={MEMORY: 1}, archive=ForgetfulArchive())
    commit(server, update(1))
    commit(server, update(2))

    assert moments(server.query(CUPS)) == [2]
    assert server.status().archive_failures == 1
    assert "did not take 1 evicted snapshots" in caplog.text
