"""A memory that a process opened, used in processes forked from it: each answers rightly, and none harms another's."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import suppress
from threading import Event as Signal
from threading import Thread
from typing import Any, NoReturn
from uuid import UUID

import pytest

import elm
from elm import cues
from elm.errors import ConsumerBusy, DatabaseUnreachable
from elm.event import Event
from elm.storage.connections import Connection, Connections
from elm.storage.postgres import PostgresStore
from tests.clock import span

# Later Pythons warn of any fork beside a thread.
pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")

PATIENCE = 60
"""Seconds after which a child that hangs is ended."""


class Child:
    """A forked process that does one thing."""

    def __init__(self, task: Callable[[], Any]) -> None:
        ours, theirs = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            os.close(ours)
            _work(task, theirs)
        os.close(theirs)
        self._answer = ours

    def result(self) -> Any:
        """What it returned; what it raised is raised."""
        with open(self._answer, "rb") as answer:
            told = answer.read()
        _, status = os.waitpid(self.pid, 0)
        assert told, f"the child ended without an answer: {status}"
        ok, value = pickle.loads(told)  # noqa: S301 - from a process of this test
        assert ok, value
        return value


def _work(task: Callable[[], Any], answer: int) -> NoReturn:
    signal.alarm(PATIENCE)
    try:
        told: Any = (True, task())
    except BaseException:
        told = (False, traceback.format_exc())
    with suppress(OSError):
        os.write(answer, pickle.dumps(told))
    os._exit(0)


def in_child(task: Callable[[], Any]) -> Any:
    return Child(task).result()


def thing(agent: str) -> Event:
    return Event(type="Thing", interval=span(0, 1), agent=agent)


@pytest.fixture
def memory(dsn: str) -> Iterator[elm.Memory]:
    """300 events, 200 of agent a, in a memory whose connections have been used."""
    with elm.connect(dsn, "forked") as opened:
        opened.add_type("Thing")
        opened.load(thing("a" if number % 3 else "b") for number in range(300))
        assert opened.recall(cues.agent("a")).count() == 200
        yield opened


def backend(connections: Connections) -> tuple[int, int]:
    """The server's processes behind the connections that an idle store writes and recalls with."""

    def asked(connection: Connection) -> int:
        row = connection.execute("SELECT pg_backend_pid()").fetchone()
        assert row is not None
        return int(row[0])

    with connections.writing() as writing, connections.recalling() as recalling:
        return asked(writing), asked(recalling)


def connections_of(memory: elm.Memory) -> Connections:
    assert isinstance(memory.store, PostgresStore)
    return memory.store._connections


def test_children_get_their_own_answers_and_the_parent_its_own(memory: elm.Memory) -> None:
    before = backend(connections_of(memory))

    def ask(agent: str) -> Callable[[], set[int]]:
        return lambda: {memory.recall(cues.agent(agent)).count() for _ in range(100)}

    children = {agent: Child(ask(agent)) for agent in ("a", "b", "c")}
    assert {memory.recall(cues.agent("b")).count() for _ in range(100)} == {100}
    assert {agent: child.result() for agent, child in children.items()} == {"a": {200}, "b": {100}, "c": {0}}
    theirs = in_child(lambda: backend(connections_of(memory)))
    assert backend(connections_of(memory)) == before
    assert not set(theirs) & set(before)


_shared: elm.Memory


def _committed(worker: int) -> list[tuple[int, UUID]]:
    events = [thing(f"worker {worker}") for _ in range(50)]
    return [(_shared.commit(event).id, event.uid) for event in events]


def test_workers_of_a_pool_commit_each_its_own(memory: elm.Memory) -> None:
    global _shared
    _shared = memory
    with multiprocessing.get_context("fork").Pool(3) as pool:
        told = [pair for pairs in pool.map_async(_committed, range(3), chunksize=1).get(PATIENCE) for pair in pairs]
    assert len(told) == 150
    assert [(memory.get(uid).id, uid) for _, uid in told] == told
    assert memory.recall().count() == 450


def test_a_child_of_a_child_and_a_closed_memory(memory: elm.Memory) -> None:
    def closing() -> int:
        count: int = in_child(memory.recall().count)
        memory.close()
        return count

    assert in_child(closing) == 300
    assert memory.recall().count() == 300


@pytest.mark.parametrize("everything", [False, True], ids=["a recall", "all with their parts"])
def test_a_half_read_result_goes_on_where_it_was_begun(memory: elm.Memory, *, everything: bool) -> None:
    reading = memory.store.everything() if everything else iter(memory.recall())
    read = [next(reading)]

    def dropped() -> int:
        nonlocal reading
        reading = iter(())
        return memory.recall().count()

    def read_on() -> int:
        with pytest.raises(DatabaseUnreachable, match="connection"):
            list(reading)
        return memory.recall().count()

    assert in_child(dropped) == 300
    assert in_child(read_on) == 300
    read += reading
    assert len(read) == 300


