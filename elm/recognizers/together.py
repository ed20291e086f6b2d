"""The ready-made recognizer of co-occurrence: two events of different kinds at one time, near each other if asked."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, ClassVar, Literal

from elm.cues.algebra import Cue, Or
from elm.cues.relations import Place, named
from elm.recognizers.base import Emission, Fed, Judge, Process
from elm.recognizers.conditions import Condition, Near, Same
from elm.recognizers.durations import later, micros_of
from elm.recognizers.grouped import Grouped, GroupedProcess, HeldGroup
from elm.recognizers.naming import sorted_names
from elm.recognizers.partition import Key, values_of

MOST_HELD = 10_000
"""Events of either kind that are held for each group, unless the definition says otherwise."""
_FIRST, _SECOND = "first", "second"


@dataclass(frozen=True, slots=True, kw_only=True)
class CoOccurrence(Grouped):
    """Pairs of an event of each kind that share a stretch of time of at least `at_least`, each pair once.

    Their moments lie at most `within` apart; `near` is how many metres their regions (or subjects) may lie apart;
    `same` names features of which both have a value in common.
    """

    STEPS: ClassVar[tuple[str, ...]] = (_FIRST, _SECOND)

    first: Cue
    second: Cue
    within: timedelta
    at_least: timedelta = timedelta(0)
    near: float | None = None
    of: Place | Literal["region", "subject"] = Place.REGION
    same: Sequence[str] = ()
    most_held: int = MOST_HELD

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.first, self.second)
        self._check_durations("within", "at_least")
        same = sorted_names(self.same, what=f"what both events of {self.title} have in common")
        object.__setattr__(self, "same", same)
        self._check_count("most_held")
        object.__setattr__(self, "of", named(self.of, Place, what=f"whose place {self.title} looks at"))
        self.conditions()

    def conditions(self) -> tuple[Condition, ...]:
        """What must hold between the two events beside their times."""
        near = () if self.near is None else (Near(metres=self.near, place=Place(self.of), step=_FIRST),)
        return (*(Same(feature=name, step=_FIRST) for name in self.same), *near)

    @property
    def interest(self) -> Cue:
        """Events of both kinds."""
        return Or(args=(self.first, self.second))

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _CoOccurrences(self, around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _CoOccurrences.resumed(self, around, snapshot, held)


class _CoOccurrences(GroupedProcess[CoOccurrence]):
    """For each key the events of either kind that one still to come may be paired with."""

    def __init__(self, definition: CoOccurrence, around: Judge) -> None:
        super().__init__(definition, around)
        self._conditions = definition.conditions()
        self._within = micros_of(definition.within)
        self._at_least = micros_of(definition.at_least)

    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        is_first = self._around.matches(self._definition.first, fed.event)
        is_second = self._around.matches(self._definition.second, fed.event)
        found = [self._pair(key, first, fed) for first in self._partners(key, _FIRST, fed)] if is_second else []
        if is_first:
            # A pair that fits both ways round is one pair: the event fed before is its first.
            known = {emission.parts[0][1].uid for emission in found}
            partners = self._partners(key, _SECOND, fed)
            found += [self._pair(key, fed, second) for second in partners if second.event.uid not in known]
        for side, belongs in ((_FIRST, is_first), (_SECOND, is_second)):
            if belongs:
                self._keep(key, side, fed)
        return found

    def _partners(self, key: Key, side: str, fed: Fed) -> list[Fed]:
        group = self._find(key, side)
        if group is None:
            return []
        begin, end = fed.event.interval.micros
        since = fed.moment - self._within
        # No event ends after its moment: most are out of the question before their intervals are looked at.
        begun = max(since, begin)
        near = [each for each in group.held if begun <= each.moment and each.begin <= end]
        return [each for each in near if self._is_together(fed, each)]

    def _is_together(self, fed: Fed, other: Fed) -> bool:
        shared = min(fed.event.interval.micros[1], other.event.interval.micros[1]) - max(fed.begin, other.begin)
        return shared >= self._at_least and all(each.between(fed.event, other.event) for each in self._conditions)

    def _pair(self, key: Key, first: Fed, second: Fed) -> Emission:
        parts = ((_FIRST, first.event), (_SECOND, second.event))
        features = self._definition.measured(parts)
        return Emission(type=self._definition.type, parts=parts, key=values_of(key), features=features)

    def _keep(self, key: Key, side: str, fed: Fed) -> None:
        """Hold an event, and let go of those that are too old for any to come."""
        known = self._find(key, side)
        held = [] if known is None else known.held
        del held[: bisect_left(held, fed.moment - self._within, key=lambda each: each.moment)]
        if len(held) >= self._definition.most_held:
            del held[0]
            self._dropped += 1
        held.append(fed)
        self._put(HeldGroup(key, (side,), later(fed.moment, self._within), held))

    def _tells(self, group: HeldGroup) -> bool:
        return False

    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        return ()
