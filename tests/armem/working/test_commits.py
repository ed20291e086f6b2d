"""Commits: each update by itself, late ones in their place, and of two versions always the same one."""

from __future__ import annotations

import logging
import math
from datetime import UTC, datetime
from itertools import permutations
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.data import Dict, Double, Int, List, NDArray, String
from armem_bridge.memory_id import InvalidMemoryID, MemoryID
from armem_bridge.moments import INVALID
from armem_bridge.working import Commit, CoreSegmentDefinition, EntityUpdate, MemoryServer, Query, Snapshot
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.query import (
    AllNames,
    AllSnapshots,
    CoreSegmentQuery,
    EntityQuery,
    MemoryQuery,
    ProviderSegmentQuery,
)
from armem_bridge.working.refusals import InvalidCommit, InvalidServer, ServerClosed
from armem_bridge.working.snapshot import Instance, snapshot_hash, supersedes
from tests.armem.working.archives import BrokenArchive, ListArchive
from tests.armem.working.oracle import about_the_cup, memories, what_counts
from tests.armem.working.scenes import CUP, NOW, commit, data, moments, object_memory, snapshot, timeless, update

_ENTITIES = [EntityQuery(names=AllNames(), snapshots=[AllSnapshots()])]
_PROVIDERS = [ProviderSegmentQuery(names=AllNames(), entities=_ENTITIES)]
EVERYTHING = Query(
    memories=[
        MemoryQuery(names=AllNames(), core_segments=[CoreSegmentQuery(names=AllNames(), provider_segments=_PROVIDERS)])
    ]
)
CUPS = about_the_cup(AllSnapshots())
HUGE = Dict({"image": NDArray((1000, 1000, 1), "uint8", bytes(1_000_000))})


def values(server: MemoryServer) -> list[object]:
    """The values of the blue cup, in order of time."""
    return [
        each.instances[0].data.elements["value"].value  # type: ignore[union-attr]
        for each in server.query(CUPS).snapshots()
    ]


def test_a_commit_is_acknowledged_update_by_update() -> None:
    server = object_memory()
    result = server.commit(Commit(updates=[update(5), update(7, entity=CUP.with_entity("mug"))]))

    assert result.success
    assert [str(each.snapshot) for each in result.results] == [
        "Object/Instance/ObjectLocalizer/blue-cup/5",
        "Object/Instance/ObjectLocalizer/mug/7",
    ]
    assert {each.arrived for each in result.results} == {NOW}
    assert server.commit(Commit()).results == ()


def test_metadata_are_those_of_the_update() -> None:
    server = object_memory()
    several = EntityUpdate(entity=CUP, instances=(data(1), None, data(2)), referenced=5, sent=3, confidence=0.25)
    commit(server, several)
    found = server.get(CUP)

    assert found is not None
    assert [each.data for each in found.instances] == [data(1), None, data(2)]
    assert {
        (each.metadata.confidence, each.metadata.referenced, each.metadata.sent, each.metadata.arrived)
        for each in found.instances
    } == {(0.25, 5, 3, NOW)}


def test_a_snapshot_may_be_empty() -> None:
    server = object_memory()
    commit(server, EntityUpdate(entity=CUP, instances=(), referenced=5))

    assert moments(server.query(CUPS)) == [5]
    assert server.get(CUP) == Snapshot(id=CUP.with_timestamp(5))


