"""A bench: the processes of one strand for one agent, or for all, fed to saturation in the order of time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, TypeVar

import msgspec

from elm.errors import ElmError, InvalidValue
from elm.event import StoredEvent
from elm.recognition.results import Result, depth_of, result_of
from elm.recognition.strands import Strand
from elm.recognizers.base import Emission, Fed, Judge, Process

T = TypeVar("T")
SELF_FEEDING = 20
"""How many layers of recognized events may lie beneath one, and follow from one event."""


@dataclass(slots=True, kw_only=True)
class Count:
    """What one recognizer's work amounted to; times in seconds."""

    fed: int = 0
    found: int = 0
    cut: int = 0
    """Results left out because they were recognized from too long a chain of results."""
    slowest: float = 0.0
    # Of this process alone:
    fed_here: int = 0
    seconds: float = 0.0


class Tally:
    """What a strand's work amounted to, for its status: by recognizer, in their order, and altogether."""

    def __init__(self, strand: Strand) -> None:
        self.counts = [Count() for _ in strand.recognizers]
        self.late = 0
        self.passed_over = 0
        self.forgotten = 0
        """Entries whose events had been forgotten before they were read."""
        self._longest = 0.0

    def took(self, number: int, seconds: float) -> None:
        """Note how long a call took."""
        count = self.counts[number]
        count.seconds += seconds
        if seconds > count.slowest:
            count.slowest = seconds
        if seconds > self._longest:
            self._longest = seconds

    def longest_call(self) -> float:
        """How long the longest call took since this was asked last."""
        longest, self._longest = self._longest, 0.0
        return longest

    def snapshot(self) -> Any:
        """What is told of the whole past, as plain JSON."""
        counts = [[each.fed, each.found, each.cut, each.slowest] for each in self.counts]
        return [counts, self.late, self.passed_over, self.forgotten]

    def resume(self, told: Any) -> None:
        """Count on from a snapshot."""
        # Checkpoints of memories that could not forget yet do not tell of it.
        counts, self.late, self.passed_over, *forgotten = told
        self.forgotten = sum(forgotten)
        self.counts = [Count(fed=fed, found=found, cut=cut, slowest=slow) for fed, found, cut, slow in counts]


class RecognizerFailure(Exception):
    """A recognizer raised, or emitted what cannot be a result."""

    def __init__(self, recognizer: str, error: BaseException) -> None:
        super().__init__(f"{recognizer}: {type(error).__name__}: {error}")
        self.recognizer = recognizer


