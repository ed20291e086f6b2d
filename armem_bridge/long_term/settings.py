"""How long-term memory consolidates: when, how durably, how much may wait, and how long one waits for what."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from armem_bridge.long_term.refusals import InvalidArchive


class When(StrEnum):
    """When snapshots are consolidated."""

    ON_COMMIT = "on_commit"
    """Write-through: every version that a commit brings."""

    ON_EVICTION = "on_eviction"
    """What leaves working memory, as far as online forgetting lets it (Algorithm 1)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Consolidation:
    """The settings of `LongTermMemory`; times are seconds."""

    when: When = When.ON_COMMIT
    at_stop: bool = True
    """Whether what is still in working memory when this is closed is consolidated then, as if it left."""

    durable: bool = False
    """Whether a commit is acknowledged only after consolidation; otherwise that happens soon after."""

    backlog: int = 10_000
    """At most so many snapshots wait to be consolidated."""

    backlog_bytes: int = 512 * 1024 * 1024
    """At most about so many bytes of data wait."""

    wait: float = 5.0
    """So long a commit waits for room in the backlog, or for the database when it is `durable`."""

    patience: float = 0.5
    """So long a snapshot waits for the poses of the robot that tell where it was, which may come later than it.

    Where nobody tells where the robot is, and where commits are `durable`, nothing waits for that.
    """

    batch: int = 1_000
    """At most so many snapshots are written in one transaction."""

    least_pause: float = 0.1
    most_pause: float = 10.0
    """After a failure of the database it is left alone for so long, twice as long each time up to the greatest."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "when", _when(self.when))
        if self.durable and self.when is not When.ON_COMMIT:
            raise InvalidArchive("commits are only durable with when='on_commit': what is evicted was committed before")
        if not isinstance(self.at_stop, bool):
            raise InvalidArchive(f"the setting at_stop of consolidation is true or false, not {self.at_stop!r:.80}")
        if not self.at_stop and self.when is not When.ON_EVICTION:
            raise InvalidArchive(
                "at_stop = false goes with when='on_eviction': what is consolidated at its commit is there before the "
                "stop. Leave it out"
            )
        for name in ("backlog", "backlog_bytes", "batch"):
            value = getattr(self, name)
            if type(value) is not int or value < 1:
                raise InvalidArchive(f"the setting {name} of consolidation is 1 or more, not {value!r:.80}")
        for name in ("wait", "patience", "least_pause", "most_pause"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not value >= 0:
                raise InvalidArchive(f"the setting {name} of consolidation is 0 s or more, not {value!r:.80}")


def _when(given: str) -> When:
    try:
        return When(given)
    except ValueError as error:
        raise InvalidArchive(f"snapshots are consolidated {' or '.join(When)}, not {given!r:.80}") from error
