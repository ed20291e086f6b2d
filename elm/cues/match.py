"""The meaning of every cue in plain Python: the specification by which each store's answers are judged."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import lru_cache
from itertools import dropwhile, takewhile
from types import MappingProxyType
from typing import Any, Protocol, assert_never
from uuid import UUID

from elm.cues.algebra import (
    AgentCue,
    And,
    Cue,
    DurationCue,
    FeatureCue,
    FeatureNamesCue,
    FeaturesCue,
    KinCue,
    Not,
    Or,
    PayloadCue,
    RegionCue,
    TimeCue,
    TypeCue,
    UidCue,
    node,
)
from elm.cues.relations import Comparison, Kin, Place, SetRelation, TimeAxis, TypeRelation
from elm.event import StoredEvent
from elm.features import identity, kind_of
from elm.geometry import SpatialRelation
from elm.interval import AllenRelation, to_micros


class Surroundings(Protocol):
    """What a cue may ask about an event beyond the event itself."""

    def is_a(self, name: str, ancestor: str) -> bool:
        """Whether the type `name` is `ancestor` or a sub-type of it; unknown types are an error."""

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        """The direct parts or wholes of an event, or all of Def 4 when transitive."""


def match(cue: Cue, event: StoredEvent, around: Surroundings) -> bool:
    """Whether `event` matches `cue` (Def 14). Two-valued: a condition on a missing component is false."""
    match node(cue):
        case And(args=args):
            return all(match(arg, event, around) for arg in args)
        case Or(args=args):
            return any(match(arg, event, around) for arg in args)
        case Not(arg=arg):
            return not match(arg, event, around)
        case TypeCue(relation=type_relation, type=name):
            return event.type == name if type_relation is TypeRelation.EXACTLY else around.is_a(event.type, name)
        case TimeCue() as condition:
            return _time(condition, event)
        case RegionCue() as condition:
            return _region(condition, event)
        case FeaturesCue(relation=relation, features=features):
            return sets(relation, set(map(identity, event.features)), set(map(identity, features)))
        case FeatureNamesCue(relation=relation, names=names):
            return sets(relation, {name for name, _ in event.features}, set(names))
        case FeatureCue() as condition:
            return _feature(condition, event)
        case PayloadCue(data=data):
            return event.payload is not None and event.payload.data == data
        case AgentCue(agent=agent):
            return event.agent == agent
        case DurationCue(compare=compare, duration=duration):
            lasted = event.interval.duration
            return lasted is not None and COMPARE[compare](lasted, duration)
        case KinCue(relation=relation, uids=uids, kin=kin, transitive=transitive):
            return sets(relation, around.kin(event.uid, kin, transitive=transitive), set(uids))
        case UidCue(uids=uids):
            return event.uid in uids
        case unknown:
            assert_never(unknown)


def sets(relation: SetRelation, event: Set[Any], given: Set[Any]) -> bool:
    """How two finite sets compare, the event's on the left; the empty set follows mathematics."""
    match relation:
        case SetRelation.EQUAL:
            return event == given
        case SetRelation.SUBSET:
            return event <= given
        case SetRelation.SUPERSET:
            return event >= given
        case SetRelation.INTERSECTS:
            return not event.isdisjoint(given)
        case SetRelation.DISJOINT:
            return event.isdisjoint(given)
        case _:
            assert_never(relation)


def _time(cue: TimeCue, event: StoredEvent) -> bool:
    if cue.axis is TimeAxis.RECORDED_AT:
        learned = to_micros(event.recorded_at)
        a, b = learned, learned
    else:
        a, b = event.interval.micros
    c, d = cue.window.micros
    match cue.relation:
        case AllenRelation() as relation:
            return relation.holds((a, b), (c, d))
        case SetRelation.EQUAL:
            return (a, b) == (c, d)
        case SetRelation.SUBSET:
            return c <= a and b <= d
        case SetRelation.SUPERSET:
            return a <= c and d <= b
        case SetRelation.INTERSECTS:
            return a <= d and c <= b
        case SetRelation.DISJOINT:
            return b < c or d < a
        case unknown:
            assert_never(unknown)