POSITION = t.Object(name="Position", members={"value": t.Int(), "frame": t.String(maybe=True)})


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"entity": CUP.with_core_segment("Grasp").with_provider_segment("P").with_entity("e")}, "has no core segment"),
        (
            {"entity": MemoryID(memory="Grasp", core_segment="Instance", provider_segment="P", entity="e")},
            "for the mem",
        ),
        ({"entity": MemoryID()}, "for the memory ''"),
        ({"entity": MemoryID(memory="Object", core_segment="Instance", entity="e")}, "provider segment ''"),
        ({"entity": MemoryID(memory="Object", core_segment="Instance", provider_segment="P")}, "entity ''"),
        ({"entity": "Object/Instance/P/e"}, "by a MemoryID, not by a str"),
        ({"referenced": -1}, "no valid referenced time"),
        ({"referenced": INVALID}, "no valid referenced time"),
        ({"referenced": 2**63}, "no valid referenced time"),
        ({"referenced": 1.5}, "no valid referenced time"),
        ({"sent": None}, "sent time"),
        ({"sent": 2**63}, "sent time .* of 64 bits"),
        ({"confidence": math.nan}, "confidence"),
        ({"confidence": "sure"}, "confidence"),
        ({"confidence": True}, "confidence"),
        ({"confidence": 10**400}, "confidence"),
        ({"instances": (Dict({}), List([]))}, "instance 1 .* is a List"),
        ({"instances": {"value": Int(1)}}, "not a dict"),
        ({"instances": (HUGE,)}, "1,000,005 bytes of data, over the limit of 100,000"),
        ({"instances": (Dict({"text": List([String("x" * 100_000)])}),)}, "100,004 bytes"),
        ({"instances": (Dict({"value": Double(1.0)}),)}, "value is a Double, and its type Int"),
        ({"instances": (Dict({"value": Int(1)}), Dict({"value": None}))}, "instance 1 .* allows none"),
        ({"instances": (None,)}, "is null"),
    ],
)
def test_an_update_is_refused_by_itself(wrong: dict[str, object], words: str) -> None:
    server = MemoryServer(
        "Object", [CoreSegmentDefinition(name="Instance", aron_type=POSITION)], update_bytes=100_000, clock=lambda: NOW
    )
    given = {"entity": CUP, "instances": (data(1),), "referenced": 6, "sent": -1, "confidence": 1.0} | wrong
    result = server.commit(Commit(updates=[update(5), EntityUpdate(**given), update(7)]))  # type: ignore[arg-type]

    assert [each.success for each in result.results] == [True, False, True]
    assert not result.success
    assert result.results[1].snapshot is None
    assert result.results[1].arrived == NOW
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(result.errors[0])
    assert moments(server.query(CUPS)) == [5, 7]
    assert server.status().refused == 1


def test_typed_segments_take_more_and_less_than_their_type() -> None:
    server = MemoryServer("Object", [CoreSegmentDefinition(name="Instance", aron_type=POSITION)])

    for number, elements in enumerate(
        [{"value": Int(1), "frame": None}, {"value": Int(1), "colour": String("blue")}, {"frame": String("map")}, {}]
    ):
        commit(server, EntityUpdate(entity=CUP, instances=(Dict(elements),), referenced=number))  # type: ignore[arg-type]


def test_what_comes_late_is_inserted_at_its_time() -> None:
    server = object_memory()
    for moment in (30, 10, 40, 20):
        commit(server, update(moment, moment))

    assert values(server) == [10, 20, 30, 40]
    latest = server.get(CUP)
    assert latest is not None
    assert latest.referenced == 40


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_version_sent_last_counts(order: tuple[int, ...]) -> None:
    server = object_memory(archive=ListArchive())
    versions = [update(5, "first", sent=1), update(5, "second", sent=2), update(5, "zeroth", sent=0)]
    for number in order:
        commit(server, versions[number])

    assert values(server) == ["second"]


@pytest.mark.parametrize("words", [("wrong", "corrected"), ("corrected", "wrong")])
@pytest.mark.parametrize("unset", [-1, INVALID])
def test_without_a_sent_time_the_later_commit_counts(words: tuple[str, str], unset: int) -> None:
    time = iter(range(100, 200))
    archive = ListArchive()
    server = object_memory(clock=lambda: next(time), archive=archive)
    for word in words:
        commit(server, update(5, word, sent=unset))

    assert values(server) == [words[1]]
    assert [(each.sent, each.instances[0].metadata.arrived) for each in archive.consolidated] == [
        (100, 100),
        (101, 101),
    ]
    assert server.status().delayed == 0


def test_the_same_commit_with_a_sent_time_changes_nothing_and_without_one_is_a_version() -> None:
    time = iter(range(100, 200))
    archive = ListArchive()
    server = object_memory(clock=lambda: next(time), archive=archive)
    for _ in range(2):
        commit(server, update(5, "said", sent=7))
    assert archive.evicted == []
    for _ in range(2):
        commit(server, update(6, "unsaid"))

    assert [each.snapshot.sent for each in archive.evicted] == [102]
    assert values(server) == ["said", "unsaid"]


def test_of_versions_sent_at_once_the_greater_hash_counts() -> None:
    one, other = snapshot(5, "one", sent=3), snapshot(5, "other", sent=3)
    expected = "one" if snapshot_hash(one) > snapshot_hash(other) else "other"
    for order in permutations([update(5, "one", sent=3), update(5, "other", sent=3)]):
        server = object_memory()
        commit(server, *order)
        assert values(server) == [expected]


