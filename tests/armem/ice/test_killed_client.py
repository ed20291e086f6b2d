"""A client that is killed in the middle of a commit."""

from __future__ import annotations

from collections.abc import Callable
from time import sleep

from armem_bridge.aron.data import Dict, NDArray
from armem_bridge.ice import MemoryClient
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit
from tests.armem.ice.processes import ClientProcess, ServerProcess
from tests.armem.ice.test_two_processes import committing, history, moments, querying, update

EXTENT = 1_000_000
ENTITIES = ("left", "right", "depth")


def commit_for_ever(client: MemoryClient, first: MemoryID) -> None:
    """Commits of several large updates, one after the other, until somebody puts an end to it."""
    memory = client.memory("Object")
    moment = 0
    while True:
        moment += 1
        data = Dict({"image": NDArray((EXTENT, 1), "uint8", bytes([moment % 256]) * EXTENT)})
        memory.commit(Commit(updates=[update(first.with_entity(name), moment, data) for name in ENTITIES]))


def test_nothing_is_half_written(
    server: ServerProcess,
    client: ClientProcess,
    cup: MemoryID,
    eventually: Callable[[Callable[[], bool]], None],
) -> None:
    for attempt in range(2):
        place = cup.with_provider_segment(f"{cup.provider_segment}{attempt}")
        commits = server.ask("server")["commits"]
        doomed = ClientProcess(server.generation, server.locator)
        doomed.start(commit_for_ever, place)
        eventually(lambda commits=commits: server.ask("server")["commits"] >= commits + 2)  # type: ignore[misc]
        sleep(0.003 * attempt)

        doomed.kill()

        written = [client.call(values, place.with_entity(name)) for name in ENTITIES]
        assert len(written[0]) >= 2
        assert written[0] == written[1] == written[2]
        assert written[0] == [(moment, EXTENT, {moment % 256}) for moment in range(1, len(written[0]) + 1)]

    assert client.call(committing, update(cup, 1)).success
    assert moments(client, cup) == [1]


def values(client: MemoryClient, entity: MemoryID) -> list[tuple[int, int, set[int]]]:
    """Of each snapshot: when, how much, and of what."""
    found = querying(client, history(entity)).entity(entity)
    assert found is not None
    rows = []
    for moment, snapshot in found.history.items():
        (instance,) = snapshot.instances
        assert instance.data is not None
        array = instance.data.elements["image"]
        assert isinstance(array, NDArray)
        rows.append((moment, len(array.data), set(array.data)))
    return rows
