"""Random memories and cues for the property tests, from pools so small that coincidences are frequent."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from types import MappingProxyType
from typing import Any
from uuid import UUID

from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from shapely.geometry import Polygon

from elm import cues
from elm.cues.algebra import Cue
from elm.cues.relations import Comparison, SetRelation
from elm.event import Event, Payload
from elm.features import FeatureValue
from elm.geometry import Region, SpatialRelation
from elm.interval import AllenRelation
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span

# The pools

TYPE_NAMES = ("Thing", "Action", "Motion", "Grasp", "Noise")
"""Every random memory has these types, with random parents."""

UIDS = tuple(UUID(int=number) for number in range(1, 13))
"""Events of random memories have these uids; cues also name ones that no event has."""

SECONDS = (0, 1, 2, 2.000001, 3, 4)
LENGTHS = (0, 0, 0.000001, 1, 2, None)
AGENTS = ("armar6", "armar7")
FRAMES = ("map", "odom")
NAMES = ("a", "b", "A")
VALUES: tuple[FeatureValue, ...] = (
    *(0, 1, -1, 2, 10, 1.0, -0.0, 0.5, 2**53, 2**53 + 1, float(2**53), 2.0**60, 2**60),
    *(True, False),
    *("", "1", "a", "A", "b%", "b_", "ä", "10"),
)
PATTERNS = ("%", "_", "a%", "b\\%", "b\\_", "_%_", "", "A")
PAYLOADS = (b"", b"a", b"b")
OUTLINES: tuple[Polygon, ...] = (
    *(Polygon([(x, y), (x + side, y), (x + side, y + side), (x, y + side)]) for x, y, side in (
        (0, 0, 4),
        (4, 0, 4),
        (4, 4, 4),
        (1, 1, 2),
        (0, 0, 2),
        (6, 6, 2),
        (0, 0, 8),
        (2, 2, 4),
    )),
    Polygon([(0, 0), (4, 0), (4, 2), (4, 4), (0, 4)]),
    Polygon([(0, 0), (4, 0), (0, 4)]),
    Polygon([(4, 0), (4, 4), (0, 4)]),
    Polygon([(0, 0), (8, 0), (8, 8), (0, 8)], [[(2, 2), (6, 2), (6, 6), (2, 6)]]),
    Polygon([(0, 0), (8, 0), (8, 1), (1, 1), (1, 8), (0, 8)]),
)  # fmt: skip
DISTANCES = (0, 0.25, 1.25, 2.25, 4.25, 20)
"""No two outlines with corners on whole metres are so far apart, so that no digit decides."""


def regions() -> SearchStrategy[Region]:
    """Outlines on whole metres, often the same, touching or nested."""
    return st.builds(
        lambda outline, frame: Region(polygon=outline, frame=frame),
        st.sampled_from(OUTLINES),
        st.sampled_from((*FRAMES, FRAMES[0], FRAMES[0])),
    )


def feature_pairs(*, max_size: int = 4) -> SearchStrategy[list[tuple[str, FeatureValue]]]:
    """Features, often several of one name and values that look alike."""
    return st.lists(st.tuples(st.sampled_from(NAMES), st.sampled_from(VALUES)), max_size=max_size)


# Memories


@dataclass(frozen=True, slots=True, kw_only=True)
class Story:
    """What a random memory was told: its types, and its events in an order in which parts come first."""

    types: tuple[EventType, ...]
    arrivals: tuple[Arrival, ...]


def taxonomies() -> SearchStrategy[tuple[EventType, ...]]:
    """The types of `TYPE_NAMES` as a random acyclic hierarchy with several parents."""
    parents = [
        st.lists(st.sampled_from(TYPE_NAMES[:index]), unique=True, max_size=2) if index else st.just([])
        for index in range(len(TYPE_NAMES))
    ]
    return st.tuples(*parents).map(
        lambda drawn: tuple(
            EventType(name=name, parents=tuple(above)) for name, above in zip(TYPE_NAMES, drawn, strict=True)
        )
    )


def _atomic(uid: UUID) -> SearchStrategy[Event]:
    return st.builds(
        lambda begin, length, **fields: Event(
            uid=uid, interval=span(begin, None if length is None else begin + length), **fields
        ),
        begin=st.sampled_from(SECONDS),
        length=st.sampled_from(LENGTHS),
        type=st.sampled_from(TYPE_NAMES),
        region=st.none() | regions(),
        subject=st.none() | regions(),
        features=feature_pairs(),
        agent=st.none() | st.sampled_from(AGENTS),
        payload=st.none() | st.sampled_from(PAYLOADS).map(lambda data: Payload(data=data)),
    )


def _complex(uid: UUID, earlier: Sequence[UUID]) -> SearchStrategy[Event]:
    return st.builds(
        Event,
        uid=st.just(uid),
        type=st.sampled_from(TYPE_NAMES),
        parts=st.lists(st.sampled_from(earlier), min_size=1, max_size=3, unique=True),
        features=feature_pairs(max_size=2),
        agent=st.none() | st.sampled_from(AGENTS),
    )


@st.composite
def stories(draw: st.DrawFn, *, max_events: int = 10) -> Story:
    """A random memory: atomic, open and complex events over earlier ones."""
    types = draw(taxonomies())
    arrivals: list[Arrival] = []
    for index in range(draw(st.integers(0, max_events))):
        uid, earlier = UIDS[index], UIDS[:index]
        is_complex = bool(earlier) and draw(st.integers(0, 2)) == 0
        event = draw(_complex(uid, earlier) if is_complex else _atomic(uid))
        arrivals.append(Arrival(event=event, recorded_at=at(draw(st.sampled_from(SECONDS)))))
    return Story(types=types, arrivals=tuple(arrivals))


# Cues, class by class

CueClass = Callable[[Sequence[str]], SearchStrategy[Cue]]
"""Random cues of one class over the given type names."""

PAPER_SETS = (SetRelation.EQUAL, SetRelation.SUBSET, SetRelation.SUPERSET, SetRelation.INTERSECTS)
_BOUNDS = st.none() | st.sampled_from(SECONDS).map(at)
_UID_SETS = st.lists(st.sampled_from(UIDS), max_size=3)


def _windows() -> SearchStrategy[tuple[Any, Any]]:
    return st.tuples(_BOUNDS, _BOUNDS).map(
        lambda drawn: drawn if None in drawn else (min(drawn), max(drawn))  # type: ignore[type-var]
    )


def _time(build: Callable[..., Cue], relation: str) -> CueClass:
    return lambda _: _windows().map(lambda bounds: build(relation, *bounds))


def _place(build: Callable[..., Cue], relation: str) -> CueClass:
    return lambda _: regions().map(lambda region: build(relation, region))


def _within(build: Callable[..., Cue]) -> CueClass:
    return lambda _: st.builds(build, st.sampled_from(DISTANCES), regions())


def _features(relation: SetRelation) -> CueClass:
    return lambda _: feature_pairs(max_size=3).map(lambda pairs: cues.features(relation, pairs))


def _feature_names(relation: SetRelation) -> CueClass:
    return lambda _: st.lists(st.sampled_from(NAMES), max_size=3).map(lambda names: cues.feature_names(relation, names))


def _feature(compare: Comparison) -> CueClass:
    if compare is Comparison.LIKE:
        values: SearchStrategy[FeatureValue] = st.sampled_from(PATTERNS)
    elif compare in (Comparison.EQ, Comparison.NE):
        values = st.sampled_from(VALUES)
    else:
        values = st.sampled_from([value for value in VALUES if not isinstance(value, bool)])
    return lambda _: st.builds(lambda name, value: cues.feature(name, compare, value), st.sampled_from(NAMES), values)


def _duration(compare: Comparison) -> CueClass:
    return lambda _: st.sampled_from((-1, 0, 0.000001, 1, 2)).map(
        lambda seconds: cues.lasting(compare, timedelta(seconds=seconds))
    )


def _kin(build: Callable[..., Cue], relation: SetRelation, *, transitive: bool) -> CueClass:
    return lambda _: _UID_SETS.map(lambda uids: build(relation, uids, transitive=transitive))


PAPER_CLASSES: Mapping[str, CueClass] = MappingProxyType(
    {
        "type.exactly": lambda names: st.sampled_from(list(names)).map(cues.exactly),
        "type.is_a": lambda names: st.sampled_from(list(names)).map(cues.is_a),
        "payload.equal": lambda _: st.sampled_from((*PAYLOADS, b"c")).map(cues.payload),
        **{f"time.{relation}": _time(cues.time, relation) for relation in PAPER_SETS},
        **{f"region.{relation}": _place(cues.region, relation) for relation in PAPER_SETS},
        **{f"parts.{relation}": _kin(cues.parts, relation, transitive=False) for relation in PAPER_SETS},
        **{f"wholes.{relation}": _kin(cues.wholes, relation, transitive=False) for relation in PAPER_SETS},
        **{f"features.{relation}": _features(relation) for relation in PAPER_SETS},
        **{f"feature_names.{relation}": _feature_names(relation) for relation in PAPER_SETS},
    }
)
"""The paper's 27 one-component classes (Def 14), by the names they have everywhere."""

