"""Tests of events: valid from birth, and a content hash that differs exactly where the content does."""

from __future__ import annotations

import enum
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace
from datetime import UTC
from typing import Any
from uuid import RFC_4122, UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from elm.errors import CycleRefused, InvalidValue
from elm.event import Event, PartialEvent, Payload, StoredEvent, content_hash, hashed_uid
from elm.features import Feature
from tests.clock import at, span
from tests.contents import HERE, ONE, OTHER_CONTENT, SAME_CONTENT, THERE, THREE, TWO, grasp

# Valid from birth


def test_type_and_interval_are_enough() -> None:
    event = Event(type="Grasp", interval=span(0, None))

    assert (event.region, event.subject, event.agent, event.payload) == (None, None, None, None)
    assert (event.features, event.parts, event.is_complex) == ((), (), False)


def test_uids_may_be_given_as_text() -> None:
    event = Event(type="Serve", uid=str(ONE), parts=[str(TWO), THREE])

    assert (event.uid, event.parts) == (ONE, (TWO, THREE))
    assert PartialEvent(type="Grasp", interval=span(0, 1), uid=str(ONE)).uid == ONE  # type: ignore[arg-type]


@pytest.mark.parametrize("place", ["region", "subject"])
def test_a_bare_polygon_for_a_place_is_refused_with_what_to_make_of_it(place: str) -> None:
    polygon: Any = Polygon([(0, 0), (1, 0), (1, 1)])
    with pytest.raises(InvalidValue, match=rf"the {place} of an event is an elm\.Region\(polygon="):
        Event(type="Grasp", interval=span(0, 1), **{place: polygon})


def test_each_event_gets_a_uid_of_its_own() -> None:
    uids = [Event(type="Grasp", interval=span(0, 1)).uid for _ in range(100)]

    assert len(set(uids)) == 100
    assert {type(uid) for uid in uids} == {UUID}
    assert {uid.version for uid in uids} == {7}


