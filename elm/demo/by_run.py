"""What the mower's own recognizers share: each run is kept by itself, until nothing has come of it for a while."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any, ClassVar, Self

from elm.cues.algebra import Cue
from elm.cues.codec import cue_to_json
from elm.recognizers import Emission, Fed, Judge, Process
from elm.taxonomy import EventType

PAUSE = timedelta(minutes=2)
"""A run is over when nothing has ended in it for so long: longer than any one motion or silence lasts."""
MOST_HELD = 10_000
"""Events that are held of one run; beyond that it is ended then and there, and counted as cut."""
_PAUSE_MICROS = PAUSE // timedelta(microseconds=1)


@dataclass(slots=True, kw_only=True)
class Run:
    """What a process knows of a run: when it is over, how many results it had, and the events it may need yet."""

    over_at: int
    found: int = 0
    held: defaultdict[str, list[Fed]] = field(default_factory=lambda: defaultdict(list))


class RunProcess(ABC):
    """A process that looks at the runs of one agent, each in its frame, and says what it finds in them."""

    NUMBERS: ClassVar[Mapping[str, float]] = {}
    """The numbers that its results depend on."""

    def __init__(self) -> None:
        self._runs: dict[str, Run] = {}
        self._split = 0

    @classmethod
    def resumed(cls, snapshot: Any, held: Mapping[str, Fed]) -> Self:
        """The process of which `snapshot` was taken."""
        process = cls()
        process._split = snapshot["split"]
        for frame, told in snapshot["runs"].items():
            run = process._runs[frame] = Run(over_at=told["over_at"], found=told["found"])
            for role, uids in told["held"].items():
                run.held[role] = [held[uid] for uid in uids]
        return process

    def feed(self, fed: Fed) -> Sequence[Emission]:
        """Take in a motion, a contact, or what was recognized of them."""
        region = fed.event.region
        if region is None:
            return ()
        run = self._runs.get(region.frame)
        over_at = fed.moment + _PAUSE_MICROS
        if run is None:
            run = self._runs[region.frame] = Run(over_at=over_at)
        elif not fed.event.is_complex:
            # Only what happens is a sign of life: episodes may be certain long after they ended.
            run.over_at = over_at
        found = [*self._take(run, fed)]
        if sum(map(len, run.held.values())) > MOST_HELD:
            found += self._end(region.frame)
            self._split += 1
        return found

    def deadline(self) -> int | None:
        """When the first run is over."""
        return min((run.over_at for run in self._runs.values()), default=None)

    def expire(self, moment: int) -> Sequence[Emission]:
        """What is certain because runs are over."""
        over = sorted((run.over_at, frame) for frame, run in self._runs.items() if run.over_at <= moment)
        return [emission for _, frame in over for emission in self._end(frame)]

    def snapshot(self) -> Any:
        """The state as plain JSON."""
        runs = {
            frame: {
                "over_at": run.over_at,
                "found": run.found,
                "held": {role: [str(fed.event.uid) for fed in held] for role, held in run.held.items()},
            }
            for frame, run in self._runs.items()
        }
        return {"runs": runs, "split": self._split}

    def held(self) -> Sequence[Fed]:
        """The events of all runs."""
        return [fed for run in self._runs.values() for held in run.held.values() for fed in held]

    def counts(self) -> Mapping[str, int]:
        """Runs under way, and how often one was ended for its bound."""
        return {"partial": len(self._runs), "split": self._split}

    def _end(self, frame: str) -> Sequence[Emission]:
        return self._over(self._runs.pop(frame))

    @abstractmethod
    def _take(self, run: Run, fed: Fed) -> Iterable[Emission]:
        """What an event of a run completes."""

    @abstractmethod
    def _over(self, run: Run) -> Sequence[Emission]:
        """What the end of a run completes."""


ProcessClass = type[RunProcess]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRecognizer:
    """The definition of episodes of runs: their type, what they are found in, and the process that finds them."""

    name: str
    type: str
    interest: Cue
    process: ProcessClass
    version: int = 1

    @property
    def across_agents(self) -> bool:
        """A run is one agent's."""
        return False

    @property
    def outputs(self) -> tuple[EventType, ...]:
        """The type of its results."""
        return (EventType(name=self.type, parents=("Episode",)),)

    @property
    def definition(self) -> Any:
        """All that its results depend on, as plain JSON."""
        return {
            "type": self.type,
            "interest": cue_to_json(self.interest),
            "process": self.process.__name__,
            "numbers": {"pause": PAUSE.total_seconds(), "most_held": MOST_HELD, **self.process.NUMBERS},
        }

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return self.process()

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return self.process.resumed(snapshot, held)
