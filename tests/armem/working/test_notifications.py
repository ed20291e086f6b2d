"""Update notifications reach those who listen, in threads of their own, and nobody else waits for them."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from typing import Any

import pytest

from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit
from armem_bridge.working.query import LatestSnapshots
from armem_bridge.working.refusals import InvalidSubscription, ServerClosed
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import CUP, MEMORY, commit, object_memory, update

MUG = CUP.with_entity("mug")


def test_one_message_a_commit_with_what_was_updated() -> None:
    heard: list[Sequence[MemoryID]] = []
    with object_memory() as server:
        subscription = server.subscribe(heard.append)
        server.commit(Commit(updates=[update(1), update(-1), update(2, entity=MUG)]))
        server.commit(Commit(updates=[update(-1)]))
        server.commit(Commit())
        server.commit(Commit(updates=[update(3)]))
        assert subscription.flush(10)

    assert heard == [(CUP.with_timestamp(1), MUG.with_timestamp(2)), (CUP.with_timestamp(3),)]


def test_listeners_hear_what_they_subscribed_to() -> None:
    heard: dict[str, list[MemoryID]] = {}
    with object_memory() as server:
        places = [MEMORY, CUP, MUG, CUP.with_timestamp(1), MemoryID(entity="mug"), MemoryID(memory="Grasp")]
        subscriptions = [server.subscribe(heard.setdefault(repr(each), []).extend, each) for each in places]
        commit(server, update(1), update(2, entity=MUG))
        commit(server, update(3))
        assert all(each.flush(10) for each in subscriptions)
        assert [each.status().delivered for each in subscriptions] == [2, 2, 1, 1, 1, 0]

    assert [[(each.entity, each.timestamp) for each in heard[repr(place)]] for place in places] == [
        [("blue-cup", 1), ("mug", 2), ("blue-cup", 3)],
        [("blue-cup", 1), ("blue-cup", 3)],
        [("mug", 2)],
        [("blue-cup", 1)],
        [("mug", 2)],
        [],
    ]


def test_a_listener_finds_what_it_hears_of() -> None:
    found: list[bool] = []
    with object_memory() as server:
        subscription = server.subscribe(lambda updated: found.extend(server.get(each) is not None for each in updated))
        for moment in range(100):
            commit(server, update(moment))
        assert subscription.flush(10)

    assert found == [True] * 100


def test_a_listener_may_commit() -> None:
    with object_memory() as server:
        first = server.subscribe(
            lambda updated: commit(server, *(update(each.timestamp, entity=MUG) for each in updated)), CUP
        )
        heard: list[MemoryID] = []
        second = server.subscribe(heard.extend, MUG)
        commit(server, update(1))
        assert first.flush(10)
        assert second.flush(10)

    assert heard == [MUG.with_timestamp(1)]


def test_a_slow_listener_keeps_nobody_waiting() -> None:
    go_on, heard = threading.Event(), list[int]()

    def listen(updated: Sequence[MemoryID]) -> None:
        go_on.wait(20)
        heard.append(updated[0].timestamp)

    server = object_memory()
    slow = server.subscribe(listen, queue_limit=5)
    quick: list[MemoryID] = []
    other = server.subscribe(quick.extend)
    commit(server, update(0))
    deadline = time.monotonic() + 10
    while slow.status().delivered == 0 and time.monotonic() < deadline:
        time.sleep(0.001)
    for moment in range(1, 21):
        commit(server, update(moment))
    assert other.flush(10)
    assert len(quick) == 21
    assert (slow.status().waiting, slow.status().dropped) == (5, 15)
    assert not slow.flush(0.01)

    go_on.set()
    assert slow.flush(10)
    assert heard == [0, 16, 17, 18, 19, 20], "the oldest are dropped"
    server.close()


def test_a_listener_that_raises_is_told_of_and_called_again(caplog: pytest.LogCaptureFixture) -> None:
    def listen(updated: Sequence[MemoryID]) -> None:
        if updated[0].timestamp == 1:
            raise RuntimeError("no idea what to do")
        heard.extend(updated)

    heard: list[MemoryID] = []
    server = object_memory()
    subscription = server.subscribe(listen, CUP)
    commit(server, update(1))
    commit(server, update(2))
    assert subscription.flush(10)

    assert heard == [CUP.with_timestamp(2)]
    (status,) = server.status().listeners
    assert (status.delivered, status.failures, status.last_failure) == (2, 1, "RuntimeError: no idea what to do")
    assert status.subscribed == CUP
    assert "no idea what to do" in caplog.text
    server.close()


def test_who_unsubscribes_is_not_called_any_more() -> None:
    heard: list[MemoryID] = []
    with object_memory() as server:
        threads = threading.active_count()
        subscription = server.subscribe(heard.extend)
        subscription.close()
        commit(server, update(1))
        assert threading.active_count() == threads
        assert server.status().listeners == ()
        subscription.close()

    assert heard == []


def test_a_listener_may_unsubscribe_itself() -> None:
    with object_memory() as server:
        subscription = server.subscribe(lambda updated: subscription.close())
        commit(server, update(1))
        deadline = time.monotonic() + 10
        while not subscription.closed and time.monotonic() < deadline:
            time.sleep(0.001)
        assert subscription.closed


def test_closing_a_server_ends_its_threads() -> None:
    threads = threading.active_count()
    server = object_memory()
    for _ in range(3):
        server.subscribe(lambda updated: None)
    assert threading.active_count() == threads + 3
    server.close()

    assert threading.active_count() == threads
    with pytest.raises(ServerClosed):
        server.subscribe(lambda updated: None)
    assert list(server.query(about_the_cup(LatestSnapshots())).snapshots()) == []


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"subscribed": "Object/Instance"}, r"is a MemoryID, not 'Object/Instance': .* MemoryID\.parse"),
        ({"subscribed": None}, "is a MemoryID, not None"),
        ({"listener": "print"}, "a str cannot be"),
        ({"queue_limit": 0}, "1 or more: not 0"),
        ({"queue_limit": 2.5}, "1 or more: not 2.5"),
        ({"queue_limit": None}, "1 or more: not None"),
    ],
)
def test_who_cannot_listen_like_this_is_told_at_once_and_no_commit_suffers(wrong: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"listener": print, "subscribed": CUP, "queue_limit": 1} | wrong
    with object_memory() as server:
        with pytest.raises(InvalidSubscription, match=words):
            server.subscribe(**given)
        commit(server, update(1))
        commit(server, update(2))
        assert server.status().listeners == ()
