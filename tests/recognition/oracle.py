"""What a pattern finds by docs/recognition.md, worked out by enumeration: the oracle that judges the engine.

Every list of (step, event) is tried, and those are kept whose every event taken and every event passed over is as the
document says. Nothing is remembered from one event to the next, so it is slow and plainly right; it shares no code
with the engine. Where the document leaves room, it is read so:

- events are fed one after another, those of one moment too: what an earlier one makes certain is certain before what
  a later one does, and only among matches that one event (or one passing of time) makes certain their positions decide;
- an event longer than `within` cannot be taken by the first step either;
- a time-out at a moment is barred by all results up to that moment, those that the same passing of time makes certain
  among them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from itertools import product
from uuid import UUID

from elm.event import StoredEvent
from elm.features import FeatureValue, kind_of
from elm.recognizers.base import Fed, Judge
from elm.recognizers.elements import Absent, Contiguity, Element, Step, Without
from elm.recognizers.patterns import AfterMatch, Pattern

Key = tuple[tuple[str, FeatureValue], ...]
"""Which partition: the kind and the value of each feature that makes it."""

Run = tuple[tuple[int, int], ...]
"""A list of (step, event), both as positions: of the step among the steps, of the event in the partition."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A result: when it was certain, and which step took which event."""

    moment: int
    output: str
    key: Key
    taken: tuple[tuple[str, UUID], ...]
    deadline: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """What ended a run that took nothing more: the event at a position, or time, before that event came."""

    moment: int
    position: int
    by_time: bool


def results(pattern: Pattern, fed: Sequence[Fed], until: int | None, judge: Judge) -> list[Found]:
    """All that a process of `pattern` finds when it is fed so and time then passes till `until`."""

    def over(moment: int) -> bool:
        return (until is not None and moment <= until) or any(each.moment > moment for each in fed)

    found: list[Found] = []
    for key, sequence in _partitions(pattern, fed, judge).items():
        found += Partition(pattern, key, sequence, over, judge).results()
    return found


def key_of(values: Sequence[FeatureValue]) -> Key:
    """A partition's values, those told apart that Python holds for the same."""
    return tuple((kind_of(value), value) for value in values)


def _partitions(pattern: Pattern, fed: Sequence[Fed], judge: Judge) -> dict[Key, list[Fed]]:
    partitions: dict[Key, list[Fed]] = {}
    for each in fed:
        if pattern.among is None or judge.matches(pattern.among, each.event):
            values = [each.event.values(name) for name in pattern.partition]
            for key in dict.fromkeys(key_of(chosen) for chosen in product(*values)):
                partitions.setdefault(key, []).append(each)
    return partitions


def _micros(duration: timedelta) -> int:
    return duration // timedelta(microseconds=1)


