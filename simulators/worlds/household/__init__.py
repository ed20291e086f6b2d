"""A household in which a robot lives: its events over days, what is true behind them, and what the robot sees."""

from __future__ import annotations

from simulators.worlds.household.household import FIRST_DAY, Household, moves, simulate_household
from simulators.worlds.household.kinds import event_types
from simulators.worlds.household.truth import Move, Sighting, Whereabouts, last_places

__all__ = [
    "FIRST_DAY",
    "Household",
    "Move",
    "Sighting",
    "Whereabouts",
    "event_types",
    "last_places",
    "moves",
    "simulate_household",
]
