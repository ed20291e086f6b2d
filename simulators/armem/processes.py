"""Processes of a measurement, which run a module of ours and are read from line by line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from select import select
from types import TracebackType
from typing import Final, Self

from elm.errors import StoreFailure

ROOT: Final = Path(__file__).resolve().parents[2]
_ENDING: Final = 20.0
"""Seconds in which a process ends once it is told to."""
_SILENCE: Final = 60.0
"""Seconds after which a process is given up that does not answer."""


class Process:
    """A module that runs until its stdin ends."""

    def __init__(self, module: str, *arguments: str) -> None:
        self._module = module
        self._process = subprocess.Popen(  # noqa: S603 - our own program
            [sys.executable, "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        assert self._process.stdout is not None  # noqa: S101 - a pipe
        self._out = self._process.stdout
        self._read = b""

    def line(self) -> str:
        """The next line that it writes."""
        while b"\n" not in self._read:
            ready, _, _ = select([self._out], [], [], _SILENCE)
            more = os.read(self._out.fileno(), 4096) if ready else b""
            if not more:
                how = "ended" if ready else f"was silent for {_SILENCE:g} s"
                raise StoreFailure(f"{self._module} {how} before it answered: see what it wrote to stderr")
            self._read += more
        line, _, self._read = self._read.partition(b"\n")
        return line.decode()

    def close(self) -> None:
        """Have it end."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()
        try:
            self._process.wait(_ENDING)
        finally:
            self._process.kill()
            self._process.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
