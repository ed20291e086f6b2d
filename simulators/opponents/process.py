"""The process of a side, as the runner sees it: it is asked line by line, and may die or fall silent."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from threading import Timer
from types import TracebackType
from typing import Any, Self

from simulators.opponents.catalogue import ROOT

SILENCE = 900.0
"""Seconds after which a side is given up that does not answer."""
_LAST_WORDS = 300
"""Letters of what it wrote to stderr."""


class SideFailedError(Exception):
    """A side ended, or was given up, before it answered; the message says why as far as it is known."""


class ModeLackingError(Exception):
    """A side cannot be run in this mode: no failure, but how its store is."""


class SideProcess:
    """A side at work in one mode, in a directory of its own."""

    def __init__(self, command: Sequence[str], directory: Path, *, silence: float = SILENCE) -> None:
        self.directory = directory
        self._silence = silence
        self._said = directory.with_suffix(".stderr")
        with self._said.open("wb") as stderr:
            self._process = subprocess.Popen(  # noqa: S603 - our own programs
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr, text=True, cwd=ROOT
            )
        try:
            if "lacks" in (greeting := self._answer()):
                raise ModeLackingError(greeting["lacks"])
        except BaseException:
            self.kill()
            raise

    def ask(self, **order: Any) -> dict[str, Any]:
        """Give an order; what the side answers."""
        assert self._process.stdin is not None  # noqa: S101 - a pipe
        try:
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise SideFailedError(self._why()) from None
        return self._answer()

    def end(self) -> None:
        """Have it close its store, and wait for that."""
        if self._process.poll() is None:
            self.ask(do="end")
            self._process.wait(self._silence)
        self.kill()

    def kill(self) -> None:
        """See to it that nothing of it is left."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except BrokenPipeError:
                    continue

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.kill()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None  # noqa: S101 - a pipe
        watch = Timer(self._silence, self._process.kill)
        watch.start()
        try:
            line = self._process.stdout.readline()
        finally:
            watch.cancel()
        if not line.endswith("\n"):
            raise SideFailedError(self._why())
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _why(self) -> str:
        code = self._process.wait()
        words = self._said.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        last = words[-1][:_LAST_WORDS] if words else "nothing"
        return f"it ended with exit code {code}, and last wrote: {last}"
