"""Tests of cues as JSON: every node there and back, and what is malformed is refused by name."""

from __future__ import annotations

import json
import math
from datetime import timedelta
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from elm import cues
from elm.cues.algebra import DEPTH_LIMIT, And, Cue, Not, Or
from elm.cues.codec import cue_from_json, cue_to_json
from elm.cues.relations import Comparison, SetRelation
from elm.errors import InvalidValue
from elm.exchange import parse_json, to_line
from elm.geometry import Region, SpatialRelation
from elm.interval import AllenRelation
from tests.clock import at, span
from tests.strategies import TYPE_NAMES, combined_cues

BOX_JSON = {"type": "Polygon", "coordinates": [[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]]]}
BOX = Region.from_geojson(BOX_JSON, frame="map")
ONE, TWO = UUID(int=1), UUID(int=2)
ONE_TEXT, TWO_TEXT = "00000000-0000-0000-0000-000000000001", "00000000-0000-0000-0000-000000000002"
SETS = [*SetRelation]
IN_TIME = [*SetRelation, *AllenRelation]
IN_SPACE = [relation for relation in SpatialRelation if relation is not SpatialRelation.WITHIN_DISTANCE]
COMPARISONS = [compare for compare in Comparison if compare is not Comparison.LIKE]
BOUNDS = ["2026-01-01T10:00:00Z", "2026-01-01T10:00:04Z"]

EXAMPLES: list[tuple[Cue, dict[str, Any]]] = [
    (cues.everything(), {"op": "and", "args": []}),
    (cues.any_of(), {"op": "or", "args": []}),
    (
        cues.all_of(cues.agent("a"), cues.agent("b")),
        {"op": "and", "args": [{"op": "agent", "agent": "a"}, {"op": "agent", "agent": "b"}]},
    ),
    (
        cues.any_of(cues.agent("a"), cues.agent("b")),
        {"op": "or", "args": [{"op": "agent", "agent": "a"}, {"op": "agent", "agent": "b"}]},
    ),
    (~cues.agent("a"), {"op": "not", "arg": {"op": "agent", "agent": "a"}}),
    (cues.exactly("Grasp"), {"op": "type", "relation": "exactly", "type": "Grasp"}),
    (cues.is_a("Grasp"), {"op": "type", "relation": "is_a", "type": "Grasp"}),
    *(
        (build(relation, at(0), at(4)), {"op": op, "relation": relation.value, "interval": BOUNDS})
        for op, build in (("time", cues.time), ("recorded_at", cues.recorded))
        for relation in IN_TIME
    ),
    (cues.time("subset"), {"op": "time", "relation": "subset", "interval": [None, None]}),
    (cues.time("subset", at(0)), {"op": "time", "relation": "subset", "interval": [BOUNDS[0], None]}),
    (cues.recorded("subset", None, at(4)), {"op": "recorded_at", "relation": "subset", "interval": [None, BOUNDS[1]]}),
    (cues.time("equal", span(0, None)), {"op": "time", "relation": "equal", "interval": [BOUNDS[0], None]}),
    *(
        (build(relation, BOX), {"op": op, "relation": relation.value, "frame": "map", "polygon": BOX_JSON})
        for op, build in (("region", cues.region), ("subject", cues.subject))
        for relation in IN_SPACE
    ),
    (
        cues.within(2.5, BOX),
        {"op": "region", "relation": "within_distance", "frame": "map", "polygon": BOX_JSON, "distance": 2.5},
    ),
    (
        cues.subject_within(0, BOX),
        {"op": "subject", "relation": "within_distance", "frame": "map", "polygon": BOX_JSON, "distance": 0.0},
    ),
    *(
        (
            cues.features(relation, [("object", "cup"), ("force", 3.2), ("n", 1), ("on", True)]),
            {
                "op": "features",
                "relation": relation.value,
                "features": [["object", "cup"], ["force", 3.2], ["n", 1], ["on", True]],
            },
        )
        for relation in SETS
    ),
    *(
        (
            cues.feature_names(relation, ["b", "a"]),
            {"op": "feature_names", "relation": relation.value, "names": ["b", "a"]},
        )
        for relation in SETS
    ),
    *(
        (
            cues.feature("force", compare, 3.5),
            {"op": "feature", "name": "force", "compare": compare.value, "value": 3.5},
        )
        for compare in COMPARISONS
    ),
    (
        cues.feature("object", "like", "c\\%p%"),
        {"op": "feature", "name": "object", "compare": "like", "value": "c\\%p%"},
    ),
    (cues.feature("on", "=", True), {"op": "feature", "name": "on", "compare": "=", "value": True}),
    (cues.feature("on", "!=", False), {"op": "feature", "name": "on", "compare": "!=", "value": False}),
    (cues.feature("n", "=", 1), {"op": "feature", "name": "n", "compare": "=", "value": 1}),
    (cues.feature("n", "=", "1"), {"op": "feature", "name": "n", "compare": "=", "value": "1"}),
    (cues.feature("n", "=", 2**63 - 1), {"op": "feature", "name": "n", "compare": "=", "value": 2**63 - 1}),
    (cues.payload(b"{}"), {"op": "payload", "base64": "e30="}),
    (cues.payload(b""), {"op": "payload", "base64": ""}),
    (cues.agent("armar7"), {"op": "agent", "agent": "armar7"}),
    *(
        (
            cues.lasting(compare, timedelta(seconds=90)),
            {"op": "duration", "compare": compare.value, "seconds": 90},
        )
        for compare in COMPARISONS
    ),
    (cues.lasting(">", timedelta(seconds=-1)), {"op": "duration", "compare": ">", "seconds": -1}),
    (cues.lasting("=", timedelta(microseconds=1)), {"op": "duration", "compare": "=", "seconds": 1e-06}),
    (
        cues.lasting(">", timedelta(days=200_000, microseconds=1)),
        {"op": "duration", "compare": ">", "seconds": 17_280_000_000, "microseconds": 1},
    ),
    (
        cues.lasting("<", timedelta.max),
        {"op": "duration", "compare": "<", "seconds": 86_399_999_999_999, "microseconds": 999_999},
    ),
    *(
        (
            build(relation, [TWO, ONE], transitive=transitive),
            {"op": op, "relation": relation.value, "uids": [TWO_TEXT, ONE_TEXT], "transitive": transitive},
        )
        for op, build in (("parts", cues.parts), ("wholes", cues.wholes))
        for relation in SETS
        for transitive in (False, True)
    ),
    (cues.parts("equal", []), {"op": "parts", "relation": "equal", "uids": [], "transitive": False}),
    (cues.uid(ONE, TWO), {"op": "uid", "uids": [ONE_TEXT, TWO_TEXT]}),
    (cues.uid(), {"op": "uid", "uids": []}),
]


