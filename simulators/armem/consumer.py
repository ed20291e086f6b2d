"""A consumer in a process of its own: says when it has what, whichever way it came."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from time import monotonic
from typing import Any

from armem_bridge.ice import MemoryClient
from armem_bridge.ice.communicators import servant_of
from armem_bridge.ice.grid import Grid
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import QueryBuilder
from simulators.armem.channel import load_channel
from simulators.armem.data_objects import KINDS, Kind


def topic_of(kind: Kind) -> str:
    """The topic to which objects of a kind are published without a memory."""
    return f"elm.{kind.name}"


def consume(locator: str) -> None:
    """Receive until stdin ends.

    The first line of stdout has the proxies that receive direct calls, in the order of the kinds. Each
    further line is the moment, by the clock that all processes share, at which a business object was there.
    """
    words, channel = load_channel()
    with MemoryClient(words, locator) as client:
        adapter = client.communicator.createObjectAdapterWithEndpoints("consumer", "tcp -h 127.0.0.1")
        grid = Grid(client.communicator)
        direct = []
        topics = []
        for kind in KINDS.values():
            proxy = adapter.addWithUUID(servant_of(channel.Consumer, receive=_receiver(client, kind)))
            direct.append(str(proxy))
            topics.append((grid.topic(topic_of(kind)), proxy.ice_oneway()))
            client.listen(kind.name, _listener(client, kind))
        adapter.activate()
        for topic, proxy in topics:
            topic.subscribeAndGetPublisher({}, proxy)
        print("\t".join(direct), flush=True)
        sys.stdin.read()
        for topic, proxy in topics:
            topic.unsubscribe(proxy)


def _receiver(client: MemoryClient, kind: Kind) -> Any:
    read = kind.business_class.from_aron

    def receive(data: Any, _: Any) -> None:
        read(client.wire.aron.read(data))
        _tell()

    return receive


def _listener(client: MemoryClient, kind: Kind) -> Any:
    memory = client.memory(kind.name)
    read = kind.business_class.from_aron

    def updated(snapshots: Sequence[MemoryID]) -> None:
        builder = QueryBuilder()
        for each in snapshots:
            builder.select(each)
        for _, instance in memory.query(builder.build()).instances():
            read(instance.data)
        _tell()

    return updated


def _tell() -> None:
    moment = monotonic()
    print(repr(moment), flush=True)


if __name__ == "__main__":
    consume(sys.argv[1])
