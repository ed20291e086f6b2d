"""Join: memories of this process as further ones of a running robot, with its IceGrid, IceStorm and name system."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

from armem_bridge.ice.edge import NAME_SYSTEM, Edge, topic_of
from armem_bridge.ice.grid import Grid
from armem_bridge.ice.making import maker
from armem_bridge.ice.parting import part
from armem_bridge.ice.refusals import RemoteFailure, Unreachable
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.names import MemoryNameSystem
from armem_bridge.working.server import MemoryServer

_logger = logging.getLogger(__name__)


class Joined(Edge):
    """Memory servers that are registered with a robot's name system and publish on its topics.

    `locator` is the robot's `Ice.Default.Locator`; `endpoint` is where its other components reach this
    process. A robot has one name system: only where there is none, and with `own_name_system`, this process
    is it. Raises `Unreachable` and `RemoteFailure`.
    """

    def __init__(
        self,
        words: Vocabulary,
        servers: Iterable[MemoryServer],
        *,
        locator: str,
        endpoint: str = "tcp",
        own_name_system: bool = False,
        properties: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(words, endpoint=endpoint, properties={"Ice.Default.Locator": locator, **(properties or {})})
        self._grid = Grid(self.communicator)
        self._registered: list[Any] = []
        self._named: list[str] = []
        try:
            self.adapter.activate()
            self._names = self._find_names(own_name_system)
            self._register, self._unregister = self._makers()
            for server in servers:
                self.add(server)
        except BaseException:
            self.close()
            raise

    def add(self, server: MemoryServer) -> None:
        """Make one more memory known to the robot."""
        topic = self._grid.topic(topic_of(server.name))
        proxy = self._reading.uncheckedCast(self._add_servant(server))
        self._grid.register(proxy)
        self._registered.append(proxy)
        wish = self._register(name=server.name, server=self._interfaces_of(proxy))
        answer = self._names.registerServer(wish)
        if not answer.success:
            raise RemoteFailure(
                f"the robot's name system does not take the memory {server.name!r:.80}: {answer.errorMessage}"
            )
        self._named.append(server.name)
        self._publish(server, topic.getPublisher())
        _logger.info("the memory %s joined", server.name)

    def _find_names(self, own: bool) -> Any:
        prx = self.words.member(self.words.mns, "MemoryNameSystemInterfacePrx")
        found = self._grid.find(NAME_SYSTEM, prx)
        if found is not None:
            return found
        if not own:
            raise Unreachable(
                f"the robot has no {NAME_SYSTEM}: start it, or let this process be it (own_name_system = true)"
            )
        proxy = prx.uncheckedCast(self._serve_names(MemoryNameSystem()))
        self._grid.register(proxy)
        self._registered.append(proxy)
        return proxy

    def _makers(self) -> tuple[Any, Any]:
        data = self.words.mns_data
        register, unregister = (self.words.member(data, f"{each}ServerInput") for each in ("Register", "Unregister"))
        return maker(register, "name", "server"), maker(unregister, "name")

    def _leave(self) -> None:
        """Unregister everything, as far as the robot is still there."""
        named = [
            (f"unregistering {name} from the name system", partial(self._leave_names, name)) for name in self._named
        ]
        registered = [
            (f"unregistering {proxy} from the registry", partial(self._grid.unregister, proxy))
            for proxy in self._registered
        ]
        part([*named, *registered])

    def _leave_names(self, name: str) -> None:
        self._names.unregisterServer(self._unregister(name=name))