@pytest.mark.parametrize(("cue", "expected"), EXAMPLES)
def test_a_cue_is_written_in_the_fixed_format(cue: Cue, expected: dict[str, Any]) -> None:
    assert to_line(cue_to_json(cue)) == to_line(expected)


@pytest.mark.parametrize(("cue", "given_json"), EXAMPLES)
def test_the_fixed_format_is_read_as_the_cue(cue: Cue, given_json: dict[str, Any]) -> None:
    found = cue_from_json(parse_json(to_line(given_json), what="a cue"))

    assert found == cue
    assert to_line(cue_to_json(found)) == to_line(given_json)


def test_no_two_examples_are_the_same_cue() -> None:
    lines = [to_line(cue_to_json(cue)) for cue, _ in EXAMPLES]

    assert len(set(lines)) == len(lines)


@given(combined_cues(TYPE_NAMES))
def test_random_cues_go_there_and_back(cue: Cue) -> None:
    line = to_line(cue_to_json(cue))
    back = cue_from_json(parse_json(line, what="a cue"))

    assert back == cue
    assert to_line(cue_to_json(back)) == line
    assert "\n" not in line


# Beside the canonical form


def test_transitive_is_false_unless_given() -> None:
    assert cue_from_json({"op": "parts", "relation": "equal", "uids": []}) == cues.parts("equal", [])


def test_times_may_be_in_any_zone_and_finer_digits_are_cut() -> None:
    bounds = ["2026-01-01T12:00:00+02:00", "2026-01-01T10:00:04.9999999Z"]

    assert cue_from_json({"op": "time", "relation": "during", "interval": bounds}) == cues.time(
        "during", at(0), at(4.999999)
    )


def test_a_repeated_member_of_a_set_counts_once() -> None:
    given_json = {"op": "features", "relation": "equal", "features": [["a", 1], ["a", 1.0], ["a", True]]}

    assert to_line(cue_to_json(cue_from_json(given_json))) == to_line(
        {**given_json, "features": [["a", 1], ["a", True]]}
    )
    names = {"op": "feature_names", "relation": "equal", "names": ["a", "b", "a"]}
    assert cue_from_json(names) == cues.feature_names("equal", ["a", "b"])


