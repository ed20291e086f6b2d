"""Tests of events and types as JSON Lines: there and back, results taken back in, and malformed lines by name."""

from __future__ import annotations

from typing import Any
from uuid import UUID

import pytest
from hypothesis import given

from elm.errors import CycleRefused, ElmError, InvalidValue
from elm.event import Event, Payload, StoredEvent, content_hash
from elm.exchange import (
    ReadEvent,
    event_from_json,
    event_to_json,
    parse_json,
    region_to_json,
    to_line,
    type_from_json,
    type_to_json,
)
from elm.geometry import Region
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.strategies import Story, stories

ONE, TWO, THREE = UUID(int=1), UUID(int=2), UUID(int=3)
RING = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0], [0.0, 0.0]]
POLYGON = {"type": "Polygon", "coordinates": [RING]}
FULL: dict[str, Any] = {
    "uid": str(ONE),
    "type": "Grasp",
    "interval": ["2026-01-01T10:00:00Z", "2026-01-01T10:00:04.500000Z"],
    "region": {"frame": "map", "polygon": POLYGON},
    "subject": {"frame": "odom", "polygon": POLYGON},
    "features": [["object", "cup"], ["force", 3.2], ["count", 1], ["held", True]],
    "agent": "armar7",
    "payload": {"media_type": "application/json", "base64": "e30="},
    "parts": [],
}
COMPLEX: dict[str, Any] = {"uid": str(ONE), "type": "Serve", "parts": [str(THREE), str(TWO)]}
MINIMAL: dict[str, Any] = {"type": "Grasp", "interval": ["2026-01-01T10:00:00Z", None]}


def _read(given_json: dict[str, Any]) -> ReadEvent:
    return event_from_json(parse_json(to_line(given_json), what="line 1"))


def test_a_full_event_is_read() -> None:
    event = _read(FULL).event

    assert event.uid == ONE
    assert event.type == "Grasp"
    assert event.interval == span(0, 4.5)
    assert event.region == Region.box(0, 0, 4, 4, frame="map")
    assert event.subject == Region.box(0, 0, 4, 4, frame="odom")
    assert event.features == (("object", "cup"), ("force", 3.2), ("count", 1), ("held", True))
    assert [type(value) for _, value in event.features] == [str, float, int, bool]
    assert event.agent == "armar7"
    assert event.payload == Payload(data=b"{}", media_type="application/json")
    assert event.parts == ()


def test_a_full_event_is_written_as_it_was_read() -> None:
    assert to_line(event_to_json(_read(FULL).event)) == to_line(FULL)


def test_type_and_interval_are_enough_and_each_line_is_an_event_of_its_own() -> None:
    first, second = _read(MINIMAL), _read(MINIMAL)

    assert first.event.interval == span(0, None)
    assert first.event.uid != second.event.uid
    assert (first.recorded_at, first.ignored) == (None, ())


def test_parts_are_enough_instead_of_an_interval_and_keep_their_order() -> None:
    for given_json in (COMPLEX, {**COMPLEX, "interval": None}):
        event = _read(given_json).event
        assert event.interval is None
        assert event.parts == (THREE, TWO)
        assert event_to_json(event)["parts"] == [str(THREE), str(TWO)]


@pytest.mark.parametrize("key", ["region", "subject", "payload", "agent"])
def test_what_an_event_lacks_is_null_or_absent(key: str) -> None:
    absent = {name: value for name, value in FULL.items() if name != key}

    assert getattr(_read(absent).event, key) is None
    assert getattr(_read({**FULL, key: None}).event, key) is None
    assert event_to_json(_read(absent).event)[key] is None


def test_a_result_adds_id_recorded_at_and_wholes_and_can_be_loaded_back() -> None:
    event = _read(FULL).event
    stored = StoredEvent(
        id=7,
        uid=event.uid,
        type=event.type,
        interval=span(0, 4.5),
        region=event.region,
        subject=event.subject,
        features=event.features,
        agent=event.agent,
        payload=event.payload,
        recorded_at=at(60),
        wholes=(TWO,),
    )

    shown = event_to_json(stored)
    assert to_line(shown) == to_line({**FULL, "id": 7, "recorded_at": "2026-01-01T10:01:00Z", "wholes": [str(TWO)]})
    back = _read(shown)
    assert back.event == event
    assert back.recorded_at == at(60)
    assert back.ignored == ("id", "wholes")


