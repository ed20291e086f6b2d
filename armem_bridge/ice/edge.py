"""What both modes share: an adapter with a servant for each memory, and the messages of what was updated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from threading import Event, Lock
from types import TracebackType
from typing import Any, Final, Self

import msgspec

from armem_bridge.ice.communicators import identity, make_communicator
from armem_bridge.ice.making import maker
from armem_bridge.ice.memory_servant import MemoryServant
from armem_bridge.ice.name_servant import NameServant
from armem_bridge.ice.refusals import Unreachable
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire import Wire
from armem_bridge.memory_id import MemoryID
from armem_bridge.names import MemoryNameSystem
from armem_bridge.working.notifications import Subscription
from armem_bridge.working.server import MemoryServer

NAME_SYSTEM: Final = "MemoryNameSystem"
"""The identity of the memory name system, which all clients know."""


class EdgeStatus(msgspec.Struct, frozen=True, kw_only=True):
    """What the Ice edge of a process tells of itself; what is counted is counted since it started."""

    generation: int
    """The generation of the interface that the slice files are of."""

    version: str
    """The version of ARON that the bridge writes."""

    versions: Mapping[str, int]
    """The versions of ARON that arrived, and how many instances were of each; empty text where none was set."""

    memories: tuple[str, ...]
    malformed: int
    """So many updates and queries could not be read."""

    untimed: int
    """So many updates had no valid referenced time, and got that of their arrival."""

    waiting: int
    """So many clients wait for a memory."""


class Edge:
    """Memory servers of this process for clients that speak Ice.

    Use it as a context, or call `close`: clients hold on to connections until then.
    """

    def __init__(self, words: Vocabulary, *, endpoint: str, properties: Mapping[str, str] | None = None) -> None:
        self.words = words
        self.wire = Wire(words)
        self._servants: dict[str, MemoryServant] = {}
        self._name_servant: NameServant | None = None
        self._subscriptions: dict[str, Subscription] = {}
        self._lock = Lock()
        self._ended = Event()
        reading, writing = ("ReadingMemoryInterfacePrx", "WritingMemoryInterfacePrx")
        self._reading, self._writing = (words.member(words.server, name) for name in (reading, writing))
        self._listener = words.member(words.client, "MemoryListenerInterfacePrx")
        self._interfaces = maker(words.member(words.mns_data, "MemoryServerInterfaces"), "reading", "writing")
        self.communicator = make_communicator(properties)
        try:
            self.adapter = self.communicator.createObjectAdapterWithEndpoints("elm", endpoint)
        except Exception as error:
            self.communicator.destroy()
            raise Unreachable(
                f"cannot listen at {endpoint!r}: {error}. Is another robot's registry, or another elm, running there?"
            ) from error

    # The memories

    def _add_servant(self, server: MemoryServer) -> Any:
        """Make a memory reachable; its proxy."""
        servant = MemoryServant(server, self.wire)
        proxy = self.adapter.add(servant.servant, identity(f"{server.name}Memory"))
        self._servants[server.name] = servant
        return proxy

    def _interfaces_of(self, proxy: Any) -> Any:
        """What a name system gives for a memory."""
        return self._interfaces(reading=self._reading.uncheckedCast(proxy), writing=self._writing.uncheckedCast(proxy))

    def _publish(self, server: MemoryServer, publisher: Any) -> None:
        """Send the IDs of what is updated from now on to a topic, one message a commit."""
        listener = self._listener.uncheckedCast(publisher.ice_oneway())
        write = self.wire.identifiers.write_id

        def send(updated: Sequence[MemoryID]) -> None:
            listener.memoryUpdated([write(each) for each in updated])

        with self._lock:
            if server.name not in self._subscriptions:
                self._subscriptions[server.name] = server.subscribe(send)

    def _publish_no_more(self, name: str) -> None:
        with self._lock:
            subscription = self._subscriptions.pop(name, None)
        if subscription is not None:
            subscription.close()

    def _serve_names(self, names: MemoryNameSystem[Any]) -> Any:
        """Be the name system of a robot; its proxy."""
        self._name_servant = NameServant(names, self.words)
        return self.adapter.add(self._name_servant.servant, identity(NAME_SYSTEM))

    # Looking after it

    def status(self) -> EdgeStatus:
        """What arrived so far, and what was wrong with it."""
        servants = list(self._servants.values())
        return EdgeStatus(
            generation=int(self.words.generation),
            version=self.wire.aron.version,
            versions=self.wire.aron.versions.report(),
            memories=tuple(sorted(self._servants)),
            malformed=sum(servant.malformed for servant in servants),
            untimed=sum(servant.untimed for servant in servants),
            waiting=self._name_servant.waiting() if self._name_servant is not None else 0,
        )

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until somebody closes the edge; False if nobody did within `timeout` seconds."""
        return self._ended.wait(timeout)

    def close(self) -> None:
        """Answer no more. The memory servers stay as they are."""
        if self._ended.is_set():
            return
        try:
            for name in list(self._subscriptions):
                self._publish_no_more(name)
            self._leave()
            if self._name_servant is not None:
                self._name_servant.close()
        finally:
            self.communicator.destroy()
            self._ended.set()

    def _leave(self) -> None:
        """Say goodbye to others, as far as there are any."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def topic_of(memory: str) -> str:
    """The topic on which a memory tells of its updates."""
    return f"MemoryUpdates.{memory}"
