"""The age of data: from their production in one process to their reception in another, three ways: figure 5.3."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import monotonic
from typing import Any, Final

from armem_bridge.ice import MemoryClient
from armem_bridge.ice.grid import Grid
from simulators.armem.channel import load_channel
from simulators.armem.consumer import topic_of
from simulators.armem.data_objects import KINDS, Kind
from simulators.armem.preloaded import ENTRIES, batch
from simulators.armem.processes import Process
from simulators.armem.series import in_microseconds
from simulators.bench.timing import in_turn, steady_heap

WAYS: Final = ("direct", "topic", "memory")
"""A call from the producer to the consumer; a topic between them; a memory, which notifies and is then asked."""

Send = Callable[[], object]


def measure(
    locator: str, *, samples: int, first: Iterator[int], advance: Callable[[int], None]
) -> dict[str, dict[str, dict[str, float]]]:
    """The ages of one object at a time, by kind and way; conversions from and to business objects are in them.

    This process produces, the memories and the topics are in the process at `locator`, a third one consumes.
    The ways take turns object by object.
    """
    words, channel = load_channel()
    found: dict[str, dict[str, list[float]]] = {name: {way: [] for way in WAYS} for name in KINDS}
    with Process("simulators.armem.consumer", locator) as consumer, MemoryClient(words, locator) as client:
        proxies = consumer.line().split("\t")
        for kind, proxy in zip(KINDS.values(), proxies, strict=True):
            direct = channel.ConsumerPrx.uncheckedCast(client.communicator.stringToProxy(proxy))
            ways = _ways(client, channel, kind, direct, first)
            for way in WAYS:
                # Connections are made at the first call.
                ways[way]()
                consumer.line()
            with steady_heap():
                for turn in range(samples):
                    for way in in_turn(WAYS, turn):
                        produced = monotonic()
                        ways[way]()
                        found[kind.name][way].append(float(consumer.line()) - produced)
                    advance(1)
    return {name: {way: in_microseconds(series) for way, series in of_kind.items()} for name, of_kind in found.items()}


def _ways(client: MemoryClient, channel: Any, kind: Kind, direct: Any, first: Iterator[int]) -> dict[str, Send]:
    thing = kind.make(1)
    write = client.wire.aron.write
    topic = Grid(client.communicator).topic(topic_of(kind))
    publisher = channel.ConsumerPrx.uncheckedCast(topic.getPublisher().ice_oneway())
    memory = client.memory(kind.name)
    return {
        "direct": lambda: direct.receive(write(thing.to_aron())),
        "topic": lambda: publisher.receive(write(thing.to_aron())),
        "memory": lambda: memory.commit(batch(kind, [thing.to_aron()], next(first) * ENTRIES)),
    }
