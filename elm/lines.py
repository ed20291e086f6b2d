"""The lines of a file or a pipe as they come, and word of when whoever writes it makes us wait."""

from __future__ import annotations

import io
import select
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os import fstat
from time import monotonic
from typing import BinaryIO, TypeGuard

PATIENCE = 1.0
"""Seconds after which a line that came is not kept waiting for the next one."""
_CHUNK = 1 << 16
_GLANCE = 0.2
"""Seconds between two looks at whether to stop: a signal does not end the wait for a line by itself."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """In a stream: nothing more is there for now, and what came is to be dealt with."""


def lines_as_they_come(
    stream: BinaryIO, *, stopped: Callable[[], bool] = lambda: False, patience: float = PATIENCE
) -> Iterator[bytes | Waiting]:
    """The lines of `stream`, to its end or until `stopped` says so.

    `Waiting` comes among them when `patience` seconds have passed since the first line after the last one, and the
    next is not there yet: of pipes and terminals only, for a file never makes us wait. A line that has not ended
    when we are stopped is left out, for nobody knows what is missing.
    """
    lines = _waiting_lines(stream, stopped, patience) if _may_wait(stream) else stream
    for line in lines:
        if stopped():
            return
        yield line


def _may_wait(stream: BinaryIO) -> TypeGuard[io.BufferedReader]:
    # Others, a gzip.GzipFile for one, may hold data that the file descriptor does not tell of.
    if not isinstance(stream, io.BufferedReader) or not isinstance(stream.raw, io.FileIO):
        return False
    return not stat.S_ISREG(fstat(stream.fileno()).st_mode)


def _waiting_lines(
    stream: io.BufferedReader, stopped: Callable[[], bool], patience: float
) -> Iterator[bytes | Waiting]:
    ready = select.poll()
    ready.register(stream.fileno(), select.POLLIN)
    begun: list[bytes] = []
    deadline: float | None = None
    while not stopped():
        rest = _GLANCE if deadline is None else max(0.0, min(_GLANCE, deadline - monotonic()))
        if not ready.poll(rest * 1_000):
            if deadline is not None and monotonic() >= deadline:
                deadline = None
                yield Waiting()
            continue
        chunk = stream.read1(_CHUNK)
        if not chunk:
            if begun:
                yield b"".join(begun)
            return
        first, *others = chunk.split(b"\n")
        begun.append(first)
        for following in others:
            if deadline is None:
                deadline = monotonic() + patience
            yield b"".join(begun) + b"\n"
            begun = [following]
