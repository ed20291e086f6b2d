"""The client refuses by itself what cannot be sent or is for another memory, as a memory server in the process does."""

from __future__ import annotations

import logging
from queue import Queue
from typing import Any

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.data import Dict, Int, String
from armem_bridge.ice import MemoryClient
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import now
from armem_bridge.working import AddSegment, Commit, CommitResult, EntityUpdate, Query, QueryBuilder
from armem_bridge.working.query import AllNames, LatestSnapshots, MemoryQuery, RegexNames, SingleName
from armem_bridge.working.refusals import InvalidCommit, InvalidQuery, InvalidSubscription
from tests.armem.ice.processes import ClientProcess
from tests.armem.ice.test_two_processes import committing, history, moments, querying, update


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (AllNames(), True),
        (SingleName(name="Object"), True),
        (RegexNames(pattern="Obj.*"), True),
        (SingleName(name="Vision"), False),
        (RegexNames(pattern="Obj"), False),
    ],
)
def test_a_query_for_another_memory_finds_nothing(
    client: ClientProcess, cup: MemoryID, names: AllNames | SingleName | RegexNames, found: bool
) -> None:
    client.call(committing, update(cup, 1))
    (asked,) = history(cup).memories
    query = Query(memories=[MemoryQuery(names=names, core_segments=asked.core_segments)])

    answer = client.call(querying, query)

    assert answer.id == MemoryID(memory="Object")
    assert bool(answer.core_segments) == found


def test_what_a_query_asks_another_memory_for_is_left_out(client: ClientProcess, cup: MemoryID) -> None:
    client.call(committing, update(cup, 1), update(cup.with_entity("mug"), 1))
    builder = QueryBuilder()
    builder.select(cup)
    builder.select(MemoryID(memory="Vision", core_segment="Instance", provider_segment=cup.provider_segment))

    found = client.call(querying, builder.build())

    assert [each.id.entity for each in found.entities()] == ["cup"]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"instances": ({"colour": "red"},)}, "instance 0 .* is a dict"),
        ({"instances": (String("x"),)}, "instance 0 .* is a String"),
        ({"entity": "Object/Cup"}, r"by a MemoryID, not by a str: .* MemoryID\.parse"),
        ({"referenced": 2**63}, "no valid referenced time"),
        ({"sent": 2**63}, "sent time"),
        ({"confidence": "sure"}, "confidence"),
        ({"confidence": 1e300}, "confidence .* in 32 bits"),
    ],
)
def test_an_update_that_cannot_be_sent_is_refused_by_itself(
    client: ClientProcess, cup: MemoryID, wrong: dict[str, Any], words: str
) -> None:
    given: dict[str, Any] = {"entity": cup, "instances": (Dict({}),), "referenced": 6} | wrong
    unknown = update(cup.with_core_segment("Nowhere").with_provider_segment("p").with_entity("e"), 1)

    result = client.call(committing, update(cup, 5), EntityUpdate(**given), unknown, update(cup, 7))

    assert [each.success for each in result.results] == [True, False, False, True]
    with pytest.raises(AssertionError, match=words):
        raise AssertionError(result.errors[0])
    assert "no core segment 'Nowhere'" in result.errors[1]
    assert moments(client, cup) == [5, 7]


def test_a_commit_of_which_nothing_can_be_sent(client: ClientProcess, cup: MemoryID) -> None:
    result = client.call(committing, EntityUpdate(entity=cup, instances=(String("x"),), referenced=1))  # type: ignore[arg-type]

    assert [each.success for each in result.results] == [False]


def test_the_later_commit_counts_and_says_when_it_was_sent(client: ClientProcess, cup: MemoryID) -> None:
    before = now()
    for order in (range(5), reversed(range(5))):
        for number in order:
            client.call(committing, update(cup, 1, Dict({"n": Int(number)})))
        found = client.call(querying, history(cup, LatestSnapshots())).entity(cup)
        assert found is not None
        (instance,) = found.latest.instances  # type: ignore[union-attr]
        assert instance.data == Dict({"n": Int(number)})
        assert before <= instance.metadata.sent <= instance.metadata.arrived <= now()


