"""Memory servers that join a robot: one without IceGrid, and one with Debian's IceGrid and IceStorm where they are."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from time import monotonic, sleep

import pytest

from armem_bridge.ice import MemoryClient
from armem_bridge.ice.communicators import make_communicator
from armem_bridge.ice.installation import load_ice, load_package
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit
from tests.armem.ice.processes import ROOT, ClientProcess, ServerProcess
from tests.armem.ice.serving import SLICES
from tests.armem.ice.test_two_processes import listen_and_commit, update


def registered(client: MemoryClient) -> list[str]:
    return list(client.registered())


def wait_and_commit(client: MemoryClient, entity: MemoryID) -> bool:
    return client.wait(entity.memory, 20).commit(Commit(updates=[update(entity, 1)])).success


def test_one_more_memory_for_a_robot(server: ServerProcess, client: ClientProcess, cup: MemoryID) -> None:
    with ServerProcess(server.generation, "Speech", server.locator):
        words = MemoryID(memory="Speech", core_segment="Instance", provider_segment="p", entity="word")

        assert "Speech" in client.call(registered)
        assert client.call(wait_and_commit, words)

    assert "Speech" not in client.call(registered)
    assert "Object" in client.call(registered)


def test_without_a_registry_the_message_names_it(ice: None) -> None:
    message = refused("IceGrid/Locator:tcp -h 127.0.0.1 -p 1")

    assert "cannot be reached through IceGrid/Locator" in message
    assert "Is the registry running there?" in message


def refused(locator: str) -> str:
    program = (
        "import sys\n"
        "from armem_bridge.ice import Joined, MemoryClient, load_slices\n"
        "from armem_bridge.ice.refusals import Unreachable\n"
        "words = load_slices([sys.argv[1]])\n"
        "for make in (lambda: Joined(words, [], locator=sys.argv[2]), lambda: MemoryClient(words, sys.argv[2])):\n"
        "    try:\n"
        "        make()\n"
        "    except Unreachable as error:\n"
        "        print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(SLICES / "gen4"), locator],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
        timeout=60,
    )
    assert len(done.stdout.splitlines()) == 2
    return done.stdout


REGISTRY = """
IceGrid.InstanceName=IceGrid
IceGrid.Registry.Client.Endpoints=tcp -h 127.0.0.1 -p {port}
IceGrid.Registry.Server.Endpoints=tcp -h 127.0.0.1
IceGrid.Registry.Internal.Endpoints=tcp -h 127.0.0.1
IceGrid.Registry.AdminPermissionsVerifier=IceGrid/NullPermissionsVerifier
IceGrid.Registry.PermissionsVerifier=IceGrid/NullPermissionsVerifier
IceGrid.Registry.DynamicRegistration=1
IceGrid.Registry.LMDB.Path={directory}
IceGrid.Registry.LMDB.MapSize=1
"""

STORM = """
Ice.Default.Locator={locator}
IceBox.Service.IceStorm=IceStormService,37:createIceStorm
IceBox.InheritProperties=1
IceStorm.InstanceName=IceStorm
IceStorm.Transient=1
IceStorm.TopicManager.Endpoints=tcp -h 127.0.0.1 -p {port}
IceStorm.Publish.Endpoints=tcp -h 127.0.0.1
"""


@pytest.fixture(scope="module")
def grid(ice: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The locator of a real IceGrid with a real IceStorm."""
    registry, box = (shutil.which(program) for program in ("icegridregistry", "icebox"))
    if registry is None or box is None or not any(Path("/usr/lib").glob("*/libIceStormService.so.37")):
        pytest.skip("IceGrid and IceStorm are missing: apt-get install zeroc-icegrid zeroc-icebox libzeroc-icestorm3.7")
    directory = tmp_path_factory.mktemp("grid")
    ports = free_ports(2)
    locator = f"IceGrid/Locator:tcp -h 127.0.0.1 -p {ports[0]}"
    (directory / "registry").mkdir()
    settings = {
        registry: REGISTRY.format(port=ports[0], directory=directory / "registry"),
        box: STORM.format(locator=locator, port=ports[1]),
    }
    with ExitStack() as stack:
        for program, text in settings.items():
            config = directory / f"{Path(program).name}.cfg"
            config.write_text(text)
            process = stack.enter_context(
                subprocess.Popen(
                    [program, f"--Ice.Config={config}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
            )
            stack.callback(process.kill)
        add_manager(locator, f"IceStorm/TopicManager:tcp -h 127.0.0.1 -p {ports[1]}")
        yield locator


def free_ports(count: int) -> list[int]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]


def add_manager(locator: str, manager: str) -> None:
    """Wait for registry and topic manager, and have the one know the other."""
    grid, storm = load_package("IceGrid"), load_package("IceStorm")
    ice = load_ice()
    with make_communicator({"Ice.Default.Locator": locator}) as communicator:
        deadline = monotonic() + 20
        while True:
            try:
                found = storm.TopicManagerPrx.checkedCast(communicator.stringToProxy(manager))
                registry = grid.RegistryPrx.checkedCast(communicator.stringToProxy("IceGrid/Registry"))
                break
            except ice.LocalException:
                assert monotonic() < deadline, "the registry or the topic manager does not answer"
                sleep(0.05)
        session = registry.createAdminSession("user", "password")
        session.getAdmin().addObjectWithType(found, storm.TopicManager.ice_staticId())
        session.destroy()


def test_memories_join_a_real_registry(grid: str) -> None:
    generation = "gen4"
    cup = MemoryID(memory="Object", core_segment="Instance", provider_segment="p", entity="cup")
    word = MemoryID(memory="Speech", core_segment="Instance", provider_segment="p", entity="word")

    # The first is the name system too, for the robot has none; the second registers with it.
    with ServerProcess(generation, "Object", grid), ClientProcess(generation, grid) as client:
        with ServerProcess(generation, "Speech", grid):
            names = client.call(registered)
            made = client.call(wait_and_commit, word)
            heard = client.call(listen_and_commit, cup, [[update(cup, 1), update(cup, 2)], [update(cup, 3)]])
        left = client.call(registered)

    assert names == ["Object", "Speech"]
    assert made
    assert heard == [[cup.with_timestamp(1), cup.with_timestamp(2)], [cup.with_timestamp(3)]]
    assert left == ["Object"]
