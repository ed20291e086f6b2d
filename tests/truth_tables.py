"""What every relation means, as hand-made examples that tell each relation from each other one of its family.

A row is one event, the same thing asked in every relation of a family, and the relations that hold. The
tables are data: `match` is judged by them, and so is every store.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID

from shapely.geometry import Polygon

from elm import cues
from elm.cues.algebra import Cue, KinCue, TimeCue
from elm.cues.relations import Comparison, Kin, SetRelation, TimeAxis
from elm.event import Event, Payload
from elm.features import FeatureValue
from elm.geometry import Region
from elm.interval import AllenRelation, Interval, Window
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span, window


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One example: which of the cues, by the relation they ask, the event matches."""

    why: str
    event: UUID
    asked: Mapping[str, Cue]
    holds: frozenset[str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """The examples of one family of relations, and the memory they are about, parts before wholes.

    `alike` lists relations that mean the same for the events of this table; all others are told apart.
    """

    family: str
    types: tuple[EventType, ...]
    arrivals: tuple[Arrival, ...]
    rows: tuple[Row, ...]
    alike: tuple[frozenset[str], ...] = ()

    @property
    def relations(self) -> list[str]:
        """All relations of the family."""
        return list(dict.fromkeys(relation for row in self.rows for relation in row.asked))


PLAIN = (EventType(name="Event"),)
NOON = span(0, 1)


def _table(
    family: str,
    examples: Iterable[tuple[str, Event | Arrival, Mapping[str, Cue], set[str]]],
    *,
    types: tuple[EventType, ...] = PLAIN,
    alike: Iterable[set[str]] = (),
) -> Table:
    """A table in which each example has an event of its own."""
    arrivals: list[Arrival] = []
    rows: list[Row] = []
    for number, (why, given, asked, holds) in enumerate(examples, start=1):
        arrival = given if isinstance(given, Arrival) else Arrival(event=given)
        uid = UUID(int=number)
        arrivals.append(replace(arrival, event=replace(arrival.event, uid=uid)))
        assert holds <= asked.keys(), f"{family}: {why}"
        rows.append(Row(why=why, event=uid, asked=asked, holds=frozenset(holds)))
    return Table(
        family=family,
        types=types,
        arrivals=tuple(arrivals),
        rows=tuple(rows),
        alike=tuple(frozenset(group) for group in alike),
    )


# Type


def _types() -> Table:
    def asked(name: str) -> dict[str, Cue]:
        return {"exactly": cues.exactly(name), "is_a": cues.is_a(name)}

    def event(name: str) -> Event:
        return Event(type=name, interval=NOON)

    return _table(
        "type",
        [
            ("the type itself", event("Action"), asked("Action"), {"exactly", "is_a"}),
            ("a direct sub-type", event("Grasp"), asked("Action"), {"is_a"}),
            ("a sub-type's sub-type", event("MobileGrasp"), asked("Action"), {"is_a"}),
            ("through the second parent", event("MobileGrasp"), asked("Motion"), {"is_a"}),
            ("the root, by two paths", event("MobileGrasp"), asked("Thing"), {"is_a"}),
            ("a super-type is no sub-type", event("Action"), asked("Grasp"), set()),
            ("a sibling", event("Action"), asked("Motion"), set()),
            ("an unrelated type", event("Noise"), asked("Thing"), set()),
            ("another type by case", event("action"), asked("Action"), set()),
            ("a type that looks like a pattern", event("A%"), asked("Action"), set()),
            ("asked for a type that looks like a pattern", event("Action"), asked("A%"), set()),
            ("the type that looks like a pattern", event("A%"), asked("A%"), {"exactly", "is_a"}),
        ],
        types=(
            EventType(name="Thing"),
            EventType(name="Action", parents=("Thing",)),
            EventType(name="Motion", parents=("Thing",)),
            EventType(name="Grasp", parents=("Action",)),
            EventType(name="Drive", parents=("Motion",)),
            EventType(name="MobileGrasp", parents=("Grasp", "Drive")),
            EventType(name="Noise"),
            EventType(name="action"),
            EventType(name="A%"),
        ),
    )


# Time

_IN_TIME = (*SetRelation, *AllenRelation)
_DAWN, _DUSK = datetime.min.replace(tzinfo=UTC), datetime.max.replace(tzinfo=UTC)


def _in_time(asked_window: Window, axis: TimeAxis) -> dict[str, Cue]:
    return {relation.value: TimeCue(relation=relation, window=asked_window, axis=axis) for relation in _IN_TIME}


def _time() -> Table:
    """Mostly against the window from second 10 to second 20."""
    the_window, from_10, to_20, always = window(10, 20), window(10, None), window(None, 20), window(None, None)
    examples: list[tuple[str, Interval, Window, set[str]]] = [
        # Proper intervals: Allen's thirteen cases.
        ("before", span(0, 5), the_window, {"before", "disjoint"}),
        ("meets: the end is shared", span(0, 10), the_window, {"meets", "intersects"}),
        ("overlaps", span(5, 15), the_window, {"overlaps", "intersects"}),
        ("starts", span(10, 15), the_window, {"starts", "subset", "intersects"}),
        ("during", span(12, 18), the_window, {"during", "subset", "intersects"}),
        ("finishes", span(15, 20), the_window, {"finishes", "subset", "intersects"}),
        ("equals", span(10, 20), the_window, {"equals", "equal", "subset", "superset", "intersects"}),
        ("started by", span(10, 25), the_window, {"started_by", "superset", "intersects"}),
        ("contains", span(5, 25), the_window, {"contains", "superset", "intersects"}),
        ("finished by", span(5, 20), the_window, {"finished_by", "superset", "intersects"}),
        ("overlapped by", span(15, 25), the_window, {"overlapped_by", "intersects"}),
        ("met by: the begin is shared", span(20, 25), the_window, {"met_by", "intersects"}),
        ("after", span(25, 30), the_window, {"after", "disjoint"}),
        # One microsecond decides.
        ("ends a microsecond early", span(0, 9.999999), the_window, {"before", "disjoint"}),
        ("begins a microsecond late", span(20.000001, 25), the_window, {"after", "disjoint"}),
        ("ends a microsecond inside", span(0, 10.000001), the_window, {"overlaps", "intersects"}),
        ("begins a microsecond late inside", span(10.000001, 20), the_window, {"finishes", "subset", "intersects"}),
        ("ends a microsecond early inside", span(10, 19.999999), the_window, {"starts", "subset", "intersects"}),
        # Events that are instants.
        ("an instant before", span(5, 5), the_window, {"before", "disjoint"}),
        ("an instant at the begin", span(10, 10), the_window, {"meets", "starts", "subset", "intersects"}),
        ("an instant within", span(15, 15), the_window, {"during", "subset", "intersects"}),
        ("an instant at the end", span(20, 20), the_window, {"met_by", "finishes", "subset", "intersects"}),
        ("an instant after", span(25, 25), the_window, {"after", "disjoint"}),
        # Windows that are instants.
        ("at the event's begin", span(10, 20), window(10, 10), {"met_by", "started_by", "superset", "intersects"}),
        ("inside the event", span(10, 20), window(15, 15), {"contains", "superset", "intersects"}),
        ("at the event's end", span(10, 20), window(20, 20), {"meets", "finished_by", "superset", "intersects"}),
        (
            "the same instant",
            span(15, 15),
            window(15, 15),
            {"equals", "equal", "meets", "met_by", "subset", "superset", "intersects"},
        ),
        ("another instant", span(15, 15), window(15.000001, 15.000001), {"before", "disjoint"}),
        # Windows without begin.
        ("inside, no begin", span(5, 15), to_20, {"during", "subset", "intersects"}),
        ("up to the end, no begin", span(5, 20), to_20, {"finishes", "subset", "intersects"}),
        ("across the end, no begin", span(5, 25), to_20, {"overlapped_by", "intersects"}),
        ("from the end on, no begin", span(20, 25), to_20, {"met_by", "intersects"}),
        ("behind, no begin", span(25, 30), to_20, {"after", "disjoint"}),
        (
            "the first day there is, no begin",
            Interval(begin=_DAWN, end=at(5)),
            to_20,
            {"during", "subset", "intersects"},
        ),
        # Windows without end.
        ("inside, no end", span(15, 25), from_10, {"during", "subset", "intersects"}),
        ("from the begin on, no end", span(10, 25), from_10, {"starts", "subset", "intersects"}),
        ("across the begin, no end", span(5, 15), from_10, {"overlaps", "intersects"}),
        ("up to the begin, no end", span(5, 10), from_10, {"meets", "intersects"}),
        ("ahead, no end", span(0, 5), from_10, {"before", "disjoint"}),
        (
            "the last day there is is not for ever",
            Interval(begin=at(10), end=_DUSK),
            from_10,
            {"starts", "subset", "intersects"},
        ),
        # A window without bounds.
        ("any time", span(5, 15), always, {"during", "subset", "intersects"}),
        ("any instant", span(5, 5), always, {"during", "subset", "intersects"}),
        # Events still going on.
        ("open, begun before", span(5, None), the_window, {"contains", "superset", "intersects"}),
        ("open, begun with it", span(10, None), the_window, {"started_by", "superset", "intersects"}),
        ("open, begun within", span(15, None), the_window, {"overlapped_by", "intersects"}),
        ("open, begun at its end", span(20, None), the_window, {"met_by", "intersects"}),
        ("open, begun behind", span(25, None), the_window, {"after", "disjoint"}),
        (
            "open equals only open",
            span(10, None),
            from_10,
            {"equals", "equal", "subset", "superset", "intersects"},
        ),
        ("open, begun later than open", span(15, None), from_10, {"finishes", "subset", "intersects"}),
        ("open, begun earlier than open", span(5, None), from_10, {"finished_by", "superset", "intersects"}),
        ("open against no begin", span(5, None), to_20, {"overlapped_by", "intersects"}),
        ("open against its end, no begin", span(20, None), to_20, {"met_by", "intersects"}),
        ("open at any time", span(5, None), always, {"finishes", "subset", "intersects"}),
        (
            "open against the instant of its begin",
            span(10, None),
            window(10, 10),
            {"started_by", "met_by", "superset", "intersects"},
        ),
    ]
    return _table(
        "time",
        [
            # Recorded at another time, which does not count.
            (why, Arrival(event=Event(type="Event", interval=interval), recorded_at=at(-100)), asked, holds)
            for why, interval, given, holds in examples
            for asked in [_in_time(given, TimeAxis.TIME)]
        ],
        alike=[{"equal", "equals"}],
    )


def _recorded_at() -> Table:
    """When the memory learned of an event is an instant, so that five of Allen's relations never hold."""
    examples: list[tuple[str, float, Window, set[str]]] = [
        ("before", 5, window(10, 20), {"before", "disjoint"}),
        ("at the begin", 10, window(10, 20), {"meets", "starts", "subset", "intersects"}),
        ("within", 15, window(10, 20), {"during", "subset", "intersects"}),
        ("at the end", 20, window(10, 20), {"met_by", "finishes", "subset", "intersects"}),
        ("after", 25, window(10, 20), {"after", "disjoint"}),
        ("a microsecond early", 9.999999, window(10, 20), {"before", "disjoint"}),
        (
            "the same instant",
            15,
            window(15, 15),
            {"equals", "equal", "meets", "met_by", "subset", "superset", "intersects"},
        ),
        ("inside, no begin", 15, window(None, 20), {"during", "subset", "intersects"}),
        ("at the end, no begin", 20, window(None, 20), {"met_by", "finishes", "subset", "intersects"}),
        ("behind, no begin", 25, window(None, 20), {"after", "disjoint"}),
        ("inside, no end", 25, window(10, None), {"during", "subset", "intersects"}),
        ("at the begin, no end", 10, window(10, None), {"meets", "starts", "subset", "intersects"}),
        ("ahead, no end", 5, window(10, None), {"before", "disjoint"}),
        ("any time", 15, window(None, None), {"during", "subset", "intersects"}),
    ]
    # Happened at another time, and for long, which does not count.
    happened = Event(type="Event", interval=span(-100, -50))
    return _table(
        "recorded_at",
        [
            (why, Arrival(event=happened, recorded_at=at(seconds)), _in_time(given, TimeAxis.RECORDED_AT), holds)
            for why, seconds, given, holds in examples
        ],
        alike=[
            {"equal", "equals", "superset"},
            {"subset", "intersects"},
            {"overlaps", "overlapped_by", "started_by", "contains", "finished_by"},
        ],
    )


# Places

_BOX = Polygon([(10, 10), (20, 10), (20, 20), (10, 20)])
_AROUND_A_HOLE = Polygon([(0, 0), (30, 0), (30, 30), (0, 30)], [[(10, 10), (20, 10), (20, 20), (10, 20)]])


def _rectangle(xmin: float, ymin: float, xmax: float, ymax: float) -> Polygon:
    return Polygon([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)])


