"""Cues as JSON objects and back, in the exchange format of docs/formats.md; unknown keys are refused."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from types import MappingProxyType
from typing import Any, assert_never

from elm.cues.algebra import (
    DEPTH_LIMIT,
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
from elm.cues.relations import Comparison, Kin, Place, SetRelation, TimeAxis, TypeRelation, named, time_relation
from elm.errors import InvalidValue
from elm.features import as_features
from elm.fields import Fields, base64_text, shown, time_text
from elm.geometry import Region, SpatialRelation
from elm.interval import Window, parse_time


def cue_to_json(cue: Cue) -> dict[str, Any]:
    """The JSON object that `cue_from_json` reads as the same cue."""
    match node(cue):
        case And(args=args):
            return {"op": "and", "args": [cue_to_json(arg) for arg in args]}
        case Or(args=args):
            return {"op": "or", "args": [cue_to_json(arg) for arg in args]}
        case Not(arg=arg):
            return {"op": "not", "arg": cue_to_json(arg)}
        case TypeCue(relation=relation, type=name):
            return {"op": "type", "relation": relation.value, "type": name}
        case TimeCue(relation=time_relation, window=window, axis=axis):
            bounds = [None if t is None else time_text(t) for t in (window.begin, window.end)]
            return {"op": axis.value, "relation": time_relation.value, "interval": bounds}
        case RegionCue(relation=spatial, region=region, distance=distance, place=place):
            given: dict[str, Any] = {"op": place.value, "relation": spatial.value, "frame": region.frame}
            given["polygon"] = region.geojson
            return given if distance is None else {**given, "distance": distance}
        case FeaturesCue(relation=set_relation, features=features):
            return {"op": "features", "relation": set_relation.value, "features": [list(f) for f in features]}
        case FeatureNamesCue(relation=set_relation, names=names):
            return {"op": "feature_names", "relation": set_relation.value, "names": list(names)}
        case FeatureCue(name=name, compare=compare, value=value):
            return {"op": "feature", "name": name, "compare": compare.value, "value": value}
        case PayloadCue(data=data):
            return {"op": "payload", "base64": base64_text(data)}
        case AgentCue(agent=agent):
            return {"op": "agent", "agent": agent}
        case DurationCue(compare=compare, duration=duration):
            return {"op": "duration", "compare": compare.value, **_seconds(duration)}
        case KinCue(relation=set_relation, uids=uids, kin=kin, transitive=transitive):
            named_uids = [str(uid) for uid in uids]
            return {
                "op": kin.value,
                "relation": set_relation.value,
                "uids": named_uids,
                "transitive": transitive,
            }
        case UidCue(uids=uids):
            return {"op": "uid", "uids": [str(uid) for uid in uids]}
        case unknown:
            assert_never(unknown)


def cue_from_json(given: Any) -> Cue:
    """The cue a JSON object stands for; what is wrong with it is named."""
    return _read(given, 0)


def _read(given: Any, depth: int) -> Cue:
    if depth > DEPTH_LIMIT:
        raise InvalidValue(f"a cue may nest and/or/not at most {DEPTH_LIMIT} deep: write it with fewer levels")
    fields = Fields(given, what="a cue")
    op = fields.text("op")
    if op in ("and", "or"):
        args = tuple(_read(arg, depth + 1) for arg in fields.items("args"))
        fields.finish()
        return And(args=args) if op == "and" else Or(args=args)
    if op == "not":
        arg = _read(fields.take("arg"), depth + 1)
        fields.finish()
        return Not(arg=arg)
    read = _READ.get(op)
    if read is None:
        raise InvalidValue(f"unknown cue op {op!r}: choose one of and, or, not, {', '.join(_READ)}")
    return read(Fields(given, what=f"a cue with op {op!r}"))


def _relation(fields: Fields) -> SetRelation:
    return named(fields.text("relation"), SetRelation, what=fields.what_of("relation"))


def _type(fields: Fields) -> Cue:
    relation = named(fields.text("relation"), TypeRelation, what=fields.what_of("relation"))
    return TypeCue(relation=relation, type=fields.text("type"))


def _time(fields: Fields) -> Cue:
    axis = TimeAxis(fields.text("op"))
    relation = time_relation(fields.text("relation"), what=fields.what_of("relation"))
    bounds = fields.items("interval")
    if len(bounds) != 2:
        raise InvalidValue(f"{fields.what_of('interval')} is a pair [BEGIN, END], each a time or null")
    begin, end = (_moment(bound, fields) for bound in bounds)
    return TimeCue(relation=relation, window=Window(begin=begin, end=end), axis=axis)


def _moment(bound: Any, fields: Fields) -> datetime | None:
    return None if bound is None else parse_time(bound, what=fields.what_of("interval"))


def _region(fields: Fields) -> Cue:
    place = Place(fields.text("op"))
    relation = named(fields.text("relation"), SpatialRelation, what=fields.what_of("relation"))
    region = Region.from_geojson(fields.take("polygon"), frame=fields.text("frame"))
    return RegionCue(relation=relation, region=region, distance=fields.optional("distance"), place=place)


def _features(fields: Fields) -> Cue:
    return FeaturesCue(relation=_relation(fields), features=as_features(fields.items("features")))


def _feature_names(fields: Fields) -> Cue:
    return FeatureNamesCue(relation=_relation(fields), names=tuple(fields.texts("names")))


def _feature(fields: Fields) -> Cue:
    compare = named(fields.text("compare"), Comparison, what=fields.what_of("compare"))
    return FeatureCue(name=fields.text("name"), compare=compare, value=fields.take("value"))


def _payload(fields: Fields) -> Cue:
    return PayloadCue(data=fields.base64("base64"))


def _agent(fields: Fields) -> Cue:
    return AgentCue(agent=fields.text("agent"))


def _duration(fields: Fields) -> Cue:
    compare = named(fields.text("compare"), Comparison, what=fields.what_of("compare"))
    seconds = fields.number("seconds")
    micros = 0 if fields.optional("microseconds") is None else fields.number("microseconds")
    if not isinstance(micros, int):
        raise InvalidValue(f"{fields.what_of('microseconds')} must be a whole number, not {shown(micros)}")
    try:
        duration = timedelta(seconds=seconds) + timedelta(microseconds=micros)
    except (OverflowError, ValueError) as error:
        raise InvalidValue(f"{fields.what_of('seconds')} is out of range: {shown(seconds)}") from error
    return DurationCue(compare=compare, duration=duration)


def _seconds(duration: timedelta) -> dict[str, int | float]:
    """A duration in seconds; where one number would lose the last digits, whole ones and microseconds beside them."""
    whole, micros = divmod(duration // timedelta(microseconds=1), 10**6)
    if micros == 0:
        return {"seconds": whole}
    if abs(whole) < _EXACT_SECONDS:
        return {"seconds": duration.total_seconds()}
    return {"seconds": whole, "microseconds": micros}


_EXACT_SECONDS = 10**8
"""Up to so many seconds, three years, a JSON number has all microseconds however it is read."""


def _kin(fields: Fields) -> Cue:
    kin = Kin(fields.text("op"))
    transitive = fields.optional("transitive", False)
    return KinCue(relation=_relation(fields), uids=fields.uids("uids"), kin=kin, transitive=transitive)


def _uid(fields: Fields) -> Cue:
    return UidCue(uids=fields.uids("uids"))


def _finished(read: Callable[[Fields], Cue]) -> Callable[[Fields], Cue]:
    def complete(fields: Fields) -> Cue:
        fields.take("op")
        cue = read(fields)
        fields.finish()
        return cue

    return complete


_READ = MappingProxyType(
    {
        op: _finished(read)
        for op, read in {
            "type": _type,
            "time": _time,
            "recorded_at": _time,
            "region": _region,
            "subject": _region,
            "features": _features,
            "feature_names": _feature_names,
            "feature": _feature,
            "payload": _payload,
            "agent": _agent,
            "duration": _duration,
            "parts": _kin,
            "wholes": _kin,
            "uid": _uid,
        }.items()
    }
)
