"""Standalone: memories for ArmarX clients on a machine without a robot, IceGrid and IceStorm."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from threading import Lock
from typing import Any

from armem_bridge.ice.edge import Edge, topic_of
from armem_bridge.ice.registry import Registry
from armem_bridge.ice.topics import Topics
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.names import MemoryNameSystem
from armem_bridge.working.server import MemoryServer

_logger = logging.getLogger(__name__)


class Standalone(Edge):
    """Memory servers, their name system, and what clients expect around them, in one process.

    An unmodified client needs `Ice.Default.Locator` set to what `locator` says. It listens on the loopback
    interface, for whoever reaches it may do everything. `port` 0 takes one that is free.
    """

    def __init__(
        self,
        words: Vocabulary,
        servers: Iterable[MemoryServer] = (),
        *,
        host: str = "127.0.0.1",
        port: int,
        properties: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(words, endpoint=f"tcp -h {host} -p {port}", properties=properties)
        try:
            self.names: MemoryNameSystem[Any] = MemoryNameSystem()
            self._servers: dict[str, MemoryServer] = {}
            self._audience = Lock()
            self._registry = Registry(self.adapter)
            self._topics = Topics(self.adapter, self._on_audience)
            self._registry.put(self._topics.proxy, "::IceStorm::TopicManager")
            interface = words.member(words.mns, "MemoryNameSystemInterface")
            self._registry.put(self._serve_names(self.names), interface.ice_staticId())
            for server in servers:
                self.add(server)
            self.adapter.activate()
        except BaseException:
            self.close()
            raise
        _logger.info("%d memories at %s", len(self._servers), self.locator)

    @property
    def locator(self) -> str:
        """What clients set `Ice.Default.Locator` to."""
        return str(self._registry.locator)

    def add(self, server: MemoryServer) -> None:
        """Make one more memory known; clients that wait for it are told."""
        proxy = self._add_servant(server)
        self._servers[topic_of(server.name)] = server
        self._registry.put(proxy, self.words.member(self.words.server, "MemoryInterface").ice_staticId())
        self._topics.topic(topic_of(server.name))
        self.names.register(server.name, self._interfaces_of(proxy))

    def _on_audience(self, name: str) -> None:
        """Subscribe to a memory only while somebody listens to its topic: commits are cheaper otherwise."""
        server = self._servers.get(name)
        if server is None:
            return
        with self._audience:
            topic = self._topics.topic(name)
            if topic.has_audience:
                self._publish(server, topic.publisher)
            else:
                self._publish_no_more(server.name)
