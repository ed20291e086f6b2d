"""Commands on a terminal: a pseudo-terminal in place of stdout, stderr, or both."""

from __future__ import annotations

import os
import pty
import select
import subprocess
import time
from typing import Literal

from tests.cli.conftest import Program

_PATIENCE = 60.0


def on_terminal(program: Program, *arguments: object, stream: Literal["stdout", "stderr"]) -> tuple[int, str, str]:
    """Exit code, what came to the terminal, and what came to the other stream, which is a pipe."""
    terminal, inside = pty.openpty()
    other, outside = os.pipe()
    ends = {"stdout": inside, "stderr": outside} if stream == "stdout" else {"stdout": outside, "stderr": inside}
    process = program.start(*arguments, stdin=subprocess.DEVNULL, **ends)
    os.close(inside)
    os.close(outside)
    read = {terminal: b"", other: b""}
    open_ends = [*read]
    deadline = time.monotonic() + _PATIENCE
    while open_ends:
        ready, _, _ = select.select(open_ends, [], [], max(0.0, deadline - time.monotonic()))
        assert ready, f"no end after {_PATIENCE} s: {read}"
        for end in ready:
            try:
                chunk = os.read(end, 65536)
            except OSError:
                # How Linux says that nobody holds the terminal's other side any more.
                chunk = b""
            if not chunk:
                open_ends.remove(end)
                os.close(end)
            read[end] += chunk
    code = process.wait(timeout=_PATIENCE)
    return code, read[terminal].decode().replace("\r\n", "\n"), read[other].decode()
