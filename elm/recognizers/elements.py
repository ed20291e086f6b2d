"""What patterns are made of: steps that take events, and what must not happen between and after them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import timedelta
from enum import StrEnum
from typing import Self

from elm.cues.algebra import Cue
from elm.cues.relations import named
from elm.errors import InvalidValue
from elm.recognizers.conditions import Condition
from elm.recognizers.durations import check_duration
from elm.recognizers.purity import check_pure
from elm.text import check_name

MOST_TAKEN = 10_000
"""Most events that a step may take: a complex event of more parts is an archive, not an episode."""


class Contiguity(StrEnum):
    """How the next event of a run is looked for: the very next one, the next that fits, or any that fits."""

    STRICT = "strict"
    SKIP_TILL_NEXT = "skip_till_next"
    SKIP_TILL_ANY = "skip_till_any"


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """Takes events that match a cue and conditions: from `least` to `most` of them, looked for by `contiguity`.

    `gap` is the longest time from the moment of the event taken before.
    """

    name: str
    cue: Cue
    conditions: tuple[Condition, ...] = ()
    least: int = 1
    most: int = 1
    contiguity: Contiguity = Contiguity.SKIP_TILL_NEXT
    longest_gap: timedelta | None = None

    def __post_init__(self) -> None:
        check_name(self.name, what="the name of a step")
        what = f"step {self.name!r}"
        check_pure(self.cue, what=what)
        _check_conditions(self.conditions, what=what)
        for count in (self.least, self.most):
            if isinstance(count, bool) or not isinstance(count, int) or not 0 <= count <= MOST_TAKEN:
                raise InvalidValue(f"{what} takes a number of events from 0 to {MOST_TAKEN:,}, not {count!r}")
        if not self.least <= self.most or self.most == 0:
            raise InvalidValue(f"{what} cannot take {self.least} to {self.most} events")
        object.__setattr__(self, "contiguity", named(self.contiguity, Contiguity, what="the contiguity of a step"))
        if self.longest_gap is not None:
            check_duration(self.longest_gap, what=f"the gap of {what}")

    def times(self, least: int, most: int | None = None) -> Self:
        """The step taking `least` to `most` events; exactly `least` without `most`."""
        return replace(self, least=least, most=least if most is None else most)

    def one_or_more(self) -> Self:
        """The step taking one event or more."""
        return replace(self, least=1, most=MOST_TAKEN)

    def optional(self) -> Self:
        """The step, which may also take nothing."""
        return replace(self, least=0)

    def strict(self) -> Self:
        """The step taking the very next event of the partition only."""
        return replace(self, contiguity=Contiguity.STRICT)

    def skip_till_next(self) -> Self:
        """The step taking the next event that fits, whatever lies between."""
        return replace(self, contiguity=Contiguity.SKIP_TILL_NEXT)

    def skip_till_any(self) -> Self:
        """The step taking any later event that fits: every combination is a match of its own."""
        return replace(self, contiguity=Contiguity.SKIP_TILL_ANY)

    def gap(self, longest: timedelta) -> Self:
        """The step taking events whose moment lies at most so long after that of the event taken before."""
        return replace(self, longest_gap=longest)


@dataclass(frozen=True, slots=True, kw_only=True)
class Without:
    """Between two steps: no event that matches lies between the one taken before and the one taken after."""

    cue: Cue
    conditions: tuple[Condition, ...] = ()

    def __post_init__(self) -> None:
        check_pure(self.cue, what="a negation")
        _check_conditions(self.conditions, what="a negation")


@dataclass(frozen=True, slots=True, kw_only=True)
class Absent:
    """At the end: none that matches comes within `duration` after the moment of the last event taken."""

    cue: Cue
    duration: timedelta
    conditions: tuple[Condition, ...] = ()

    def __post_init__(self) -> None:
        check_pure(self.cue, what="an absence")
        _check_conditions(self.conditions, what="an absence")
        check_duration(self.duration, what="the duration of an absence")


Element = Step | Without | Absent


def step(name: str, cue: Cue, *conditions: Condition) -> Step:
    """Takes one event that matches `cue` and the conditions."""
    return Step(name=name, cue=cue, conditions=conditions)


def without(cue: Cue, *conditions: Condition) -> Without:
    """No event that matches between the steps around."""
    return Without(cue=cue, conditions=conditions)


def absent(cue: Cue, duration: timedelta, *conditions: Condition) -> Absent:
    """No event that matches for so long after the last one taken."""
    return Absent(cue=cue, duration=duration, conditions=conditions)


def check_elements(elements: tuple[Element, ...], *, what: str) -> None:
    """Refuse elements in an order that has no meaning."""
    if not elements or not isinstance(elements[0], Step) or elements[0].least == 0:
        raise InvalidValue(f"{what} begins with a step that takes at least one event")
    for at, each in enumerate(elements):
        if not isinstance(each, Element):
            raise InvalidValue(f"{what} is made of step(...), without(...) and absent(...), not of {each!r:.80}")
        last = at == len(elements) - 1
        if isinstance(each, Without) and (last or not isinstance(elements[at + 1], Step)):
            raise InvalidValue(f"in {what} without(...) stands between two steps; at the end use absent(...)")
        if isinstance(each, Absent) and not last:
            raise InvalidValue(f"in {what} absent(...) can only come last; between two steps use without(...)")
    names = [each.name for each in elements if isinstance(each, Step)]
    if len(set(names)) != len(names):
        raise InvalidValue(f"two steps of {what} have the same name: give each its own")
    known: set[str] = set()
    for each in elements:
        if isinstance(each, Step):
            known.add(each.name)
        for condition in each.conditions:
            if condition.step not in known:
                raise InvalidValue(
                    f"a condition in {what} compares with step {condition.step!r}, which does not come before it"
                )


def _check_conditions(conditions: tuple[Condition, ...], *, what: str) -> None:
    for each in conditions:
        if not isinstance(each, Condition):
            raise InvalidValue(f"the conditions of {what} are made by same, allen, near ...: not {each!r:.80}")