# Malformed

TYPE = {"op": "type", "relation": "is_a", "type": "Grasp"}
TIME = {"op": "time", "relation": "during", "interval": BOUNDS}
REGION = {"op": "region", "relation": "subset", "frame": "map", "polygon": BOX_JSON}
WITHIN = {**REGION, "relation": "within_distance", "distance": 1}
FEATURES = {"op": "features", "relation": "equal", "features": [["a", 1]]}
NAMES = {"op": "feature_names", "relation": "equal", "names": ["a"]}
FEATURE = {"op": "feature", "name": "a", "compare": "<", "value": 1}
PAYLOAD = {"op": "payload", "base64": "e30="}
AGENT = {"op": "agent", "agent": "armar7"}
DURATION = {"op": "duration", "compare": "<", "seconds": 1}
PARTS = {"op": "parts", "relation": "equal", "uids": [ONE_TEXT], "transitive": False}
UID = {"op": "uid", "uids": [ONE_TEXT]}
NODES: list[dict[str, Any]] = [
    {"op": "and", "args": []},
    {"op": "or", "args": []},
    {"op": "not", "arg": AGENT},
    TYPE,
    TIME,
    {**TIME, "op": "recorded_at"},
    REGION,
    {**REGION, "op": "subject"},
    FEATURES,
    NAMES,
    FEATURE,
    PAYLOAD,
    AGENT,
    DURATION,
    PARTS,
    {**PARTS, "op": "wholes"},
    UID,
]


@pytest.mark.parametrize("node", NODES, ids=lambda node: node["op"])
def test_every_member_of_every_node_is_needed_except_transitive(node: dict[str, Any]) -> None:
    assert isinstance(cue_from_json(node), Cue)
    for key in node.keys() - {"transitive"}:
        with pytest.raises(InvalidValue, match=f"lacks '{key}'"):
            cue_from_json({name: value for name, value in node.items() if name != key})


@pytest.mark.parametrize("node", NODES, ids=lambda node: node["op"])
def test_unknown_members_of_every_node_are_refused_by_name(node: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue, match="'colour'"):
        cue_from_json({**node, "colour": "red"})
    with pytest.raises(InvalidValue, match="'colour'"):
        cue_from_json({"op": "not", "arg": {**node, "colour": None}})


@pytest.mark.parametrize("node", NODES, ids=lambda node: node["op"])
@pytest.mark.parametrize("wrong", [None, {}, object(), [None], [[]], math.nan], ids=lambda wrong: type(wrong).__name__)
def test_members_of_the_wrong_kind_are_refused(node: dict[str, Any], wrong: Any) -> None:
    for key in node:
        with pytest.raises(InvalidValue):
            cue_from_json({**node, key: wrong})


@pytest.mark.parametrize("given_cue", [None, [], "and", 5, True, 1.5, [AGENT]])
def test_what_is_no_object_is_no_cue(given_cue: Any) -> None:
    for malformed in (given_cue, {"op": "and", "args": [given_cue]}, {"op": "not", "arg": given_cue}):
        with pytest.raises(InvalidValue, match="JSON object"):
            cue_from_json(malformed)