@given(stories())
def test_random_events_go_there_and_back(story: Story) -> None:
    for arrival in story.arrivals:
        line = to_line(event_to_json(arrival.event))
        back = event_from_json(parse_json(line, what="a line")).event
        assert back == arrival.event
        assert content_hash(back) == content_hash(arrival.event)
        assert to_line(event_to_json(back)) == line
        assert "\n" not in line
    for event_type in story.types:
        assert type_from_json(parse_json(to_line(type_to_json(event_type)), what="a line")) == event_type


# Malformed events


@pytest.mark.parametrize(
    ("malformed", "named"),
    [
        (None, "JSON object"),
        ([], "JSON object"),
        ("event", "JSON object"),
        ({}, "'type'"),
        ({**MINIMAL, "type": None}, "'type'"),
        ({**MINIMAL, "type": 5}, "'type'"),
        ({**MINIMAL, "type": ""}, "type"),
        ({**MINIMAL, "type": "a\x00"}, "type"),
        ({"type": "Grasp"}, "interval"),
        ({"type": "Grasp", "interval": None}, "interval"),
        ({"type": "Grasp", "parts": []}, "interval"),
        ({**MINIMAL, "interval": []}, "'interval'"),
        ({**MINIMAL, "interval": ["2026-01-01T10:00:00Z"]}, "'interval'"),
        ({**MINIMAL, "interval": ["2026-01-01T10:00:00Z", None, None]}, "'interval'"),
        ({**MINIMAL, "interval": "2026-01-01T10:00:00Z"}, "'interval'"),
        ({**MINIMAL, "interval": {"begin": 0, "end": 1}}, "'interval'"),
        ({**MINIMAL, "interval": [None, "2026-01-01T10:00:00Z"]}, "begin of an interval"),
        ({**MINIMAL, "interval": [0, 1]}, "begin of an interval"),
        ({**MINIMAL, "interval": ["2026-01-01T10:00:00Z", 1]}, "end of an interval"),
        ({**MINIMAL, "interval": ["2026-01-01T10:00:00", None]}, "begin of an interval.*naive"),
        ({**MINIMAL, "interval": ["2026-01-01T10:00:04Z", "2026-01-01T10:00:00Z"]}, "before it begins"),
        ({**MINIMAL, "region": POLYGON}, "'frame'|'polygon'"),
        ({**MINIMAL, "region": []}, "'region' of an event"),
        ({**MINIMAL, "region": {"frame": "map"}}, "'polygon'"),
        ({**MINIMAL, "region": {"polygon": POLYGON}}, "'frame'"),
        ({**MINIMAL, "region": {"frame": "map", "polygon": None}}, "polygon"),
        ({**MINIMAL, "region": {"frame": 5, "polygon": POLYGON}}, "'frame'"),
        ({**MINIMAL, "region": {"frame": "map", "polygon": POLYGON, "srid": 0}}, "'srid'"),
        ({**MINIMAL, "subject": {"frame": "map", "polygon": POLYGON, "srid": 0}}, "'srid'.*|'subject'"),
        ({**MINIMAL, "subject": 5}, "'subject' of an event"),
        ({**MINIMAL, "features": {"a": 1}}, "'features'"),
        ({**MINIMAL, "features": ["ab"]}, "'features'|pair"),
        ({**MINIMAL, "features": [{"a": 1, "b": 2}]}, "'features'|pair"),
        ({**MINIMAL, "features": "ab"}, "'features'"),
        ({**MINIMAL, "features": [["a"]]}, "pair"),
        ({**MINIMAL, "features": [["a", 1, 2]]}, "pair"),
        ({**MINIMAL, "features": [[1, 2]]}, "feature name"),
        ({**MINIMAL, "features": [["a", None]]}, "'a'"),
        ({**MINIMAL, "features": [["a", {}]]}, "'a'"),
        ({**MINIMAL, "features": [["a", 2**63]]}, "'a'.*64 bit"),
        ({**MINIMAL, "agent": 5}, "agent"),
        ({**MINIMAL, "agent": ""}, "agent"),
        ({**MINIMAL, "payload": "e30="}, "'payload'"),
        ({**MINIMAL, "payload": {"media_type": "text/plain"}}, "'base64'"),
        ({**MINIMAL, "payload": {"base64": "e30="}}, "'media_type'"),
        ({**MINIMAL, "payload": {"media_type": "text/plain", "base64": "e30"}}, "'base64'"),
        ({**MINIMAL, "payload": {"media_type": 5, "base64": "e30="}}, "'media_type'"),
        ({**MINIMAL, "payload": {"media_type": "text/plain", "base64": "", "size": 0}}, "'size'"),
        ({**MINIMAL, "parts": str(ONE)}, "'parts'"),
        ({**MINIMAL, "parts": ["one"]}, "'parts'"),
        ({**MINIMAL, "parts": [1]}, "'parts'"),
        ({**MINIMAL, "parts": [str(ONE), str(ONE)]}, "twice"),
        ({**MINIMAL, "uid": "0197"}, "'uid'"),
        ({**MINIMAL, "uid": 5}, "'uid'"),
        ({**MINIMAL, "recorded_at": "yesterday"}, "'recorded_at'"),
        ({**MINIMAL, "recorded_at": 5}, "'recorded_at'"),
        ({**MINIMAL, "colour": "red"}, "'colour'"),
        ({**MINIMAL, "Type": "Grasp"}, "'Type'"),
    ],
)
def test_a_malformed_event_is_refused_naming_what_is_wrong(malformed: Any, named: str) -> None:
    with pytest.raises(InvalidValue, match=named):
        event_from_json(malformed)


