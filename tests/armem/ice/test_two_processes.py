"""A memory server and a client in two processes, with the interface of either generation."""

from __future__ import annotations

from queue import Queue
from typing import Any

import numpy as np
import pytest

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Bool, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.ice import MemoryClient
from armem_bridge.ice.refusals import NotExpressible, RemoteFailure
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import now
from armem_bridge.names import UnknownMemory
from armem_bridge.working import Commit, CommitResult, EntityUpdate, Memory, Query, QueryBuilder, QueryTarget
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
    ProviderSegmentQuery,
    SingleName,
    SingleSnapshot,
    SnapshotQuery,
    TimeRange,
)
from armem_bridge.working.segments import AddSegment
from tests.armem.ice.processes import ClientProcess, ServerProcess

EVERY_KIND = Dict(
    {
        "text": String("größe ☃"),
        "yes": Bool(True),
        "int": Int(-(2**31)),
        "long": Long(2**63 - 1),
        "float": Float(0.1),
        "double": Double(0.1),
        "nan": Double(float("nan")),
        "list": List([Int(1), None, List([])]),
        "dict": Dict({"": Dict({}), "a/b": None}),
        "array": NDArray((2, 2, 4), "float32", bytes(range(16))),
        "point": NDArray((), "", b""),
        "null": None,
    }
)


def update(entity: MemoryID, referenced: int, *instances: Dict | None, **more: Any) -> EntityUpdate:
    return EntityUpdate(
        entity=entity, instances=instances or (Dict({"n": Long(referenced)}),), referenced=referenced, **more
    )


def committing(client: MemoryClient, *updates: EntityUpdate) -> CommitResult:
    return client.memory("Object").commit(Commit(updates=updates))


def querying(client: MemoryClient, query: Query) -> Memory:
    return client.memory("Object").query(query)


def history(entity: MemoryID, snapshots: SnapshotQuery | None = None, *, with_data: bool = True) -> Query:
    entities = EntityQuery(names=SingleName(name=entity.entity), snapshots=[snapshots or AllSnapshots()])
    provider = ProviderSegmentQuery(names=SingleName(name=entity.provider_segment), entities=[entities])
    core = CoreSegmentQuery(names=SingleName(name=entity.core_segment), provider_segments=[provider])
    return Query(memories=[MemoryQuery(names=AllNames(), core_segments=[core])], with_data=with_data)


def moments(client: ClientProcess, entity: MemoryID, snapshots: SnapshotQuery | None = None) -> list[int]:
    found = client.call(querying, history(entity, snapshots)).entity(entity)
    assert found is not None
    return list(found.history)


def test_everything_of_a_commit_comes_back(client: ClientProcess, server: ServerProcess, cup: MemoryID) -> None:
    before = now()
    result = client.call(committing, update(cup, 50, EVERY_KIND, None, confidence=0.5, sent=before))
    found = client.call(querying, history(cup)).entity(cup)

    assert result.success
    assert result.results[0].snapshot == cup.with_timestamp(50)
    assert before <= result.results[0].arrived <= now()
    assert found is not None
    assert found.id == cup
    snapshot = found.history[50]
    assert snapshot.id == cup.with_timestamp(50)
    assert [instance.data for instance in snapshot.instances] == [EVERY_KIND, None]
    for instance in snapshot.instances:
        assert instance.metadata.confidence == 0.5
        assert instance.metadata.referenced == 50
        assert instance.metadata.sent == before
        assert instance.metadata.arrived == result.results[0].arrived
    assert server.ask("edge")["generation"] == int(server.generation.removeprefix("gen"))


def test_histories_come_in_order_of_time(client: ClientProcess, cup: MemoryID) -> None:
    client.call(committing, *(update(cup, moment) for moment in (30, 10, 20)))

    assert moments(client, cup) == [10, 20, 30]


@pytest.mark.parametrize(
    ("snapshots", "expected"),
    [
        (AllSnapshots(), [10, 20, 30, 40]),
        (LatestSnapshots(), [40]),
        (SingleSnapshot(), [40]),
        (SingleSnapshot(timestamp=20), [20]),
        (SingleSnapshot(timestamp=21), []),
        (TimeRange(min_timestamp=20, max_timestamp=30), [20, 30]),
        (TimeRange(min_timestamp=21, max_timestamp=29), []),
        (TimeRange(min_timestamp=30), [30, 40]),
    ],
)
def test_queries_of_both_generations(
    client: ClientProcess, cup: MemoryID, snapshots: SnapshotQuery, expected: list[int]
) -> None:
    client.call(committing, *(update(cup, moment) for moment in (10, 20, 30, 40)))

    assert moments(client, cup, snapshots) == expected