def test_a_sent_time_that_is_given_stays(client: ClientProcess, cup: MemoryID) -> None:
    client.call(committing, update(cup, 1, Dict({"n": Int(1)}), sent=2))
    client.call(committing, update(cup, 1, Dict({"n": Int(2)}), sent=1))

    found = client.call(querying, history(cup)).entity(cup)

    assert found is not None
    assert [(each.data, each.metadata.sent) for each in found.history[1].instances] == [(Dict({"n": Int(1)}), 2)]


def test_types_of_segments_do_not_travel_and_are_not_dropped_in_silence(client: ClientProcess, cup: MemoryID) -> None:
    name = cup.provider_segment
    typed, plain, unknown, nameless = client.call(
        adding,
        [
            AddSegment(core_segment="Instance", provider_segment=name, aron_type=t.Object(name="Cup")),
            AddSegment(core_segment="Instance", provider_segment=f"{name}-plain"),
            AddSegment(core_segment="Nowhere", provider_segment=name),
            AddSegment(core_segment="Instance", provider_segment=3),  # type: ignore[arg-type]
        ],
    )

    assert not typed.success
    assert "types of segments do not travel" in typed.error
    assert plain.success
    assert "no core segment 'Nowhere'" in unknown.error
    assert "names of segments are text" in nameless.error


def adding(client: MemoryClient, wishes: Any) -> Any:
    return client.memory("Object").add_segments(wishes)


def committing_plainly(client: MemoryClient, commit: Any) -> CommitResult:
    return client.memory("Object").commit(commit)


def test_what_is_none_of_it_is_refused_as_by_a_server_in_the_process(client: ClientProcess, cup: MemoryID) -> None:
    with pytest.raises(InvalidCommit, match="is a Commit"):
        client.call(committing_plainly, [update(cup, 1)])
    with pytest.raises(InvalidCommit, match="a list of AddSegment"):
        client.call(adding, AddSegment(core_segment="Instance", provider_segment="p"))
    with pytest.raises(InvalidQuery, match=r"a QueryBuilder makes one with build\(\)"):
        client.call(query_with_a_builder)


def query_with_a_builder(client: MemoryClient) -> None:
    client.memory("Object").query(QueryBuilder())  # type: ignore[arg-type]


def test_who_cannot_listen_like_this_is_told_at_once(client: ClientProcess) -> None:
    with pytest.raises(InvalidSubscription, match=r"is a MemoryID, not 'Object/Free': .* MemoryID\.parse"):
        client.call(listen_to_text)


def listen_to_text(client: MemoryClient) -> None:
    client.listen("Object", print, "Object/Free")  # type: ignore[arg-type]


def test_a_listener_that_raises_is_logged_and_called_again(client: ClientProcess, cup: MemoryID) -> None:
    assert client.call(raise_once, cup) == (["no idea what to do"], [2])


def raise_once(client: MemoryClient, entity: MemoryID) -> tuple[list[str], list[int]]:
    """What was logged of a listener that raises at the first message, and the times it heard of later."""
    heard: Queue[int] = Queue()
    logged: Queue[str] = Queue()

    def listen(updated: Any) -> None:
        if updated[0].timestamp == 1:
            raise RuntimeError("no idea what to do")
        heard.put(updated[0].timestamp)

    handler = logging.Handler()
    handler.emit = lambda record: logged.put(str(record.exc_info and record.exc_info[1]))  # type: ignore[method-assign]
    logger = logging.getLogger("armem_bridge.ice.client")
    logger.addHandler(handler)
    try:
        client.listen("Object", listen, entity)
        client.memory("Object").commit(Commit(updates=[update(entity, 1)]))
        said = [logged.get(timeout=20)]
        client.memory("Object").commit(Commit(updates=[update(entity, 2)]))
        return said, [heard.get(timeout=20)]
    finally:
        logger.removeHandler(handler)
