"""The cue nodes: a closed union of frozen values, each one condition of Def 14 or of elm's additions to it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import timedelta
from typing import Never, TypeGuard
from uuid import UUID

from elm.arguments import as_uids, check_several
from elm.cues.relations import Comparison, Kin, Place, SetRelation, TimeAxis, TypeRelation, named, time_relation
from elm.errors import InvalidValue
from elm.features import Feature, FeatureValue, as_features, check_value, kind_of
from elm.geometry import LIMIT, Region, SpatialRelation
from elm.interval import AllenRelation, Window
from elm.text import check_name, check_short_name

DEPTH_LIMIT = 100
"""How deep and/or/not may nest. Chains of one operator are flattened and do not count."""


class Cue:
    """Base of all cue nodes: combine them with & (and), | (or) and ~ (not)."""

    __slots__ = ()

    @property
    def depth(self) -> int:
        """How deep and/or/not are nested here; 0 for a single condition."""
        return 0

    def __and__(self, other: Cue) -> And:
        return And(args=(self, _cue(other)))

    def __or__(self, other: Cue) -> Or:
        return Or(args=(self, _cue(other)))

    def __invert__(self) -> Not:
        return Not(arg=self)

    def __bool__(self) -> Never:
        raise InvalidValue("a cue is neither true nor false: combine cues with &, | and ~, not with and, or, not")


def is_cue(given: object) -> TypeGuard[Cue]:
    """Whether `given` is a cue, which the base of all cues alone is not."""
    return isinstance(given, Cue) and type(given) is not Cue


def _cue(given: object) -> Cue:
    if not is_cue(given):
        raise InvalidValue(f"a cue combines with cues, not with {given!r:.80}")
    return given


def _deeper(args: Iterable[Cue]) -> int:
    depth = 1 + max((arg.depth for arg in args), default=0)
    if depth > DEPTH_LIMIT:
        raise InvalidValue(f"a cue may nest and/or/not at most {DEPTH_LIMIT} deep: write it with fewer levels")
    return depth


@dataclass(frozen=True, slots=True, kw_only=True)
class And(Cue):
    """Every argument holds; without arguments: everything matches."""

    args: tuple[Cue, ...] = ()
    depth: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        args = check_several(self.args, what="the arguments of and")
        flat = [part for arg in args for part in (arg.args if isinstance(arg, And) else (_cue(arg),))]
        object.__setattr__(self, "args", tuple(flat))
        object.__setattr__(self, "depth", _deeper(flat))


@dataclass(frozen=True, slots=True, kw_only=True)
class Or(Cue):
    """Some argument holds; without arguments: nothing matches."""

    args: tuple[Cue, ...] = ()
    depth: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        args = check_several(self.args, what="the arguments of or")
        flat = [part for arg in args for part in (arg.args if isinstance(arg, Or) else (_cue(arg),))]
        object.__setattr__(self, "args", tuple(flat))
        object.__setattr__(self, "depth", _deeper(flat))


@dataclass(frozen=True, slots=True, kw_only=True)
class Not(Cue):
    """The argument does not hold: also true of events that lack the component it speaks of."""

    arg: Cue
    depth: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "depth", _deeper((_cue(self.arg),)))


@dataclass(frozen=True, slots=True, kw_only=True)
class TypeCue(Cue):
    """The event's type: exactly this one, or this one and its sub-types."""

    relation: TypeRelation
    type: str

    def __post_init__(self) -> None:
        relation = named(self.relation, TypeRelation, what="the relation of a type cue")
        object.__setattr__(self, "relation", relation)
        object.__setattr__(self, "type", check_short_name(self.type, what="the type of a cue"))


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeCue(Cue):
    """The event's interval against a window: as point sets, or by Allen's relations.

    On the axis `recorded_at` the interval is the instant at which the memory learned of the event.
    """

    relation: SetRelation | AllenRelation
    window: Window
    axis: TimeAxis = TimeAxis.TIME

    def __post_init__(self) -> None:
        relation = time_relation(self.relation, what="the relation of a time cue")
        object.__setattr__(self, "relation", relation)
        object.__setattr__(self, "axis", named(self.axis, TimeAxis, what="the axis of a time cue"))
        if not isinstance(self.window, Window):
            raise InvalidValue(f"a time cue compares with a Window, not with {self.window!r:.80}")


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionCue(Cue):
    """The event's region or subject against a polygon of one frame.

    False for events without that place, or with one in another frame, `disjoint` included.
    `distance` in metres, inclusive, goes with `within_distance` only.
    """

    relation: SpatialRelation
    region: Region
    distance: float | None = None
    place: Place = Place.REGION

    def __post_init__(self) -> None:
        relation = named(self.relation, SpatialRelation, what="the relation of a region cue")
        object.__setattr__(self, "relation", relation)
        object.__setattr__(self, "place", named(self.place, Place, what="the place of a region cue"))
        if not isinstance(self.region, Region):
            raise InvalidValue(f"a region cue compares with a Region(polygon=...), not with {self.region!r:.80}")
        if relation is SpatialRelation.WITHIN_DISTANCE:
            if isinstance(self.distance, bool) or not isinstance(self.distance, int | float):
                raise InvalidValue(
                    f"within_distance needs a distance in metres (int or float), not {self.distance!r:.80}"
                )
            if not 0 <= self.distance <= LIMIT:
                raise InvalidValue(f"the distance must be between 0 and {LIMIT:g} m, not {self.distance!r}")
            object.__setattr__(self, "distance", float(self.distance))
        elif self.distance is not None:
            raise InvalidValue(f"a distance goes with within_distance, not with {relation.value!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class FeaturesCue(Cue):
    """The event's set of (name, value) pairs against a given set."""

    relation: SetRelation
    features: tuple[Feature, ...]

    def __post_init__(self) -> None:
        relation = named(self.relation, SetRelation, what="the relation of a features cue")
        object.__setattr__(self, "relation", relation)
        object.__setattr__(self, "features", as_features(self.features))


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureNamesCue(Cue):
    """The names of the event's features (their projection π1) against a given set."""

    relation: SetRelation
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        relation = named(self.relation, SetRelation, what="the relation of a feature names cue")
        object.__setattr__(self, "relation", relation)
        several = check_several(self.names, what="feature names")
        names = dict.fromkeys(check_name(name, what="a feature name of a cue") for name in several)
        object.__setattr__(self, "names", tuple(names))


@dataclass(frozen=True, slots=True, kw_only=True)
class FeatureCue(Cue):
    """Some value of the feature `name` compares so with `value`; values of another kind never do.

    Numbers compare exactly, strings by code point, bools only by = and !=. `like` is for strings:
    % stands for any text, _ for one character, backslash makes the next character plain.
    """

    name: str
    compare: Comparison
    value: FeatureValue

    def __post_init__(self) -> None:
        object.__setattr__(self, "name", check_name(self.name, what="the feature name of a cue"))
        compare = named(self.compare, Comparison, what="the comparison of a feature cue")
        object.__setattr__(self, "compare", compare)
        object.__setattr__(self, "value", check_value(self.name, self.value))
        kind = kind_of(self.value)
        if kind == "b" and compare not in (Comparison.EQ, Comparison.NE):
            raise InvalidValue(f"truth values compare by = and != only, not by {compare.value!r}")
        if compare is Comparison.LIKE:
            if kind != "s":
                raise InvalidValue(f"like compares text with a pattern, not with {self.value!r}")
            if (len(str(self.value)) - len(str(self.value).rstrip("\\"))) % 2:
                raise InvalidValue("a like pattern cannot end with a single backslash: write two for a plain one")


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadCue(Cue):
    """The event's payload has exactly these bytes; the media type does not count."""

    data: bytes

    def __post_init__(self) -> None:
        if not isinstance(self.data, bytes | bytearray | memoryview):
            raise InvalidValue(f"a payload cue compares bytes, not {type(self.data).__name__}")
        object.__setattr__(self, "data", bytes(self.data))


@dataclass(frozen=True, slots=True, kw_only=True)
class AgentCue(Cue):
    """The event is seen from this agent's perspective."""

    agent: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "agent", check_short_name(self.agent, what="the agent of a cue"))


