"""The processes of these tests: servers, told what to do by lines, and clients, which call functions of the tests."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, Self, TypeVar

from armem_bridge.ice import MemoryClient, load_slices
from tests.armem.ice.serving import SLICES

ROOT = Path(__file__).resolve().parents[3]

P = ParamSpec("P")
T = TypeVar("T")

_client: MemoryClient


class ServerProcess:
    """A memory server, standalone or joined to `locator`."""

    def __init__(self, generation: str, name: str = "Object", locator: str = "alone") -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.armem.ice.serving", generation, name, locator],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        self.generation = generation
        self.locator: str = self._answer()

    def ask(self, order: str, *arguments: str) -> Any:
        """Have it do something; what it answers."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([order, *arguments]) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def close(self) -> None:
        """Have it end in an orderly way."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        try:
            assert self._process.wait(20) == 0
        finally:
            self._process.kill()
            self._process.wait()
            self._process.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _answer(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        assert line, "the server's process ended"
        return json.loads(line)


class ClientProcess:
    """A process with a client of its own, in which functions that take a client are called."""

    def __init__(self, generation: str, locator: str) -> None:
        self._pool = ProcessPoolExecutor(1, get_context("spawn"), _connect, (generation, locator))

    def call(self, function: Callable[Concatenate[MemoryClient, P], T], *args: P.args, **kwargs: P.kwargs) -> T:
        """What the function returns, or raises, over there."""
        return self.start(function, *args, **kwargs).result(60)

    def start(
        self, function: Callable[Concatenate[MemoryClient, P], T], *args: P.args, **kwargs: P.kwargs
    ) -> Future[T]:
        """Begin to call it."""
        return self._pool.submit(_call, function, args, kwargs)

    def kill(self) -> None:
        """Have the process end at once, whatever it does."""
        for process in list(self._pool._processes.values()):
            process.kill()
        self._pool.shutdown(wait=True, cancel_futures=True)

    def close(self) -> None:
        """Have it end in an orderly way."""
        self._pool.submit(_disconnect).result(60)
        self._pool.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _connect(generation: str, locator: str) -> None:
    global _client
    _client = MemoryClient(load_slices([SLICES / generation]), locator)


def _disconnect() -> None:
    _client.close()


def _call(function: Callable[..., T], args: tuple[Any, ...], kwargs: dict[str, Any]) -> T:
    return function(_client, *args, **kwargs)
