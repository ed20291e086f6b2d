"""When the household does what: the routines of weekdays and weekends, with times that vary from day to day."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date


@dataclass(frozen=True, slots=True, kw_only=True)
class Appointment:
    """A routine that begins about `hour` o'clock (6.5 is half past six), give or take `spread` minutes.

    It takes place with the probability `likely`, on these days only (Monday is 0).
    """

    routine: str
    hour: float
    spread: float = 10.0
    likely: float = 1.0
    days: tuple[int, ...] = tuple(range(7))


_WEEKDAY: Sequence[Appointment] = (
    Appointment(routine="Unloading", hour=6.45, spread=3),
    Appointment(routine="Breakfast", hour=6.9, spread=6),
    Appointment(routine="Departure", hour=8.2, spread=6),
    Appointment(routine="Tidying", hour=9.2),
    Appointment(routine="Delivery", hour=10.8, spread=40, likely=0.6),
    Appointment(routine="Lunch", hour=12.6, spread=12),
    Appointment(routine="Patrol", hour=14.2, spread=15),
    Appointment(routine="Cleaning", hour=15.2, spread=15, likely=0.9, days=(1, 4)),
    Appointment(routine="Watering", hour=16.1, likely=0.9, days=(0, 3)),
    Appointment(routine="Homecoming", hour=17.4, spread=12),
    Appointment(routine="Dinner", hour=19.0),
    Appointment(routine="Tidying", hour=20.9, likely=0.5),
    Appointment(routine="Patrol", hour=22.0, spread=8),
    Appointment(routine="Night", hour=22.6, spread=8),
)
_WEEKEND: Sequence[Appointment] = (
    Appointment(routine="Patrol", hour=6.8, spread=8),
    Appointment(routine="Unloading", hour=8.0),
    Appointment(routine="Breakfast", hour=9.0, spread=15),
    Appointment(routine="Cleaning", hour=10.7, spread=15),
    Appointment(routine="Delivery", hour=11.5, spread=30, likely=0.4, days=(5,)),
    Appointment(routine="Lunch", hour=13.2, spread=15),
    Appointment(routine="Tidying", hour=15.0, spread=20),
    Appointment(routine="Watering", hour=16.8, likely=0.8, days=(6,)),
    Appointment(routine="Dinner", hour=19.3, spread=12),
    Appointment(routine="Patrol", hour=22.6, spread=8),
    Appointment(routine="Night", hour=23.2, spread=8),
)


def is_weekend(day: date) -> bool:
    """Whether nobody goes to work."""
    return day.weekday() >= 5


def plan(day: date, chance: random.Random) -> list[tuple[int, str]]:
    """The routines of a day in order, each with its begin in microseconds since midnight."""
    drawn = [
        (round((each.hour * 60 + chance.triangular(-each.spread, each.spread)) * 60_000_000), each.routine)
        for each in (_WEEKEND if is_weekend(day) else _WEEKDAY)
        if day.weekday() in each.days and chance.random() < each.likely
    ]
    return sorted(drawn)
