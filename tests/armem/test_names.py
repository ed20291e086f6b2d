"""The memory name system: register, resolve, and wait without a thread for each who waits."""

from __future__ import annotations

import threading
import time
from concurrent.futures import Future

import pytest

from armem_bridge.names import MemoryNameSystem, UnknownMemory


@pytest.fixture
def mns() -> MemoryNameSystem[object]:
    return MemoryNameSystem()


def test_what_is_registered_is_found(mns: MemoryNameSystem[object]) -> None:
    server, other = object(), object()
    mns.register("Object", server)
    mns.register("a/b ü", other)

    assert mns.resolve("Object") is server
    assert mns.registered() == {"Object": server, "a/b ü": other}
    assert mns.wait("Object", timeout=0) is server


def test_what_is_not_registered_is_named(mns: MemoryNameSystem[object]) -> None:
    mns.register("Object", object())

    with pytest.raises(UnknownMemory, match=r"'Grasp' \(there are: Object\)"):
        mns.resolve("Grasp")
    with pytest.raises(UnknownMemory, match="under its name"):
        mns.register("", object())


def test_a_server_that_comes_again_takes_its_name(mns: MemoryNameSystem[object]) -> None:
    before, after = object(), object()
    mns.register("Object", before)
    mns.register("Object", after)

    assert mns.resolve("Object") is after
    assert not mns.unregister("Object", before), "the old process must not take the name from the new one"
    assert mns.unregister("Object", after)
    assert not mns.unregister("Object")
    with pytest.raises(UnknownMemory, match="none"):
        mns.resolve("Object")


def test_waiting_ends_in_time(mns: MemoryNameSystem[object]) -> None:
    begin = time.monotonic()
    with pytest.raises(UnknownMemory, match=r"within 0\.05 s"):
        mns.wait("Object", timeout=0.05)

    assert 0.04 < time.monotonic() - begin < 5
    assert mns.waiting() == {}, "who gave up is forgotten"


def test_who_waits_is_told(mns: MemoryNameSystem[object]) -> None:
    server = object()
    timer = threading.Timer(0.05, mns.register, ("Object", server))
    timer.start()

    assert mns.wait("Object", timeout=10) is server
    timer.join()


def test_64_wait_without_64_threads(mns: MemoryNameSystem[object]) -> None:
    threads = threading.active_count()
    waiting = [mns.waiting_for(f"Memory{number % 4}") for number in range(64)]
    told: list[Future[object]] = []
    for future in waiting:
        future.add_done_callback(told.append)

    assert threading.active_count() == threads
    assert mns.waiting() == {f"Memory{number}": 16 for number in range(4)}
    server = object()
    mns.register("Memory1", server)
    assert [future.result(timeout=0) for future in waiting[1::4]] == [server] * 16
    assert len(told) == 16
    assert mns.waiting() == {f"Memory{number}": 16 for number in (0, 2, 3)}


def test_who_cancels_is_not_told(mns: MemoryNameSystem[object]) -> None:
    gone, stays = mns.waiting_for("Object"), mns.waiting_for("Object")
    assert gone.cancel()
    assert mns.waiting() == {"Object": 1}
    server = object()
    mns.register("Object", server)

    assert gone.cancelled()
    assert stays.result(timeout=0) is server
    assert mns.waiting_for("Object").result(timeout=0) is server


def test_registering_and_waiting_at_once_misses_nobody(mns: MemoryNameSystem[object]) -> None:
    found: list[object] = []
    threads = [
        threading.Thread(target=lambda name=f"Memory{number}": found.append(mns.wait(name, timeout=10)))
        for number in range(8)
        for _ in range(4)
    ]
    threads += [
        threading.Thread(target=mns.register, args=(f"Memory{number}", f"server {number}")) for number in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=20)

    assert sorted(map(str, found)) == sorted(f"server {number}" for number in range(8) for _ in range(4))