def _placed(place: str, polygon: Polygon | None, frame: str = "map") -> Event:
    """An event with this place, while its other place is the box that is asked about."""
    region = None if polygon is None else Region(polygon=polygon, frame=frame)
    other = {"region": "subject", "subject": "region"}[place]
    places: dict[str, Any] = {place: region, other: Region(polygon=_BOX)}
    return Event(type="Event", interval=NOON, **places)


_PLACE_CUES: Mapping[str, tuple[Callable[..., Cue], Callable[..., Cue]]] = {
    "region": (cues.region, cues.within),
    "subject": (cues.subject, cues.subject_within),
}


def _in_space(place: str, asked_polygon: Polygon) -> dict[str, Cue]:
    """All relations to a polygon, and being at most 1 m away."""
    relation_cue, distance_cue = _PLACE_CUES[place]
    region = Region(polygon=asked_polygon)
    names = ("equal", "subset", "superset", "intersects", "disjoint", "touches")
    return {**{name: relation_cue(name, region) for name in names}, "within_distance": distance_cue(1.0, region)}


def _place(place: str) -> Table:
    """Mostly against the box from (10, 10) to (20, 20)."""
    same = {"equal", "subset", "superset", "intersects", "within_distance"}
    inside = {"subset", "intersects", "within_distance"}
    outside = {"superset", "intersects", "within_distance"}
    across = {"intersects", "within_distance"}
    beside = {"touches", "intersects", "within_distance"}
    examples: list[tuple[str, Polygon | None, str, Polygon, set[str]]] = [
        ("the same box", _BOX, "map", _BOX, same),
        (
            "the same box from another corner, turned, with a point on an edge",
            Polygon([(20, 20), (20, 10), (15, 10), (10, 10), (10, 20)]),
            "map",
            _BOX,
            same,
        ),
        ("inside", _rectangle(12, 12, 18, 18), "map", _BOX, inside),
        ("inside, along an edge", _rectangle(10, 12, 15, 18), "map", _BOX, inside),
        ("inside, in a corner", _rectangle(10, 10, 15, 15), "map", _BOX, inside),
        ("around it", _rectangle(5, 5, 25, 25), "map", _BOX, outside),
        ("around it, along an edge", _rectangle(10, 5, 25, 25), "map", _BOX, outside),
        ("across a corner", _rectangle(15, 15, 25, 25), "map", _BOX, across),
        ("across like a cross", _rectangle(5, 12, 25, 18), "map", _BOX, across),
        ("a shared edge", _rectangle(20, 10, 30, 20), "map", _BOX, beside),
        ("a piece of an edge", _rectangle(20, 12, 30, 14), "map", _BOX, beside),
        ("a shared corner", _rectangle(20, 20, 30, 30), "map", _BOX, beside),
        ("a corner on an edge", Polygon([(20, 15), (25, 10), (25, 20)]), "map", _BOX, beside),
        ("exactly 1 m away", _rectangle(21, 10, 30, 20), "map", _BOX, {"disjoint", "within_distance"}),
        ("a bit more than 1 m away", _rectangle(21.0001, 10, 30, 20), "map", _BOX, {"disjoint"}),
        ("far away", _rectangle(100, 100, 200, 200), "map", _BOX, {"disjoint"}),
        (
            "an angle whose bounds cover the box",
            Polygon([(0, 0), (30, 0), (30, 5), (5, 5), (5, 30), (0, 30)]),
            "map",
            _BOX,
            {"disjoint"},
        ),
        (
            "the box lies in the event's hole",
            Polygon([(0, 0), (30, 0), (30, 30), (0, 30)], [[(5, 5), (25, 5), (25, 25), (5, 25)]]),
            "map",
            _BOX,
            {"disjoint"},
        ),
        ("the box fills the event's hole", _AROUND_A_HOLE, "map", _BOX, beside),
        (
            "around it, but for a hole inside the box",
            Polygon([(0, 0), (30, 0), (30, 30), (0, 30)], [[(12, 12), (14, 12), (14, 14), (12, 14)]]),
            "map",
            _BOX,
            across,
        ),
        ("the event fills the cue's hole", _BOX, "map", _AROUND_A_HOLE, beside),
        ("the event lies in the cue's hole", _rectangle(12, 12, 18, 18), "map", _AROUND_A_HOLE, {"disjoint"}),
        ("the event covers the cue's hole and more", _rectangle(5, 5, 25, 25), "map", _AROUND_A_HOLE, across),
        ("the same ring with its hole", _AROUND_A_HOLE, "map", _AROUND_A_HOLE, same),
        ("no such place", None, "map", _BOX, set()),
        ("the same box in another frame", _BOX, "odom", _BOX, set()),
        ("far away in another frame", _rectangle(100, 100, 200, 200), "odom", _BOX, set()),
        ("a frame by another case", _BOX, "Map", _BOX, set()),
    ]
    return _table(
        place,
        [
            (why, _placed(place, polygon, frame), _in_space(place, asked), holds)
            for why, polygon, frame, asked, holds in examples
        ],
    )


