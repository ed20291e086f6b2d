"""Clients that commit, query, listen and clear at once find the memory whole."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from itertools import pairwise

import pytest

from armem_bridge.memory_id import MemoryID
from armem_bridge.working import AddSegment, MemoryServer, Query, QueryBuilder, QueryTarget, Snapshot
from armem_bridge.working.query import AllSnapshots
from armem_bridge.working.refusals import ServerClosed
from tests.armem.working.archives import ListArchive
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import CUP, commit, moments, object_memory, update

WRITERS, COMMITS = 4, 150


def at_once(*work: Callable[[], None]) -> None:
    """Run all in threads, and raise what any of them raised."""
    failed: list[BaseException] = []

    def run(each: Callable[[], None]) -> None:
        try:
            each()
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=run, args=(each,)) for each in work]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads), "stuck"
    for error in failed:
        raise error


def everything(target: QueryTarget = QueryTarget.WM) -> Query:
    """All snapshots of all entities, by names that are looked through."""
    builder = QueryBuilder()
    builder.core_segments.all().provider_segments.regex(".*").entities.all().snapshots.all()
    return builder.build(target=target)


def test_committing_and_querying_at_once() -> None:
    server = object_memory()
    done = threading.Event()

    def write(writer: int) -> None:
        for number in range(COMMITS):
            moment = number * WRITERS + writer
            commit(server, update(moment), update(moment, entity=CUP.with_entity(f"of {writer}, {number % 40}")))

    def read() -> None:
        while not done.is_set():
            for entity in server.query(everything()).entities():
                assert all(earlier < later for earlier, later in pairwise(entity.history))
            server.query(about_the_cup(AllSnapshots()))
            server.status()

    def write_all() -> None:
        at_once(*(lambda writer=writer: write(writer) for writer in range(WRITERS)))
        done.set()

    at_once(write_all, read, read)
    assert moments(server.query(about_the_cup(AllSnapshots()))) == list(range(WRITERS * COMMITS))
    assert (server.status().commits, server.status().updates) == (WRITERS * COMMITS, 2 * WRITERS * COMMITS)


def test_what_is_acknowledged_is_found_whatever_moves() -> None:
    archive = ListArchive(on_eviction_only=True)
    server = object_memory(limits={CUP: 3}, archive=archive)
    lock, acknowledged = threading.Lock(), list[int]()
    both = about_the_cup(AllSnapshots())
    query = Query(memories=both.memories, target=QueryTarget.BOTH)

    def write(writer: int) -> None:
        for number in range(40):
            moment = number * 2 + writer
            commit(server, update(moment))
            with lock:
                acknowledged.append(moment)

    def read() -> None:
        for _ in range(30):
            with lock:
                expected = set(acknowledged)
            if expected:
                assert expected <= set(moments(server.query(query)))

    at_once(lambda: write(0), lambda: write(1), read, read)
    assert moments(server.query(query)) == list(range(80))


def test_clearing_while_others_work() -> None:
    heard: list[MemoryID] = []
    with object_memory() as server:
        subscription = server.subscribe(heard.extend)

        def clear() -> None:
            wish = AddSegment(core_segment="Instance", provider_segment="ObjectLocalizer", clear_when_exists=True)
            for _ in range(50):
                assert server.add_segments([wish])[0].success
                server.query(everything())

        def write() -> None:
            for moment in range(200):
                commit(server, update(moment))

        at_once(clear, write)
        assert subscription.flush(10)
        left: Sequence[int] = moments(server.query(about_the_cup(AllSnapshots()))) if server.get(CUP) else []
        assert list(left) == list(range(200 - len(left), 200)), "what was cleared is an early part"
        assert server.status().evicted == 200 - len(left)

    assert [each.timestamp for each in heard] == list(range(200))


class Together(ListArchive):
    """An archive that consolidates only where two commits are there at once."""

    def __init__(self) -> None:
        super().__init__()
        self._both = threading.Barrier(2, timeout=30)

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        self._both.wait()
        super().consolidate(snapshots)


def test_commits_go_on_beside_each_other() -> None:
    server = object_memory(archive=Together())

    at_once(lambda: commit(server, update(1)), lambda: commit(server, update(2)))

    assert moments(server.query(about_the_cup(AllSnapshots()))) == [1, 2]


class Slow(ListArchive):
    """An archive that consolidates when it is let to."""

    def __init__(self) -> None:
        super().__init__()
        self.entered, self.go_on = threading.Event(), threading.Event()

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        self.entered.set()
        assert self.go_on.wait(30)
        super().consolidate(snapshots)


def add_segment(server: MemoryServer, name: str) -> None:
    """Add a provider segment beside the cup's."""
    wish = AddSegment(core_segment="Instance", provider_segment=name)
    assert server.add_segments([wish])[0].success


def test_segments_wait_for_commits_and_commits_for_segments() -> None:
    archive = Slow()
    server = object_memory(archive=archive)
    order: list[str] = []

    def first() -> None:
        commit(server, update(1))
        order.append("first")

    def segment() -> None:
        assert archive.entered.wait(30)
        add_segment(server, "Simox")
        order.append("segment")

    def second() -> None:
        assert archive.entered.wait(30)
        time.sleep(0.2)
        commit(server, update(2))
        order.append("second")

    def look() -> None:
        assert archive.entered.wait(30)
        time.sleep(0.5)
        assert not server.get(CUP), "reading waits for nobody"
        assert order == []
        archive.go_on.set()

    at_once(first, segment, second, look)
    assert sorted(order) == ["first", "second", "segment"]
    assert server.status().provider_segments == 2


def test_listeners_commit_while_segments_are_added() -> None:
    with object_memory() as server:

        def answer(updated: Sequence[MemoryID]) -> None:
            for each in updated:
                commit(server, update(each.timestamp, entity=CUP.with_entity("answer")))

        subscription = server.subscribe(answer, CUP)

        def write() -> None:
            for moment in range(100):
                commit(server, update(moment))

        def add() -> None:
            for number in range(100):
                add_segment(server, str(number))

        at_once(write, add, add)
        assert subscription.flush(30)
        assert subscription.status().failures == 0
        answers = CUP.with_entity("answer")
        assert moments(server.query(about_the_cup(AllSnapshots()))) == list(range(100))
        assert server.status().snapshots == 200
        assert server.get(answers.with_timestamp(99))


def test_closing_waits_for_who_is_at_the_door() -> None:
    archive = Slow()
    server = object_memory(archive=archive)
    known: list[int] = []
    refused: list[ServerClosed] = []

    def late() -> None:
        assert archive.entered.wait(30)
        try:
            add_segment(server, "Simox")
        except ServerClosed as error:
            refused.append(error)

    def close() -> None:
        assert archive.entered.wait(30)
        time.sleep(0.3)
        archive.go_on.set()
        server.close()
        known.append(server.status().provider_segments)

    at_once(lambda: commit(server, update(1)), late, close)
    assert known == [1 if refused else 2]
    with pytest.raises(ServerClosed):
        add_segment(server, "Simox")
