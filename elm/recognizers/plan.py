"""A pattern made ready to run: its atoms numbered, the steps that may follow each, and what must not lie between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from elm.cues.algebra import Cue
from elm.recognizers.conditions import Condition
from elm.recognizers.durations import micros_of
from elm.recognizers.elements import Absent, Contiguity, Element, Step, Without
from elm.recognizers.measures import Measure


@dataclass(frozen=True, slots=True, kw_only=True)
class Atom:
    """What an event must be for one element: a cue, and conditions each with the number of the step it names."""

    cue: Cue
    conditions: tuple[tuple[Condition, int], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A step that may take the next event: its number, and the numbers of the negations on the way to it."""

    step: int
    guards: tuple[int, ...]
    strict: bool
    divides: bool
    gap: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The elements of a pattern by number: steps first, then negations, then the absence at the end."""

    atoms: tuple[Atom, ...]
    names: tuple[str, ...]
    least: tuple[int, ...]
    most: tuple[int, ...]
    ahead: tuple[tuple[Target, ...], ...]
    """For each step the targets behind it."""
    again_or_ahead: tuple[tuple[Target, ...], ...]
    """For each step the target that is the step itself, and those."""
    may_end: tuple[bool, ...]
    """For each step whether all behind it may take nothing."""
    guards_behind: tuple[tuple[int, ...], ...]
    """For each step the negations on its ways on."""
    watches: tuple[bool, ...]
    """For each step whether a run that it took the last event for must look at events that it passes over."""
    absent: int | None
    absent_for: int
    has_strict: bool

    def targets(self, step: int, count: int) -> tuple[Target, ...]:
        """The targets of a run whose last event was taken by `step`, which has taken `count`."""
        if count < self.least[step]:
            return self.again_or_ahead[step][:1]
        return self.again_or_ahead[step] if count < self.most[step] else self.ahead[step]

    def accepts(self, step: int, count: int) -> bool:
        """Whether a run may end whose last event was taken by `step`, which has taken `count`."""
        return count >= self.least[step] and self.may_end[step]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """What a process needs to know of its pattern beside the plan; times in microseconds."""

    type: str
    timed_out: str | None
    within: int
    among: Cue | None
    partition: tuple[str, ...]
    bars_overlaps: bool
    bars_same_start: bool
    measures: Mapping[str, Measure]
    most_runs: int


def plan(elements: Sequence[Element]) -> Plan:
    """The plan of a pattern's elements."""
    steps = [each for each in elements if isinstance(each, Step)]
    number = {each.name: at for at, each in enumerate(steps)}
    negations: list[Without] = []
    between: list[list[int]] = [[] for _ in steps]
    before = -1
    for each in elements:
        if isinstance(each, Step):
            before += 1
        elif isinstance(each, Without):
            between[before].append(len(steps) + len(negations))
            negations.append(each)
    last = elements[-1]
    absence = last if isinstance(last, Absent) else None
    every: list[Step | Without | Absent] = [*steps, *negations, *([absence] if absence else [])]
    ahead = []
    for at in range(len(steps)):
        found: list[Target] = []
        for later in range(at + 1, len(steps)):
            found.append(_target(steps[later], later, [g for way in between[at:later] for g in way]))
            if steps[later].least > 0:
                break
        ahead.append(tuple(found))
    again = [_target(each, at, []) for at, each in enumerate(steps)]
    may_end = [all(later.least == 0 for later in steps[at + 1 :]) for at in range(len(steps))]
    guards_behind = [tuple(dict.fromkeys(g for target in way for g in target.guards)) for way in ahead]
    has_strict = any(each.contiguity is Contiguity.STRICT for each in steps)
    return Plan(
        atoms=tuple(
            Atom(cue=each.cue, conditions=tuple((one, number[one.step]) for one in each.conditions)) for each in every
        ),
        names=tuple(each.name for each in steps),
        least=tuple(each.least for each in steps),
        most=tuple(each.most for each in steps),
        ahead=tuple(ahead),
        again_or_ahead=tuple((one, *others) for one, others in zip(again, ahead, strict=True)),
        may_end=tuple(may_end),
        guards_behind=tuple(guards_behind),
        watches=tuple(
            has_strict or bool(guards) or (absence is not None and ends)
            for guards, ends in zip(guards_behind, may_end, strict=True)
        ),
        absent=None if absence is None else len(every) - 1,
        absent_for=0 if absence is None else micros_of(absence.duration),
        has_strict=has_strict,
    )


def _target(step: Step, number: int, guards: list[int]) -> Target:
    return Target(
        step=number,
        guards=tuple(guards),
        strict=step.contiguity is Contiguity.STRICT,
        divides=step.contiguity is Contiguity.SKIP_TILL_ANY,
        gap=None if step.longest_gap is None else micros_of(step.longest_gap),
    )
