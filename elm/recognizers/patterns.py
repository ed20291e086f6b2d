"""Patterns: which events, in which order and with what between them, make up a complex event (docs/recognition.md)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field
from datetime import timedelta
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from elm.cues.algebra import And, Cue, Or
from elm.cues.relations import named
from elm.errors import InvalidValue
from elm.recognizers.base import DEADLINE, Fed, Judge, Process, check_count, check_identity
from elm.recognizers.durations import check_duration, micros_of
from elm.recognizers.elements import Absent, Contiguity, Element, Step, check_elements
from elm.recognizers.matching import Matching
from elm.recognizers.measures import Measure, checked_measures
from elm.recognizers.naming import ordered_names, parents_of
from elm.recognizers.plan import Rules, plan
from elm.recognizers.purity import check_pure
from elm.recognizers.spelling import plain
from elm.taxonomy import EventType
from elm.text import check_short_name

MOST_RUNS = 10_000
"""Unfinished runs that one process of a pattern holds, unless the pattern says otherwise."""


class AfterMatch(StrEnum):
    """Which matches count once one has been found: those that begin behind it, at other events, or all."""

    PAST_LAST = "past_last"
    NEXT_START = "next_start"
    ALL = "all"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pattern:
    """A recognizer of sequences of events; docs/recognition.md says exactly which it finds.

    `type` is the event type of its results and `parents` what that is a kind of; `timed_out` the type of runs
    that time ended. `within` is the longest time from the first begin to the last moment.
    """

    name: str
    version: int
    type: str
    elements: tuple[Element, ...]
    within: timedelta
    among: Cue | None = None
    partition: tuple[str, ...] = ()
    across_agents: bool = False
    after_match: AfterMatch = AfterMatch.PAST_LAST
    measures: Mapping[str, Measure] = field(default_factory=dict)
    timed_out: str | None = None
    parents: tuple[str, ...] = ()
    most_runs: int = MOST_RUNS

    if TYPE_CHECKING:
        # What may be given is wider than what is kept: checkers read this, dataclass writes the real one.
        def __init__(
            self,
            *,
            name: str,
            version: int,
            type: str,  # noqa: A002 - the field's name in every format
            elements: Iterable[Element],
            within: timedelta,
            among: Cue | None = ...,
            partition: Iterable[str] = ...,
            across_agents: bool = ...,
            after_match: AfterMatch | str = ...,
            measures: Mapping[str, Measure] = ...,
            timed_out: str | None = ...,
            parents: Iterable[str] = ...,
            most_runs: int = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_identity(self.name, self.version)
        what = f"pattern {self.name!r}"
        check_short_name(self.type, what=f"the type of {what}")
        if self.timed_out is not None:
            check_short_name(self.timed_out, what=f"the type of what times out in {what}")
        check_duration(self.within, what=f"the time within which {what} must be complete")
        if isinstance(self.elements, str | Set) or not isinstance(self.elements, Iterable):
            raise InvalidValue(f"the elements of {what} are a list: [step(...), ...], not {self.elements!r:.80}")
        object.__setattr__(self, "elements", tuple(self.elements))
        object.__setattr__(self, "partition", ordered_names(self.partition, what=f"the partition of {what}"))
        object.__setattr__(self, "parents", parents_of(self.type, self.parents))
        if self.among is not None:
            check_pure(self.among, what=f"the filter of {what}")
        object.__setattr__(self, "after_match", named(self.after_match, AfterMatch, what="what comes after a match"))
        check_count(self.most_runs, what=f"'most_runs' of {what}")
        check_elements(self.elements, what=what)
        measures = checked_measures(self.measures, (each.name for each in self.steps), what=what)
        object.__setattr__(self, "measures", measures)
        if self.timed_out and any(each.contiguity is Contiguity.SKIP_TILL_ANY for each in self.steps):
            raise InvalidValue(
                f"{what} lists every combination (skip-till-any): which of them timed out cannot be said. "
                f"Leave timed_out out, or skip till next"
            )

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps alone, in order."""
        return tuple(each for each in self.elements if isinstance(each, Step))

    @property
    def interest(self) -> Cue:
        """What is fed: what passes the filter; without one everything where strict steps count it, else the atoms."""
        if self.among is not None:
            return self.among
        if any(each.contiguity is Contiguity.STRICT for each in self.steps):
            return And()
        return Or(args=tuple(each.cue for each in self.elements))

    @property
    def outputs(self) -> tuple[EventType, ...]:
        """The types of its results."""
        found = [EventType(name=self.type, parents=self.parents)]
        if self.timed_out is not None:
            found.append(EventType(name=self.timed_out, parents=self.parents))
        if self.timed_out is not None or isinstance(self.elements[-1], Absent):
            found.append(DEADLINE)
        return tuple(found)

    @property
    def definition(self) -> Any:
        """All that its results depend on, as plain JSON."""
        return plain(self)

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return Matching(self._rules, plan(self.elements), around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return Matching.resumed(self._rules, plan(self.elements), around, snapshot, held)

    @property
    def _rules(self) -> Rules:
        return Rules(
            type=self.type,
            timed_out=self.timed_out,
            within=micros_of(self.within),
            among=self.among,
            partition=self.partition,
            bars_overlaps=self.after_match is AfterMatch.PAST_LAST,
            bars_same_start=self.after_match is AfterMatch.NEXT_START,
            measures=self.measures,
            most_runs=self.most_runs,
        )