class Bench:
    """The recognizers of a strand that look at one agent (or, with `across`, at all) and their processes."""

    def __init__(self, strand: Strand, *, across: bool, agent: str | None, judge: Judge, tally: Tally) -> None:
        self._strand = strand
        self._agent = agent
        self._judge = judge
        self._tally = tally
        self._interests = {
            at: each.interest for at, each in enumerate(strand.recognizers) if each.across_agents is across
        }
        self._processes: dict[int, Process] = {}
        self._deadlines: dict[int, int | None] = {}
        self._due: tuple[int, int] | None = None
        """The next deadline, and whose it is."""
        self._interested: dict[str, tuple[tuple[int, bool], ...]] = {}

    def interested(self, type_name: str) -> bool:
        """Whether events of a type may be of interest to any of the recognizers here."""
        return bool(self._interest_in(type_name))

    def _interest_in(self, type_name: str) -> tuple[tuple[int, bool], ...]:
        known = self._interested.get(type_name)
        if known is None:
            told = [(at, self._may_want(at, type_name)) for at in self._interests]
            known = self._interested[type_name] = tuple((at, sure is True) for at, sure in told if sure is not False)
        return known

    def _may_want(self, number: int, type_name: str) -> bool | None:
        try:
            return self._judge.of_type(self._interests[number], type_name)
        except ElmError:
            # What cannot be judged by its type is judged, and fails, with the event.
            return None

    def _wants(self, number: int, event: StoredEvent) -> bool:
        try:
            return self._judge.matches(self._interests[number], event)
        except ElmError as error:
            raise RecognizerFailure(self._strand.recognizers[number].name, error) from error

    # Feeding

    def feed(self, fed: Fed) -> list[Result]:
        """Time comes to an event, the event is fed, and what is found is fed again until nothing new is."""
        found = self.pass_time(fed.moment)
        if told := self._fed_to_all(fed, 0):
            found += self._saturate(told)
        return found

    def pass_time(self, moment: int) -> list[Result]:
        """What is certain because time has come to `moment`: deadlines strictly before it are over."""
        found: list[Result] = []
        while (due := self._due) is not None and due[0] < moment:
            deadline, number = due
            emitted = self._call(number, _expire, deadline)
            if self._due == due:
                error = InvalidValue("its deadline did not move when it was told that this was over")
                raise RecognizerFailure(self._strand.recognizers[number].name, error)
            if told := self._results(number, emitted, deadline, 0):
                found += self._saturate(told)
        return found

    def next_deadline(self) -> int | None:
        """The moment that something waits to be over."""
        return None if self._due is None else self._due[0]

    def _saturate(self, given: list[tuple[Result, int]]) -> list[Result]:
        """Results and all that is found when each is fed, in the order in which they are."""
        found: list[Result] = []
        queue = deque(given)
        while queue:
            result, depth = queue.popleft()
            found.append(result)
            queue += self._fed_to_all(result.fed, depth)
        return found

    def _fed_to_all(self, fed: Fed, depth: int) -> list[tuple[Result, int]]:
        """What the recognizers find when an event is fed to those that it is of interest to."""
        found: list[tuple[Result, int]] = []
        for number, sure in self._interest_in(fed.event.type):
            if not sure and not self._wants(number, fed.event):
                continue
            count = self._tally.counts[number]
            count.fed += 1
            count.fed_here += 1
            emitted = self._call(number, _feed, fed)
            # Mostly nothing was found; what is not even a sequence goes on, to be refused.
            if emitted or not isinstance(emitted, list | tuple):
                found += self._results(number, emitted, fed.moment, depth + 1)
        return found

    def _call(self, number: int, work: Callable[[Process, T], Sequence[Emission]], given: T) -> Sequence[Emission]:
        """Call a process, and see what it waits for now; whatever it raises is its failure."""
        start = perf_counter()
        try:
            process = self._processes.get(number)
            if process is None:
                process = self._processes[number] = self._strand.recognizers[number].start(self._judge)
            emitted = work(process, given)
            deadline = process.deadline()
            if deadline != self._deadlines.get(number):
                self._set_deadline(number, deadline)
        except (Exception, SystemExit) as error:
            raise RecognizerFailure(self._strand.recognizers[number].name, error) from error
        finally:
            self._tally.took(number, perf_counter() - start)
        return emitted

    def _set_deadline(self, number: int, deadline: int | None) -> None:
        self._deadlines[number] = deadline
        # Of recognizers that wait for the same moment, those that feed others first.
        self._due = min(
            ((until, at) for at, until in self._deadlines.items() if until is not None),
            default=None,
        )

    def _results(self, number: int, emitted: Sequence[Emission], moment: int, depth: int) -> list[tuple[Result, int]]:
        recognizer, count = self._strand.recognizers[number], self._tally.counts[number]
        definition = self._strand.fingerprints[number]
        found = []
        try:
            if not isinstance(emitted, Sequence) or isinstance(emitted, str):
                raise InvalidValue(f"a process returns a sequence of Emissions, not {emitted!r:.80}")
            for emission in emitted:
                if max(depth, depth_of(emission)) > SELF_FEEDING:
                    count.cut += 1
                    continue
                result = result_of(recognizer, definition, emission, moment=moment, agent=self._agent)
                found.append((result, depth))
        except Exception as error:
            raise RecognizerFailure(recognizer.name, error) from error
        count.found += len(found)
        return found

    # What is kept

    def counts(self) -> dict[str, dict[str, int]]:
        """What each recognizer's process counts."""
        return self._asked(lambda process: dict(process.counts()))

    def held(self) -> list[Fed]:
        """The events that processes refer to."""
        return [fed for held in self._asked(lambda process: process.held()).values() for fed in held]

    def snapshot(self) -> Any:
        """The processes' states as JSON, by recognizer."""
        return self._asked(lambda process: msgspec.Raw(msgspec.json.encode(process.snapshot())))

    def _asked(self, question: Callable[[Process], T]) -> dict[str, T]:
        found = {}
        for number, process in sorted(self._processes.items()):
            name = self._strand.recognizers[number].name
            try:
                found[name] = question(process)
            except Exception as error:
                raise RecognizerFailure(name, error) from error
        return found

    def resume(self, told: Any, held: Mapping[str, Fed]) -> None:
        """Have the processes of which a snapshot was taken."""
        numbers = {each.name: at for at, each in enumerate(self._strand.recognizers)}
        for name, state in told.items():
            number = numbers[name]
            try:
                process = self._strand.recognizers[number].resume(self._judge, state, held)
                self._processes[number] = process
                self._set_deadline(number, process.deadline())
            except Exception as error:
                raise RecognizerFailure(name, error) from error


def _feed(process: Process, fed: Fed) -> Sequence[Emission]:
    return process.feed(fed)


def _expire(process: Process, moment: int) -> Sequence[Emission]:
    return process.expire(moment)
