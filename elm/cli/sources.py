"""Files to read that are named on the command line, with - for stdin."""

from __future__ import annotations

import io
import os
import sys
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import BinaryIO

import typer

STDIN = "-"


def opened(name: str, *, hint: str) -> AbstractContextManager[BinaryIO]:
    """The file, or stdin, which is left open; a file that cannot be opened is wrong usage of `hint`."""
    if name == STDIN:
        return nullcontext(sys.stdin.buffer)
    try:
        return Path(name).open("rb")
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise typer.BadParameter(f"{name!r} cannot be read: {reason}", param_hint=hint) from error


def size_of(name: str) -> int | None:
    """How many bytes there are to read; None when nobody knows, as of a pipe."""
    path = Path(name)
    return path.stat().st_size if name != STDIN and path.is_file() else None


def reads(stream: BinaryIO, path: Path) -> bool:
    """Whether `stream` reads the file `path`, under whatever name."""
    try:
        return os.path.samestat(os.fstat(stream.fileno()), path.stat())
    except (FileNotFoundError, io.UnsupportedOperation):
        return False
