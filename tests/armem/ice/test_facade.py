"""The standalone server as an unmodified client sees it: registry, administration, topics."""

from __future__ import annotations

import subprocess
import sys
from queue import Empty, Queue
from time import monotonic, sleep
from typing import Any
from uuid import uuid4

from armem_bridge.ice import MemoryClient
from armem_bridge.ice.communicators import servant_of
from armem_bridge.ice.installation import load_ice, load_package
from armem_bridge.memory_id import MemoryID
from tests.armem.ice.processes import ROOT, ClientProcess, ServerProcess
from tests.armem.ice.serving import SLICES
from tests.armem.ice.test_two_processes import committing, update


def admin_of(client: MemoryClient) -> Any:
    grid = load_package("IceGrid")
    registry = grid.RegistryPrx.checkedCast(client.communicator.stringToProxy("IceGrid/Registry"))
    return registry.createAdminSession("user", "password").getAdmin()


def manager_of(client: MemoryClient) -> Any:
    return load_package("IceStorm").TopicManagerPrx.checkedCast(
        client.communicator.stringToProxy("IceStorm/TopicManager")
    )


def add_listener(client: MemoryClient, name: str, heard: Queue[Any]) -> Any:
    """A listener with an adapter of its own, as clients make one."""
    adapter = client.communicator.createObjectAdapterWithEndpoints(name, "tcp -h 127.0.0.1")
    interface = client.wire.words.client.MemoryListenerInterface
    servant = servant_of(interface, memoryUpdated=lambda wires, current: heard.put(wires))
    proxy = adapter.add(servant, load_ice().Identity(name, ""))
    adapter.activate()
    return proxy


def test_the_name_system_is_a_well_known_object(client: ClientProcess) -> None:
    assert client.call(names_by_proxy) == ["Object"]


def names_by_proxy(client: MemoryClient) -> list[str]:
    prx = client.wire.words.mns.MemoryNameSystemInterfacePrx
    names = prx.checkedCast(client.communicator.stringToProxy("MemoryNameSystem"))
    return [name for name in names.getAllRegisteredServers().servers if name == "Object"]


def test_what_is_not_registered_is_reported_as_by_a_registry(client: ClientProcess) -> None:
    assert client.call(ping, "NoSuchObject") == "NotRegisteredException"
    assert client.call(ping, "object @ NoSuchAdapter") == "NotRegisteredException"
    assert client.call(ping, "ObjectMemory") == "pinged"


def ping(client: MemoryClient, name: str) -> str:
    try:
        client.communicator.stringToProxy(name).ice_ping()
    except load_ice().Exception as error:
        return type(error).__name__
    return "pinged"


def test_objects_are_added_updated_and_removed(client: ClientProcess) -> None:
    assert client.call(administrate, uuid4().hex) == [
        "found",
        "exists",
        "updated",
        "listed",
        "info",
        "removed",
        "gone",
        "gone for good",
        "not updated",
        "node is there",
    ]


def administrate(client: MemoryClient, name: str) -> list[str]:
    """What an administration session answers, step by step."""
    ice, grid = load_ice(), load_package("IceGrid")
    admin = admin_of(client)
    proxy = add_listener(client, name, Queue())
    kind = proxy.ice_id()
    steps = []
    admin.addObjectWithType(proxy, kind)
    client.communicator.stringToProxy(name).ice_ping()
    steps.append("found")
    try:
        admin.addObjectWithType(proxy, kind)
    except grid.ObjectExistsException:
        steps.append("exists")
    admin.updateObject(proxy)
    steps.append("updated")
    if [info.type for info in admin.getAllObjectInfos(f"{name}*")] == [kind]:
        steps.append("listed")
    if admin.getObjectInfo(proxy.ice_getIdentity()).proxy == proxy:
        steps.append("info")
    admin.removeObject(proxy.ice_getIdentity())
    steps.append("removed")
    try:
        client.communicator.getDefaultLocator().findObjectById(proxy.ice_getIdentity())
    except ice.ObjectNotFoundException:
        steps.append("gone")
    try:
        admin.removeObject(proxy.ice_getIdentity())
    except grid.ObjectNotRegisteredException:
        steps.append("gone for good")
    try:
        admin.updateObject(proxy)
    except grid.ObjectNotRegisteredException:
        steps.append("not updated")
    if admin.pingNode("NodeMain"):
        steps.append("node is there")
    return steps


def test_adapters_are_found_by_their_names(client: ClientProcess) -> None:
    assert client.call(adapter_by_name, uuid4().hex)


def adapter_by_name(client: MemoryClient, name: str) -> bool:
    ice = load_ice()
    locator = client.communicator.getDefaultLocator()
    proxy = add_listener(client, name, Queue())
    locator.getRegistry().setAdapterDirectProxy(name, proxy)
    found = client.communicator.stringToProxy(f"{name} @ {name}")
    answers: bool = found.ice_isA(proxy.ice_id())
    locator.getRegistry().setAdapterDirectProxy(name, None)
    try:
        locator.findAdapterById(name)
    except ice.AdapterNotFoundException:
        return answers
    return False


def test_topics_as_clients_use_them(client: ClientProcess) -> None:
    assert client.call(use_topics, uuid4().hex) == [
        "none",
        "exists",
        "the same",
        "already subscribed",
        "heard",
        "quiet",
    ]


