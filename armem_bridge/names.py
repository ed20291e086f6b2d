"""The memory name system: where the memories of a robot are, by their names (section 4.4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from threading import Lock
from typing import Generic, TypeVar

from armem_bridge.errors import ArmemError

S = TypeVar("S")


class UnknownMemory(ArmemError, LookupError):
    """No memory server is registered under this name. Start it, or correct the name."""


class MemoryNameSystem(Generic[S]):
    """Memory servers by the names of their memories; a server may be anything that stands for one.

    All methods may be called from any thread. Waiting costs no thread: `waiting_for` gives a future.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._servers: dict[str, S] = {}
        self._waiting: dict[str, list[Future[S]]] = {}

    def register(self, name: str, server: S) -> None:
        """From now on the memory of that name is at `server`; all who wait for it are told.

        A name that is registered already is moved: a server that broke down and was started again never
        had the time to unregister.
        """
        if not isinstance(name, str) or not name:
            raise UnknownMemory(f"a memory is registered under its name, which is text, not under {name!r:.80}")
        with self._lock:
            self._servers[name] = server
            waiting = self._waiting.pop(name, [])
        for future in waiting:
            # One that was cancelled meanwhile refuses to run.
            if future.set_running_or_notify_cancel():
                future.set_result(server)

    def unregister(self, name: str, server: S | None = None) -> bool:
        """Forget the server of a name; with `server`, only if it is still that one. Says whether it was there."""
        with self._lock:
            known = self._servers.get(name)
            if known is None or (server is not None and known is not server):
                return False
            del self._servers[name]
            return True

    def resolve(self, name: str) -> S:
        """The server of the memory of that name. Raises `UnknownMemory` if there is none."""
        with self._lock:
            found = self._servers.get(name)
            known = sorted(self._servers)
        if found is None:
            raise UnknownMemory(
                f"no memory server is registered as {name!r:.80} (there are: {', '.join(known) or 'none'}): "
                f"start it, or wait for it"
            )
        return found

    def registered(self) -> Mapping[str, S]:
        """All names and their servers, as they are now."""
        with self._lock:
            return dict(sorted(self._servers.items()))

    def wait(self, name: str, timeout: float | None = None) -> S:
        """The server of that name as soon as it is there.

        Raises `UnknownMemory` if it is not after `timeout` seconds; without a timeout this waits for ever.
        """
        future = self.waiting_for(name)
        try:
            return future.result(timeout)
        except FutureTimeout:
            # It may have come in the very last moment.
            if not future.cancel():
                return future.result()
            raise UnknownMemory(
                f"no memory server was registered as {name!r:.80} within {timeout} s: start it, or wait longer"
            ) from None

    def waiting_for(self, name: str) -> Future[S]:
        """A future of the server of that name: done at once if it is there. Cancel it to wait no more."""
        future: Future[S] = Future()
        with self._lock:
            found = self._servers.get(name)
            if found is None:
                self._waiting.setdefault(name, []).append(future)
        if found is None:
            future.add_done_callback(lambda done: self._forget(name, done))
        else:
            future.set_running_or_notify_cancel()
            future.set_result(found)
        return future

    def waiting(self) -> Mapping[str, int]:
        """How many wait for which names."""
        with self._lock:
            return {name: len(futures) for name, futures in sorted(self._waiting.items())}

    def _forget(self, name: str, future: Future[S]) -> None:
        """Drop a future that was cancelled."""
        with self._lock:
            futures = self._waiting.get(name)
            if futures is not None and future in futures:
                futures.remove(future)
                if not futures:
                    del self._waiting[name]