def _distance(place: str) -> Table:
    """How far counts as within; one relation with its limits in metres."""
    _, distance_cue = _PLACE_CUES[place]
    in_the_hole = _rectangle(12, 12, 18, 18)
    examples: list[tuple[str, Polygon | None, str, Polygon, dict[float, bool]]] = [
        ("beside", _rectangle(23, 10, 25, 20), "map", _BOX, {2.999: False, 3: True, 3.001: True, 0: False}),
        ("off the corner, 3-4-5", _rectangle(23, 24, 30, 30), "map", _BOX, {4.999: False, 5: True}),
        ("touching", _rectangle(20, 20, 30, 30), "map", _BOX, {0: True, 1: True}),
        ("overlapping", _rectangle(15, 15, 30, 30), "map", _BOX, {0: True}),
        ("inside", _rectangle(12, 12, 18, 18), "map", _BOX, {0: True}),
        ("in a hole, 2 m from its rim", in_the_hole, "map", _AROUND_A_HOLE, {1.999: False, 2: True}),
        ("kilometres away", _rectangle(1e6, 10, 1e6 + 1, 20), "map", _BOX, {1e5: False, 1e9: True}),
        ("no such place", None, "map", _BOX, {0: False, 1e9: False}),
        ("another frame", _BOX, "odom", _BOX, {0: False, 1e9: False}),
    ]
    return _table(
        f"{place} within a distance",
        [
            (
                f"{why}: {metres} m",
                _placed(place, polygon, frame),
                {"within_distance": distance_cue(metres, Region(polygon=asked))},
                {"within_distance"} if expected else set(),
            )
            for why, polygon, frame, asked, limits in examples
            for metres, expected in limits.items()
        ],
    )


