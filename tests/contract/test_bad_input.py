"""Input that breaks stores: a clear error or a right answer, never the driver's error, never half an event."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from functools import partial
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elm import cues
from elm.cues.algebra import DEPTH_LIMIT, Cue
from elm.cues.relations import Place
from elm.errors import ElmError, StoreClosed, UnknownEvent
from elm.event import Event, Payload
from elm.geometry import LIMIT, Region
from elm.interval import Interval
from elm.query import ByFeature, Cursor, Grouping, Join, JoinRelation, Nearest, Order, Query
from elm.recollector import Recollector
from elm.store import Arrival, Store
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.contract.telling import everything, found, is_clear, story, tell
from tests.strategies import CUE_CLASSES, TYPE_NAMES

A, B = UUID(int=1), UUID(int=2)
BOX = Region.box(0, 0, 1, 1)

TEXTS = [
    "'; DROP TABLE event; --",
    "' OR '1'='1",
    '"; DROP SCHEMA elm CASCADE; --',
    "quote ' and \" and `",
    "100% %s %(name)s %%",
    ":name ::text $1 ?",
    "{} {0} {name}",
    "\\ \\\\ \\n E'\\x00'",
    "line\nbreak\rand\ttab",
    "NULL",
    "null",
    "infinity",
    "{a,b}",
    '{"a": 1}',
    "[1, 2]",
    "(1,2)",
    "/* comment */ -- comment",
    " blanks around ",
    "ÄÖÜ äöü ß",
    "日本語",
    "😀👩‍👩‍👧",
    "\u202eright to left",
    "\ufeffmark",
    "e\u0301",
    "\uffff",
    "\x01\x02\x7f",
    "x" * 500,
]
"""Texts of at most 500 bytes that are legal in every string field."""


# Quotes and SQL in every string field


@pytest.mark.parametrize("text", TEXTS, ids=range(len(TEXTS)))
def test_any_text_in_any_field_is_kept_and_recalled_by_it(store: Store, text: str) -> None:
    store.add_types([EventType(name="Other"), EventType(name=text, parents=("Other",))])
    event = Event(
        type=text,
        uid=A,
        interval=span(0, 1),
        region=Region.box(0, 0, 1, 1, frame=text),
        subject=Region.box(0, 0, 1, 1, frame=text),
        features=[(text, text), (text, 1)],
        agent=text,
        payload=Payload(data=text.encode(), media_type=text),
    )
    store.commit(Arrival(event=event))
    store.commit(Arrival(event=Event(type="Other", uid=B, interval=span(2, 3), features={"other": "other"})))

    assert everything(store)[0].as_event() == event
    framed = Region.box(0, 0, 1, 1, frame=text)
    for cue in (
        cues.exactly(text),
        cues.is_a(text),
        cues.region("equal", framed),
        cues.subject("intersects", framed),
        cues.within(0, framed),
        cues.features("equal", [(text, 1), (text, text)]),
        cues.features("superset", [(text, text)]),
        cues.features("intersects", [(text, text), ("other", 2)]),
        cues.features("subset", [(text, text), (text, 1), ("more", text)]),
        cues.feature_names("equal", [text]),
        cues.feature_names("intersects", [text, "more"]),
        cues.feature(text, "=", text),
        cues.feature(text, "<=", text),
        cues.feature(text, "like", text.replace("\\", "\\\\").replace("%", "\\%").replace("_", "\\_")),
        cues.feature(text, "=", 1),
        cues.payload(text.encode()),
        cues.agent(text),
    ):
        assert [stored.uid for stored in store.find(Query(cue=cue))] == [A], cue
        assert [stored.uid for stored in store.find(Query(cue=~cue))] == [B], cue
    assert [group.key for group in store.groups(cues.exactly(text), Grouping.TYPE)] == [text]
    assert [group.key for group in store.groups(cues.exactly(text), Grouping.AGENT)] == [text]
    assert [group.key for group in store.groups(cues.exactly(text), Grouping.FRAME)] == [text]
    assert {group.key for group in store.groups(cues.exactly(text), ByFeature(name=text))} == {text, 1}
    assert [stored.uid for stored in store.find(Query(order=Nearest(to=framed)))] == [A]
    assert store.explain(Query(cue=cues.agent(text) & cues.exactly(text))).plan


def test_texts_are_all_told_apart(store: Store) -> None:
    tell(store, story(*(Event(type="Event", interval=span(0, 0), agent=text, features={"v": text}) for text in TEXTS)))

    for text in TEXTS:
        assert store.count(cues.agent(text)) == 1
        assert store.count(cues.feature("v", "=", text)) == 1
        assert store.count(cues.features("equal", {"v": text})) == 1
    assert len(store.groups(cues.everything(), Grouping.AGENT)) == len(TEXTS)
    assert [group.key for group in store.groups(cues.everything(), ByFeature(name="v"))] == sorted(TEXTS)


# A great deal of it


def test_ten_thousand_features_are_kept_and_recalled(store: Store) -> None:
    features = [(f"name {number}", number) for number in range(9_000)] + [("same", number) for number in range(1_000)]
    tell(store, story(Event(type="Event", uid=A, interval=span(0, 1), features=features), types=["Event"]))
    store.commit(Arrival(event=Event(type="Event", uid=B, interval=span(0, 1), features=features[:-1])))

    (first, second) = everything(store)
    assert first.features == tuple(features)
    assert len(second.features) == 9_999
    assert found(store, cues.features("equal", features)) == [first.id]
    assert found(store, cues.features("superset", features[:5_000])) == [first.id, second.id]
    assert found(store, cues.feature_names("equal", [name for name, _ in features])) == [first.id, second.id]
    assert found(store, cues.feature("same", "=", 999)) == [first.id]


def test_a_subset_of_ten_thousand_features_is_asked_for(store: Store) -> None:
    features = [(f"name {number}", number) for number in range(10_000)]
    tell(store, story(Event(type="Event", interval=span(0, 1), features=features[::1_000])))

    assert store.count(cues.features("subset", features)) == 1
    assert store.count(cues.features("subset", features[:-1_001])) == 0
    assert store.count(cues.feature_names("subset", [name for name, _ in features])) == 1


def test_very_long_texts_are_kept_and_told_apart(store: Store) -> None:
    """Incompressible, so that no index entry would hold them."""
    import random

    source = random.Random(5)
    text = "".join(chr(source.randrange(0x4E00, 0x9FFF)) for _ in range(100_000))
    tell(
        store,
        story(
            Event(type="Event", interval=span(0, 1), features=[("v", text + "1"), (text, 1)]),
            Event(type="Event", interval=span(0, 1), features=[("v", text + "2"), (text + "2", 1)]),
        ),
    )
    first, second = everything(store)

    assert first.value("v") == text + "1"
    assert found(store, cues.feature("v", "=", text + "1")) == [first.id]
    assert found(store, cues.feature("v", ">", text + "1")) == [second.id]
    assert found(store, cues.features("superset", {"v": text + "2"})) == [second.id]
    assert found(store, cues.feature_names("superset", [text])) == [first.id]
    assert found(store, cues.feature(text, "=", 1)) == [first.id]


def test_an_outline_of_many_corners_is_kept(store: Store) -> None:
    import math

    from shapely.geometry import Polygon

    corners = [(1e6 * math.cos(turn / 1_591.5), 1e6 * math.sin(turn / 1_591.5)) for turn in range(10_000)]
    region = Region(polygon=Polygon(corners))
    tell(store, story(Event(type="Event", interval=span(0, 1), region=region)))

    assert everything(store)[0].region == region
    assert store.count(cues.region("equal", region)) == 1


def test_a_cue_of_very_many_uids_features_and_names_is_answered(store: Store) -> None:
    tell(store, story(Event(type="Event", uid=A, interval=span(0, 1), features={"v": 7})))
    uids = [UUID(int=number) for number in range(1, 70_001)]

    assert store.count(cues.uid(*uids)) == 1
    assert store.count(cues.parts("subset", uids)) == 1
    assert store.count(cues.wholes("intersects", uids)) == 0
    assert store.count(cues.features("intersects", [("v", number) for number in range(70_000)])) == 1
    assert store.count(cues.feature_names("intersects", [f"name {number}" for number in range(70_000)])) == 0


@pytest.mark.parametrize("several", [cues.all_of, cues.any_of])
def test_a_cue_of_a_thousand_conditions_is_answered(store: Store, several: Callable[..., Cue]) -> None:
    tell(store, story(Event(type="Event", interval=span(0, 1), agent="a5")))

    wide = several(*(cues.agent(f"a{number}") for number in range(1_000)))
    assert store.count(wide) == (1 if several is cues.any_of else 0)
    assert store.count(~wide) == (0 if several is cues.any_of else 1)


def test_a_cue_of_more_conditions_than_a_statement_has_parameters_is_answered_or_refused(store: Store) -> None:
    tell(store, story(Event(type="Event", interval=span(0, 1), agent="a5")))

    wide = cues.any_of(*(cues.agent(f"a{number}") for number in range(70_000)))
    _right_or_refused(lambda: store.count(wide), 1)


def test_a_cue_as_deep_as_allowed_is_answered(store: Store) -> None:
    tell(store, story(Event(type="Event", interval=span(0, 1), agent="a")))
    cue, negated = cues.agent("a"), cues.agent("b")
    for level in range(DEPTH_LIMIT):
        cue = ~cue
        negated = (negated & cues.everything()) if level % 2 else (negated | cues.any_of())

    assert store.count(cue) == 1
    assert store.count(negated) == 0
    assert store.explain(Query(cue=cue)).plan


@pytest.mark.slow
def test_a_payload_of_100_megabytes_is_kept_and_recalled(store: Store) -> None:
    data = bytes(range(250)) * 400_000
    tell(store, story(Event(type="Event", uid=A, interval=span(0, 1), payload=Payload(data=data)), types=["Event"]))
    store.commit(Arrival(event=Event(type="Event", interval=span(0, 1), payload=Payload(data=data[:-1]))))

    assert len(data) == 100_000_000
    (stored,) = store.find(Query(cue=cues.payload(data)))
    assert stored.uid == A
    assert stored.payload == Payload(data=data)
    assert not store.commit(Arrival(event=stored.as_event())).new


# Empty everything


def test_an_empty_memory_answers_everything_with_nothing(store: Store) -> None:
    tell(store, story(types=["Event"]))

    assert everything(store) == []
    for query in (Query(), Query(order=Order.BEGIN_REVERSED), Query(order=Nearest(to=BOX)), Query(limit=0)):
        assert list(store.find(query)) == []
        assert list(store.ids(query)) == []
        assert list(store.join(Join(anchors=query, relation=JoinRelation.BEFORE, cue=cues.everything()))) == []
    assert (store.count(cues.everything()), store.exists(cues.everything())) == (0, False)
    assert store.groups(cues.everything(), Grouping.TYPE) == []
    assert store.groups(cues.everything(), ByFeature(name="v")) == []
    assert Recollector(store).recall().page().events == ()
    assert store.get([1]) == []
    assert store.explain(Query()).plan
    statistics = store.statistics()
    assert (statistics.events, statistics.first_begin, statistics.last_recorded_at) == (0, None, None)
    store.finish_load()
    with pytest.raises(UnknownEvent):
        Recollector(store).get(A)


@settings(max_examples=3)
@given(st.data())
def test_cues_of_every_class_find_nothing_in_an_empty_memory(store: Store, data: st.DataObject) -> None:
    tell(store, story(types=TYPE_NAMES))

    for cue_class in CUE_CLASSES.values():
        cue = data.draw(cue_class(TYPE_NAMES))
        assert found(store, cue) == []
        assert found(store, ~cue) == []
        assert not store.exists(cue)


def test_the_least_there_can_be_of_every_component(store: Store) -> None:
    event = Event(
        type="x",
        uid=A,
        interval=span(0, 0),
        features={"x": ""},
        agent="x",
        payload=Payload(data=b"", media_type="x"),
        region=Region.box(0, 0, 1e-6, 1e-6, frame="x"),
    )
    tell(store, story(event))

    assert [stored.as_event() for stored in everything(store)] == [event]


# The ends of numbers


def test_the_ends_of_time_and_space_are_kept(store: Store) -> None:
    first, last = datetime.min.replace(tzinfo=UTC), datetime.max.replace(tzinfo=UTC)
    vast = Region.box(-LIMIT, -LIMIT, LIMIT, LIMIT)
    event = Event(type="Event", uid=A, interval=Interval(begin=first, end=last), region=vast)
    tell(store, story(event, Event(type="Event", uid=B, interval=Interval(begin=last, end=None))))

    assert [stored.interval for stored in everything(store)] == [event.interval, Interval(begin=last, end=None)]
    assert store.count(cues.time("equal", first, last)) == 1
    assert store.count(cues.time("met_by", None, last)) == 1
    assert store.count(cues.region("superset", BOX)) == 1
    assert store.count(cues.lasting("<", timedelta.max)) == 1
    assert store.count(cues.lasting(">", timedelta.min)) == 1
    assert store.groups(cues.everything(), Grouping.TYPE)[0].first_begin == first
    assert [stored.uid for stored in store.find(Query(after=Cursor(begin=first, id=2**62)))] == [B]


def test_what_lasted_for_ages_is_summed(store: Store) -> None:
    """Thirty events from the year 1 on: together more microseconds than fit into 64 bits."""
    store.add_types([EventType(name="Thing")])
    ages = Interval(begin=datetime(1, 1, 1, tzinfo=UTC), end=datetime(9999, 12, 31, 23, 59, 59, 999_999, tzinfo=UTC))
    store.commit_all([Arrival(event=Event(type="Thing", interval=ages)) for _ in range(30)])

    (group,) = store.groups(cues.everything(), Grouping.TYPE)
    assert ages.end is not None
    assert group.duration == 30 * (ages.end - ages.begin)


def _right_or_refused(ask: Callable[[], Any], right: Any) -> None:
    """The right answer or an error of elm's that is not the last resort."""
    try:
        answer = ask()
    except ElmError as error:
        answer = right if is_clear(error) else error
    assert answer == right