def test_no_child_waits_for_a_lock_that_a_thread_of_its_parent_holds(memory: elm.Memory) -> None:
    assert isinstance(memory.store, PostgresStore)
    connections, statements = connections_of(memory), memory.store._session.statements
    held, done = Signal(), Signal()

    def build() -> Any:
        held.set()
        done.wait()
        raise InterruptedError

    def hold() -> None:
        with connections.writing(), suppress(InterruptedError):
            statements.text("a slow one", build)

    thread = Thread(target=hold)
    thread.start()
    held.wait()
    try:
        child = in_child(
            lambda: (memory.commit(thing("c")).new, memory.recall(cues.agent("c") & cues.is_a("Thing")).count())
        )
    finally:
        done.set()
        thread.join()
    assert child == (True, 1)


def test_a_child_does_not_hold_its_parents_name(memory: elm.Memory) -> None:
    holding = memory.log.exclusive("reader")
    holding.__enter__()

    def let_go() -> str:
        holding.__exit__(None, None, None)
        with pytest.raises(ConsumerBusy), memory.log.exclusive("reader"):
            pass
        return "busy"

    assert in_child(let_go) == "busy"
    assert in_child(let_go) == "busy"
    holding.__exit__(None, None, None)
    with memory.log.exclusive("reader"):
        pass


def test_a_name_is_free_when_its_holder_died_though_a_child_lives_on(memory: elm.Memory) -> None:
    waits, go = os.pipe()
    told, tell = os.pipe()

    def die() -> None:
        with memory.log.exclusive("reader"):
            if os.fork() == 0:
                os.close(go)
                os.write(tell, b"alive")
                os.read(waits, 1)
                os._exit(0)
            os.read(told, 5)
            os.kill(os.getpid(), signal.SIGKILL)

    with pytest.raises(AssertionError, match="without an answer"):
        # The grandchild has the pipe of the answer too: only its writing end may stay open.
        _ended(Child(die))
    until = PATIENCE * 10
    while until:
        with suppress(ConsumerBusy), memory.log.exclusive("reader"):
            break
        until -= 1
        Signal().wait(0.1)
    os.close(go)
    for end in (waits, told, tell):
        os.close(end)
    assert until


def _ended(child: Child) -> None:
    os.close(child._answer)
    _, status = os.waitpid(child.pid, 0)
    raise AssertionError(f"the child ended without an answer: {status}")


SCRIPT = """
import os, sys
from datetime import UTC, datetime
import elm
memory = elm.connect(sys.argv[1], "forked")
memory.commit(elm.Event(type="Thing", interval=elm.Interval.at(datetime(2026, 1, 1, tzinfo=UTC))))
reading = iter(memory.recall())
first = next(reading)
everything = memory.store.everything()
next(everything)
holding = memory.log.exclusive("reader")
holding.__enter__()
child = os.fork()
if child == 0:
    if sys.argv[2] == "asks":
        assert memory.recall().count() == 301
    sys.exit(0)
assert os.waitpid(child, 0)[1] == 0
assert len([first, *reading]) == 301
assert len([*everything]) == 300
assert memory.recall().count() == 301
try:
    with elm.connect(sys.argv[1], "forked") as other, other.log.exclusive("reader"):
        print("the child let go of the name")
except elm.errors.ConsumerBusy:
    pass
holding.__exit__(None, None, None)
memory.close()
"""


@pytest.mark.parametrize("child", ["asks", "only ends"])
def test_a_child_that_ends_by_itself_leaves_everything_to_its_parent(memory: elm.Memory, dsn: str, child: str) -> None:
    done = subprocess.run(
        [sys.executable, "-X", "dev", "-W", "error", "-c", SCRIPT, dsn, child],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_store_in_the_process_is_copied_whole_while_a_thread_writes() -> None:
    with elm.connect("memory://") as memory:
        memory.add_type("Thing")
        done = Signal()

        def write() -> None:
            while not done.is_set():
                memory.load(thing("a") for _ in range(200))

        thread = Thread(target=write)
        thread.start()
        try:
            for _ in range(20):
                counted = in_child(
                    lambda: [memory.recall().count(), memory.commit(thing("b")).id, memory.recall().count()]
                )
                assert counted == [counted[0], counted[0] + 1, counted[0] + 1]
                assert counted[0] % 200 == 0
        finally:
            done.set()
            thread.join()
        assert memory.recall(cues.agent("b")).count() == 0