# Features

Pairs = list[tuple[str, FeatureValue]]
_SAME = {"equal", "subset", "superset", "intersects"}
_MORE = {"superset", "intersects"}
_LESS = {"subset", "intersects"}
_BOTH_EMPTY = {"equal", "subset", "superset", "disjoint"}
_EVENT_EMPTY = {"subset", "disjoint"}
_CUE_EMPTY = {"superset", "disjoint"}


def _featured(pairs: Pairs) -> Event:
    return Event(type="Event", interval=NOON, features=pairs)


def _features() -> Table:
    long_text = "x" * 5000
    examples: list[tuple[str, Pairs, Pairs, set[str]]] = [
        ("the same", [("a", 1)], [("a", 1)], _SAME),
        ("the same in another order", [("a", 1), ("b", 2)], [("b", 2), ("a", 1)], _SAME),
        ("more", [("a", 1), ("b", 2)], [("a", 1)], _MORE),
        ("fewer", [("a", 1)], [("a", 1), ("b", 2)], _LESS),
        ("some in common", [("a", 1), ("b", 2)], [("b", 2), ("c", 3)], {"intersects"}),
        (
            "some in common, between others",
            [("a", 1), ("b", 2), ("d", 4)],
            [("a", 1), ("c", 3), ("d", 4)],
            {"intersects"},
        ),
        ("another name", [("a", 1)], [("b", 1)], {"disjoint"}),
        ("another value", [("a", 1)], [("a", 2)], {"disjoint"}),
        ("values swapped", [("a", 1), ("b", 2)], [("a", 2), ("b", 1)], {"disjoint"}),
        ("both empty", [], [], _BOTH_EMPTY),
        ("no features", [], [("a", 1)], _EVENT_EMPTY),
        ("none asked", [("a", 1)], [], _CUE_EMPTY),
        ("two values of one name, one asked", [("a", 1), ("a", 2)], [("a", 1)], _MORE),
        ("one value of one name, two asked", [("a", 1)], [("a", 1), ("a", 2)], _LESS),
        ("two values of one name, both asked", [("a", 1), ("a", 2)], [("a", 2), ("a", 1)], _SAME),
        # Which values are one.
        ("1 is 1.0", [("a", 1)], [("a", 1.0)], _SAME),
        ("1.0 is 1", [("a", 1.0)], [("a", 1)], _SAME),
        ("0 is -0.0", [("a", 0)], [("a", -0.0)], _SAME),
        ("1 is not True", [("a", 1)], [("a", True)], {"disjoint"}),
        ("True is not 1", [("a", True)], [("a", 1)], {"disjoint"}),
        ("True is not 1.0", [("a", True)], [("a", 1.0)], {"disjoint"}),
        ("0 is not False", [("a", 0)], [("a", False)], {"disjoint"}),
        ("1 is not its text", [("a", 1)], [("a", "1")], {"disjoint"}),
        ("a text is not the number", [("a", "1")], [("a", 1)], {"disjoint"}),
        ("True is not its text", [("a", True)], [("a", "true")], {"disjoint"}),
        ("1, True and its text are three", [("a", 1), ("a", True), ("a", "1")], [("a", True)], _MORE),
        ("1 and 1.0 are one", [("a", 1), ("a", 1.0)], [("a", 1)], _SAME),
        ("2**53 + 1 is not 2**53", [("a", 2**53 + 1)], [("a", 2**53)], {"disjoint"}),
        ("2**53 + 1 is not the float", [("a", 2**53 + 1)], [("a", float(2**53))], {"disjoint"}),
        ("2**53 is the float", [("a", 2**53)], [("a", float(2**53))], _SAME),
        ("0.1 + 0.2 is not 0.3", [("a", 0.1 + 0.2)], [("a", 0.3)], {"disjoint"}),
        ("a large float is itself", [("a", 1e300)], [("a", 1e300)], _SAME),
        # Texts, character by character.
        ("a text by another case", [("a", "cup")], [("a", "Cup")], {"disjoint"}),
        ("a name by another case", [("a", 1)], [("A", 1)], {"disjoint"}),
        ("a blank behind", [("a", "cup")], [("a", "cup ")], {"disjoint"}),
        ("the same look, other characters", [("a", "é")], [("a", "e\u0301")], {"disjoint"}),
        ("the empty text", [("a", "")], [("a", "")], _SAME),
        ("the empty text is not the word null", [("a", "")], [("a", "NULL")], {"disjoint"}),
        ("the word null", [("a", "NULL")], [("a", "NULL")], _SAME),
        ("quotes, braces and backslashes", [('{"a",', "}'\\\"")], [('{"a",', "}'\\\"")], _SAME),
        ("a backslash more", [("a", "\\")], [("a", "\\\\")], {"disjoint"}),
        ("a control character inside", [("a", "b\x1fsc")], [("a", "b"), ("c", "")], {"disjoint"}),
        ("a long text", [("a", long_text + "1")], [("a", long_text + "1")], _SAME),
        ("long texts that differ at their ends", [("a", long_text + "1")], [("a", long_text + "2")], {"disjoint"}),
        ("long names that differ at their ends", [(long_text + "1", 1)], [(long_text + "2", 1)], {"disjoint"}),
    ]
    return _table(
        "features",
        [
            (
                why,
                _featured(pairs),
                {relation.value: cues.features(relation, asked) for relation in SetRelation},
                holds,
            )
            for why, pairs, asked, holds in examples
        ],
    )


