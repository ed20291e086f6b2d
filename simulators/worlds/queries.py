"""The query simulator of the paper (VI-B): cues from fields of stored events, in the 27 classes of Definition 14."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from uuid import UUID

from elm.cues.algebra import And, Cue, FeatureNamesCue, FeaturesCue, KinCue, PayloadCue, RegionCue, TimeCue, TypeCue
from elm.cues.relations import Kin, Place, SetRelation, TimeAxis, TypeRelation
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.geometry import SpatialRelation
from elm.interval import Window

SET_FIELDS = ("time", "region", "parts", "wholes", "features", "feature_names")
SET_RELATIONS = ("equal", "subset", "superset", "intersects")
CLASSES = (
    "type.exactly",
    "type.is_a",
    "payload.equal",
    *(f"{field}.{relation}" for field in SET_FIELDS for relation in SET_RELATIONS),
)
"""The one-component classes, as FIELD.RELATION."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedQuery:
    """A cue, the classes of its components in order, and the event whose fields it was made of."""

    classes: tuple[str, ...]
    cue: Cue
    source: UUID


def simulate_queries(events: Sequence[StoredEvent], *, seed: int, components: int = 1) -> Iterator[SimulatedQuery]:
    """Cues without end, from events drawn with equal probability; `events` may grow between one and the next.

    Each is of one class drawn uniformly, or of several that speak of different fields. Classes of a
    field that the drawn event lacks are not drawn.
    """
    if not 1 <= components <= 1 + len(SET_FIELDS):
        raise InvalidValue(f"a simulated cue has 1 to {1 + len(SET_FIELDS)} components, not {components}")
    chance = random.Random(seed)
    while True:
        event = chance.choice(events)
        open_classes = [name for name in CLASSES if _has(event, _field(name))]
        chosen: list[str] = []
        while open_classes and len(chosen) < components:
            chosen.append(chance.choice(open_classes))
            open_classes = [name for name in open_classes if _field(name) != _field(chosen[-1])]
        cues = [cue_of(name, event) for name in chosen]
        cue = cues[0] if components == 1 else And(args=tuple(cues))
        yield SimulatedQuery(classes=tuple(chosen), cue=cue, source=event.uid)


def cue_of(name: str, event: StoredEvent) -> Cue:
    """The cue of class `name` whose value is that field of `event`."""
    if name not in CLASSES:
        raise InvalidValue(f"{name!r} is not a class of cues: choose one of {', '.join(CLASSES)}")
    field, _, relation = name.partition(".")
    if field == "type":
        return TypeCue(relation=TypeRelation(relation), type=event.type)
    if field == "payload" and event.payload is not None:
        return PayloadCue(data=event.payload.data)
    if field == "time":
        return TimeCue(relation=SetRelation(relation), window=Window.of(event.interval))
    if field == "region" and event.region is not None:
        return RegionCue(relation=SpatialRelation(relation), region=event.region)
    if field == "features":
        return FeaturesCue(relation=SetRelation(relation), features=event.features)
    if field == "feature_names":
        return FeatureNamesCue(relation=SetRelation(relation), names=tuple(known for known, _ in event.features))
    if field in ("parts", "wholes"):
        uids = event.parts if field == "parts" else event.wholes
        return KinCue(relation=SetRelation(relation), uids=uids, kin=Kin(field))
    raise InvalidValue(f"event {event.uid} has no {field} to make a cue of: draw another")


def classes_of(cue: Cue) -> tuple[str, ...]:
    """The classes of the components of a cue, read off the cue alone."""
    if isinstance(cue, And):
        return tuple(name for arg in cue.args for name in classes_of(arg))
    match cue:
        case TypeCue(relation=type_relation):
            name = f"type.{type_relation.value}"
        case PayloadCue():
            name = "payload.equal"
        case TimeCue(relation=time_relation, axis=TimeAxis.TIME):
            name = f"time.{time_relation.value}"
        case RegionCue(relation=spatial, place=Place.REGION):
            name = f"region.{spatial.value}"
        case FeaturesCue(relation=relation):
            name = f"features.{relation.value}"
        case FeatureNamesCue(relation=relation):
            name = f"feature_names.{relation.value}"
        case KinCue(relation=relation, kin=kin, transitive=False):
            name = f"{kin.value}.{relation.value}"
        case _:
            name = "none"
    if name not in CLASSES:
        raise InvalidValue(f"the cue is of none of the {len(CLASSES)} classes: {cue!r:.80}")
    return (name,)


def _field(name: str) -> str:
    return name.partition(".")[0]


def _has(event: StoredEvent, field: str) -> bool:
    return field not in ("payload", "region") or getattr(event, field) is not None