@pytest.mark.parametrize(
    ("malformed", "named"),
    [
        ({}, "'op'"),
        ({"op": None}, "'op'"),
        ({"op": ["and"]}, "'op'"),
        ({"op": "xor", "args": []}, "'xor'.*and, or, not, type"),
        ({"op": "AND", "args": []}, "'AND'"),
        ({"op": ""}, "''"),
        ({"op": "and"}, "'args'"),
        ({"op": "and", "args": {}}, "'args'"),
        ({"op": "and", "args": [], "arg": AGENT}, "'arg'"),
        ({"op": "not", "args": [AGENT]}, "'arg'"),
        ({**TYPE, "relation": "isa"}, "'isa'.*exactly, is_a"),
        ({**TYPE, "relation": "equal"}, "'equal'"),
        ({**TYPE, "relation": 5}, "'relation'"),
        ({**TYPE, "type": ""}, "type"),
        ({**TYPE, "type": "a\x00"}, "type"),
        ({**TYPE, "type": "t" * 501}, "type"),
        ({**TIME, "relation": "touches"}, "'touches'.*equal.*before"),
        ({**TIME, "relation": "DURING"}, "'DURING'"),
        ({**TIME, "interval": []}, "'interval'"),
        ({**TIME, "interval": [BOUNDS[0]]}, "'interval'"),
        ({**TIME, "interval": [*BOUNDS, None]}, "'interval'"),
        ({**TIME, "interval": BOUNDS[0]}, "'interval'"),
        ({**TIME, "interval": {"begin": BOUNDS[0]}}, "'interval'"),
        ({**TIME, "interval": BOUNDS[::-1]}, "before it begins"),
        ({**TIME, "interval": [0, 1]}, "'interval'"),
        ({**TIME, "interval": ["2026-01-01T10:00:00", None]}, "'interval'.*naive"),
        ({**TIME, "interval": ["", None]}, "'interval'"),
        ({**TIME, "interval": [None, "infinity"]}, "'interval'"),
        ({**REGION, "relation": "within"}, "'within'.*within_distance"),
        ({**REGION, "relation": "before"}, "'before'"),
        ({**REGION, "frame": None}, "'frame'"),
        ({**REGION, "frame": ""}, "frame"),
        ({**REGION, "polygon": None}, "polygon"),
        ({**REGION, "polygon": {"type": "Point", "coordinates": [0, 0]}}, "polygon"),
        ({**REGION, "polygon": {**BOX_JSON, "crs": 4326}}, "'crs'"),
        ({**REGION, "polygon": {"type": "Polygon", "coordinates": []}}, "polygon"),
        ({**REGION, "distance": 1}, "distance"),
        ({**WITHIN, "distance": None}, "distance"),
        ({**WITHIN, "distance": "1"}, "distance"),
        ({**WITHIN, "distance": True}, "distance"),
        ({**WITHIN, "distance": -1}, "distance"),
        ({**WITHIN, "distance": 1e10}, "distance"),
        ({**WITHIN, "distance": [1]}, "distance"),
        ({**WITHIN, "distance": 10**400}, "distance"),
        ({name: value for name, value in WITHIN.items() if name != "distance"}, "distance"),
        ({**FEATURES, "relation": "is_a"}, "'is_a'"),
        ({**FEATURES, "features": {"a": 1}}, "'features'"),
        ({**FEATURES, "features": "a"}, "'features'"),
        ({**FEATURES, "features": ["a"]}, "pair"),
        ({**FEATURES, "features": ["ab"]}, "pair"),
        ({**FEATURES, "features": [{"a": 1, "b": 2}]}, "pair"),
        ({**FEATURES, "features": [["a"]]}, "pair"),
        ({**FEATURES, "features": [["a", 1, 2]]}, "pair"),
        ({**FEATURES, "features": [[1, "a"]]}, "name"),
        ({**FEATURES, "features": [["", 1]]}, "name"),
        ({**FEATURES, "features": [["a\x1f", 1]]}, "name"),
        ({**FEATURES, "features": [["a", None]]}, "'a'"),
        ({**FEATURES, "features": [["a", [1]]]}, "'a'"),
        ({**FEATURES, "features": [["a", 2**63]]}, "'a'.*64 bit"),
        ({**NAMES, "names": "a"}, "'names'"),
        ({**NAMES, "names": [1]}, "'names'"),
        ({**NAMES, "names": [""]}, "name"),
        ({**NAMES, "names": ["\ud800"]}, "name"),
        ({**FEATURE, "name": ""}, "name"),
        ({**FEATURE, "compare": "=="}, "'=='.*like"),
        ({**FEATURE, "compare": "LIKE"}, "'LIKE'"),
        ({**FEATURE, "value": None}, "'a'"),
        ({**FEATURE, "value": {}}, "'a'"),
        ({**FEATURE, "value": 2**63}, "64 bit"),
        ({**FEATURE, "value": "a\x00b"}, "'a'"),
        ({**FEATURE, "value": True}, "truth"),
        ({**FEATURE, "compare": "like", "value": 1}, "like"),
        ({**FEATURE, "compare": "like", "value": True}, "like|truth"),
        ({**FEATURE, "compare": "like", "value": "a\\"}, "backslash"),
        ({**FEATURE, "compare": "like", "value": "a\\\\\\"}, "backslash"),
        ({**PAYLOAD, "base64": "e30"}, "'base64'"),
        ({**PAYLOAD, "base64": "e30=\n"}, "'base64'"),
        ({**PAYLOAD, "base64": "!!!!"}, "'base64'"),
        ({**PAYLOAD, "base64": "é"}, "'base64'"),
        ({**PAYLOAD, "base64": 5}, "'base64'"),
        ({**AGENT, "agent": ""}, "agent"),
        ({**AGENT, "agent": 5}, "'agent'"),
        ({**AGENT, "agent": "a" * 501}, "agent"),
        ({**DURATION, "compare": "like"}, "like"),
        ({**DURATION, "compare": "~"}, "'~'"),
        ({**DURATION, "seconds": "1"}, "'seconds'"),
        ({**DURATION, "seconds": True}, "'seconds'"),
        ({**DURATION, "seconds": 1e20}, "'seconds'"),
        ({**DURATION, "microseconds": 0.5}, "'microseconds'.*whole number"),
        ({**DURATION, "microseconds": "1"}, "'microseconds'"),
        ({**DURATION, "microseconds": 10**30}, "out of range"),
        ({**DURATION, "seconds": 10**400}, "'seconds'"),
        ({**DURATION, "seconds": math.inf}, "'seconds'"),
        ({**PARTS, "uids": ONE_TEXT}, "'uids'"),
        ({**PARTS, "uids": ["one"]}, "'uids'"),
        ({**PARTS, "uids": [1]}, "'uids'"),
        ({**PARTS, "uids": [None]}, "'uids'"),
        ({**PARTS, "transitive": 1}, "transitive"),
        ({**PARTS, "transitive": "true"}, "transitive"),
        ({**PARTS, "relation": "contains"}, "'contains'"),
        ({**UID, "uids": [ONE_TEXT, ""]}, "'uids'"),
        ({**UID, "relation": "equal"}, "'relation'"),
    ],
)
def test_what_is_malformed_is_refused_naming_it(malformed: dict[str, Any], named: str) -> None:
    with pytest.raises(InvalidValue, match=named):
        cue_from_json(malformed)
    with pytest.raises(InvalidValue, match=named):
        cue_from_json({"op": "and", "args": [AGENT, {"op": "not", "arg": malformed}]})