def _feature_names() -> Table:
    long_name = "x" * 5000
    examples: list[tuple[str, Pairs, list[str], set[str]]] = [
        ("the same", [("a", 1)], ["a"], _SAME),
        ("the same, whatever the values", [("a", 1), ("b", "x")], ["b", "a"], _SAME),
        ("more", [("a", 1), ("b", 2)], ["a"], _MORE),
        ("fewer", [("a", 1)], ["a", "b"], _LESS),
        ("fewer, between others", [("b", 1)], ["a", "b", "c"], _LESS),
        ("fewer, the outermost", [("a", 1), ("c", 1)], ["a", "b", "c"], _LESS),
        ("more, the outermost", [("a", 1), ("b", 1), ("c", 1)], ["a", "c"], _MORE),
        ("some in common", [("a", 1), ("b", 2)], ["b", "c"], {"intersects"}),
        ("as many, with the same outermost", [("a", 1), ("b", 1), ("d", 1)], ["a", "c", "d"], {"intersects"}),
        ("another", [("a", 1)], ["b"], {"disjoint"}),
        ("none between the asked ones", [("b", 1)], ["a", "c"], {"disjoint"}),
        ("both empty", [], [], _BOTH_EMPTY),
        ("no features", [], ["a"], _EVENT_EMPTY),
        ("none asked", [("a", 1)], [], _CUE_EMPTY),
        ("a name with two values is one name", [("a", 1), ("a", 2)], ["a"], _SAME),
        ("two values and another name", [("a", 1), ("a", 2), ("b", 1)], ["a"], _MORE),
        ("by another case", [("a", 1)], ["A"], {"disjoint"}),
        ("a value is no name", [("a", "b")], ["b"], {"disjoint"}),
        ("quotes, braces and backslashes", [('{"a",\\}', 1)], ['{"a",\\}'], _SAME),
        ("long names that differ at their ends", [(long_name + "1", 1)], [long_name + "2"], {"disjoint"}),
        ("a long name", [(long_name + "1", 1)], [long_name + "1"], _SAME),
    ]
    return _table(
        "feature_names",
        [
            (
                why,
                _featured(pairs),
                {relation.value: cues.feature_names(relation, asked) for relation in SetRelation},
                holds,
            )
            for why, pairs, asked, holds in examples
        ],
    )


_EQUAL_TO = {"=", "<=", ">="}
_LESS_THAN = {"!=", "<", "<="}
_MORE_THAN = {"!=", ">", ">="}


def _comparisons(value: FeatureValue) -> dict[str, Cue]:
    """Every comparison that is allowed with a value of this kind."""
    if isinstance(value, bool):
        allowed = [Comparison.EQ, Comparison.NE]
    elif isinstance(value, str):
        allowed = [*Comparison]
    else:
        allowed = [compare for compare in Comparison if compare is not Comparison.LIKE]
    return {compare.value: cues.feature("v", compare, value) for compare in allowed}


