"""Conditions between steps: how an event must compare with what an earlier step of the same run took."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal, assert_never

from elm.cues.match import COMPARE
from elm.cues.relations import Comparison, Place, named
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.features import identity, kind_of
from elm.geometry import LIMIT, Region
from elm.interval import AllenRelation
from elm.text import check_name


class Of(StrEnum):
    """Which event of a step that took several is compared with."""

    LAST = "last"
    FIRST = "first"
    EVERY = "every"


OfName = Of | Literal["last", "first", "every"]
PlaceName = Place | Literal["region", "subject"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition(ABC):
    """Compares the event at hand with what `step` took; it holds where that step has taken nothing."""

    step: str
    of: Of = Of.LAST

    def __post_init__(self) -> None:
        check_name(self.step, what="the step that a condition names")
        object.__setattr__(self, "of", named(self.of, Of, what="which event of a step a condition means"))

    def holds(self, event: StoredEvent, taken: Sequence[StoredEvent]) -> bool:
        """Whether it holds for an event, given what the step took, in order."""
        if not taken:
            return True
        match self.of:
            case Of.LAST:
                return self.between(event, taken[-1])
            case Of.FIRST:
                return self.between(event, taken[0])
            case Of.EVERY:
                return all(self.between(event, other) for other in taken)
            case _:
                assert_never(self.of)

    @abstractmethod
    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether it holds for an event and one that was taken."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Same(Condition):
    """Both have the feature, and some value of it in common."""

    feature: str

    def __post_init__(self) -> None:
        Condition.__post_init__(self)
        check_name(self.feature, what="a feature that a condition compares")

    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether both have a value in common."""
        ours = {identity((self.feature, value)) for value in event.values(self.feature)}
        return any(identity((self.feature, value)) in ours for value in other.values(self.feature))


@dataclass(frozen=True, slots=True, kw_only=True)
class Allen(Condition):
    """One of Allen's relations of the event at hand to the one taken."""

    relation: AllenRelation

    def __post_init__(self) -> None:
        Condition.__post_init__(self)
        relation = named(self.relation, AllenRelation, what="the relation of a condition")
        object.__setattr__(self, "relation", relation)

    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether the intervals stand in the relation."""
        return self.relation.holds(event.interval.micros, other.interval.micros)


@dataclass(frozen=True, slots=True, kw_only=True)
class Near(Condition):
    """Their places lie in one frame, at most so many metres apart."""

    metres: float
    place: Place = Place.REGION

    def __post_init__(self) -> None:
        Condition.__post_init__(self)
        object.__setattr__(self, "place", named(self.place, Place, what="the place of a condition"))
        if isinstance(self.metres, bool) or not isinstance(self.metres, int | float) or not 0 <= self.metres <= LIMIT:
            raise InvalidValue(f"the distance must be between 0 and {LIMIT:g} m, not {self.metres!r}")

    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether the places are that near."""
        here, there = _place(event, self.place), _place(other, self.place)
        if here is None or there is None:
            return False
        apart = here.distance(there)
        return apart is not None and apart <= self.metres


@dataclass(frozen=True, slots=True, kw_only=True)
class SameRegion(Condition):
    """Their places lie in one frame and share at least a point."""

    place: Place = Place.REGION

    def __post_init__(self) -> None:
        Condition.__post_init__(self)
        object.__setattr__(self, "place", named(self.place, Place, what="the place of a condition"))

    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether the places intersect."""
        here, there = _place(event, self.place), _place(other, self.place)
        if here is None or there is None or here.frame != there.frame:
            return False
        return bool(here.polygon.intersects(there.polygon))


@dataclass(frozen=True, slots=True, kw_only=True)
class Compare(Condition):
    """Some value of the event's feature compares so with some value, of the same kind, of the other's feature."""

    feature: str
    comparison: Comparison
    other_feature: str

    def __post_init__(self) -> None:
        Condition.__post_init__(self)
        comparison = named(self.comparison, Comparison, what="the comparison of a condition")
        if comparison is Comparison.LIKE:
            raise InvalidValue("features of two events compare by = != < <= > >=, not by 'like'")
        object.__setattr__(self, "comparison", comparison)
        for name in (self.feature, self.other_feature):
            check_name(name, what="a feature that a condition compares")

    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether a pair of values compares so; truth values only by = and !=."""
        equality = self.comparison in (Comparison.EQ, Comparison.NE)
        holds = COMPARE[self.comparison]
        return any(
            kind_of(value) == kind_of(known) and (equality or kind_of(value) != "b") and holds(value, known)
            for value in event.values(self.feature)
            for known in other.values(self.other_feature)
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Told(Condition):
    """What a function of one's own says of the two events: `title` stands for it in the definition.

    The function must be pure. Its code is not part of the definition: change `title` with it.
    """

    title: str
    function: Callable[[StoredEvent, StoredEvent], bool]

    def __post_init__(self) -> None:
        Condition.__post_init__(self)
        check_name(self.title, what="the title of a condition")
        if not callable(self.function):
            raise InvalidValue(f"the condition {self.title!r} needs a function of two events")

    def between(self, event: StoredEvent, other: StoredEvent) -> bool:
        """Whether the function says so of the event at hand and the one taken."""
        return bool(self.function(event, other))


def same(feature: str, step: str, *, of: OfName = Of.LAST) -> Condition:
    """Both have the feature, and some value of it in common."""
    return Same(feature=feature, step=step, of=_of(of))


def allen(relation: AllenRelation | str, step: str, *, of: OfName = Of.LAST) -> Condition:
    """The event at hand stands in this relation of Allen's to what the step took."""
    return Allen(relation=named(relation, AllenRelation, what="the relation of a condition"), step=step, of=_of(of))


def near(metres: float, step: str, *, place: PlaceName = Place.REGION, of: OfName = Of.LAST) -> Condition:
    """At most so many metres lie between the regions (or subjects)."""
    return Near(metres=metres, step=step, place=_placed(place), of=_of(of))


def same_region(step: str, *, place: PlaceName = Place.REGION, of: OfName = Of.LAST) -> Condition:
    """The regions (or subjects) share at least a point."""
    return SameRegion(step=step, place=_placed(place), of=_of(of))


def compare(
    feature: str, comparison: Comparison | str, step: str, other_feature: str | None = None, *, of: OfName = Of.LAST
) -> Condition:
    """The event's feature compares so with that of what the step took (with its `other_feature`, if given)."""
    relation = named(comparison, Comparison, what="the comparison of a condition")
    other = feature if other_feature is None else other_feature
    return Compare(feature=feature, comparison=relation, step=step, other_feature=other, of=_of(of))


def told(
    title: str, function: Callable[[StoredEvent, StoredEvent], bool], step: str, *, of: OfName = Of.LAST
) -> Condition:
    """What a pure function of the event at hand and the one taken says; `title` changes when the function does."""
    return Told(title=title, function=function, step=step, of=_of(of))


def _of(given: OfName) -> Of:
    return named(given, Of, what="which event of a step a condition means")


def _placed(given: PlaceName) -> Place:
    return named(given, Place, what="the place of a condition")


def _place(event: StoredEvent, place: Place) -> Region | None:
    return event.region if place is Place.REGION else event.subject