_IN_TIME = (*SetRelation, *AllenRelation)
_IN_SPACE = tuple(relation for relation in SpatialRelation if relation is not SpatialRelation.WITHIN_DISTANCE)

FURTHER_CLASSES: Mapping[str, CueClass] = MappingProxyType(
    {
        "time.disjoint": _time(cues.time, SetRelation.DISJOINT),
        **{f"time.{relation}": _time(cues.time, relation) for relation in AllenRelation},
        **{f"recorded_at.{relation}": _time(cues.recorded, relation) for relation in _IN_TIME},
        "region.disjoint": _place(cues.region, SpatialRelation.DISJOINT),
        "region.touches": _place(cues.region, SpatialRelation.TOUCHES),
        "region.within_distance": _within(cues.within),
        **{f"subject.{relation}": _place(cues.subject, relation) for relation in _IN_SPACE},
        "subject.within_distance": _within(cues.subject_within),
        "features.disjoint": _features(SetRelation.DISJOINT),
        "feature_names.disjoint": _feature_names(SetRelation.DISJOINT),
        **{f"feature.{compare}": _feature(compare) for compare in Comparison},
        "agent": lambda _: st.sampled_from((*AGENTS, "nobody")).map(cues.agent),
        **{f"duration.{compare}": _duration(compare) for compare in Comparison if compare is not Comparison.LIKE},
        "parts.disjoint": _kin(cues.parts, SetRelation.DISJOINT, transitive=False),
        "wholes.disjoint": _kin(cues.wholes, SetRelation.DISJOINT, transitive=False),
        **{f"parts.{relation}, transitive": _kin(cues.parts, relation, transitive=True) for relation in SetRelation},
        **{f"wholes.{relation}, transitive": _kin(cues.wholes, relation, transitive=True) for relation in SetRelation},
        "uid": lambda _: _UID_SETS.map(lambda uids: cues.uid(*uids)),
        "everything": lambda _: st.just(cues.everything()),
        "nothing": lambda _: st.just(cues.any_of()),
    }
)
"""What elm asks beyond the paper."""

CUE_CLASSES: Mapping[str, CueClass] = MappingProxyType({**PAPER_CLASSES, **FURTHER_CLASSES})


def single_cues(type_names: Sequence[str]) -> SearchStrategy[Cue]:
    """One condition, of any class."""
    return st.sampled_from(list(CUE_CLASSES.values())).flatmap(lambda cue_class: cue_class(type_names))


def combined_cues(type_names: Sequence[str]) -> SearchStrategy[Cue]:
    """Conditions of any class under and, or and not."""
    return st.recursive(
        single_cues(type_names),
        lambda inner: (
            st.lists(inner, max_size=3).map(lambda args: cues.all_of(*args))
            | st.lists(inner, max_size=3).map(lambda args: cues.any_of(*args))
            | inner.map(lambda arg: ~arg)
        ),
        max_leaves=6,
    )