@pytest.mark.parametrize("number", [0, -1, 2**31, 2**63 - 1, 2**63, -(2**63) - 1, 10**30])
def test_ids_that_no_event_can_have_are_unknown(store: Store, number: int) -> None:
    tell(store, story(Event(type="Event", interval=span(0, 1))))

    _right_or_refused(lambda: store.get([number]), [])
    with pytest.raises(ElmError) as caught:
        Recollector(store).get(number)
    assert is_clear(caught.value)


def _behind(store: Store, order: Order, number: int) -> list[int]:
    return list(store.ids(Query(order=order, after=Cursor(begin=at(0), id=number))))


def _first(store: Store, limit: int) -> list[int]:
    return list(store.ids(Query(limit=limit)))


@pytest.mark.parametrize("number", [0, -1, 2**31, 2**63 - 1, 2**63, 10**30])
def test_cursors_and_limits_of_any_size_are_answered_or_refused(store: Store, number: int) -> None:
    tell(store, story(Event(type="Event", interval=span(0, 1))))
    (event,) = everything(store)
    behind = [event.id] if number < event.id else []

    for order in (Order.BEGIN, Order.ID):
        _right_or_refused(partial(_behind, store, order, number), behind)
    if number >= 0:
        _right_or_refused(partial(_first, store, number), [event.id][:number])