def test_an_event_that_names_itself_as_part_is_refused() -> None:
    with pytest.raises(CycleRefused):
        event_from_json({**COMPLEX, "parts": [str(ONE)]})


# Types


def test_a_type_is_read_and_written() -> None:
    assert type_from_json({"type": "Grasp", "parents": ["Action", "Motion"]}) == EventType(
        name="Grasp", parents=("Action", "Motion")
    )
    assert type_from_json({"type": "Thing"}) == EventType(name="Thing")
    assert (
        to_line(type_to_json(EventType(name="Grasp", parents=("Action",)))) == '{"type":"Grasp","parents":["Action"]}'
    )
    assert type_to_json(EventType(name="Thing")) == {"type": "Thing", "parents": []}


@pytest.mark.parametrize(
    ("malformed", "named"),
    [
        (None, "JSON object"),
        ([], "JSON object"),
        ({}, "'type'"),
        ({"type": 5}, "'type'"),
        ({"type": ""}, "type"),
        ({"type": "Grasp", "parents": "Action"}, "'parents'"),
        ({"type": "Grasp", "parents": [5]}, "'parents'"),
        ({"type": "Grasp", "parents": [""]}, "parent"),
        ({"type": "Grasp", "parents": {}}, "'parents'"),
        ({"type": "Grasp", "parent": "Action"}, "'parent'"),
    ],
)
def test_a_malformed_type_is_refused_naming_what_is_wrong(malformed: Any, named: str) -> None:
    with pytest.raises(InvalidValue, match=named):
        type_from_json(malformed)


# Lines


@pytest.mark.parametrize(
    "line", ["", "{", "{]", "'a'", "{'a': 1}", '{"a": NaN}', '{"a": 1e400}', b"\xff\xfe", '"\\ud800"', "[" * 100_000]
)
def test_what_is_no_json_is_refused_naming_the_line(line: str | bytes) -> None:
    with pytest.raises(InvalidValue, match="line 17"):
        parse_json(line, what="line 17")


def test_numbers_beyond_64_bits_are_refused_however_they_are_written() -> None:
    for number in ("9223372036854775808", "18446744073709551616", "-9223372036854775809"):
        line = '{"type": "Grasp", "interval": ["2026-01-01T10:00:00Z", null], "features": [["a", NUMBER]]}'
        with pytest.raises(ElmError, match="64 bit"):
            event_from_json(parse_json(line.replace("NUMBER", number), what="line 1"))


def test_a_line_holds_no_line_break_whatever_the_text() -> None:
    event = Event(type="a\nb", interval=span(0, 1), features={"note": "one\r\ntwo\u2028three"}, uid=ONE)

    line = to_line(event_to_json(event))
    assert len(line.encode().split(b"\n")) == 1
    assert event_from_json(parse_json(line, what="line 1")).event == event


def test_a_region_is_written_with_its_frame() -> None:
    assert region_to_json(Region.from_geojson(POLYGON, frame="odom")) == {"frame": "odom", "polygon": POLYGON}


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("null", "an event is a JSON object, not null"),
        ("true", "an event is a JSON object, not true"),
        ('{"type": null}', "'type' of an event must be text, not null"),
        ('{"type": "A", "parts": [null]}', "'parts' of an event is not a UUID: null"),
        ('{"type": "A", "interval": {"begin": false}}', """pair [BEGIN, END], not {"begin":false}"""),
        ('{"type": "A", "uid": ["' + "x" * 200 + '"]}', "'uid' of an event is not a UUID: [\"" + "x" * 78),
    ],
)
def test_what_stands_on_a_line_is_told_as_it_stands_there(line: str, told: str) -> None:
    with pytest.raises(InvalidValue) as refused:
        event_from_json(parse_json(line, what="the line"))
    assert str(refused.value).endswith(told)