def test_parts_are_enough_instead_of_an_interval() -> None:
    event = Event(type="Row", parts=iter([TWO, ONE]), uid=THREE)

    assert event.is_complex
    assert event.parts == (TWO, ONE)
    assert event.interval is None


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"type": ""}, "the type of an event"),
        ({"type": None}, "the type of an event"),
        ({"type": "a\x00b"}, "the type of an event"),
        ({"type": "\ud800"}, "the type of an event"),
        ({"type": "t" * 501}, "the type of an event"),
        ({"interval": None}, "needs an interval"),
        ({"interval": (at(0), at(1))}, "the interval of an event"),
        ({"interval": "2026"}, "the interval of an event"),
        ({"region": Polygon([(0, 0), (1, 0), (1, 1)])}, "the region of an event"),
        ({"region": (0, 0)}, "the region of an event"),
        ({"subject": "cup"}, "the subject of an event"),
        ({"features": {"force": float("nan")}}, "force"),
        ({"features": {"force": None}}, "force"),
        ({"features": [("force",)]}, "pair"),
        ({"features": None}, "feature"),
        ({"agent": ""}, "the agent of an event"),
        ({"agent": 7}, "the agent of an event"),
        ({"agent": "a\x1fb"}, "the agent of an event"),
        ({"payload": b"bytes"}, "the payload of an event"),
        ({"uid": "0197"}, "the uid of an event"),
        ({"uid": None}, "the uid of an event"),
        ({"parts": ["not a uid"]}, "the parts of an event"),
        ({"parts": str(TWO)}, "the parts of an event"),
        ({"parts": TWO}, "the parts of an event"),
        ({"parts": None}, "the parts of an event"),
        ({"parts": [TWO, TWO]}, "a part twice"),
    ],
)
def test_what_cannot_be_an_event_is_refused_naming_the_component(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(InvalidValue, match=complaint):
        grasp(**changes)


def test_an_event_is_not_its_own_part() -> None:
    with pytest.raises(CycleRefused, match=str(ONE)):
        grasp(parts=[TWO, ONE])


@pytest.mark.parametrize("data", ["text", None, 5, [1, 2]])
def test_a_payload_is_bytes(data: Any) -> None:
    with pytest.raises(InvalidValue, match="payload"):
        Payload(data=data)


@pytest.mark.parametrize("media_type", ["", None, "a\x00b", "m" * 501])
def test_a_media_type_is_a_short_name(media_type: Any) -> None:
    with pytest.raises(InvalidValue, match="media type"):
        Payload(data=b"", media_type=media_type)


def test_a_payload_keeps_a_copy_of_the_bytes_it_was_given() -> None:
    buffer = bytearray(b"abc")
    payload = Payload(data=buffer)  # type: ignore[arg-type]
    buffer[0] = 0

    assert payload.data == b"abc"
    assert payload == Payload(data=memoryview(b"abc"))  # type: ignore[arg-type]
    assert Payload(data=b"") != Payload(data=b"\x00")
    assert payload.media_type == "application/octet-stream"
    assert "abc" not in repr(payload)


def test_an_event_is_frozen_and_keyword_only() -> None:
    with pytest.raises(FrozenInstanceError):
        grasp().type = "Other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        Event("Grasp", span(0, 1))  # type: ignore[call-arg]


def test_values_of_a_feature_come_in_the_order_given() -> None:
    event = grasp(features=[("force", 4), ("object", "cup"), ("force", 3.2)])

    assert event.values("force") == (4, 3.2)
    assert event.value("force") == 4
    assert event.values("colour") == ()
    assert event.value("colour") is None


class Kind(str, enum.Enum):  # noqa: UP042 - the older kind of enumeration is what is tested
    """Names of types as some programs keep them."""

    GRASP = "Grasp"


def test_a_type_of_a_derived_text_class_is_the_plain_text() -> None:
    event = Event(type=Kind.GRASP, interval=span(0, 1), agent=Kind.GRASP, uid=ONE)
    assert f"{event.type}/{event.agent}" == "Grasp/Grasp"


# What events are told apart by


def test_events_with_values_of_other_kinds_are_not_equal() -> None:
    """Python holds 1 and True for equal; here they are two values."""
    assert grasp(features={"on": 1}) == grasp(features={"on": 1.0})
    assert grasp(features={"on": 1}) != grasp(features={"on": True})
    assert _stored(features=(("on", 1),)) != _stored(features=(("on", True),))


@pytest.mark.parametrize("why", SAME_CONTENT)
def test_the_same_content_has_the_same_hash(why: str) -> None:
    assert content_hash(SAME_CONTENT[why]()) == content_hash(grasp())


def test_a_hashed_uid_is_the_same_for_ever() -> None:
    assert str(hashed_uid(b"")) == "e3b0c442-98fc-8c14-9afb-f4c8996fb924"
    assert str(hashed_uid(b"elm")) == "af9b6fe9-bdaa-854b-97a1-6b90780a1c2d"
    assert {(each.version, each.variant) for each in map(hashed_uid, (b"", b"elm"))} == {(8, RFC_4122)}


def test_the_uid_is_no_content() -> None:
    assert content_hash(grasp(uid=TWO)) == content_hash(grasp())


@pytest.mark.parametrize("why", OTHER_CONTENT)
def test_one_other_component_is_other_content(why: str) -> None:
    assert content_hash(OTHER_CONTENT[why]()) != content_hash(grasp())


def test_the_other_contents_are_all_different_from_each_other() -> None:
    hashes = {why: content_hash(build()) for why, build in OTHER_CONTENT.items()}

    assert len(set(hashes.values())) == len(hashes)


def test_number_text_and_truth_value_of_one_look_are_three_contents() -> None:
    hashes = {content_hash(grasp(features=[("v", value)])) for value in (1, True, "1", "true", 1.5, "1.5")}

    assert len(hashes) == 6
    assert content_hash(grasp(features=[("v", 2**53)])) != content_hash(grasp(features=[("v", 2**53 + 1)]))
    assert content_hash(grasp(features=[("v", 2**53)])) == content_hash(grasp(features=[("v", 2.0**53)]))


def test_features_do_not_run_together() -> None:
    """Feature sets whose plain concatenations read the same."""
    pairs: list[list[tuple[str, Any]]] = [
        [("a", "b\x1fsc")],
        [("a", "b"), ("c", "")],
        [("a", "bc")],
        [("ab", "c")],
        [("a", "b,c")],
        [("a", "b"), ("a", "c")],
        [("a", "x" * 5000 + "1")],
        [("a", "x" * 5000 + "2")],
    ]

    assert len({content_hash(grasp(features=pair)) for pair in pairs}) == len(pairs)


def test_the_extents_of_a_complex_event_are_no_content() -> None:
    bare = grasp(parts=[TWO, THREE], interval=None, region=None, subject=None)

    assert content_hash(grasp(parts=[TWO, THREE])) == content_hash(bare)
    assert content_hash(grasp(parts=[TWO, THREE], interval=span(9, None), region=THERE)) == content_hash(bare)
    assert content_hash(replace(bare, agent="armar6")) != content_hash(bare)
    assert content_hash(replace(bare, features=())) != content_hash(bare)


def test_parts_are_content_as_a_set() -> None:
    assert content_hash(grasp(parts=[TWO, THREE])) == content_hash(grasp(parts=[THREE, TWO]))
    assert content_hash(grasp(parts=[TWO])) != content_hash(grasp(parts=[TWO, THREE]))


def test_a_hash_is_a_sha_256() -> None:
    assert len(content_hash(grasp())) == 32


FEATURES = st.lists(
    st.tuples(st.sampled_from("ab"), st.sampled_from([0, 1, 1.0, True, False, "1", "", 2**53, 2**53 + 1])), max_size=4
)


@given(FEATURES, FEATURES)
def test_the_hash_of_features_is_that_of_the_set(one: list[Feature], other: list[Feature]) -> None:
    def as_set(features: list[Feature]) -> set[tuple[str, str, object]]:
        return {(name, type(value).__name__.replace("float", "int"), value) for name, value in features}

    same = content_hash(grasp(features=one)) == content_hash(grasp(features=other))
    assert same == (as_set(one) == as_set(other))


# Partial and stored events


def test_a_partial_event_becomes_an_event_when_its_place_is_known() -> None:
    partial = PartialEvent(type="Grasp", interval=span(0, 1), features={"force": 3}, agent="a", subject=THERE)  # type: ignore[arg-type]

    placed = partial.complete(region=HERE)
    assert (placed.region, placed.subject, placed.uid) == (HERE, THERE, partial.uid)
    assert (placed.type, placed.interval, placed.features) == ("Grasp", span(0, 1), (("force", 3),))
    assert partial.complete(region=None).region is None


@pytest.mark.parametrize("changes", [{"type": ""}, {"interval": None}, {"features": {"a": None}}, {"agent": ""}])
def test_a_partial_event_is_valid_from_birth(changes: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        PartialEvent(**{"type": "Grasp", "interval": span(0, 1), **changes})


def _stored(**changes: Any) -> StoredEvent:
    given_fields: dict[str, Any] = {
        "id": 7,
        "uid": ONE,
        "type": "Grasp",
        "interval": span(0, 1),
        "recorded_at": at(2),
        "region": HERE,
        "features": (("force", 3), ("force", 4)),
        "parts": (TWO,),
        "wholes": (THREE,),
    }
    return StoredEvent(**{**given_fields, **changes})


def test_a_stored_event_is_immutable_and_pickles() -> None:
    event = _stored()

    with pytest.raises(AttributeError, match="immutable"):
        event.id = 8
    with pytest.raises(AttributeError, match="colour"):
        event.colour  # noqa: B018 - reading it is the test
    assert pickle.loads(pickle.dumps(event)) == event  # noqa: S301 - our own bytes
    assert event.is_complex
    assert event.values("force") == (3, 4)


@pytest.mark.parametrize("name", StoredEvent.FIELDS)
def test_stored_events_differ_when_any_field_does(name: str) -> None:
    other: dict[str, Any] = {
        "id": 8,
        "uid": TWO,
        "type": "Grip",
        "interval": span(0, None),
        "region": THERE,
        "subject": THERE,
        "features": (("force", 3),),
        "agent": "a",
        "payload": Payload(data=b""),
        "parts": (),
        "wholes": (),
        "recorded_at": at(3).astimezone(UTC),
    }

    assert _stored(**{name: other[name]}) != _stored()


def test_a_row_is_decoded_field_by_field_when_looked_at() -> None:
    asked: list[str] = []

    def reader(name: str) -> Callable[[Any], Any]:
        def read(row: Any) -> Any:
            asked.append(name)
            return row[StoredEvent.FIELDS.index(name)]

        return read

    row = [getattr(_stored(), name) for name in StoredEvent.FIELDS]
    event = StoredEvent.of_row(row, {name: reader(name) for name in StoredEvent.FIELDS})

    assert (event.type, event.type, event.id) == ("Grasp", "Grasp", 7)
    assert asked == ["type", "id"]
    assert event == _stored()


def test_a_stored_event_can_be_committed_elsewhere() -> None:
    stored = _stored(agent="a", payload=Payload(data=b""), subject=THERE)

    event = stored.as_event()
    assert (event.uid, event.type, event.interval, event.region) == (ONE, "Grasp", span(0, 1), HERE)
    assert (event.subject, event.agent, event.payload) == (THERE, "a", Payload(data=b""))
    assert (event.features, event.parts) == ((("force", 3), ("force", 4)), (TWO,))
