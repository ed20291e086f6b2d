"""How consolidation gets on with the database: whether it fails just now, since when, and what was said last."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from threading import Lock

from elm.errors import ElmError

_logger = logging.getLogger(__name__)


class Health:
    """Notes failures and successes; a warning tells when failing begins and when it ends. Any thread may use it."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._lock = Lock()
        self._failures = 0
        self._failing_since: float | None = None
        self._last_error = ""

    def failed(self, error: Exception) -> None:
        """The database did not do what was asked of it; it is asked again."""
        with self._lock:
            self._note(error)
            is_first = self._failing_since is None
            if is_first:
                self._failing_since = time.monotonic()
        if is_first:
            unexpected = None if isinstance(error, ElmError) else error
            _logger.warning(
                "consolidation into %r fails, and is tried again: %s", self._name, error, exc_info=unexpected
            )

    def stumbled(self, error: Exception) -> None:
        """Something else went wrong, and nothing waits on that account."""
        with self._lock:
            self._note(error)

    def worked(self) -> None:
        """The database did what was asked of it."""
        with self._lock:
            was_failing, self._failing_since = self._failing_since is not None, None
        if was_failing:
            _logger.warning("consolidation into %r works again", self._name)

    def why_slow(self) -> str:
        """Why things wait, in words."""
        return self._last_error if self._failing_since is not None else "the database is only slower than what comes"

    def status(self) -> Mapping[str, object]:
        """How often it failed, for how many seconds it does so now, and what was said last."""
        with self._lock:
            since = self._failing_since
            return {
                "failures": self._failures,
                "failing_seconds": 0.0 if since is None else time.monotonic() - since,
                "last_error": self._last_error,
            }

    def _note(self, error: Exception) -> None:
        self._failures += 1
        self._last_error = f"{type(error).__name__}: {error}"
