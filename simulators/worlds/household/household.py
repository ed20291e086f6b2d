"""The household: days without end in the life of a robot in a flat, as events and as what is true behind them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, date, datetime, timedelta
from itertools import count
from types import MappingProxyType
from uuid import UUID

from elm.errors import InvalidValue
from elm.event import Event
from elm.interval import to_micros
from simulators.worlds.household.day_plan import is_weekend, plan
from simulators.worlds.household.kinds import DAY
from simulators.worlds.household.life import AGENT, Life
from simulators.worlds.household.routines import RISE, ROUTINES, stand_by
from simulators.worlds.household.truth import Move, Whereabouts

FIRST_DAY = date(2024, 1, 1)
"""A Monday."""
_GAP = 120_000_000
"""Microseconds up to the next routine that are worth filling."""


class Household:
    """One life from a seed: iterate `events`, or `happenings`, which are the events and what is moved, once.

    The events are atomic, in the order in which they happen: their begins ascend, and so do their ends, for events
    may overlap but none lies within another. With `structured` each routine is told too when it is over, as a
    complex event of one of `kinds.ROUTINES` that has all its events as parts, and each day as one that has its
    routines as parts: every atomic event belongs to one routine, and every routine to the day that it began on.
    The atomic events are the same either way. All is the same for the same seed, uids included.
    """

    def __init__(self, seed: int, *, structured: bool = False, first_day: date = FIRST_DAY) -> None:
        begin = datetime.combine(first_day, RISE, tzinfo=UTC)
        self._life = Life(seed, begin)
        self._day = first_day
        self._structured = structured
        self._places = dict(self._life.places)
        self._begun = False

    @property
    def places(self) -> Mapping[str, Whereabouts]:
        """Where each thing is, seen or not: at the time up to which happenings or events have been taken."""
        return MappingProxyType(self._places)

    def events(self, days: int | None = None) -> Iterator[Event]:
        """The events alone, of so many days; without end by default."""
        return (told for told in self.happenings(days) if isinstance(told, Event))

    def happenings(self, days: int | None = None) -> Iterator[Event | Move]:
        """The events, and before what follows from it each move of a thing, whether the robot noticed it or not."""
        if days is not None and days < 1:
            raise InvalidValue(f"a household lives for one day at least, not for {days}")
        if self._begun:
            raise InvalidValue("a household lives once: make another with the same seed to see it again")
        self._begun = True
        return self._days(count() if days is None else range(days))

    def _days(self, numbers: Iterable[int]) -> Iterator[Event | Move]:
        for _ in numbers:
            routines: list[UUID] = []
            begin = to_micros(datetime.combine(self._day, datetime.min.time(), tzinfo=UTC))
            for start, routine in plan(self._day, self._life.chance):
                if begin + start - self._life.now > _GAP:
                    stand_by(self._life, begin + start)
                    yield from self._over("StandBy", routines)
                ROUTINES[routine](self._life)
                yield from self._over(routine, routines)
            day = self._whole(DAY, routines)
            if self._structured:
                yield day
            self._day += timedelta(days=1)

    def _over(self, routine: str, routines: list[UUID]) -> Iterator[Event | Move]:
        """What was told in a routine, and at its end the routine; its uid goes to the others of the day."""
        told, self._life.told = self._life.told, []
        for each in told:
            if isinstance(each, Move):
                self._places[each.thing] = each.goal
            yield each
        parts = [each.uid for each in told if isinstance(each, Event)]
        if parts:
            whole = self._whole(routine, parts)
            routines.append(whole.uid)
            if self._structured:
                yield whole

    def _whole(self, kind: str, parts: Sequence[UUID]) -> Event:
        """A routine or a day, whose extents derive from its parts."""
        told = (("weekday", f"{self._day:%A}"), ("weekend", is_weekend(self._day)))
        uid = self._life.uid(self._life.now)
        return Event(type=kind, features=told, agent=AGENT, parts=parts, uid=uid)


def simulate_household(
    seed: int, *, structured: bool = False, days: int | None = None, first_day: date = FIRST_DAY
) -> Iterator[Event]:
    """The events of a `Household`, of so many days; without end by default."""
    return Household(seed, structured=structured, first_day=first_day).events(days)


def moves(seed: int, *, first_day: date = FIRST_DAY) -> Iterator[Move]:
    """What is true behind the events of the same seed: each move of a thing, in order of time, without end."""
    return (told for told in Household(seed, first_day=first_day).happenings() if isinstance(told, Move))
