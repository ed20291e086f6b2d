"""Hits: which atoms of a pattern one event is, each judged once and when it is asked for."""

from __future__ import annotations

from typing import Any

from elm.recognizers.base import Fed, Judge
from elm.recognizers.plan import Plan
from elm.recognizers.runs import Taken, taken_by


class Hits:
    """Which atoms one event is, of one plan."""

    __slots__ = ("_around", "_event", "_known", "_plan")

    def __init__(self, plan: Plan, around: Judge, fed: Fed, statics: tuple[bool | None, ...]) -> None:
        self._plan = plan
        self._around = around
        self._event = fed.event
        self._known: Any = statics

    def of(self, atom: int) -> bool:
        """Whether the event matches the atom's cue."""
        known: bool | None = self._known[atom]
        if known is None:
            known = self._around.matches(self._plan.atoms[atom].cue, self._event)
            if isinstance(self._known, tuple):
                self._known = list(self._known)
            self._known[atom] = known
        return known

    def holds(self, atom: int, taken: Taken | None) -> bool:
        """Whether the atom's conditions hold for the event and what a run took."""
        # Written out: most atoms have none, and all() of a generator takes its time for nothing.
        for condition, step in self._plan.atoms[atom].conditions:
            if not condition.holds(self._event, taken_by(step, taken)):
                return False
        return True
