"""The door of a memory server: once it is closed nobody enters, and who is inside finishes first."""

from __future__ import annotations

from threading import Condition
from types import TracebackType

from armem_bridge.working.refusals import ServerClosed


class Door:
    """Whoever changes something does so within `with door:`, in any thread; `closed` says what is told later."""

    def __init__(self, closed: str) -> None:
        self._said = closed
        self._closed = False
        self._inside = 0
        self._left = Condition()

    def __enter__(self) -> None:
        """Enter. Raises `ServerClosed` where it is closed."""
        with self._left:
            if self._closed:
                raise ServerClosed(self._said)
            self._inside += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._left:
            self._inside -= 1
            if self._closed:
                self._left.notify_all()

    def close(self) -> None:
        """Let nobody in any more, and wait until all who are inside have left; again changes nothing."""
        with self._left:
            self._closed = True
            self._left.wait_for(lambda: not self._inside)
