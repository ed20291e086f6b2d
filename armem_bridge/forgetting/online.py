"""Online forgetting: what leaves working memory is either consolidated or forgotten (section 4.5.1, Algorithm 1)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.distances import Compared, mean_distance
from armem_bridge.forgetting.mechanisms import NAMES, Frequency, Online, Similarity, TimeDecay, combined
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET, is_set


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What one mechanism says of a snapshot: it keeps it if the `value` reaches the `threshold`.

    Values are activations, seconds or distances; infinite where there is nothing to compare with.
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


@dataclass(slots=True)
class _Consolidated:
    """What is remembered of an entity: the reference time of what was consolidated last, and the last n of it."""

    referenced: int = NOT_SET
    last: deque[Compared] = field(default_factory=deque)


class OnlineForgetting:
    """Algorithm 1 for all entities of a memory; to be used by one thread at a time.

    A snapshot is consolidated only if every mechanism keeps it, and without mechanisms always. Which
    snapshot it is, and that working memory is overfilled, has been decided by then: history limits let the
    oldest reference time go. Deciding changes nothing, so what could not be consolidated can be asked about
    again; `consolidated` says what was. After a restart that is said of the last n snapshots in long-term
    memory, oldest first: otherwise the first snapshot of each entity counts as new once more.
    """

    def __init__(self, mechanisms: Iterable[Online] = ()) -> None:
        self.mechanisms = combined(mechanisms, allowed=(TimeDecay, Frequency, Similarity), where="online")
        self._compared = max((each.count for each in self.mechanisms if isinstance(each, Similarity)), default=0)
        self._entities: dict[MemoryID, _Consolidated] = {}

    @property
    def remembers(self) -> int:
        """How many of an entity's last consolidated snapshots its decisions look at."""
        return max(self._compared, 1 if any(isinstance(each, Frequency) for each in self.mechanisms) else 0)

    def decide(self, candidate: Candidate, now: int) -> Decision:
        """Whether the candidate is consolidated; `now` is in microseconds, by the clock that its uses were noted by."""
        known = self._entities.get(candidate.entity, _Consolidated())
        verdicts: list[Verdict] = []
        for mechanism in self.mechanisms:
            verdicts.append(_verdict(mechanism, candidate, known, now))
            if not verdicts[-1].keep:
                break
        return Decision(snapshot=candidate.id, verdicts=tuple(verdicts))

    def consolidated(self, candidate: Candidate) -> None:
        """The candidate is in long-term memory from now on."""
        known = self._entities.get(candidate.entity)
        if known is None:
            known = self._entities[candidate.entity] = _Consolidated(last=deque(maxlen=self._compared))
        known.referenced = candidate.snapshot.referenced
        if self._compared:
            known.last.append(candidate.compared)


def _verdict(mechanism: Online, candidate: Candidate, known: _Consolidated, now: int) -> Verdict:
    name = NAMES[type(mechanism)]
    match mechanism:
        case TimeDecay():
            return Verdict(mechanism=name, value=mechanism.activation(candidate.idle(now)), threshold=mechanism.minimum)
        case Frequency():
            waited = math.inf
            if is_set(known.referenced):
                waited = abs(candidate.snapshot.referenced - known.referenced) / 1e6
            return Verdict(mechanism=name, value=waited, threshold=mechanism.wait)
        case Similarity():
            return Verdict(
                mechanism=name,
                value=mean_distance(candidate.compared, known.last, mechanism.measure),
                threshold=mechanism.minimum,
            )