def test_numbers_at_their_ends_compare_exactly(store: Store) -> None:
    values = [-1.7976931348623157e308, -(2**63), -5e-324, 0, 5e-324, 0.1, 2**53, 2**53 + 1, 2**63 - 1, 1e300]
    tell(store, story(*(Event(type="Event", interval=span(0, 0), features={"v": value}) for value in values)))
    ids = [event.id for event in everything(store)]

    for place, value in enumerate(values):
        assert found(store, cues.feature("v", "<", value)) == ids[:place]
        assert found(store, cues.feature("v", "=", value)) == [ids[place]]
        assert found(store, cues.feature("v", ">", value)) == ids[place + 1 :]
    assert [group.key for group in store.groups(cues.everything(), ByFeature(name="v"))] == values


# A store that was closed


def test_a_closed_store_refuses_every_call_and_may_be_closed_again(store: Store) -> None:
    tell(store, story(Event(type="Event", uid=A, interval=span(0, None))))
    store.close()
    store.close()

    calls: list[Callable[[], object]] = [
        lambda: store.add_types([EventType(name="Event")]),
        lambda: list(store.types()),
        lambda: store.commit(Arrival(event=Event(type="Event", interval=span(0, 1)))),
        lambda: store.commit_all([Arrival(event=Event(type="Event", interval=span(0, 1)))]),
        lambda: store.load([Arrival(event=Event(type="Event", interval=span(0, 1)))]),
        lambda: store.close_event(A, at(1)),
        lambda: list(store.find(Query())),
        lambda: list(store.ids(Query())),
        lambda: store.count(cues.everything()),
        lambda: store.exists(cues.everything()),
        lambda: store.groups(cues.everything(), Grouping.TYPE),
        lambda: list(store.join(Join(anchors=Query(), relation=JoinRelation.BEFORE, cue=cues.everything()))),
        lambda: store.get([1]),
        lambda: store.explain(Query()),
        lambda: store.statistics(),
    ]
    for call in calls:
        with pytest.raises(StoreClosed):
            call()


def test_places_are_asked_by_their_own_column(store: Store) -> None:
    """A name of a place is no name of the other."""
    tell(store, story(Event(type="Event", uid=A, interval=span(0, 1), subject=BOX)))

    assert [event.uid for event in store.find(Query(order=Nearest(to=BOX, place=Place.SUBJECT)))] == [A]
    assert list(store.find(Query(order=Nearest(to=BOX, place=Place.REGION)))) == []