def _feature() -> Table:
    """The feature `v` of an event against a value; every text is also tried as a pattern."""
    like = {"like"}
    examples: list[tuple[str, Pairs, FeatureValue, set[str]]] = [
        # Numbers.
        ("equal", [("v", 1)], 1, _EQUAL_TO),
        ("equal, as float", [("v", 1)], 1.0, _EQUAL_TO),
        ("greater", [("v", 2)], 1, _MORE_THAN),
        ("less", [("v", 0)], 1, _LESS_THAN),
        ("some value equal, some greater", [("v", 1), ("v", 2)], 1, {"=", "!=", "<=", ">", ">="}),
        ("some value less, some greater", [("v", 0), ("v", 2)], 1, {"!=", "<", "<=", ">", ">="}),
        ("negative", [("v", -5)], 3, _LESS_THAN),
        ("as numbers, not as texts", [("v", 10)], 9, _MORE_THAN),
        ("zeros of both signs", [("v", -0.0)], 0, _EQUAL_TO),
        ("tenths", [("v", 0.1)], 0.1, _EQUAL_TO),
        ("0.1 + 0.2 is greater than 0.3", [("v", 0.1 + 0.2)], 0.3, _MORE_THAN),
        ("2**53 + 1 against 2**53", [("v", 2**53 + 1)], 2**53, _MORE_THAN),
        ("2**53 + 1 against the float", [("v", 2**53 + 1)], float(2**53), _MORE_THAN),
        ("2**53 as float against 2**53 + 1", [("v", float(2**53))], 2**53 + 1, _LESS_THAN),
        ("2**53 against the float", [("v", 2**53)], float(2**53), _EQUAL_TO),
        ("the greatest integer against the float above", [("v", 2**63 - 1)], 2.0**63, _LESS_THAN),
        ("2**60 against its float", [("v", 2**60)], 2.0**60, _EQUAL_TO),
        ("2**60 as float against 2**60", [("v", 2.0**60)], 2**60, _EQUAL_TO),
        ("2**60 as float against 2**60 + 1", [("v", 2.0**60)], 2**60 + 1, _LESS_THAN),
        ("very large", [("v", 1e300)], 1e299, _MORE_THAN),
        ("very large against itself", [("v", 1e300)], 1e300, _EQUAL_TO),
        ("very small", [("v", 1e-300)], 0, _MORE_THAN),
        ("a text is no number", [("v", "1")], 1, set()),
        ("a truth value is no number", [("v", True)], 1, set()),
        ("a number among other kinds", [("v", True), ("v", "1"), ("v", 1)], 1, _EQUAL_TO),
        ("a greater number among other kinds", [("v", True), ("v", "0"), ("v", 7)], 1, _MORE_THAN),
        ("another name has it", [("w", 1)], 1, set()),
        ("no features", [], 1, set()),
        # Truth values.
        ("true is true", [("v", True)], True, {"="}),
        ("false is not true", [("v", False)], True, {"!="}),
        ("false is false", [("v", False)], False, {"="}),
        ("both", [("v", True), ("v", False)], True, {"=", "!="}),
        ("a number is no truth value", [("v", 1)], True, set()),
        ("zero is no truth value", [("v", 0)], True, set()),
        ("a text is no truth value", [("v", "true")], True, set()),
        ("no features, asked for a truth value", [], True, set()),
        # Texts, by code point.
        ("the same text", [("v", "b")], "b", _EQUAL_TO | like),
        ("an earlier text", [("v", "a")], "b", _LESS_THAN),
        ("a later text", [("v", "c")], "b", _MORE_THAN),
        ("capitals come first", [("v", "B")], "a", _LESS_THAN),
        ("umlauts come behind z", [("v", "ä")], "z", _MORE_THAN),
        ("U+FFFD comes before U+10000", [("v", "\ufffd")], "\U00010000", _LESS_THAN),
        ("the empty text comes first", [("v", "")], "a", _LESS_THAN),
        ("the empty text", [("v", "")], "", _EQUAL_TO | like),
        ("a longer text comes behind", [("v", "abc")], "ab", _MORE_THAN),
        ("a blank more comes behind", [("v", "a ")], "a", _MORE_THAN),
        ("a hyphen counts", [("v", "a-b")], "ab", _LESS_THAN),
        ("as texts, not as numbers", [("v", "10")], "9", _LESS_THAN),
        ("a number is no text", [("v", 5)], "5", set()),
        ("a truth value is no text", [("v", True)], "true", set()),
        ("no features, asked for a text", [], "", set()),
        ("some text equal, some less", [("v", "a"), ("v", "b")], "b", {"=", "!=", "<", "<=", ">=", "like"}),
        # Patterns. Where the text differs from the pattern, their first difference decides the order.
        ("% is any text", [("v", "cup")], "c%", _MORE_THAN | like),
        ("% is also no text", [("v", "c")], "c%", _LESS_THAN | like),
        ("% alone", [("v", "cup")], "%", _MORE_THAN | like),
        ("% alone, of the empty text", [("v", "")], "%", _LESS_THAN | like),
        ("% in the middle", [("v", "cup")], "c%p", _MORE_THAN | like),
        ("_ is one character", [("v", "cup")], "c_p", _MORE_THAN | like),
        ("_ is not no character", [("v", "cp")], "c_p", _MORE_THAN),
        ("_ is not two characters", [("v", "coup")], "c_p", _MORE_THAN),
        ("_ is one character beyond 16 bits", [("v", "\U0001f600")], "_", _MORE_THAN | like),
        ("_ is one of two characters that look like one", [("v", "e\u0301")], "_", _MORE_THAN),
        ("by case", [("v", "Cup")], "c%", _LESS_THAN),
        ("from the first character", [("v", "xcup")], "c%", _MORE_THAN),
        ("to the last character", [("v", "cups")], "cup", _MORE_THAN),
        ("to the last line", [("v", "cup\n")], "cup", _MORE_THAN),
        ("% goes over lines", [("v", "a\nb")], "a%b", _LESS_THAN | like),
        ("_ is also a line break", [("v", "a\nb")], "a_b", _LESS_THAN | like),
        ("an escaped %", [("v", "100%")], "100\\%", _LESS_THAN | like),
        ("an escaped % is nothing else", [("v", "1000")], "100\\%", _LESS_THAN),
        ("an escaped _", [("v", "a_b")], "a\\_b", _MORE_THAN | like),
        ("an escaped _ is nothing else", [("v", "axb")], "a\\_b", _MORE_THAN),
        ("an escaped backslash", [("v", "a\\b")], "a\\\\b", _MORE_THAN | like),
        ("an escaped letter is the letter", [("v", "cup")], "\\c\\u\\p", _MORE_THAN | like),
        ("a dot is a dot", [("v", "abc")], "a.c", _MORE_THAN),
        ("a dot is itself", [("v", "a.c")], "a.c", _EQUAL_TO | like),
        ("brackets, stars and dollars are plain", [("v", "[a]*$^")], "[a]*$^", _EQUAL_TO | like),
        ("a bracket is no choice", [("v", "a")], "[a]", _MORE_THAN),
        ("a pattern of another kind of value", [("v", 100)], "1%", set()),
    ]
    return _table(
        "feature", [(why, _featured(pairs), _comparisons(value), holds) for why, pairs, value, holds in examples]
    )


# Payload, agent, uid: one relation each


def _payload() -> Table:
    def paid(data: bytes | None, media_type: str = "text/plain") -> Event:
        payload = None if data is None else Payload(data=data, media_type=media_type)
        return Event(type="Event", interval=NOON, payload=payload)

    large = bytes(range(256)) * 400
    examples: list[tuple[str, Event, bytes, bool]] = [
        ("the same bytes", paid(b"abc"), b"abc", True),
        ("the same bytes of another media type", paid(b"abc", "application/json"), b"abc", True),
        ("other bytes", paid(b"abc"), b"abd", False),
        ("a byte more", paid(b"abc"), b"abc\x00", False),
        ("by case", paid(b"abc"), b"ABC", False),
        ("empty is empty", paid(b""), b"", True),
        ("none is not empty", paid(None), b"", False),
        ("none is nothing", paid(None), b"abc", False),
        ("empty is not a NUL", paid(b""), b"\x00", False),
        ("bytes that are no text", paid(b"\x00\xff\\"), b"\x00\xff\\", True),
        ("many bytes", paid(large), large, True),
        ("many bytes, the last differs", paid(large), large[:-1] + b"\x00", False),
    ]
    return _table(
        "payload",
        [
            (why, event, {"equal": cues.payload(data)}, {"equal"} if holds else set())
            for why, event, data, holds in examples
        ],
    )


def _agent() -> Table:
    def by(agent: str | None) -> Event:
        return Event(type="Event", interval=NOON, agent=agent)

    examples: list[tuple[str, Event, str, bool]] = [
        ("the agent", by("armar7"), "armar7", True),
        ("another agent", by("armar6"), "armar7", False),
        ("by case", by("Armar7"), "armar7", False),
        ("a blank behind", by("armar7 "), "armar7", False),
        ("no agent", by(None), "armar7", False),
        ("an agent that looks like a pattern", by("armar7"), "armar%", False),
        ("an agent called null", by("NULL"), "NULL", True),
        ("no agent is not one called null", by(None), "NULL", False),
    ]
    return _table(
        "agent",
        [(why, event, {"is": cues.agent(name)}, {"is"} if holds else set()) for why, event, name, holds in examples],
    )


