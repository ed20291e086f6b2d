"""Online forgetting as the gate between working memory and long-term memory (Algorithm 1)."""

from __future__ import annotations

from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.online import OnlineForgetting
from armem_bridge.working.archive import Evicted
from armem_bridge.working.history import Source


class ForgettingGate:
    """A `long_term.Gate` that lets through what every mechanism keeps."""

    def __init__(self, forgetting: OnlineForgetting) -> None:
        self._forgetting = forgetting

    def lets_through(self, evicted: Evicted, now: int, known: Source) -> bool:
        """Whether it is consolidated; otherwise it is forgotten."""
        candidate = Candidate.evicted(evicted)
        keep = self._forgetting.decide(candidate, now, known).keep
        if keep:
            self._forgetting.consolidated(candidate)
        else:
            self._forgetting.forgotten(candidate)
        return keep
