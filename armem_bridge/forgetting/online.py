"""Online forgetting: what leaves working memory is either consolidated or forgotten (section 4.5.1, Algorithm 1)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.consolidated import Consolidated
from armem_bridge.forgetting.distances import mean_distance
from armem_bridge.forgetting.mechanisms import NAMES, Frequency, Online, Similarity, TimeDecay, combined
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.history import Source

VERSION = "version"
"""Verdicts by this name are about another version of the snapshot, that long-term memory has or does not want."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What one mechanism says of a snapshot: it keeps it if the `value` reaches the `threshold`.

    Values are activations, seconds or distances; infinite where there is nothing to compare with. In verdicts
    by `VERSION` they are the seconds that it was sent after the other version.
    """

    mechanism: str
    value: float
    threshold: float

    @property
    def keep(self) -> bool:
        """Whether this mechanism keeps it; one that is exactly at the threshold is kept."""
        return self.threshold <= self.value

    def __str__(self) -> str:
        sign = ">=" if self.keep else "<"
        return f"{self.mechanism}: {self.value:.4g} {sign} {self.threshold:.4g}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """Whether a snapshot is consolidated, and why.

    There is a verdict for each mechanism that was asked, the last one of a snapshot that is forgotten
    being the one that forgets it: nobody asks those behind it.
    """

    snapshot: MemoryID
    verdicts: tuple[Verdict, ...]

    @property
    def keep(self) -> bool:
        """Whether it is consolidated: every mechanism keeps it."""
        return all(verdict.keep for verdict in self.verdicts)

    @property
    def why(self) -> str:
        """The verdicts in words."""
        return "; ".join(map(str, self.verdicts)) or "no mechanism is used"


class OnlineForgetting:
    """Algorithm 1 for all entities of a memory; to be used by one thread at a time.

    A snapshot is consolidated only if every mechanism keeps it, and without mechanisms always. Which
    snapshot it is, and that working memory is overfilled, has been decided by then: history limits let the
    oldest reference time go. A snapshot is compared with what is consolidated next to its own reference time,
    so it does not matter much in which order they come.

    Deciding changes nothing: `consolidated` and `forgotten` say what became of it. With a source, which is
    long-term memory, what was consolidated before a restart or long ago is looked up there. Without,
    only the last `consolidated.REMEMBERED` ones of each entity are known.

    Of several versions of a snapshot one that was sent before a consolidated one, or not after a forgotten one,
    is forgotten too, and one that was sent after a consolidated one is kept: it takes its place.
    """

    def __init__(self, mechanisms: Iterable[Online] = ()) -> None:
        self.mechanisms = combined(mechanisms, allowed=(TimeDecay, Frequency, Similarity), where="online")
        self._compared = max((each.count for each in self.mechanisms if isinstance(each, Similarity)), default=0)
        self._entities: dict[MemoryID, Consolidated] = {}

    def decide(self, candidate: Candidate, now: int, source: Source | None = None) -> Decision:
        """Whether the candidate is consolidated; `now` is in microseconds, by the clock that its uses were noted by.

        `source` has what was consolidated already.
        """
        if not self.mechanisms:
            return Decision(snapshot=candidate.id, verdicts=())
        known = self._known(candidate.entity, source)
        version = _version(candidate, known, source)
        if version is not None:
            return Decision(snapshot=candidate.id, verdicts=(version,))
        verdicts: list[Verdict] = []
        for mechanism in self.mechanisms:
            verdicts.append(_verdict(mechanism, candidate, known, now, source))
            if not verdicts[-1].keep:
                break
        return Decision(snapshot=candidate.id, verdicts=tuple(verdicts))

    def consolidated(self, candidate: Candidate) -> None:
        """The candidate is in long-term memory from now on."""
        self._known(candidate.entity, None).add(candidate)

    def forgotten(self, candidate: Candidate) -> None:
        """The candidate was forgotten, and so are versions of it that were not sent after it."""
        self._known(candidate.entity, None).forget(candidate)

    def _known(self, entity: MemoryID, source: Source | None) -> Consolidated:
        known = self._entities.get(entity)
        if known is None:
            known = self._entities[entity] = Consolidated(entity, self._compared, source)
        return known


def _version(candidate: Candidate, known: Consolidated, source: Source | None) -> Verdict | None:
    """What another version of the snapshot says of it; None where it is judged by its own merits."""
    moment, sent = candidate.id.timestamp, candidate.snapshot.sent
    kept = known.sent_at(moment, source)
    if kept is not None:
        return Verdict(mechanism=VERSION, value=(sent - kept) / 1e6, threshold=0.0)
    gone = known.forgotten_at(moment)
    if gone is not None and sent <= gone:
        return Verdict(mechanism=VERSION, value=(sent - gone) / 1e6, threshold=1e-6)
    return None


def _verdict(mechanism: Online, candidate: Candidate, known: Consolidated, now: int, source: Source | None) -> Verdict:
    name = NAMES[type(mechanism)]
    match mechanism:
        case TimeDecay():
            return Verdict(mechanism=name, value=mechanism.activation(candidate.idle(now)), threshold=mechanism.minimum)
        case Frequency():
            nearest = known.nearest(candidate.snapshot.referenced, source)
            waited = math.inf if nearest is None else nearest / 1e6
            return Verdict(mechanism=name, value=waited, threshold=mechanism.wait)
        case Similarity():
            return Verdict(
                mechanism=name,
                value=mean_distance(
                    candidate.compared, known.before(candidate.id.timestamp, source), mechanism.measure
                ),
                threshold=mechanism.minimum,
            )