def _uid() -> Table:
    event = Event(type="Event", interval=NOON)
    mine, other, unknown = UUID(int=1), UUID(int=2), UUID(int=99)
    examples: list[tuple[str, list[UUID], bool]] = [
        ("asked for event 1", [mine], True),
        ("event 2, asked for event 1", [mine], False),
        ("event 3, asked for 1 and 2", [mine, other], False),
        ("event 4, asked for itself and others", [unknown, UUID(int=4), other], True),
        ("event 5, asked for none", [], False),
        ("event 6, asked for an unknown one", [unknown], False),
    ]
    return _table(
        "uid", [(why, event, {"is": cues.uid(*uids)}, {"is"} if holds else set()) for why, uids, holds in examples]
    )


# Duration


def _duration() -> Table:
    day = 86_400.0
    examples: list[tuple[str, Interval, timedelta, set[str]]] = [
        ("as long", span(0, 10), timedelta(seconds=10), _EQUAL_TO),
        ("longer", span(0, 11), timedelta(seconds=10), _MORE_THAN),
        ("shorter", span(0, 9), timedelta(seconds=10), _LESS_THAN),
        ("longer by a microsecond", span(0, 10.000001), timedelta(seconds=10), _MORE_THAN),
        ("shorter by a microsecond", span(0, 9.999999), timedelta(seconds=10), _LESS_THAN),
        ("an instant lasts nothing", span(5, 5), timedelta(0), _EQUAL_TO),
        ("an instant is short", span(5, 5), timedelta(microseconds=1), _LESS_THAN),
        ("an instant is longer than less than nothing", span(5, 5), timedelta(microseconds=-1), _MORE_THAN),
        ("a day is 24 hours", span(0, day), timedelta(hours=24), _EQUAL_TO),
        ("25 hours are more than a day", span(0, day + 3600), timedelta(days=1), _MORE_THAN),
        ("31 days are 31 days", span(0, 31 * day), timedelta(days=31), _EQUAL_TO),
        ("31 days are more than 30", span(0, 31 * day), timedelta(days=30), _MORE_THAN),
        ("a long time", Interval(begin=_DAWN, end=_DUSK), _DUSK - _DAWN, _EQUAL_TO),
        ("a long time, against one too long to be", Interval(begin=_DAWN, end=_DUSK), timedelta.max, _LESS_THAN),
        ("still going on lasts no known time", span(0, None), timedelta(0), set()),
        ("still going on is not longer either", span(0, None), timedelta.max, set()),
    ]
    compares = [compare for compare in Comparison if compare is not Comparison.LIKE]
    return _table(
        "duration",
        [
            (
                why,
                Event(type="Event", interval=interval),
                {compare.value: cues.lasting(compare, duration) for compare in compares},
                holds,
            )
            for why, interval, duration, holds in examples
        ],
    )


# Parts and wholes

P, Q, R, S = (UUID(int=number) for number in (1, 2, 3, 4))
W1, W2, W3, W4 = (UUID(int=number) for number in (11, 12, 13, 14))
NOBODY = UUID(int=99)
_FAMILY: Sequence[tuple[UUID, tuple[UUID, ...]]] = (
    (P, ()),
    (Q, ()),
    (R, ()),
    (S, ()),
    (W1, (P, Q)),
    (W2, (W1, R)),
    (W3, (P,)),
    (W4, (W1, P)),
)
"""W2 = {W1 = {P, Q}, R}; W3 = {P}; W4 = {W1, P}; S stands alone."""


def _kin_cues(kin: Kin, uids: Sequence[UUID]) -> dict[str, Cue]:
    return {
        f"{reach}{relation.value}": KinCue(relation=relation, uids=tuple(uids), kin=kin, transitive=bool(reach))
        for reach in ("", "transitive ")
        for relation in SetRelation
    }


def _kin(kin: Kin, examples: Iterable[tuple[UUID, list[UUID], set[str], set[str]]]) -> Table:
    """Rows of: an event, the uids asked for, what holds of its direct relatives, what of all."""
    rows = [
        Row(
            why=f"event {event.int}, asked for {[uid.int for uid in uids]}",
            event=event,
            asked=_kin_cues(kin, uids),
            holds=frozenset(direct | {f"transitive {relation}" for relation in transitive}),
        )
        for event, uids, direct, transitive in examples
    ]
    events = [Event(uid=uid, type="Event", interval=NOON, parts=parts) for uid, parts in _FAMILY]
    return Table(
        family=kin.value, types=PLAIN, arrivals=tuple(Arrival(event=event) for event in events), rows=tuple(rows)
    )


def _parts() -> Table:
    none = {"disjoint"}
    return _kin(
        Kin.PARTS,
        [
            (W1, [P, Q], _SAME, _SAME),
            (W1, [Q, P], _SAME, _SAME),
            (W1, [P], _MORE, _MORE),
            (W3, [P, Q], _LESS, _LESS),
            (W1, [Q, R], {"intersects"}, {"intersects"}),
            (W1, [R], none, none),
            (W1, [], _CUE_EMPTY, _CUE_EMPTY),
            (S, [], _BOTH_EMPTY, _BOTH_EMPTY),
            (S, [P], _EVENT_EMPTY, _EVENT_EMPTY),
            # An event is no part of itself, and a whole no part of its parts.
            (W1, [W1], none, none),
            (P, [W1], _EVENT_EMPTY, _EVENT_EMPTY),
            # uids that no event has.
            (W1, [NOBODY], none, none),
            (W1, [P, NOBODY], {"intersects"}, {"intersects"}),
            (W1, [P, Q, NOBODY], _LESS, _LESS),
            (S, [NOBODY], _EVENT_EMPTY, _EVENT_EMPTY),
            # Where parts of parts count and where not.
            (W2, [W1, R], _SAME, _MORE),
            (W2, [W1, R, P, Q], _LESS, _SAME),
            (W2, [P, Q], none, _MORE),
            (W2, [P, S], none, {"intersects"}),
            (W2, [W1, R, P, Q, S], _LESS, _LESS),
            (W2, [P, Q, R], {"intersects"}, _MORE),
            (W2, [P, Q, R, S], {"intersects"}, {"intersects"}),
            (W2, [S], none, none),
            # By two ways: P is a part of W4 and of its part W1.
            (W4, [W1, P], _SAME, _MORE),
            (W4, [W1, P, Q], _LESS, _SAME),
        ],
    )


