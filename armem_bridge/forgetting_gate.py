"""Online forgetting as the gate between working memory and long-term memory (Algorithm 1)."""

from __future__ import annotations

from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.online import OnlineForgetting
from armem_bridge.working.archive import Evicted


class ForgettingGate:
    """A `long_term.Gate` that lets through what every mechanism keeps."""

    def __init__(self, forgetting: OnlineForgetting) -> None:
        self._forgetting = forgetting

    @property
    def remembers(self) -> int:
        """How many of an entity's last snapshots in long-term memory it must be told of after a restart."""
        return self._forgetting.remembers

    def keeps(self, evicted: Evicted, now: int) -> bool:
        """Whether it is consolidated; otherwise it is forgotten. Asking changes nothing."""
        return self._forgetting.decide(Candidate.evicted(evicted), now).keep

    def kept(self, evicted: Evicted, now: int) -> None:
        """It is consolidated since `now`."""
        self._forgetting.consolidated(Candidate.evicted(evicted))
