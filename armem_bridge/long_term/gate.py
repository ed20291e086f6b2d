"""The port of online forgetting: what decides whether a snapshot that leaves working memory is consolidated."""

from __future__ import annotations

from typing import Protocol

from armem_bridge.working.archive import Evicted
from armem_bridge.working.history import Source


class Gate(Protocol):
    """Decides for one snapshot after the other, in one thread.

    It is asked about versions that count when they leave working memory. One that another superseded there is
    forgotten without being asked about: in long-term memory it would stand for the other, should that be forgotten.
    """

    def lets_through(self, evicted: Evicted, now: int, known: Source) -> bool:
        """Whether it is consolidated, which is taken to be done then; otherwise it is forgotten.

        `now` is when it left, in microseconds by the archive's clock. `known` has what was let through so far, also
        before a restart. Where that cannot be read its error passes through, and this is called again.
        """