def use_topics(client: MemoryClient, name: str) -> list[str]:
    """What a topic manager answers, step by step."""
    storm = load_package("IceStorm")
    manager = manager_of(client)
    prx = client.wire.words.client.MemoryListenerInterfacePrx
    steps = []
    try:
        manager.retrieve(name)
    except storm.NoSuchTopic:
        steps.append("none")
    topic = manager.create(name)
    try:
        manager.create(name)
    except storm.TopicExists:
        steps.append("exists")
    if manager.retrieve(name) == topic == manager.retrieveAll()[name] and topic.getName() == name:
        steps.append("the same")
    heard: Queue[Any] = Queue()
    listener = add_listener(client, name, heard)
    topic.subscribeAndGetPublisher(None, listener)
    try:
        topic.subscribeAndGetPublisher(None, listener)
    except storm.AlreadySubscribed:
        steps.append("already subscribed")
    topic.unsubscribe(listener)
    mine = topic.subscribeAndGetPublisher(None, listener)
    for publisher in (topic.getPublisher(), mine):
        prx.uncheckedCast(publisher.ice_oneway()).memoryUpdated([client.wire.identifiers.write_id(MemoryID())])
    if all(len(heard.get(timeout=10)) == 1 for _ in range(2)):
        steps.append("heard")
    topic.unsubscribe(listener)
    prx.uncheckedCast(topic.getPublisher()).memoryUpdated([])
    try:
        heard.get(timeout=0.1)
    except Empty:
        steps.append("quiet")
    topic.destroy()
    return steps


def test_a_subscriber_that_is_gone_is_dropped_and_the_others_go_on(client: ClientProcess, cup: MemoryID) -> None:
    assert client.call(lose_a_subscriber, cup) == ([1, 2, 3], 2)


def lose_a_subscriber(client: MemoryClient, entity: MemoryID) -> tuple[list[int], int]:
    """Times that the other subscriber heard of, in whatever order, and how many subscribers are left."""
    heard: Queue[Any] = Queue()
    topic = manager_of(client).retrieve("MemoryUpdates.Object")
    before = len(topic.getSubscribers())
    other = add_listener(client, uuid4().hex, Queue())
    kept = add_listener(client, uuid4().hex, heard)
    for proxy in (other, kept):
        topic.subscribeAndGetPublisher(None, proxy)
    unreachable = client.communicator.stringToProxy(f"{uuid4().hex}:tcp -h 127.0.0.1 -p 1")
    topic.subscribeAndGetPublisher(None, unreachable)
    for moment in (1, 2, 3):
        committing(client, update(entity, moment))
    # Each message is a oneway call, which the threads of an Ice process may take up in any order.
    times = sorted(wire.timestamp.timeSinceEpoch.microSeconds for _ in range(3) for wire in heard.get(timeout=10))
    deadline = monotonic() + 15
    while unreachable.ice_getIdentity() in topic.getSubscribers() and monotonic() < deadline:
        sleep(0.02)
    left = len(topic.getSubscribers()) - before
    for proxy in (other, kept):
        topic.unsubscribe(proxy)
    return times, left


def test_subscribers_come_and_go_while_others_commit(
    server: ServerProcess, client: ClientProcess, cup: MemoryID
) -> None:
    with ClientProcess(server.generation, server.locator) as busy:
        committing_meanwhile = busy.start(commit_often, cup, 300)
        heard = client.call(subscribe_often, cup.with_entity("other"), 30)

        assert committing_meanwhile.result(60)
        assert heard == 30
        assert client.call(hears_again, cup)


def commit_often(client: MemoryClient, entity: MemoryID, times: int) -> bool:
    return all(committing(client, update(entity, moment)).success for moment in range(1, times + 1))


def subscribe_often(client: MemoryClient, entity: MemoryID, times: int) -> int:
    """How many subscriptions, one after the other, heard of a commit."""
    heard: Queue[Any] = Queue()
    topic = manager_of(client).retrieve("MemoryUpdates.Object")
    listener = add_listener(client, uuid4().hex, heard)
    count = 0
    for moment in range(1, times + 1):
        topic.subscribeAndGetPublisher(None, listener)
        committing(client, update(entity, moment))
        count += bool(heard.get(timeout=20))
        topic.unsubscribe(listener)
    return count


def hears_again(client: MemoryClient, entity: MemoryID) -> bool:
    heard: Queue[Any] = Queue()
    topic = manager_of(client).retrieve("MemoryUpdates.Object")
    listener = add_listener(client, uuid4().hex, heard)
    topic.subscribeAndGetPublisher(None, listener)
    committing(client, update(entity, 1_000))
    message = heard.get(timeout=20)
    topic.unsubscribe(listener)
    moment: int = message[0].timestamp.timeSinceEpoch.microSeconds
    return moment == 1_000


def test_a_port_that_is_taken_is_named(server: ServerProcess) -> None:
    port = server.locator.rpartition("-p ")[2].split()[0]
    program = (
        "import sys\n"
        "from armem_bridge.ice import Standalone, load_slices\n"
        "from armem_bridge.ice.refusals import Unreachable\n"
        "try:\n"
        "    Standalone(load_slices([sys.argv[1]]), port=int(sys.argv[2]))\n"
        "except Unreachable as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(SLICES / server.generation), port],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
        timeout=60,
    )

    assert f"cannot listen at 'tcp -h 127.0.0.1 -p {port}'" in done.stdout
