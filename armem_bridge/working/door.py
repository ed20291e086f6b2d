"""The door of a memory server: who changes it goes in beside others or alone, and once it is closed nobody does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Condition
from types import TracebackType

from armem_bridge.working.refusals import ServerClosed


class Door:
    """Whoever changes something does so within `with door:` beside others, or within `with door.alone():`.

    Both in any thread, and neither within the other: who is inside waits for nobody who wants to be inside.
    `closed` says what is told to those who come later.
    """

    def __init__(self, closed: str) -> None:
        self._said = closed
        self._closed = False
        self._inside = 0
        self._alone = False
        """Whether somebody is inside alone, or waits for those inside to leave."""

        self._changed = Condition()

    def __enter__(self) -> None:
        """Enter beside others. Raises `ServerClosed` where it is closed."""
        with self._changed:
            # Every commit passes here: a call less, as long as there is nothing to wait for.
            if self._alone or self._closed:
                self._wait_for_turn()
            self._inside += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._inside -= 1
            if self._alone or self._closed:
                self._changed.notify_all()

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Be inside alone: nobody enters any more, and who is inside leaves first. Raises `ServerClosed`."""
        with self._changed:
            self._wait_for_turn()
            self._alone = True
        try:
            with self._changed:
                self._changed.wait_for(lambda: not self._inside)
            yield
        finally:
            with self._changed:
                self._alone = False
                self._changed.notify_all()

    def close(self) -> None:
        """Let nobody in any more, and wait until all who are inside have left; again changes nothing."""
        with self._changed:
            self._closed = True
            self._changed.wait_for(lambda: not self._inside and not self._alone)

    def _wait_for_turn(self) -> None:
        while self._alone:
            self._changed.wait()
        if self._closed:
            raise ServerClosed(self._said)
