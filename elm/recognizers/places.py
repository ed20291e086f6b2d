"""Ready-made recognizers of whereabouts: stays in named places with what leads in and out, and standstills anywhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Literal

from elm.cues.algebra import Cue, RegionCue
from elm.cues.relations import Place, named
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.geometry import LIMIT, Region, SpatialRelation
from elm.recognizers.base import Emission, Fed, Judge, Process
from elm.recognizers.durations import later, micros_of
from elm.recognizers.grouped import MOST_PARTS, Grouped, GroupedProcess, HeldGroup, alike
from elm.recognizers.partition import Key, values_of
from elm.taxonomy import EventType
from elm.text import check_short_name

PLACE = "place"
"""The feature of stays that names the place."""
_INSIDE, _OUTSIDE = "inside", "outside"
_RELATIONS = (SpatialRelation.SUBSET, SpatialRelation.INTERSECTS, SpatialRelation.WITHIN_DISTANCE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stay(Grouped):
    """Longest stretches of events in one of several named places, at least `least` long.

    An event is in a place when its region (or subject) stands in `relation` to it. A stretch ends when one is
    seen outside, or none inside for `gap`. `passage` is the type of shorter stretches, `enter` and `leave` those
    of the two events around the boundary; None leaves them out.
    """

    cue: Cue
    places: Mapping[str, Region]
    least: timedelta
    gap: timedelta
    relation: SpatialRelation | Literal["subset", "intersects", "within_distance"] = SpatialRelation.SUBSET
    distance: float | None = None
    of: Place | Literal["region", "subject"] = Place.REGION
    passage: str | None = None
    enter: str | None = None
    leave: str | None = None
    most_parts: int = MOST_PARTS

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.cue)
        self._check_durations("least", "gap")
        self._check_types(self.passage, self.enter, self.leave)
        self._reserve(PLACE)
        self._check_count("most_parts")
        relation = named(self.relation, SpatialRelation, what=f"the relation of {self.title} to its places")
        if relation not in _RELATIONS:
            known = ", ".join(each.value for each in _RELATIONS)
            raise InvalidValue(f"{self.title} is in a place by one of {known}, not by {relation.value!r}")
        object.__setattr__(self, "relation", relation)
        object.__setattr__(self, "of", named(self.of, Place, what=f"whose place {self.title} looks at"))
        if not isinstance(self.places, Mapping) or not self.places:
            raise InvalidValue(f'{self.title} needs places by their names: {{"dock": Region.box(0, 0, 2, 2)}}')
        object.__setattr__(self, "places", dict(self.places))
        for name, region in self.places.items():
            check_short_name(name, what=f"the name of a place of {self.title}")
            self.inside(region)

    def inside(self, region: Region) -> Cue:
        """The condition of being in a place."""
        relation, of = SpatialRelation(self.relation), Place(self.of)
        return RegionCue(relation=relation, region=region, distance=self.distance, place=of)

    @property
    def interest(self) -> Cue:
        """What tells where something was."""
        return self.cue

    @property
    def outputs(self) -> tuple[EventType, ...]:
        """The types of its results."""
        return self._types(self.passage, self.enter, self.leave)

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _Stays(self, around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _Stays.resumed(self, around, snapshot, held)


class _Stays(GroupedProcess[Stay]):
    """For each place either the stretch inside, or the last event outside while one may still enter."""

    def __init__(self, definition: Stay, around: Judge) -> None:
        super().__init__(definition, around)
        # By name: in which order places were given is no part of the definition's fingerprint.
        places = sorted(definition.places.items())
        self._places = [(name, region.frame, definition.inside(region)) for name, region in places]
        self._of = Place(definition.of)
        self._gap = micros_of(definition.gap)
        self._least = micros_of(definition.least)

    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        where = _where(fed.event, self._of)
        if where is None:
            return ()
        found: list[Emission] = []
        for place, frame, inside in self._places:
            if where.frame == frame:
                goes_in = self._around.matches(inside, fed.event)
                found += self._see_inside(key, place, fed) if goes_in else self._see_outside(key, place, fed)
        return found

    def _see_inside(self, key: Key, place: str, fed: Fed) -> Sequence[Emission]:
        found: list[Emission] = []
        deadline = later(fed.moment, self._gap)
        group, outside = self._find(key, _INSIDE, place), self._find(key, _OUTSIDE, place)
        if outside is not None:
            self._remove(outside)
            found += self._crossing(self._definition.enter, "enter", outside, fed)
        elif group is not None and len(group.held) >= self._definition.most_parts:
            self._split += 1
            found += self._over(group)
            group = None
        if group is None:
            group = HeldGroup(key, (_INSIDE, place), deadline, [])
        group.add(fed, deadline)
        self._put(group)
        return found

    def _see_outside(self, key: Key, place: str, fed: Fed) -> Sequence[Emission]:
        found: list[Emission] = []
        group = self._find(key, _INSIDE, place)
        if group is not None:
            self._remove(group)
            found += self._over(group)
            found += self._crossing(self._definition.leave, "leave", group, fed)
        if self._definition.enter is not None:
            self._put(HeldGroup(key, (_OUTSIDE, place), later(fed.moment, self._gap), [fed]))
        return found

    def _tells(self, group: HeldGroup) -> bool:
        return group.tag[0] == _INSIDE and (group.span >= self._least or self._definition.passage is not None)

    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        side, place = group.tag
        if side == _OUTSIDE:
            return ()
        is_stay = group.span >= self._least
        kind = self._definition.type if is_stay else self._definition.passage
        if kind is None:
            return ()
        parts = alike(group.held)
        emission = Emission(
            type=kind,
            parts=parts,
            output="match" if is_stay else "passage",
            key=(*values_of(group.key), place),
            features=((PLACE, place), *self._definition.measured(parts)),
        )
        return (emission,)

    def _crossing(self, kind: str | None, output: str, before: HeldGroup, fed: Fed) -> Sequence[Emission]:
        """The last event on one side and the first on the other."""
        if kind is None:
            return ()
        place = before.tag[1]
        parts = ((before.tag[0], before.held[-1].event), (_other_side(before), fed.event))
        key = (*values_of(before.key), place)
        return (Emission(type=kind, parts=parts, output=output, key=key, features=((PLACE, place),)),)


def _other_side(group: HeldGroup) -> str:
    return _INSIDE if group.tag[0] == _OUTSIDE else _OUTSIDE


@dataclass(frozen=True, slots=True, kw_only=True)
class Standstill(Grouped):
    """Runs of events that all lie within `radius` metres of where the first of them was, at least `least` long.

    A run ends when none has been seen for `gap`; where one is too short, the next is looked for from its second event.
    """

    cue: Cue
    radius: float
    least: timedelta
    gap: timedelta
    of: Place | Literal["region", "subject"] = Place.REGION
    most_parts: int = MOST_PARTS

    def __post_init__(self) -> None:
        Grouped.__post_init__(self)
        self._check_cues(self.cue)
        self._check_durations("least", "gap")
        self._check_count("most_parts")
        object.__setattr__(self, "of", named(self.of, Place, what=f"whose place {self.title} looks at"))
        radius = self.radius
        if isinstance(radius, bool) or not isinstance(radius, int | float) or not 0 <= radius <= LIMIT:
            raise InvalidValue(f"the radius of {self.title} is from 0 to {LIMIT:g} m, not {radius!r:.80}")

    @property
    def interest(self) -> Cue:
        """What tells where something was."""
        return self.cue

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""
        return _Standstills(self, around)

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken."""
        return _Standstills.resumed(self, around, snapshot, held)


