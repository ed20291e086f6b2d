"""The meaning of every cue in plain Python: the specification by which each store's answers are judged."""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping, Set
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
        Comparison.LIKE: lambda text, pattern: like_pattern(pattern).fullmatch(text) is not None,
    }
)


def _feature(cue: FeatureCue, event: StoredEvent) -> bool:
    kind, compare = kind_of(cue.value), COMPARE[cue.compare]
    return any(
        name == cue.name and kind_of(value) == kind and compare(value, cue.value) for name, value in event.features
    )


def like_pattern(pattern: str) -> re.Pattern[str]:
    """SQL's LIKE as a regular expression: % any text, _ one character, backslash makes the next one plain."""
    pieces = re.findall(r"\\.|[^\\]", pattern, flags=re.DOTALL)
    wild = {"%": ".*", "_": "."}
    return re.compile("".join(wild.get(piece, re.escape(piece[-1])) for piece in pieces), flags=re.DOTALL)
