"""Clients that wait for a memory: many at once, and some that never see it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any
from uuid import uuid4

import pytest

from armem_bridge.ice import MemoryClient
from armem_bridge.memory_id import MemoryID
from armem_bridge.names import UnknownMemory
from tests.armem.ice.processes import ClientProcess, ServerProcess
from tests.armem.ice.test_two_processes import committing, moments, update

CLIENTS = 64

_waiting: list[Any] = []


@pytest.fixture
def waiter(server: ServerProcess) -> Iterator[ClientProcess]:
    """One more process, for what waits in it."""
    with ClientProcess(server.generation, server.locator) as process:
        yield process


def begin_to_wait(client: MemoryClient, name: str) -> None:
    """Wait as so many clients would, each with a connection of its own."""
    wish = client.wire.words.mns_data.WaitForServerInput(name)
    connections = (client.names.ice_connectionId(str(number)) for number in range(CLIENTS))
    _waiting.extend(names.waitForServerAsync(wish) for names in connections)


def end_to_wait(client: MemoryClient) -> list[bool]:
    """Whether each got a memory that answers."""
    answers = [future.result() for future in _waiting]
    _waiting.clear()
    return [answer.success and answer.server.reading.ice_isA(_reading(client)) for answer in answers]


def _reading(client: MemoryClient) -> str:
    name: str = client.wire.words.server.ReadingMemoryInterface.ice_staticId()
    return name


def wait_for(client: MemoryClient, name: str, timeout: float) -> str:
    return client.wait(name, timeout).name


def test_sixty_four_waiting_clients_keep_nobody_from_working(
    server: ServerProcess,
    client: ClientProcess,
    waiter: ClientProcess,
    cup: MemoryID,
    eventually: Callable[[Callable[[], bool]], None],
) -> None:
    name = f"Later{uuid4().hex}"
    waiter.call(begin_to_wait, name)
    eventually(lambda: server.ask("edge")["waiting"] == CLIENTS)

    assert client.call(committing, update(cup, 1)).success
    assert moments(client, cup) == [1]
    server.ask("add", name)

    assert waiter.call(end_to_wait) == [True] * CLIENTS
    assert server.ask("edge")["waiting"] == 0


def test_who_waits_for_what_is_there_has_it_at_once(client: ClientProcess) -> None:
    assert client.call(wait_for, "Object", 20) == "Object"


def test_patience_ends(client: ClientProcess) -> None:
    with pytest.raises(UnknownMemory, match=r"'Never' within 0\.1 s"):
        client.call(wait_for, "Never", 0.1)


def test_a_client_that_is_gone_waits_no_more(
    server: ServerProcess, eventually: Callable[[Callable[[], bool]], None]
) -> None:
    before = server.ask("edge")["waiting"]
    lost = ClientProcess(server.generation, server.locator)
    lost.call(begin_to_wait, f"Never{uuid4().hex}")
    eventually(lambda: server.ask("edge")["waiting"] == before + CLIENTS)

    lost.kill()

    eventually(lambda: server.ask("edge")["waiting"] == before)


def test_a_server_ends_although_clients_wait(
    server: ServerProcess, eventually: Callable[[Callable[[], bool]], None]
) -> None:
    with ServerProcess(server.generation) as short, ClientProcess(server.generation, short.locator) as client:
        client.call(begin_to_wait, "Never")
        eventually(lambda: short.ask("edge")["waiting"] == CLIENTS)

        short.close()

        assert client.call(outcomes) == {"not found"}


def outcomes(client: MemoryClient) -> set[str]:
    """What became of the waiting."""
    found = {"found" if future.result().success else "not found" for future in _waiting}
    _waiting.clear()
    return found
