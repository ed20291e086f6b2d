"""Ready-made recognizers of episodes: sessions by gaps, missions from a begin to an end, and repetitions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from typing import Any, ClassVar, Literal

from elm.cues.algebra import Cue, Or
from elm.cues.relations import named
from elm.errors import InvalidValue
from elm.interval import from_micros
from elm.recognizers.base import DEADLINE, Emission, Fed, Judge, Process, check_feature
from elm.recognizers.conditions import Same
from elm.recognizers.durations import check_duration, later, micros_of
from elm.recognizers.grouped import MOST_PARTS, Grouped, GroupedProcess, HeldGroup, alike
from elm.recognizers.naming import sorted_names
from elm.recognizers.partition import Key, values_of
from elm.taxonomy import EventType

DAY = "day"
_DAY_MICROS = 86_400 * 10**6
_BEGIN, _INCLUDE, _END = "begin", "include", "end"


class Again(StrEnum):
    """What a begin does to a mission under way: nothing, or it begins anew."""

    IGNORE = "ignore"
    RESTART = "restart"


@dataclass(frozen=True, slots=True, kw_only=True)
class Session(Grouped):
    """Events that follow each other by at most `gap`, from moment to moment; at least `least` of them."""

    cue: Cue
    gap: timedelta
    least: int = 1
    most_parts: int = MOST_PARTS

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.cue)
        self._check_durations("gap")
        self._check_count("least")
        self._check_count("most_parts", least=self.least)

    @property
    def interest(self) -> Cue:
        """What sessions are made of."""
        return self.cue

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _Sessions(self, around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _Sessions.resumed(self, around, snapshot, held)


class _Sessions(GroupedProcess[Session]):
    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        found: Sequence[Emission] = ()
        group, deadline = self._find(key), later(fed.moment, micros_of(self._definition.gap))
        if group is not None and len(group.held) >= self._definition.most_parts:
            self._split += 1
            found, group = self._over(group), None
        if group is None:
            group = HeldGroup(key, (), deadline, [])
        group.add(fed, deadline)
        self._put(group)
        return found

    def _tells(self, group: HeldGroup) -> bool:
        return len(group.held) >= self._definition.least

    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        if len(group.held) < self._definition.least:
            return ()
        parts = alike(group.held)
        features = self._definition.measured(parts)
        return (Emission(type=self._definition.type, parts=parts, key=values_of(group.key), features=features),)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission(Grouped):
    """From an event that begins it to the next one that ends it, at most `within` later.

    `same` names features of which both have a value in common; `outcome` one that is copied from the end;
    `include` says what between the two is a part; `timed_out` is the type of missions that did not end in time.
    """

    STEPS: ClassVar[tuple[str, ...]] = (_BEGIN, _INCLUDE, _END)

    begin: Cue
    end: Cue
    within: timedelta
    include: Cue | None = None
    outcome: str | None = None
    same: Sequence[str] = ()
    timed_out: str | None = None
    again: Again | Literal["ignore", "restart"] = Again.IGNORE
    most_parts: int = MOST_PARTS

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.begin, self.end, *self._included)
        self._check_durations("within")
        self._check_types(self.timed_out)
        if self.outcome is not None:
            check_feature(self.outcome, what=f"the outcome of {self.title}")
            self._reserve(self.outcome)
        same = sorted_names(self.same, what=f"what begin and end of {self.title} have in common")
        object.__setattr__(self, "same", same)
        object.__setattr__(self, "again", named(self.again, Again, what=f"what a second begin does to {self.title}"))
        self._check_count("most_parts", least=2)

    @property
    def _included(self) -> tuple[Cue, ...]:
        return () if self.include is None else (self.include,)

    @property
    def interest(self) -> Cue:
        """Begins, ends, and what is included."""
        return Or(args=(self.begin, self.end, *self._included))

    @property
    def outputs(self) -> tuple[EventType, ...]:
        """The types of its results, and of deadlines where a mission may time out."""
        return self._types() if self.timed_out is None else (*self._types(self.timed_out), DEADLINE)

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _Missions(self, around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _Missions.resumed(self, around, snapshot, held)


class _Missions(GroupedProcess[Mission]):
    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        mission, group = self._definition, self._find(key)
        if group is not None and self._ends(group, fed):
            self._remove(group)
            return (self._emission(group, mission.type, "match", end=fed),)
        restarts = group is None or mission.again is Again.RESTART
        if restarts and self._around.matches(mission.begin, fed.event):
            self._put(HeldGroup(key, (), later(fed.moment, micros_of(mission.within)), [fed]))
        elif group is not None and mission.include is not None and self._around.matches(mission.include, fed.event):
            if len(group.held) < mission.most_parts - 1:
                group.held.append(fed)
            else:
                self._dropped += 1
        return ()

    def _ends(self, group: HeldGroup, fed: Fed) -> bool:
        if not self._around.matches(self._definition.end, fed.event):
            return False
        begun = group.held[0].event
        return all(Same(feature=name, step=_BEGIN).between(fed.event, begun) for name in self._definition.same)

    def _tells(self, group: HeldGroup) -> bool:
        return self._definition.timed_out is not None

    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        timed_out = self._definition.timed_out
        return () if timed_out is None else (self._emission(group, timed_out, "timed out"),)

    def _emission(self, group: HeldGroup, type_name: str, output: str, *, end: Fed | None = None) -> Emission:
        first, *rest = group.held
        parts = [(_BEGIN, first.event), *((_INCLUDE, fed.event) for fed in rest)]
        features = []
        if end is not None:
            parts.append((_END, end.event))
            outcome = self._definition.outcome
            features += [] if outcome is None else [(outcome, value) for value in end.event.values(outcome)]
        features += self._definition.measured(parts)
        return Emission(
            type=type_name,
            parts=tuple(parts),
            output=output,
            key=values_of(group.key),
            features=tuple(features),
            deadline=from_micros(group.deadline) if end is None else None,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Repetition(Grouped):
    """The `times`-th event of a UTC day ("day"), or so many events within a time."""

    cue: Cue
    times: int
    per: timedelta | Literal["day"]

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.cue)
        self._check_count("times")
        if self.per != DAY:
            if isinstance(self.per, str):
                raise InvalidValue(f"{self.title} counts per 'day' or per timedelta, not per {self.per!r:.80}")
            check_duration(self.per, what=f"the time in which {self.title} counts")

    @property
    def interest(self) -> Cue:
        """What is repeated."""
        return self.cue

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _Repetitions(self, around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _Repetitions.resumed(self, around, snapshot, held)


class _Repetitions(GroupedProcess[Repetition]):
    """A group that holds no event has been found on its day."""

    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        group, per = self._find(key), self._definition.per
        if group is not None and not group.held:
            return ()
        held = [fed] if group is None else [*group.held, fed]
        if isinstance(per, timedelta):
            held = [each for each in held if fed.moment - each.moment <= micros_of(per)]
            deadline = later(fed.moment, micros_of(per))
        else:
            deadline = _last_of_day(fed.moment)
        if len(held) < self._definition.times:
            self._put(HeldGroup(key, (), deadline, held))
            return ()
        if group is not None:
            self._remove(group)
        if per == DAY:
            self._put(HeldGroup(key, (), deadline, []))
        parts = alike(held)
        features = self._definition.measured(parts)
        return (Emission(type=self._definition.type, parts=parts, key=values_of(key), features=features),)

    def _tells(self, group: HeldGroup) -> bool:
        return False

    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        return ()


def _last_of_day(moment: int) -> int:
    return moment - moment % _DAY_MICROS + _DAY_MICROS - 1