# Depth


def _nested(op: str, depth: int) -> dict[str, Any]:
    found: dict[str, Any] = dict(AGENT)
    for _ in range(depth):
        found = {"op": "not", "arg": found} if op == "not" else {"op": op, "args": [found]}
    return found


@pytest.mark.parametrize("op", ["not", "and", "or"])
@pytest.mark.parametrize("depth", [1_000, 100_000])
def test_a_cue_nested_too_deep_is_refused_saying_so(op: str, depth: int) -> None:
    with pytest.raises(InvalidValue, match="100 deep"):
        cue_from_json(_nested(op, depth))


@pytest.mark.parametrize("depth", [1_000, 100_000])
def test_a_text_nested_too_deep_is_refused_saying_so(depth: int) -> None:
    text = '{"op": "not", "arg": ' * depth + '{"op": "and", "args": []}' + "}" * depth

    with pytest.raises(InvalidValue, match="deep"):
        cue_from_json(parse_json(text, what="a cue"))


def test_a_cue_as_deep_as_allowed_goes_there_and_back() -> None:
    cue: Cue = cues.agent("a")
    for _ in range(DEPTH_LIMIT):
        cue = ~cue

    assert cue.depth == DEPTH_LIMIT == 100
    assert cue_from_json(cue_to_json(cue)) == cue
    with pytest.raises(InvalidValue, match="100 deep"):
        Not(arg=cue)
    with pytest.raises(InvalidValue, match="100 deep"):
        And(args=(cue,))
    with pytest.raises(InvalidValue, match="100 deep"):
        Or(args=(cue,))


def test_chains_of_one_operator_are_flat_however_long() -> None:
    chain: Cue = cues.agent("a0")
    for number in range(1, 1_000):
        chain = chain & cues.agent(f"a{number}")

    assert chain.depth == 1
    assert len(cue_to_json(chain)["args"]) == 1_000


def test_an_outline_in_a_cue_keeps_its_holes() -> None:
    holed = Region(polygon=Polygon([(0, 0), (9, 0), (9, 9), (0, 9)], [[(1, 1), (2, 1), (2, 2)]]))

    assert cue_from_json(cue_to_json(cues.region("equal", holed))) == cues.region("equal", holed)


@given(micros=st.integers(-86_399_999_913_600_000_000, 86_399_999_999_999_999_999))
def test_every_duration_comes_back_to_the_microsecond(micros: int) -> None:
    cue = cues.lasting(">=", timedelta(microseconds=micros))

    assert cue_from_json(json.loads(json.dumps(cue_to_json(cue)))) == cue
