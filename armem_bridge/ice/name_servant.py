"""The servant of the memory name system: where remote clients find memories, and wait for them (section 1.7)."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from threading import Lock
from typing import Any

from armem_bridge.errors import ArmemError
from armem_bridge.ice.communicators import servant_of
from armem_bridge.ice.installation import load_ice
from armem_bridge.ice.making import maker
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.names import MemoryNameSystem

_logger = logging.getLogger(__name__)


class NameServant:
    """Answers for the name system of a robot; memories are known by the proxies that their servers gave.

    A client that waits costs no thread: its answer is sent when the memory is there, and forgotten when the
    client goes away.
    """

    def __init__(self, names: MemoryNameSystem[Any], words: Vocabulary) -> None:
        self._names = names
        self._ice = load_ice()
        interface = words.member(words.mns, "MemoryNameSystemInterface")
        self._waited = maker(words.waited_server, "success", "errorMessage", "server")
        self._all = maker(words.all_servers, "success", "errorMessage", "servers")
        operations: dict[str, Callable[..., Any]] = {
            "waitForServer": self.wait_for_server,
            "getAllRegisteredServers": self.all_registered_servers,
        }
        # These are named in no released client: they are answered where the slice files have them.
        for operation, result, answer in (
            ("registerServer", "RegisterServerResult", self.register_server),
            ("unregisterServer", "UnregisterServerResult", self.unregister_server),
            ("resolveServer", "ResolveServerResult", self.resolve_server),
        ):
            cls = getattr(words.mns_data, result, None)
            if hasattr(interface, operation) and cls is not None:
                operations[operation] = partial(answer, maker(cls, "success", "errorMessage"))
        self.servant = servant_of(interface, **operations)
        self._lock = Lock()
        self._by_connection: dict[Any, set[Future[Any]]] = {}

    def all_registered_servers(self, current: Any) -> Any:
        """MemoryNameSystemInterface.getAllRegisteredServers."""
        return self._all(success=True, errorMessage="", servers=dict(self._names.registered()))

    def wait_for_server(self, wire: Any, current: Any) -> Any:
        """MemoryNameSystemInterface.waitForServer: a future of the answer."""
        answer = self._ice.Future()
        waiting = self._names.waiting_for(wire.name)
        if not waiting.done() and current.con is not None:
            self._watch(current.con, waiting)
        waiting.add_done_callback(partial(self._answer, answer))
        return answer

    def resolve_server(self, make: Callable[..., Any], wire: Any, current: Any) -> Any:
        """MemoryNameSystemInterface.resolveServer."""
        try:
            return make(success=True, errorMessage="", server=self._names.resolve(wire.name))
        except ArmemError as error:
            return make(success=False, errorMessage=str(error))

    def register_server(self, make: Callable[..., Any], wire: Any, current: Any) -> Any:
        """MemoryNameSystemInterface.registerServer."""
        if not getattr(wire, "existOk", True) and wire.name in self._names.registered():
            why = f"a memory server is registered as {wire.name!r:.80} already: unregister it, or allow that it exists"
            return make(success=False, errorMessage=why)
        try:
            self._names.register(wire.name, wire.server)
        except ArmemError as error:
            return make(success=False, errorMessage=str(error))
        _logger.info("the memory %s was registered by %s", wire.name, current.con)
        return make(success=True, errorMessage="")

    def unregister_server(self, make: Callable[..., Any], wire: Any, current: Any) -> Any:
        """MemoryNameSystemInterface.unregisterServer."""
        if self._names.unregister(wire.name):
            return make(success=True, errorMessage="")
        return make(success=False, errorMessage=f"no memory server is registered as {wire.name!r:.80}")

    def waiting(self) -> int:
        """How many clients wait."""
        return sum(self._names.waiting().values())

    def close(self) -> None:
        """Tell all clients that wait that nothing comes any more."""
        for connection in list(self._by_connection):
            self._forget(connection)

    def _answer(self, answer: Any, waiting: Future[Any]) -> None:
        if waiting.cancelled():
            answer.set_result(
                self._waited(success=False, errorMessage="the memory name system ends, or lost its client")
            )
        else:
            answer.set_result(self._waited(success=True, errorMessage="", server=waiting.result()))

    def _watch(self, connection: Any, waiting: Future[Any]) -> None:
        """Cancel the waiting when the connection of its client is lost."""
        with self._lock:
            known = self._by_connection.get(connection)
            if known is None:
                known = self._by_connection[connection] = set()
                # Ice takes plain functions only.
                connection.setCloseCallback(lambda lost: self._forget(lost))
            known.add(waiting)
        waiting.add_done_callback(partial(self._unwatch, connection))

    def _unwatch(self, connection: Any, waiting: Future[Any]) -> None:
        with self._lock:
            self._by_connection.get(connection, set()).discard(waiting)

    def _forget(self, connection: Any) -> None:
        with self._lock:
            lost = self._by_connection.pop(connection, set())
        for waiting in lost:
            waiting.cancel()