def test_confidence_makes_a_version_of_its_own() -> None:
    found = []
    for order in permutations([0.25, 0.5]):
        server = object_memory()
        commit(server, *(update(5, confidence=confidence) for confidence in order))
        (only,) = server.query(CUPS).snapshots()
        found.append(only.instances[0].metadata.confidence)

    assert found[0] == found[1]


def test_no_version_supersedes_itself_or_both_ways() -> None:
    one, again, other = snapshot(5, 1, sent=3), snapshot(5, 1, sent=3, arrived=9), snapshot(5, 2, sent=3)

    assert not supersedes(one, one)
    assert not supersedes(one, again)
    assert supersedes(one, other) != supersedes(other, one)
    assert supersedes(one, Snapshot(id=one.id))


def test_versions_are_told_apart_by_content_alone() -> None:
    def version(elements: dict[str, Double]) -> Snapshot:
        metadata = Metadata(referenced=5, sent=3)
        return Snapshot(id=CUP.with_timestamp(5), instances=(Instance(data=Dict(elements), metadata=metadata),))

    one = version({"a": Double(math.nan), "b": Double(0.0)})
    again = version({"b": Double(0.0), "a": Double(math.nan)})
    negative = version({"a": Double(math.nan), "b": Double(-0.0)})

    assert not supersedes(one, again)
    assert not supersedes(again, one)
    assert supersedes(one, negative) != supersedes(negative, one)
    twice = Snapshot(id=one.id, instances=one.instances * 2)
    assert supersedes(one, twice) != supersedes(twice, one)


def test_the_archive_gets_every_version() -> None:
    archive = ListArchive()
    server = object_memory(archive=archive)
    commit(server, update(5, "old", sent=1))
    commit(server, update(5, "new", sent=2))
    commit(server, update(5, "late", sent=0))
    commit(server, update(5, "new", sent=2))

    assert [each.sent for each in archive.consolidated] == [1, 2, 0, 2]
    assert [(each.snapshot.sent, each.usage.count) for each in archive.evicted] == [(1, 0), (0, 0)]
    assert values(server) == ["new"]


def test_what_the_archive_cannot_take_is_not_acknowledged(caplog: pytest.LogCaptureFixture) -> None:
    server = object_memory(archive=BrokenArchive())
    result = server.commit(Commit(updates=[update(5), update(-1), update(6)]))

    assert [each.success for each in result.results] == [False, False, False]
    assert "did not take it: OSError: no space left" in result.errors[0]
    assert "referenced time" in result.errors[1]
    assert list(server.query(EVERYTHING).snapshots()) == []
    assert "did not take 2 snapshots" in caplog.text


@given(st.data(), memories)
def test_the_order_of_arrival_does_not_matter(draw: st.DataObject, versions: list[Snapshot]) -> None:
    clock = iter(range(10**6))
    memory = object_memory(clock=lambda: next(clock))
    waiting = [
        EntityUpdate(
            entity=each.id.entity_id,
            instances=tuple(instance.data for instance in each.instances),
            referenced=each.referenced,
            sent=each.sent,
        )
        for each in draw.draw(st.permutations(versions))
    ]
    while waiting:
        size = draw.draw(st.integers(1, len(waiting)))
        commit(memory, *waiting[:size])
        del waiting[:size]

    found = sorted(memory.query(EVERYTHING).snapshots(), key=lambda each: each.id)
    assert timeless(found) == timeless(what_counts(versions))


def test_slow_transfers_are_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    time = [10_000_000]
    server = object_memory(clock=lambda: time[0], delay_threshold=500_000)
    with caplog.at_level(logging.WARNING):
        commit(server, update(1, sent=9_500_000))
        commit(server, update(2, sent=-1))
        commit(server, update(3, sent=10_500_000))
        assert caplog.text == ""
        commit(server, update(4, sent=9_499_999), update(5, sent=8_000_000))
        commit(server, update(6, sent=8_500_000))

    assert [record.getMessage().split(" was")[0] for record in caplog.records] == [str(CUP.with_timestamp(5))]
    assert "2.000 s before it arrived, over the threshold of 0.500 s" in caplog.text
    assert (server.status().delayed, server.status().greatest_delay) == (3, 2_000_000)
    time[0] += 2_000_000
    with caplog.at_level(logging.WARNING):
        commit(server, update(7, sent=8_500_000))
    assert len(caplog.records) == 2