def _region(cue: RegionCue, event: StoredEvent) -> bool:
    place = event.region if cue.place is Place.REGION else event.subject
    if place is None or place.frame != cue.region.frame:
        return False
    here, given = place.polygon, cue.region.polygon
    match cue.relation:
        case SpatialRelation.EQUAL:
            return bool(here.equals(given))
        case SpatialRelation.SUBSET:
            return bool(here.covered_by(given))
        case SpatialRelation.SUPERSET:
            return bool(here.covers(given))
        case SpatialRelation.INTERSECTS:
            return bool(here.intersects(given))
        case SpatialRelation.DISJOINT:
            return bool(here.disjoint(given))
        case SpatialRelation.TOUCHES:
            return bool(here.touches(given))
        case SpatialRelation.WITHIN_DISTANCE:
            return bool(here.distance(given) <= cue.distance)
        case unknown:
            assert_never(unknown)


COMPARE: Mapping[Comparison, Callable[[Any, Any], bool]] = MappingProxyType(
    {
        Comparison.EQ: operator.eq,
        Comparison.NE: operator.ne,
        Comparison.LT: operator.lt,
        Comparison.LE: operator.le,
        Comparison.GT: operator.gt,
        Comparison.GE: operator.ge,
        Comparison.LIKE: lambda text, pattern: _like(text, pattern),
    }
)


def _feature(cue: FeatureCue, event: StoredEvent) -> bool:
    kind, compare = kind_of(cue.value), COMPARE[cue.compare]
    return any(
        name == cue.name and kind_of(value) == kind and compare(value, cue.value) for name, value in event.features
    )


def _like(text: str, pattern: str) -> bool:
    """SQL's LIKE, of the whole text: % is any text, _ one character, backslash makes the next one plain.

    What stands between two % is looked for from left to right, each piece where it fits first: no later place would
    leave more room for the rest. So nothing is tried twice, and no pattern takes long.
    """
    first, *others = _pieces(pattern)
    if not others:
        return len(text) == first.length and first.fits(text, 0)
    *inner, last = others
    if len(text) < first.length + last.length or not first.fits(text, 0):
        return False
    behind, end = first.length, len(text) - last.length
    for piece in inner:
        behind = piece.end_of_first_fit(text, behind, end)
        if behind < 0:
            return False
    return behind <= end and last.fits(text, end)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Piece:
    """What stands between two % of a pattern: `lead` places for any character, and behind them a core.

    The core is the text `plain` where all its characters are given. Else `plain` is None, `head` the text before its
    first place for any; `places` has, for each character given, where in the core it may stand, as the bits of a
    number, and `anywhere` where any other may.
    """

    length: int
    lead: int
    plain: str | None
    head: str
    places: Mapping[str, int]
    anywhere: int

    @classmethod
    def of(cls, characters: Sequence[str | None]) -> _Piece:
        core = list(dropwhile(lambda character: character is None, characters))
        head = "".join(character or "" for character in takewhile(lambda character: character is not None, core))
        anywhere = sum(1 << place for place, character in enumerate(core) if character is None)
        places: dict[str, int] = {}
        for place, character in enumerate(core):
            if character is not None:
                places[character] = places.get(character, anywhere) | 1 << place
        return cls(
            length=len(characters),
            lead=len(characters) - len(core),
            plain=head if len(head) == len(core) else None,
            head=head,
            places=places,
            anywhere=anywhere,
        )

    def fits(self, text: str, begin: int) -> bool:
        if self.plain is not None:
            return text.startswith(self.plain, begin + self.lead)
        return self.end_of_first_fit(text, begin, begin + self.length) >= 0

    def end_of_first_fit(self, text: str, begin: int, end: int) -> int:
        """Where the first place ends at which the piece stands in text[begin:end], or -1."""
        place = begin + self.lead
        if self.plain is not None:
            found = text.find(self.plain, place, end)
            return found if found < 0 else found + len(self.plain)
        # Shift-and (Baeza-Yates and Gonnet 1992); bit n: the core up to its place n ends here.
        standing, whole = 0, 1 << (self.length - self.lead - 1)
        while place < end:
            if not standing:
                place = text.find(self.head, place, end)
                if place < 0:
                    return -1
            standing = (standing << 1 | 1) & self.places.get(text[place], self.anywhere)
            place += 1
            if standing & whole:
                return place
        return -1


@lru_cache(maxsize=64)
def _pieces(pattern: str) -> tuple[_Piece, ...]:
    """The pattern, taken apart at its %; a cue has none that ends with a single backslash."""
    pieces: list[list[str | None]] = [[]]
    characters = iter(pattern)
    for character in characters:
        if character == "%":
            pieces.append([])
        elif character == "_":
            pieces[-1].append(None)
        elif character == "\\":
            pieces[-1].append(next(characters))
        else:
            pieces[-1].append(character)
    return tuple(map(_Piece.of, pieces))