@dataclass(frozen=True, slots=True, kw_only=True)
class DurationCue(Cue):
    """The event's duration compares so with a given one; false while it is still going on."""

    compare: Comparison
    duration: timedelta

    def __post_init__(self) -> None:
        compare = named(self.compare, Comparison, what="the comparison of a duration cue")
        if compare is Comparison.LIKE:
            raise InvalidValue("durations compare by = != < <= > >=, not by 'like'")
        object.__setattr__(self, "compare", compare)
        if not isinstance(self.duration, timedelta):
            raise InvalidValue(f"a duration is a timedelta, not {self.duration!r:.80}")


@dataclass(frozen=True, slots=True, kw_only=True)
class KinCue(Cue):
    """The event's parts or wholes against a set of uids; the direct ones, or all of Def 4 when transitive."""

    relation: SetRelation
    uids: tuple[UUID, ...]
    kin: Kin = Kin.PARTS
    transitive: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "kin", named(self.kin, Kin, what="the relatives of a cue"))
        relation = named(self.relation, SetRelation, what=f"the relation of a {self.kin.value} cue")
        object.__setattr__(self, "relation", relation)
        object.__setattr__(self, "uids", _uids(self.uids))
        if not isinstance(self.transitive, bool):
            raise InvalidValue(f"transitive is True or False, not {self.transitive!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class UidCue(Cue):
    """The event is one of these."""

    uids: tuple[UUID, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "uids", _uids(self.uids))


def _uids(given: Iterable[UUID]) -> tuple[UUID, ...]:
    return tuple(dict.fromkeys(as_uids(given, what="the uids of a cue")))


Condition = (
    TypeCue
    | TimeCue
    | RegionCue
    | FeaturesCue
    | FeatureNamesCue
    | FeatureCue
    | PayloadCue
    | AgentCue
    | DurationCue
    | KinCue
    | UidCue
)
"""The nodes that say something of an event themselves."""

Node = And | Or | Not | Condition
"""Every cue node there is: `match` statements over it end in `assert_never`."""


def node(cue: Cue) -> Node:
    """`cue` as a member of the closed union, for exhaustive matching."""
    assert isinstance(cue, Node)  # noqa: S101 - Cue has no other subclasses
    return cue
