"""Short ways to write cues in Python: `is_a("Row") & within(5.0, beacon) & time("during", begin, end)`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime, timedelta
from typing import Literal
from uuid import UUID

from elm.arguments import as_uids, check_several
from elm.cues.algebra import (
    AgentCue,
    And,
    Cue,
    DurationCue,
    FeatureCue,
    FeatureNamesCue,
    FeaturesCue,
    KinCue,
    Or,
    PayloadCue,
    RegionCue,
    TimeCue,
    TypeCue,
    UidCue,
)
from elm.cues.relations import Comparison, Kin, Place, SetRelation, TimeAxis, TypeRelation, named, time_relation
from elm.errors import InvalidValue
from elm.features import FeatureValue, as_features
from elm.geometry import Region, SpatialRelation
from elm.interval import AllenRelation, Interval, Window

SetName = SetRelation | Literal["equal", "subset", "superset", "intersects", "disjoint"]
AllenName = (
    AllenRelation
    | Literal[
        "before",
        "after",
        "meets",
        "met_by",
        "overlaps",
        "overlapped_by",
        "starts",
        "started_by",
        "during",
        "contains",
        "finishes",
        "finished_by",
        "equals",
    ]
)
PlaceName = SpatialRelation | Literal["equal", "subset", "superset", "intersects", "disjoint", "touches"]
CompareName = Comparison | Literal["=", "!=", "<", "<=", ">", ">=", "like"]


def everything() -> Cue:
    """Every event."""
    return And()


def all_of(*cues: Cue) -> Cue:
    """All of these hold; of none: everything."""
    return And(args=cues)


def any_of(*cues: Cue) -> Cue:
    """Some of these holds; of none: nothing."""
    return Or(args=cues)


def exactly(type_name: str) -> Cue:
    """Events of this type, not of its sub-types."""
    return TypeCue(relation=TypeRelation.EXACTLY, type=type_name)


def is_a(type_name: str) -> Cue:
    """Events of this type or of any of its sub-types."""
    return TypeCue(relation=TypeRelation.IS_A, type=type_name)


def time(
    relation: SetName | AllenName,
    begin: datetime | Interval | None = None,
    end: datetime | None = None,
) -> Cue:
    """Events whose interval stands in `relation` to [begin, end]; None is unbounded; an Interval gives both.

    `before`, `after`, `meets` and `met_by` compare with one moment as well: where only one is given, in either place,
    it is both begin and end.
    """
    known = _time_relation(relation)
    return TimeCue(relation=known, window=_window(known, begin, end))


def recorded(
    relation: SetName | AllenName,
    begin: datetime | Interval | None = None,
    end: datetime | None = None,
) -> Cue:
    """Events that the memory learned of at an instant in `relation` to [begin, end], which are as those of `time`."""
    known = _time_relation(relation)
    return TimeCue(relation=known, window=_window(known, begin, end), axis=TimeAxis.RECORDED_AT)


def region(relation: PlaceName, place: Region) -> Cue:
    """Events whose observer's region stands in `relation` to `place`."""
    return RegionCue(relation=_place_relation(relation), region=place)


def subject(relation: PlaceName, place: Region) -> Cue:
    """Events whose subject's region stands in `relation` to `place`."""
    return RegionCue(relation=_place_relation(relation), region=place, place=Place.SUBJECT)


def within(metres: float, place: Region) -> Cue:
    """Events whose observer was at most `metres` from `place`."""
    return RegionCue(relation=SpatialRelation.WITHIN_DISTANCE, region=place, distance=metres)


def subject_within(metres: float, place: Region) -> Cue:
    """Events whose subject was at most `metres` from `place`."""
    return RegionCue(relation=SpatialRelation.WITHIN_DISTANCE, region=place, distance=metres, place=Place.SUBJECT)


def features(relation: SetName, given: Mapping[str, object] | Iterable[tuple[str, object]]) -> Cue:
    """Events whose whole set of (name, value) pairs stands in `relation` to the given one."""
    return FeaturesCue(relation=_set_relation(relation), features=as_features(given))


def feature_names(relation: SetName, names: Iterable[str]) -> Cue:
    """Events whose set of feature names stands in `relation` to the given one."""
    return FeatureNamesCue(relation=_set_relation(relation), names=tuple(check_several(names, what="feature names")))


def feature(name: str, compare: CompareName, value: FeatureValue) -> Cue:
    """Events with some value of `name` that compares so with `value`."""
    return FeatureCue(name=name, compare=_comparison(compare), value=value)


def payload(data: bytes) -> Cue:
    """Events whose payload has exactly these bytes."""
    return PayloadCue(data=data)


def agent(name: str) -> Cue:
    """Events from this agent's perspective."""
    return AgentCue(agent=name)


def lasting(compare: CompareName, duration: timedelta) -> Cue:
    """Events whose duration compares so; false while they are still going on."""
    return DurationCue(compare=_comparison(compare), duration=duration)


def parts(relation: SetName, uids: Iterable[UUID | str], *, transitive: bool = False) -> Cue:
    """Events whose sub-events stand in `relation` to the given ones."""
    return KinCue(relation=_set_relation(relation), uids=_uids(uids), kin=Kin.PARTS, transitive=transitive)


def wholes(relation: SetName, uids: Iterable[UUID | str], *, transitive: bool = False) -> Cue:
    """Events whose super-events stand in `relation` to the given ones."""
    return KinCue(relation=_set_relation(relation), uids=_uids(uids), kin=Kin.WHOLES, transitive=transitive)


def uid(*uids: UUID | str) -> Cue:
    """Exactly these events."""
    for each in uids:
        if isinstance(each, Iterable) and not isinstance(each, str):
            raise InvalidValue(
                f"uids are given one after the other, as uid(one, two) or uid(*several), not {each!r:.80}"
            )
    return UidCue(uids=_uids(uids))


_OF_A_MOMENT = frozenset({AllenRelation.BEFORE, AllenRelation.AFTER, AllenRelation.MEETS, AllenRelation.MET_BY})
"""Relations that look at one end of the window: unbounded there, it is in them to no event."""


def _window(relation: SetRelation | AllenRelation, begin: datetime | Interval | None, end: datetime | None) -> Window:
    if isinstance(begin, Interval):
        if end is not None:
            raise InvalidValue(f"{begin} has an end: give an interval, or begin and end, not {end!r} beside it")
        return Window.of(begin)
    if isinstance(begin, tuple | list):
        raise InvalidValue(f"begin and end are given one after the other, or as one Interval, not as {begin!r:.80}")
    if relation in _OF_A_MOMENT:
        return Window(begin=end if begin is None else begin, end=begin if end is None else end)
    return Window(begin=begin, end=end)


def _set_relation(given: str) -> SetRelation:
    return named(given, SetRelation, what="a set relation")


def _time_relation(given: str) -> SetRelation | AllenRelation:
    return time_relation(given, what="a relation in time")


def _place_relation(given: str) -> SpatialRelation:
    return named(given, SpatialRelation, what="a relation in space")


def _comparison(given: str) -> Comparison:
    return named(given, Comparison, what="a comparison")


def _uids(given: Iterable[UUID | str]) -> tuple[UUID, ...]:
    return as_uids(given, what="the uids of a cue")
