"""A memory server and a client for each generation, each in a process of its own; skipped where Ice is missing."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterator
from time import monotonic, sleep

import pytest

from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.refusals import IceMissing
from armem_bridge.memory_id import MemoryID
from tests.armem.ice.processes import ClientProcess, ServerProcess

GENERATIONS = ("gen3", "gen4")


@pytest.fixture(scope="session")
def ice() -> None:
    """Skips where there is no Ice for this Python."""
    try:
        load_ice()
        slice_directory()
    except IceMissing as error:
        pytest.skip(str(error))


@pytest.fixture(scope="session", params=GENERATIONS)
def server(request: pytest.FixtureRequest, ice: None) -> Iterator[ServerProcess]:
    """A memory server that runs on its own."""
    with ServerProcess(request.param) as process:
        yield process


@pytest.fixture(scope="session")
def client(server: ServerProcess) -> Iterator[ClientProcess]:
    """A client of it."""
    with ClientProcess(server.generation, server.locator) as process:
        yield process


@pytest.fixture
def cup() -> MemoryID:
    """An entity that no other test has."""
    return MemoryID(memory="Object", core_segment="Instance", provider_segment=uuid.uuid4().hex, entity="cup")


@pytest.fixture
def eventually() -> Callable[[Callable[[], bool]], None]:
    """Wait until something holds, for a while."""

    def wait(holds: Callable[[], bool]) -> None:
        deadline = monotonic() + 15
        while not holds():
            assert monotonic() < deadline, "it did not come about within 15 s"
            sleep(0.02)

    return wait