@pytest.mark.parametrize(
    ("snapshots", "expected"),
    [
        (LatestSnapshots(count=2), [30, 40]),
        (LatestSnapshots(count=0), []),
        (IndexRange(first=1, last=2), [20, 30]),
        (IndexRange(first=-2), [30, 40]),
        (BeforeTime(timestamp=30, max_entries=2), [10, 20]),
        (BeforeTime(timestamp=30, max_entries=-1), [10, 20]),
        (AtOrBefore(timestamp=35), [30]),
        (Approximate(timestamp=32, eps=5), [30]),
        (Approximate(timestamp=32), [30, 40]),
    ],
)
def test_queries_that_only_some_slice_files_have(
    client: ClientProcess, server: ServerProcess, cup: MemoryID, snapshots: SnapshotQuery, expected: list[int]
) -> None:
    client.call(committing, *(update(cup, moment) for moment in (10, 20, 30, 40)))

    if server.generation == "gen3":
        with pytest.raises(NotExpressible, match=r"have no query entity::\w+"):
            moments(client, cup, snapshots)
    else:
        assert moments(client, cup, snapshots) == expected


def test_names_select_at_every_level(client: ClientProcess, server: ServerProcess, cup: MemoryID) -> None:
    others = cup.with_provider_segment(cup.provider_segment + "x").with_entity("cup")
    client.call(committing, update(cup, 1), update(others, 2))
    builder = QueryBuilder()
    builder.memories.all().core_segments.regex("Inst.*").provider_segments.all().entities.all().snapshots.all()

    found = client.call(querying, builder.build())

    assert set(found.core_segments) == {"Instance"}
    assert found.entity(cup) is not None
    assert found.entity(others) is not None


def test_without_data_the_tree_is_the_same(client: ClientProcess, cup: MemoryID) -> None:
    client.call(committing, update(cup, 1, EVERY_KIND))

    found = client.call(querying, history(cup, with_data=False)).entity(cup)

    assert found is not None
    assert [instance.data for instance in found.history[1].instances] == [None]
    assert found.history[1].instances[0].metadata.referenced == 1


def test_what_is_not_there_is_empty_and_no_error(client: ClientProcess, cup: MemoryID) -> None:
    found = client.call(querying, history(cup))

    assert found.id == MemoryID(memory="Object")
    assert found.entity(cup) is None


def test_the_target_of_a_query(client: ClientProcess, server: ServerProcess, cup: MemoryID) -> None:
    client.call(committing, update(cup, 1))
    asked = history(cup)
    query = Query(memories=asked.memories, target=QueryTarget.LTM)

    if server.generation == "gen3":
        with pytest.raises(NotExpressible, match="no target ltm"):
            client.call(querying, query)
    else:
        # Without an archive long-term memory is empty.
        assert client.call(querying, query).entity(cup) is None
        both = client.call(querying, Query(memories=asked.memories, target=QueryTarget.BOTH)).entity(cup)
        assert both is not None
        assert list(both.history) == [1]


def test_one_wrong_update_does_not_keep_the_others_from_being_made(client: ClientProcess, cup: MemoryID) -> None:
    unknown = MemoryID(memory="Object", core_segment="Nowhere", provider_segment="p", entity="e")
    grasp = MemoryID(memory="Object", core_segment="Grasp", provider_segment="p", entity="e")
    elsewhere = MemoryID(memory="Speech", core_segment="Instance", provider_segment="p", entity="e")

    result = client.call(
        committing,
        update(unknown, 1),
        update(cup, 2),
        update(grasp, 3, Dict({"name": Long(3)})),
        update(grasp, 4, None),
        update(grasp, 5, Dict({"name": String("top"), "more": Int(1), "force": None})),
        update(elsewhere, 6),
    )

    assert [each.success for each in result.results] == [False, True, False, False, True, False]
    assert "no core segment 'Nowhere'" in result.errors[0]
    assert "name" in result.errors[1]
    assert "this is 'Object'" in result.errors[3]
    assert moments(client, cup) == [2]


def test_segments_are_added_one_by_one(client: ClientProcess, cup: MemoryID) -> None:
    def adding(clear: bool) -> list[AddSegment]:
        mine = AddSegment(core_segment="Instance", provider_segment=cup.provider_segment, clear_when_exists=clear)
        return [mine, AddSegment(core_segment="Nowhere", provider_segment="p")]

    first, unknown = client.call(add_segments, adding(clear=False))
    client.call(committing, update(cup, 1))
    again, _ = client.call(add_segments, adding(clear=False))
    kept = moments(client, cup)
    client.call(add_segments, adding(clear=True))

    assert first.success
    assert first.segment == MemoryID(memory="Object", core_segment="Instance", provider_segment=cup.provider_segment)
    assert not unknown.success
    assert "no core segment 'Nowhere'" in unknown.error
    assert again.success
    assert kept == [1]
    assert client.call(querying, history(cup)).entity(cup) is None


def add_segments(client: MemoryClient, wishes: list[AddSegment]) -> Any:
    return client.memory("Object").add_segments(wishes)


