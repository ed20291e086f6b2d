"""A bench: the processes of one strand for one agent, or for all, fed to saturation in the order of time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import Any

from elm.errors import InvalidValue
from elm.recognition.results import Result, result_of
from elm.recognition.strands import Strand
from elm.recognizers.base import Emission, Fed, Judge, Process

SELF_FEEDING = 20
"""How often results may be recognized from results that one event brought about."""


class Tally:
    """What a strand's work amounted to, by recognizer, for its status."""

    def __init__(self, strand: Strand) -> None:
        names = [each.name for each in strand.recognizers]
        self.fed = dict.fromkeys(names, 0)
        self.found = dict.fromkeys(names, 0)
        self.cut = dict.fromkeys(names, 0)
        """Results left out because they were recognized from too long a chain of results."""
        self.late = 0
        self.passed_over = 0
        self.slowest = dict.fromkeys(names, 0.0)
        # Of this process alone:
        self.longest = 0.0
        """The longest call since `longest_call` was asked last, in seconds."""
        self.fed_here = dict.fromkeys(names, 0)
        self.seconds = dict.fromkeys(names, 0.0)

    def longest_call(self) -> float:
        """How long the longest call took since this was asked last, in seconds."""
        longest, self.longest = self.longest, 0.0
        return longest

    def snapshot(self) -> Any:
        """What is told of the whole past, as plain JSON."""
        return [self.fed, self.found, self.cut, self.late, self.passed_over, self.slowest]

    def resume(self, told: Any) -> None:
        """Count on from a snapshot."""
        self.fed, self.found, self.cut, self.late, self.passed_over, self.slowest = told


class RecognizerFailure(Exception):
    """A recognizer raised, or emitted what cannot be a result."""

    def __init__(self, recognizer: str, error: Exception) -> None:
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
        self._interested: dict[str, tuple[tuple[int, bool], ...]] = {}

    def interested(self, type_name: str) -> bool:
        """Whether events of a type may be of interest to any of the recognizers here."""
        return bool(self._interest_in(type_name))

    def _interest_in(self, type_name: str) -> tuple[tuple[int, bool], ...]:
        known = self._interested.get(type_name)
        if known is None:
            told = [(at, self._judge.of_type(interest, type_name)) for at, interest in self._interests.items()]
            known = self._interested[type_name] = tuple((at, sure is True) for at, sure in told if sure is not False)
        return known

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
        while (due := self._next_due()) is not None and due[0] < moment:
            deadline, number = due
            emitted = self._call(number, lambda process, until=deadline: process.expire(until))  # type: ignore[misc]
            if told := self._results(number, emitted, deadline, 0):
                found += self._saturate(told)
        return found

    def _next_due(self) -> tuple[int, int] | None:
        due = None
        for number, process in self._processes.items():
            deadline = process.deadline()
            if deadline is not None and (due is None or (deadline, number) < due):
                due = (deadline, number)
        return due

    def next_deadline(self) -> int | None:
        """The moment that something waits to be over."""
        due = self._next_due()
        return None if due is None else due[0]

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
            if not sure and not self._judge.matches(self._interests[number], fed.event):
                continue
            recognizer = self._strand.recognizers[number]
            self._tally.fed[recognizer.name] += 1
            self._tally.fed_here[recognizer.name] += 1
            emitted = self._call(number, lambda process: process.feed(fed))
            found += self._results(number, emitted, fed.moment, depth + 1)
        return found

    def _call(self, number: int, work: Callable[[Process], Sequence[Emission]]) -> Sequence[Emission]:
        recognizer = self._strand.recognizers[number]
        start = perf_counter()
        try:
            process = self._processes.get(number)
            if process is None:
                process = self._processes[number] = recognizer.start(self._judge)
                self._processes = dict(sorted(self._processes.items()))
            return work(process)
        except Exception as error:
            raise RecognizerFailure(recognizer.name, error) from error
        finally:
            took = perf_counter() - start
            self._tally.seconds[recognizer.name] += took
            if took > self._tally.longest:
                self._tally.longest = took
                self._tally.slowest[recognizer.name] = max(took, self._tally.slowest[recognizer.name])

    def _results(self, number: int, emitted: Sequence[Emission], moment: int, depth: int) -> list[tuple[Result, int]]:
        # Nothing was found, the common case; what is not even a sequence goes on, to be refused.
        if type(emitted) in (list, tuple) and not emitted:
            return []
        recognizer = self._strand.recognizers[number]
        if depth > SELF_FEEDING:
            self._tally.cut[recognizer.name] += len(emitted)
            return []
        definition = self._strand.fingerprints[number]
        found = []
        try:
            if not isinstance(emitted, Sequence) or isinstance(emitted, str):
                raise InvalidValue(f"a process returns a sequence of Emissions, not {emitted!r:.80}")
            for emission in emitted:
                result = result_of(recognizer, definition, emission, moment=moment, agent=self._agent)
                found.append((result, depth))
        except Exception as error:
            raise RecognizerFailure(recognizer.name, error) from error
        self._tally.found[recognizer.name] += len(found)
        return found

    # What is kept

    def counts(self) -> dict[str, dict[str, int]]:
        """What each recognizer's process counts."""
        names = self._strand.recognizers
        return {names[number].name: dict(process.counts()) for number, process in self._processes.items()}

    def held(self) -> list[Fed]:
        """The events that processes refer to."""
        return [fed for process in self._processes.values() for fed in process.held()]

    def snapshot(self) -> Any:
        """The processes' states as plain JSON, by recognizer."""
        names = self._strand.recognizers
        return {names[number].name: process.snapshot() for number, process in self._processes.items()}

    def resume(self, told: Any, held: Mapping[str, Fed]) -> None:
        """Have the processes of which a snapshot was taken."""
        number = {each.name: at for at, each in enumerate(self._strand.recognizers)}
        for name, state in told.items():
            recognizer = self._strand.recognizers[number[name]]
            self._processes[number[name]] = recognizer.resume(self._judge, state, held)
        self._processes = dict(sorted(self._processes.items()))
