"""The counters of a memory server, and the warning about updates that took too long to arrive."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from threading import Lock
from typing import Final

from armem_bridge.working.snapshot import Snapshot

WARNING_INTERVAL: Final = 1_000_000
"""At most one warning about delays in so many microseconds: a network that is slow delays every commit."""

_logger = logging.getLogger(__name__)


class Counters:
    """Counts what a memory server does; any thread may."""

    def __init__(self, delay_threshold: int) -> None:
        self._threshold = delay_threshold
        self._lock = Lock()
        self._warned: int | None = None
        self.commits = self.updates = self.refused = self.evicted = self.queries = 0
        self.delayed = self.greatest_delay = self.archive_failures = 0

    def note_commit(self, *, made: Iterable[Snapshot], refused: int, evicted: int, arrived: int) -> None:
        """Count a commit, and warn of updates in it that were sent longer ago than the threshold."""
        late: Snapshot | None = None
        with self._lock:
            self.commits += 1
            self.refused += refused
            self.evicted += evicted
            for snapshot in made:
                self.updates += 1
                sent = snapshot.sent
                if sent >= 0 and arrived - sent > self._threshold:
                    self.delayed += 1
                    if arrived - sent > self.greatest_delay:
                        self.greatest_delay = arrived - sent
                    late = snapshot
            if late is None or (self._warned is not None and 0 <= arrived - self._warned < WARNING_INTERVAL):
                return
            self._warned = arrived
        _logger.warning(
            "%s was sent %.3f s before it arrived, over the threshold of %.3f s (%d updates so far): "
            "look at the network, the load and the clocks of both sides",
            late.id,
            (arrived - late.sent) / 1e6,
            self._threshold / 1e6,
            self.delayed,
        )

    def note_query(self) -> None:
        """Count a query."""
        with self._lock:
            self.queries += 1

    def note_cleared(self, evicted: int) -> None:
        """Count what left working memory without a commit."""
        with self._lock:
            self.evicted += evicted

    def note_archive_failure(self) -> None:
        """Count that the archive did not take what was handed to it."""
        with self._lock:
            self.archive_failures += 1