def test_an_update_without_a_valid_time_gets_that_of_its_arrival(
    client: ClientProcess, server: ServerProcess, cup: MemoryID
) -> None:
    counted = server.ask("edge")["untimed"]
    before = now()

    result = client.call(committing, update(cup, -1), update(cup, -(2**63)))

    assert result.success
    times = [each.snapshot.timestamp for each in result.results if each.snapshot is not None]
    assert all(before <= time <= now() for time in times)
    assert moments(client, cup) == sorted(set(times))
    assert server.ask("edge")["untimed"] == counted + 2


@pytest.mark.parametrize(
    "name",
    ["a/b", "a\\/b", 'quo"te', "it's", "größe ☃ 🤖", ".*", "a|b(", "%2F", " ", "$^[x]{1000}+", "\n\t", "a" * 10_000],
)
def test_names_may_be_any_text(client: ClientProcess, cup: MemoryID, name: str) -> None:
    odd = cup.with_provider_segment(cup.provider_segment + name).with_entity(name)

    result = client.call(committing, update(odd, 7))

    assert result.success, result.errors
    assert result.results[0].snapshot == odd.with_timestamp(7)
    assert moments(client, odd) == [7]


def test_a_regular_expression_that_would_never_end_is_harmless(client: ClientProcess, cup: MemoryID) -> None:
    client.call(committing, update(cup.with_entity("a" * 5_000 + "b"), 1))
    for pattern in ("(a+)+", "(a|a)*$"):
        builder = QueryBuilder()
        builder.memories.name("Object").core_segments.regex(pattern)
        assert client.call(querying, builder.build()).core_segments == {}


def test_a_large_instance(client: ClientProcess, cup: MemoryID) -> None:
    size = 30 * 1024 * 1024
    result, same = client.call(commit_and_compare, cup, size)

    assert result.success, result.errors
    assert same


def commit_and_compare(client: MemoryClient, entity: MemoryID, size: int) -> tuple[CommitResult, bool]:
    pixels = np.arange(size // 3, dtype=np.uint32).astype(np.uint8).repeat(3)
    data = to_aron({"image": pixels[:size]})
    assert isinstance(data, Dict)
    result = committing(client, update(entity, 1, data))
    found = querying(client, history(entity)).entity(entity)
    assert found is not None
    return result, found.history[1].instances[0].data == data


def test_listeners_get_one_message_a_commit(client: ClientProcess, cup: MemoryID) -> None:
    wrong = MemoryID(memory="Object", core_segment="Nowhere", provider_segment="p", entity="e")
    messages = client.call(
        listen_and_commit, cup, [[update(cup, 1), update(wrong, 2), update(cup, 3)], [update(cup, 4)]]
    )

    # Messages are oneway calls, which the threads of an Ice process may take up in any order.
    assert sorted(messages) == [[cup.with_timestamp(1), cup.with_timestamp(3)], [cup.with_timestamp(4)]]


def listen_and_commit(
    client: MemoryClient, entity: MemoryID, commits: list[list[EntityUpdate]]
) -> list[list[MemoryID]]:
    heard: Queue[Any] = Queue()
    client.listen("Object", heard.put, entity)
    for updates in commits:
        committing(client, *updates)
    return [list(heard.get(timeout=20)) for _ in commits]


def test_clock_and_host_of_a_time_do_not_matter(client: ClientProcess, cup: MemoryID) -> None:
    assert client.call(commit_with_clocks, cup) == 1
    assert moments(client, cup) == [77]


def commit_with_clocks(client: MemoryClient, entity: MemoryID) -> int:
    """Commit the same moment by several clocks; how many keys the history of the answer has."""
    words, wire = client.wire.words, client.wire
    memory = client.memory("Object")
    clocks = words.time.ClockType.ClockTypeEnum
    for clock, host in ((clocks.Monotonic, "here"), (clocks.Realtime, "there"), (clocks.Unknown, "")):
        commit = wire.commits.write_commit(Commit(updates=[update(entity, 77)]))
        time = words.time.DateTime(words.time.Duration(77), clock, host)
        for name in ("referencedTime", "timeCreated"):
            if hasattr(commit.updates[0], name):
                setattr(commit.updates[0], name, time)
        assert memory.writing.commit(commit).results[0].success
    result = memory.reading.query(wire.queries.write(history(entity)))
    segment = result.memory.coreSegments["Instance"].providerSegments[entity.provider_segment]
    return len(segment.entities["cup"].history)


def test_a_memory_that_is_not_there(client: ClientProcess) -> None:
    with pytest.raises(UnknownMemory, match=r"'Speech' \(there are: .*Object"):
        client.call(memory_named, "Speech")


def memory_named(client: MemoryClient, name: str) -> None:
    client.memory(name)


def test_a_query_that_the_memory_refuses(client: ClientProcess, cup: MemoryID) -> None:
    with pytest.raises(RemoteFailure, match=r"the regular expression '\(' is refused"):
        client.call(ask_for_half_an_expression)


def ask_for_half_an_expression(client: MemoryClient) -> None:
    words = client.wire.words
    query = words.query.memory.Regex(coreSegmentNameRegex="(")
    client.wire.results.read(client.memory("Object").reading.query(words.query.Input([query], True)))