class Partition:
    """The events of one partition and all runs in them."""

    def __init__(
        self, pattern: Pattern, key: Key, sequence: Sequence[Fed], over: Callable[[int], bool], judge: Judge
    ) -> None:
        self.pattern, self.key, self.sequence, self.over, self.judge = pattern, key, sequence, over, judge
        self.steps = pattern.steps
        last = pattern.elements[-1]
        self.absent = last if isinstance(last, Absent) else None
        self.within = _micros(pattern.within)

    def results(self) -> list[Found]:
        """The matches that count, in the order in which they become certain, and the time-outs that do."""
        matches: list[tuple[tuple[object, ...], Run, Found]] = []
        late: list[tuple[Run, Found]] = []
        for run in self.runs():
            certain = self.certain(run)
            if certain is not None:
                event = -1 if certain.by_time else certain.position
                order = (certain.moment, certain.by_time, event, [p for _, p in run], [s for s, _ in run])
                waited = certain.moment if self.absent is not None else None
                matches.append((order, run, self._found(run, certain.moment, "match", waited)))
            elif self.pattern.timed_out is not None and (moment := self.timed_out(run)) is not None:
                late.append((run, self._found(run, moment, "timed out", moment)))
        counted: list[tuple[Run, Found]] = []
        for _, run, match in sorted(matches, key=lambda each: each[0]):
            if not self._barred(run, [earlier for earlier, _ in counted]):
                counted.append((run, match))
        timed_out = [
            found
            for run, found in late
            if not self._barred(run, [earlier for earlier, match in counted if match.moment <= found.moment])
        ]
        return [match for _, match in counted] + timed_out

    def _barred(self, run: Run, earlier: Sequence[Run]) -> bool:
        begin = run[0][1]
        match self.pattern.after_match:
            case AfterMatch.PAST_LAST:
                return any(begin <= result[-1][1] for result in earlier)
            case AfterMatch.NEXT_START:
                return any(begin == result[0][1] for result in earlier)
            case AfterMatch.ALL:
                return False

    def _found(self, run: Run, moment: int, output: str, deadline: int | None) -> Found:
        taken = tuple((self.steps[s].name, self.sequence[p].event.uid) for s, p in run)
        return Found(moment=moment, output=output, key=self.key, taken=taken, deadline=deadline)

    # Which lists are runs

    def runs(self) -> Iterator[Run]:
        """Every run, at every length that it has on its way."""
        everywhere = range(len(self.sequence))
        waiting: list[Run] = [((0, p),) for p in everywhere if self.fits(self.steps[0], (), p) and self.in_time((), p)]
        while waiting:
            run = waiting.pop()
            yield run
            waiting += [
                (*run, (s, p)) for p in everywhere for s in range(len(self.steps)) if self.takes_next(run, s, p)
            ]

    def takes_next(self, run: Run, step: int, position: int) -> bool:
        """Whether the run passes over all that lies before this event, and takes it as this step."""
        between = range(run[-1][1] + 1, position)
        return (
            position > run[-1][1]
            and all(self.lives(run, p) and self.may_pass_over(run, p) for p in between)
            and self.lives(run, position)
            and step in self.may_take(run, position)
        )

    def targets(self, run: Run) -> list[int]:
        """The steps that might take the next event."""
        step = run[-1][0]
        count = self.count(run)
        found = [step] if count < self.steps[step].most else []
        if count >= self.steps[step].least:
            for later in range(step + 1, len(self.steps)):
                found.append(later)
                if self.steps[later].least > 0:
                    break
        return found

    def count(self, run: Run) -> int:
        """How many events the step that took the last one has taken."""
        return sum(s == run[-1][0] for s, _ in run)

    def accepting(self, run: Run) -> bool:
        """Whether nothing more needs to be taken."""
        step = run[-1][0]
        return self.count(run) >= self.steps[step].least and all(each.least == 0 for each in self.steps[step + 1 :])

    def may_take(self, run: Run, position: int) -> list[int]:
        """The steps as which the run takes this event: the first possible one, or if that skips till any, all."""
        possible = [s for s in self.targets(run) if self.possible(run, s, position)]
        return possible if self.divides(possible) else possible[:1]

    def may_pass_over(self, run: Run, position: int) -> bool:
        """Whether the run, or one of those into which it divides, does not take this event."""
        possible = [s for s in self.targets(run) if self.possible(run, s, position)]
        return not possible or self.divides(possible)

    def divides(self, possible: Sequence[int]) -> bool:
        """Whether the first of these steps skips till any event."""
        return bool(possible) and self.steps[possible[0]].contiguity is Contiguity.SKIP_TILL_ANY

    def possible(self, run: Run, step: int, position: int) -> bool:
        """Whether an event may be taken as a target at all."""
        gap = self.steps[step].longest_gap
        return (
            self.fits(self.steps[step], run, position)
            and self.in_time(run, position)
            and (gap is None or self.sequence[position].moment - self.moment(run) <= _micros(gap))
            and not self.closed(run, step, position)
        )

    def fits(self, element: Element, run: Run, position: int) -> bool:
        """Whether an event matches an element's cue and conditions."""
        event = self.sequence[position].event
        return self.judge.matches(element.cue, event) and all(
            condition.holds(event, self.taken_by(condition.step, run)) for condition in element.conditions
        )

    def taken_by(self, name: str, run: Run) -> list[StoredEvent]:
        """What the step of that name took."""
        return [self.sequence[p].event for s, p in run if self.steps[s].name == name]

    def in_time(self, run: Run, position: int) -> bool:
        """Whether the run would keep `within` if it took this event."""
        begins = [self.sequence[p].begin for p in (*(p for _, p in run), position)]
        return self.sequence[position].moment - min(begins) <= self.within

    def moment(self, run: Run) -> int:
        """The moment of the last event taken."""
        return self.sequence[run[-1][1]].moment

    # Which ways on are open, when only the events before a position have come

    def closed(self, run: Run, step: int, position: int) -> bool:
        """Whether an event passed over has closed the way on to a target."""
        passed_over = position > run[-1][1] + 1
        return (self.steps[step].contiguity is Contiguity.STRICT and passed_over) or any(
            self.met(without, run, position) for without in self.between(run[-1][0], step)
        )

    def between(self, step: int, target: int) -> list[Without]:
        """The negations that lie between two steps."""
        at = [place for place, each in enumerate(self.pattern.elements) if isinstance(each, Step)]
        return [each for each in self.pattern.elements[at[step] : at[target]] if isinstance(each, Without)]

    def met(self, element: Element, run: Run, position: int) -> bool:
        """Whether an event passed over matches."""
        return any(self.fits(element, run, p) for p in range(run[-1][1] + 1, position))

    def awaits_absence(self, run: Run, position: int) -> bool:
        """Whether only time is needed for a match, and nothing has come that must not."""
        return self.absent is not None and self.accepting(run) and not self.met(self.absent, run, position)

    def ways_on(self, run: Run, position: int) -> bool:
        """Whether any is open."""
        return self.awaits_absence(run, position) or any(
            not self.closed(run, target, position) for target in self.targets(run)
        )

    # When runs end, and what they are then

    def deadline(self, run: Run, position: int) -> int:
        """The moment beyond which time ends the run."""
        if self.awaits_absence(run, position):
            assert self.absent is not None
            return self.moment(run) + _micros(self.absent.duration)
        deadline = min(self.sequence[p].begin for _, p in run) + self.within
        gaps = [self.steps[target].longest_gap for target in self.targets(run)]
        known = [gap for gap in gaps if gap is not None]
        if known and len(known) == len(gaps):
            deadline = min(deadline, self.moment(run) + _micros(max(known)))
        return deadline

    def lives(self, run: Run, position: int) -> bool:
        """Whether the run has not ended when this event comes."""
        return self.ways_on(run, position) and self.sequence[position].moment <= self.deadline(run, position)

    def end(self, run: Run) -> End | None:
        """What ends the run if it takes nothing more; None if it must take more, or nothing has ended it yet."""
        for position in range(run[-1][1] + 1, len(self.sequence)):
            moment = self.sequence[position].moment
            deadline = self.deadline(run, position)
            if moment > deadline:
                return End(moment=deadline, position=position, by_time=True)
            if not self.may_pass_over(run, position):
                return None
            if not self.ways_on(run, position + 1):
                return End(moment=moment, position=position, by_time=False)
        deadline = self.deadline(run, len(self.sequence))
        return End(moment=deadline, position=len(self.sequence), by_time=True) if self.over(deadline) else None

    def certain(self, run: Run) -> End | None:
        """What makes the run a match, if anything does."""
        if not self.accepting(run):
            return None
        targets = self.targets(run)
        if self.absent is not None:
            end = self.end(run)
            waited = end is not None and end.by_time and self.awaits_absence(run, end.position)
            return end if waited else None
        if not targets or self.steps[targets[0]].contiguity is Contiguity.SKIP_TILL_ANY:
            return End(moment=self.moment(run), position=run[-1][1], by_time=False)
        return self.end(run)

    def timed_out(self, run: Run) -> int | None:
        """When time ended the run before it was accepting."""
        end = None if self.accepting(run) else self.end(run)
        return end.moment if end is not None and end.by_time else None