def _wholes() -> Table:
    none = {"disjoint"}
    return _kin(
        Kin.WHOLES,
        [
            (R, [W2], _SAME, _SAME),
            (P, [W1, W3, W4], _SAME, _MORE),
            (P, [W1], _MORE, _MORE),
            (R, [W2, W3], _LESS, _LESS),
            (P, [W1, W2], {"intersects"}, _MORE),
            (P, [S], none, none),
            (P, [], _CUE_EMPTY, _CUE_EMPTY),
            (S, [], _BOTH_EMPTY, _BOTH_EMPTY),
            (S, [W1], _EVENT_EMPTY, _EVENT_EMPTY),
            (W2, [W2], _EVENT_EMPTY, _EVENT_EMPTY),
            (W1, [P], none, none),
            (R, [NOBODY], none, none),
            (R, [W2, NOBODY], _LESS, _LESS),
            # Where wholes of wholes count and where not.
            (Q, [W1], _SAME, _MORE),
            (Q, [W1, W2, W4], _LESS, _SAME),
            (Q, [W2], none, _MORE),
            (Q, [W2, W3], none, {"intersects"}),
            (Q, [W1, W2, W3, W4], _LESS, _LESS),
            (P, [W1, W2, W3, W4], _LESS, _SAME),
            (Q, [W3], none, none),
            (W1, [W2, W4], _SAME, _SAME),
        ],
    )


# What an event lacks, and combinations


def _missing() -> Table:
    """An event still going on with nothing but its type: every condition on the rest is false, its negation true."""
    nothing_known = Event(type="Event", interval=span(0, None))
    box = Region(polygon=_BOX)
    spatial = ("equal", "subset", "superset", "intersects", "disjoint", "touches")
    conditions: list[tuple[str, Cue]] = [
        *((f"region {name}", cues.region(name, box)) for name in spatial),  # type: ignore[arg-type]
        *((f"subject {name}", cues.subject(name, box)) for name in spatial),  # type: ignore[arg-type]
        ("region within 1e9 m", cues.within(1e9, box)),
        ("subject within 1e9 m", cues.subject_within(1e9, box)),
        ("payload empty", cues.payload(b"")),
        ("payload", cues.payload(b"x")),
        ("agent", cues.agent("armar7")),
        *((f"feature {compare}", cues.feature("v", compare, "x")) for compare in Comparison),
        ("feature != a number", cues.feature("v", "!=", 1)),
        ("feature != a truth value", cues.feature("v", "!=", True)),
        *(
            (f"duration {compare}", cues.lasting(compare, timedelta(0)))
            for compare in Comparison
            if compare is not Comparison.LIKE
        ),
        ("parts superset", cues.parts("superset", [NOBODY])),
        ("wholes superset", cues.wholes("superset", [NOBODY])),
        ("parts intersects, transitive", cues.parts("intersects", [NOBODY], transitive=True)),
        ("nothing", cues.any_of()),
    ]
    return _table(
        "missing",
        [
            (
                why,
                nothing_known,
                {
                    "cue": cue,
                    "not": ~cue,
                    "not not": ~~cue,
                    "and": cue & cues.everything(),
                    "or not": cue | ~cue,
                    "not or": ~(cue | cues.any_of()),
                },
                {"not", "or not", "not or"},
            )
            for why, cue in conditions
        ],
        alike=[{"cue", "not not", "and"}, {"not", "or not", "not or"}],
    )


def _combined() -> Table:
    """Two conditions a and b in all four cases, under every operator."""

    def asked(a: Cue, b: Cue) -> dict[str, Cue]:
        return {
            "a and b": a & b,
            "a or b": a | b,
            "not a": ~a,
            "not b": ~b,
            "not (a and b)": ~(a & b),
            "not (a or b)": ~(a | b),
            "not a or not b": ~a | ~b,
            "not a and not b": ~a & ~b,
            "a and not b": a & ~b,
            "b and not a": b & ~a,
            "everything": cues.everything(),
            "nothing": cues.any_of(),
            "not everything": ~cues.everything(),
            "not nothing": ~cues.any_of(),
            "a and nothing": a & cues.any_of(),
            "a or everything": a | cues.everything(),
            "one of one": cues.any_of(a),
            "all of one": cues.all_of(b),
        }

    a, b = cues.agent("a"), cues.feature("b", "=", True)
    always = {"everything", "not nothing", "a or everything"}

    def event(agent: str, truth: bool) -> Event:
        return Event(type="Event", interval=NOON, agent=agent, features={"b": truth})

    return _table(
        "and, or, not",
        [
            ("a and b hold", event("a", True), asked(a, b), {"a and b", "a or b", "one of one", "all of one", *always}),
            (
                "only a holds",
                event("a", False),
                asked(a, b),
                {"a or b", "not b", "not (a and b)", "not a or not b", "a and not b", "one of one", *always},
            ),
            (
                "only b holds",
                event("x", True),
                asked(a, b),
                {"a or b", "not a", "not (a and b)", "not a or not b", "b and not a", "all of one", *always},
            ),
            (
                "neither holds",
                event("x", False),
                asked(a, b),
                {
                    *("not a", "not b", "not (a and b)", "not (a or b)", "not a or not b", "not a and not b"),
                    *always,
                },
            ),
        ],
        alike=[
            {"not (a and b)", "not a or not b"},
            {"not (a or b)", "not a and not b"},
            always,
            {"nothing", "not everything", "a and nothing"},
        ],
    )


TABLES: tuple[Table, ...] = (
    _types(),
    _time(),
    _recorded_at(),
    _place("region"),
    _place("subject"),
    _distance("region"),
    _distance("subject"),
    _features(),
    _feature_names(),
    _feature(),
    _payload(),
    _agent(),
    _uid(),
    _duration(),
    _parts(),
    _wholes(),
    _missing(),
    _combined(),
)