class _Standstills(GroupedProcess[Standstill]):
    """For each frame the events from the first that may still begin a run."""

    def _take(self, key: Key, fed: Fed) -> Sequence[Emission]:
        where = _where(fed.event, Place(self._definition.of))
        if where is None:
            return ()
        found: Sequence[Emission] = ()
        deadline = later(fed.moment, micros_of(self._definition.gap))
        group = self._find(key, where.frame)
        if group is not None:
            if not self._reaches(group.held[0], fed):
                found = self._over(group)
                held = [] if found else self._from_later(group.held, fed)
                group = HeldGroup(key, group.tag, deadline, held)
            elif len(group.held) >= self._definition.most_parts:
                self._split += 1
                found = self._over(group)
                group = None
        if group is None:
            group = HeldGroup(key, (where.frame,), deadline, [])
        group.add(fed, deadline)
        self._put(group)
        return found

    def _from_later(self, held: list[Fed], fed: Fed) -> list[Fed]:
        """The rest of a run that was too short from the first event on whose own run reaches beyond it."""
        for at in range(1, len(held)):
            first = held[at]
            if self._reaches(first, fed) and all(self._reaches(first, held[i]) for i in range(at + 1, len(held))):
                return held[at:]
        return []

    def _reaches(self, first: Fed, other: Fed) -> bool:
        of = Place(self._definition.of)
        here, there = _where(first.event, of), _where(other.event, of)
        if here is None or there is None:
            return False
        return bool(there.polygon.distance(here.polygon.centroid) <= self._definition.radius)

    def _tells(self, group: HeldGroup) -> bool:
        return group.span >= micros_of(self._definition.least)

    def _over(self, group: HeldGroup) -> Sequence[Emission]:
        if not self._tells(group):
            return ()
        parts = alike(group.held)
        features = self._definition.measured(parts)
        return (Emission(type=self._definition.type, parts=parts, key=values_of(group.key), features=features),)


def _where(event: StoredEvent, of: Place) -> Region | None:
    return event.region if of is Place.REGION else event.subject