def test_a_closed_server_takes_nothing_and_can_be_read() -> None:
    with object_memory() as server:
        commit(server, update(5))

    with pytest.raises(ServerClosed, match="'Object' was closed"):
        server.commit(Commit(updates=[update(6)]))
    assert moments(server.query(CUPS)) == [5]


@pytest.mark.parametrize(
    ("name", "cores", "words"),
    [("", [], "has a name"), ("Object", [""], "has no name"), ("Object", ["A", "A"], "two core segments 'A'")],
)
def test_servers_that_cannot_be(name: str, cores: list[str], words: str) -> None:
    with pytest.raises(InvalidServer, match=words):
        MemoryServer(name, [CoreSegmentDefinition(name=each) for each in cores])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"core_segments": ["Instance"]}, r"'Object' is a CoreSegmentDefinition, not 'Instance'"),
        ({"limits": {"Object": 3}}, "set by a MemoryID, not by 'Object'"),
        ({"core_segments": [CoreSegmentDefinition(name="A", aron_type=t.Int())]}, "'A' .* type Int, and instances are"),
        ({"core_segments": [CoreSegmentDefinition(name="A", aron_type="Cup")]}, "'A' .* has the type 'Cup'"),  # type: ignore[arg-type]
    ],
)
def test_definitions_of_servers_that_cannot_be(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidServer, match=words):
        MemoryServer("Object", **wrong)


def test_segments_may_have_any_type_that_a_dict_is_of() -> None:
    for aron_type in (t.Object(name="Cup"), t.Dict(accepted=t.Int()), t.Any(), None):
        server = MemoryServer("Object", [CoreSegmentDefinition(name="Instance", aron_type=aron_type)])
        commit(server, update(5))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (update(5), r"is a Commit, not a EntityUpdate: .* Commit\(updates=\[...\]\)"),
        ([update(5)], "is a Commit, not a list"),
        (None, "not a NoneType"),
    ],
)
def test_what_is_no_commit_is_refused(wrong: Any, words: str) -> None:
    with pytest.raises(InvalidCommit, match=words):
        object_memory().commit(wrong)


def test_a_single_update_is_no_list_of_them() -> None:
    with pytest.raises(InvalidCommit, match="put a single one into a list"):
        Commit(updates=update(5))  # type: ignore[arg-type]


def test_what_is_no_update_is_refused_by_itself() -> None:
    result = object_memory().commit(Commit(updates=[update(5), CUP, update(6)]))  # type: ignore[list-item]

    assert [each.success for each in result.results] == [True, False, True]
    assert "this is a MemoryID" in result.errors[0]


def test_updates_take_lists_datetimes_and_integers_of_numpy() -> None:
    at = datetime(1970, 1, 1, 0, 0, 5, tzinfo=UTC)
    server = object_memory()
    commit(server, EntityUpdate(entity=CUP, instances=[data(1), data(2)], referenced=at, sent=at))
    commit(server, EntityUpdate(entity=CUP, instances=(), referenced=np.int64(7), sent=np.int64(8)))  # type: ignore[arg-type]

    assert moments(server.query(CUPS)) == [7, 5_000_000]
    found = server.get(CUP)
    assert found is not None
    assert [each.metadata.sent for each in found.instances] == [5_000_000, 5_000_000]


@pytest.mark.parametrize("wrong", [datetime(2026, 1, 1), datetime(1969, 1, 1, tzinfo=UTC), True, "now", 2.0])  # noqa: DTZ001
def test_what_is_no_time_is_refused_by_itself(wrong: Any) -> None:
    late = EntityUpdate(entity=CUP, instances=(), referenced=wrong)
    result = object_memory().commit(Commit(updates=[late, update(5)]))

    assert [each.success for each in result.results] == [False, True]
    assert "or as a datetime with its zone" in result.errors[0]


def test_a_snapshot_is_got_by_an_id_and_not_by_text() -> None:
    with pytest.raises(InvalidMemoryID, match=r"not by 'Object/Instance': .* MemoryID\.parse"):
        object_memory().get("Object/Instance")  # type: ignore[arg-type]


def test_an_instance_is_got_only_where_there_is_one() -> None:
    server = object_memory()
    commit(server, EntityUpdate(entity=CUP, instances=(data(1), data(2)), referenced=5))
    snapshot_id = CUP.with_timestamp(5)

    assert server.get(snapshot_id.with_instance(1)) == server.get(snapshot_id)
    assert server.get(snapshot_id.with_instance(2)) is None
