"""What is said to others at the end: to each of them, whether or not the one before could be told."""

from __future__ import annotations

import subprocess
import sys

from tests.armem.ice.processes import ROOT
from tests.armem.ice.serving import SLICES

LEAVE = """
import sys
from armem_bridge.ice import Joined, Standalone, load_slices
from armem_bridge.ice.communicators import identity
from armem_bridge.ice.installation import load_ice
from tests.armem.ice.serving import make_server

words, ice = load_slices([sys.argv[1]]), load_ice()
with Standalone(words, [make_server("Object")], port=0) as robot:
    servers = [make_server("Speech"), make_server("Grasp")]
    with Joined(words, servers, locator=robot.locator, endpoint="tcp -h 127.0.0.1"):
        # The name system is gone, the registry is not.
        robot.adapter.remove(identity("MemoryNameSystem"))
    for name in ("Object", "Speech", "Grasp"):
        try:
            ice.LocatorPrx.uncheckedCast(robot.communicator.stringToProxy(robot.locator)).findObjectById(
                identity(f"{name}Memory")
            )
            print(name)
        except ice.ObjectNotFoundException:
            pass
    for server in servers:
        server.close()
"""

LISTEN = """
import sys
from armem_bridge.ice import MemoryClient, Standalone, load_slices
from armem_bridge.ice.installation import load_package
from tests.armem.ice.serving import make_server

words, storm = load_slices([sys.argv[1]]), load_package("IceStorm")
with Standalone(words, [make_server("Object"), make_server("Speech")], port=0) as robot:
    client = MemoryClient(words, robot.locator)
    for name in ("Object", "Speech"):
        client.listen(name, print)
    manager = storm.TopicManagerPrx.uncheckedCast(robot.adapter.createProxy(
        client.communicator.stringToIdentity("IceStorm/TopicManager")))
    manager.retrieve("MemoryUpdates.Object").destroy()
    speech = manager.retrieve("MemoryUpdates.Speech")
    print(len(speech.getSubscribers()))
    client.close()
    print(len(speech.getSubscribers()))
"""


def run(program: str) -> list[str]:
    """The lines that a program says, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", program, str(SLICES / "gen4")],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_the_registry_forgets_memories_that_the_name_system_could_not_be_told_of(ice: None) -> None:
    assert run(LEAVE) == ["Object"]


def test_topics_lose_their_subscriber_though_another_topic_is_gone(ice: None) -> None:
    assert run(LISTEN) == ["1", "0"]
