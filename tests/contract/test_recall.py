"""What a store recalls is what a full scan with `match` finds, whatever the cue, the order, the limit and the page."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from itertools import pairwise, product
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from elm import cues
from elm.cues.algebra import Cue
from elm.cues.relations import Place
from elm.errors import InvalidValue, UnknownEvent, UnknownType
from elm.event import Event, Payload, StoredEvent
from elm.geometry import Region
from elm.query import ByFeature, Cursor, Group, Grouping, Join, JoinRelation, Nearest, Order, Query
from elm.recollector import Recollector
from elm.store import Store
from tests.clock import at, span
from tests.conftest import StoreFactory
from tests.contract.telling import everything, few_memories, found, holds, story, tell
from tests.model import ids_of, same_events
from tests.strategies import CUE_CLASSES, NAMES, TYPE_NAMES, UIDS, Story, combined_cues, regions, single_cues, stories

SOME_CUES = st.lists(single_cues(TYPE_NAMES), min_size=1, max_size=4)
LIMITS = st.none() | st.integers(0, 5)


def ordered(events: list[StoredEvent], order: Order) -> list[StoredEvent]:
    """Events by (begin, id), by that reversed, or by id."""
    if order is Order.ID:
        return sorted(events, key=lambda event: event.id)
    by_begin = sorted(events, key=lambda event: (event.interval.begin, event.id))
    return by_begin if order is Order.BEGIN else by_begin[::-1]


# Every cue


@few_memories
@given(st.data())
def test_cues_of_every_class_recall_what_a_full_scan_finds(store_factory: StoreFactory, data: st.DataObject) -> None:
    store = store_factory()
    model = tell(store, data.draw(stories()))

    assert holds(store, model)
    for name, cue_class in CUE_CLASSES.items():
        cue = data.draw(cue_class(TYPE_NAMES), label=name)
        assert found(store, cue) == ids_of(model.scan(cue)), name


@few_memories
@given(stories(), st.lists(combined_cues(TYPE_NAMES), min_size=10, max_size=20))
def test_combined_cues_recall_what_a_full_scan_finds(
    store_factory: StoreFactory, told: Story, asked: list[Cue]
) -> None:
    store = store_factory()
    model = tell(store, told)

    for cue in asked:
        expected = model.scan(cue)
        assert same_events(list(store.find(Query(cue=cue))), expected)
        assert list(store.ids(Query(cue=cue))) == ids_of(expected)
        assert store.count(cue) == len(expected)
        assert store.exists(cue) == bool(expected)


@pytest.mark.slow
@settings(max_examples=500)
@given(stories(max_events=12), st.lists(combined_cues(TYPE_NAMES), min_size=10, max_size=20))
def test_many_combined_cues_recall_what_a_full_scan_finds(
    store_factory: StoreFactory, told: Story, asked: list[Cue]
) -> None:
    store = store_factory()
    model = tell(store, told)

    for cue in asked:
        assert found(store, cue) == ids_of(model.scan(cue))


# Order, limit, pages


@few_memories
@given(stories(), SOME_CUES, LIMITS, st.integers(1, 4))
def test_events_come_in_order_up_to_the_limit_and_page_by_page(
    store_factory: StoreFactory, told: Story, asked: list[Cue], limit: int | None, size: int
) -> None:
    store = store_factory()
    model = tell(store, told)

    for cue, order in product(asked, Order):
        expected = ids_of(ordered(model.scan(cue), order))
        query = Query(cue=cue, order=order, limit=limit)
        assert ids_of(list(store.find(query))) == expected[:limit]
        assert list(store.ids(query)) == expected[:limit]
        assert list(_page_by_page(store, cue, order, size)) == expected


def _page_by_page(store: Store, cue: Cue, order: Order, size: int) -> Iterator[int]:
    recollection = Recollector(store).recall(cue, order=order)
    page = recollection.page(size)
    yield from ids_of(page.events)
    while page.cursor is not None:
        assert len(page.events) == size
        page = recollection.page(size, after=Cursor.parse(str(page.cursor)))
        assert page.events
        yield from ids_of(page.events)


@few_memories
@given(stories(), LIMITS)
def test_after_each_event_come_those_behind_it(store_factory: StoreFactory, told: Story, limit: int | None) -> None:
    store = store_factory()
    every = tell(store, told).scan(cues.everything())

    for order in Order:
        in_order = ordered(every, order)
        for place, event in enumerate(in_order, start=1):
            query = Query(order=order, limit=limit, after=Cursor.after(event))
            assert list(store.ids(query)) == ids_of(in_order[place:][:limit])
            assert ids_of(list(store.find(query))) == ids_of(in_order[place:][:limit])


def test_a_page_goes_on_behind_a_cursor_whose_event_is_not_there(store: Store) -> None:
    """A cursor is a place in the order, not an event: what was closed or never matched does not matter."""
    tell(store, story(*(Event(type="Event", interval=span(second, second)) for second in (1, 1, 3, 5))))
    every = everything(store)

    assert list(store.ids(Query(after=Cursor(begin=at(2), id=0)))) == ids_of(every[2:])
    assert list(store.ids(Query(after=Cursor(begin=at(1), id=every[0].id)))) == ids_of(every[1:])
    assert list(store.ids(Query(order=Order.BEGIN_REVERSED, after=Cursor(begin=at(4), id=0)))) == ids_of(
        [every[2], every[1], every[0]]
    )
    assert list(store.ids(Query(after=Cursor(begin=at(9), id=0)))) == []


def test_events_of_one_begin_are_ordered_by_id(store: Store) -> None:
    tell(store, story(*(Event(type="Event", interval=span(1, end)) for end in (9, 1, None, 5))))

    ids = ids_of(everything(store))
    assert list(store.ids(Query())) == ids
    assert list(store.ids(Query(order=Order.BEGIN_REVERSED))) == ids[::-1]


def test_first_last_and_the_counts_of_a_recollection(store: Store) -> None:
    tell(store, story(*(Event(type="Event", interval=span(second, second)) for second in (2, 1, 3))))
    recall = Recollector(store).recall

    first, last = recall().first(), recall().last()
    assert first is not None
    assert last is not None
    assert (first.interval, last.interval) == (span(1, 1), span(3, 3))
    assert (recall().count(), recall(limit=2).count(), recall(limit=9).count()) == (3, 2, 3)
    assert recall(after=Cursor.after(first)).count() == 2
    assert (recall().exists(), recall(limit=0).exists(), recall(cues.any_of()).exists()) == (True, False, False)
    assert recall(cues.any_of()).first() is None
    assert recall(cues.any_of()).last() is None
    with pytest.raises(InvalidValue):
        recall(limit=2).last()


# The nearest


@few_memories
@given(stories(), SOME_CUES, regions(), LIMITS)
def test_the_nearest_come_by_distance(
    store_factory: StoreFactory, told: Story, asked: list[Cue], to: Region, limit: int | None
) -> None:
    store = store_factory()
    model = tell(store, told)

    for cue, place in product(asked, Place):
        distances: dict[int, float] = {}
        for event in model.scan(cue):
            where: Region | None = getattr(event, place.value)
            if where is not None and where.frame == to.frame:
                distances[event.id] = where.polygon.distance(to.polygon)
        nearest = sorted(distances, key=lambda number: (distances[number], number))[:limit]

        query = Query(cue=cue, order=Nearest(to=to, place=place), limit=limit)
        ids = list(store.ids(query))
        assert ids == ids_of(list(store.find(query)))
        assert len(ids) == len(set(ids)) == len(nearest)
        # The last digit of a distance is the engine's.
        assert [distances[number] for number in ids] == pytest.approx(
            [distances[number] for number in nearest], abs=1e-9
        )


def test_equally_near_events_come_by_id(store: Store) -> None:
    boxes = [(5, 0, 6, 1), (0, 5, 1, 6), (-4, 0, -3, 1), (0, 0, 1, 1), (-1, -1, 0, 0), (3, 4, 9, 9)]
    tell(store, story(*(Event(type="Event", interval=span(0, 0), region=Region.box(*box)) for box in boxes)))
    ids = ids_of(everything(store))

    # From the box (0, 0, 0, 0 grown to 1): distances 4, 4, 3, 0, 0 and hypot(2, 3).
    nearest = Query(order=Nearest(to=Region.box(0, 0, 1, 1)))
    by_distance = [ids[3], ids[4], ids[2], ids[5], ids[0], ids[1]]
    assert list(store.ids(nearest)) == by_distance
    for limit in range(7):
        assert list(store.ids(Query(order=nearest.order, limit=limit))) == by_distance[:limit]


def test_the_nearest_are_told_whole_where_their_boxes_come_in_another_order(store: Store) -> None:
    # Thin diagonals: an index has their boxes by distance, and puts right what it takes from there.
    places = [(number % 20, number // 20) for number in range(300)]
    thin = [Polygon([(x, y), (x + 5, y + 5), (x + 5.1, y + 5), (x + 0.1, y)]) for x, y in places]
    tell(
        store,
        story(*(Event(type="Event", interval=span(0, 0), region=Region(polygon=polygon)) for polygon in thin)),
    )
    to = Region.box(9, 3, 10, 4)
    distances = {event.id: event.region.polygon.distance(to.polygon) for event in everything(store) if event.region}

    for limit in (1, 5, 40):
        query = Query(order=Nearest(to=to), limit=limit)
        told = ids_of(list(store.find(query)))
        assert told == list(store.ids(query))
        assert [distances[number] for number in told] == pytest.approx(sorted(distances.values())[:limit], abs=1e-9)


def test_the_nearest_leave_out_what_has_no_such_place(store: Store) -> None:
    here = Region.box(0, 0, 1, 1)
    tell(
        store,
        story(
            Event(type="Event", interval=span(0, 0)),
            Event(type="Event", interval=span(0, 0), region=Region.box(0, 0, 1, 1, frame="odom")),
            Event(type="Event", interval=span(0, 0), subject=here),
            Event(type="Event", interval=span(0, 0), region=here),
        ),
    )
    ids = ids_of(everything(store))

    assert list(store.ids(Query(order=Nearest(to=here)))) == [ids[3]]
    assert list(store.ids(Query(order=Nearest(to=here, place=Place.SUBJECT)))) == [ids[2]]
    assert Recollector(store).recall(order=Nearest(to=here)).count() == 1
    assert not Recollector(store).recall(order=Nearest(to=Region.box(0, 0, 1, 1, frame="unheard of"))).exists()


# Groups


def _keys(event: StoredEvent, by: Grouping | ByFeature) -> list[Any]:
    begin = event.interval.begin
    match by:
        case ByFeature(name=name):
            return list(event.values(name)) or [None]
        case Grouping.TYPE:
            return [event.type]
        case Grouping.AGENT:
            return [event.agent]
        case Grouping.FRAME:
            return [None if event.region is None else event.region.frame]
        case Grouping.DAY:
            return [datetime(begin.year, begin.month, begin.day, tzinfo=UTC)]
        case Grouping.HOUR:
            return [datetime(begin.year, begin.month, begin.day, begin.hour, tzinfo=UTC)]


def _identity(key: Any) -> tuple[str, Any]:
    """Keys as features are told apart: numbers by value, and from truth values and texts."""
    kind = type(key).__name__
    return ("number" if kind in ("int", "float") else kind), key


def _brute_groups(events: list[StoredEvent], by: Grouping | ByFeature) -> dict[tuple[str, Any], tuple[Any, ...]]:
    members: dict[tuple[str, Any], list[StoredEvent]] = {}
    for event in events:
        for key in _keys(event, by):
            members.setdefault(_identity(key), []).append(event)
    result: dict[tuple[str, Any], tuple[Any, ...]] = {}
    for key, group in members.items():
        durations = [event.interval.duration or timedelta(0) for event in group]
        ends = [event.interval.end for event in group if event.interval.end is not None]
        result[key] = (
            len(group),
            sum(durations, timedelta(0)),
            min(event.interval.begin for event in group),
            max(ends) if len(ends) == len(group) else None,
        )
    return result


def _shown(group: Group) -> tuple[Any, ...]:
    return group.count, group.duration, group.first_begin, group.last_end


@few_memories
@given(stories(), SOME_CUES)
def test_groups_are_those_of_brute_force(store_factory: StoreFactory, told: Story, asked: list[Cue]) -> None:
    store = store_factory()
    model = tell(store, told)

    for cue, by in product(asked, [*Grouping, *(ByFeature(name=name) for name in NAMES)]):
        groups = store.groups(cue, by)
        assert {_identity(group.key): _shown(group) for group in groups} == _brute_groups(model.scan(cue), by)
        keys = [_identity(group.key) for group in groups]
        assert len(set(keys)) == len(keys)
        assert None not in [key for _, key in keys[:-1]]
        for kind in {kind for kind, _ in keys}:
            alike = [key for key_kind, key in keys if key_kind == kind]
            assert alike == sorted(alike, key=lambda key: (key is None, key))


def test_days_and_hours_are_those_of_utc(store: Store) -> None:
    told = story(
        Event(type="Event", interval=span(0, 1)),
        Event(type="Event", interval=span(3_599, 3_600)),
        Event(type="Event", interval=span(3_600, 3_600)),
        Event(type="Event", interval=span(14 * 3_600, None)),
    )
    tell(store, told)

    hours = store.groups(cues.everything(), Grouping.HOUR)
    assert [(group.key, group.count) for group in hours] == [(at(0), 2), (at(3_600), 1), (at(14 * 3_600), 1)]
    assert [group.last_end for group in hours] == [at(3_600), at(3_600), None]
    days = store.groups(cues.everything(), Grouping.DAY)
    assert [(group.key, group.count) for group in days] == [
        (datetime(2026, 1, 1, tzinfo=UTC), 3),
        (datetime(2026, 1, 2, tzinfo=UTC), 1),
    ]


def test_an_event_counts_in_each_of_its_values_and_without_any_in_none(store: Store) -> None:
    tell(
        store,
        story(
            Event(type="Event", interval=span(0, 2), features=[("v", 1), ("v", 2.5)]),
            Event(type="Event", interval=span(1, 5), features=[("v", 1.0), ("w", 9)]),
            Event(type="Event", interval=span(2, None), features=[("v", 1)]),
            Event(type="Event", interval=span(3, 4)),
        ),
    )

    groups = store.groups(cues.everything(), ByFeature(name="v"))
    assert [group.key for group in groups] == [1, 2.5, None]
    assert list(map(_shown, groups)) == [
        (3, timedelta(seconds=6), at(0), None),
        (1, timedelta(seconds=2), at(0), at(2)),
        (1, timedelta(seconds=1), at(3), at(4)),
    ]


# Neighbours in time


def _neighbour(
    anchor: StoredEvent, candidates: list[StoredEvent], relation: JoinRelation, *, same_region: bool
) -> StoredEvent | None:
    def is_near(event: StoredEvent) -> bool:
        if not same_region:
            return True
        here, there = anchor.region, event.region
        if here is None or there is None or here.frame != there.frame:
            return False
        return bool(here.polygon.intersects(there.polygon))

    near = [event for event in candidates if is_near(event)]
    if relation is JoinRelation.BEFORE:
        begin = anchor.interval.begin
        before = [event for event in near if event.interval.end is not None and event.interval.end < begin]
        return max(before, key=lambda event: (event.interval.begin, event.id), default=None)
    end = anchor.interval.end
    after = [event for event in near if end is not None and event.interval.begin > end]
    return min(after, key=lambda event: (event.interval.begin, event.id), default=None)


@few_memories
@given(stories(), single_cues(TYPE_NAMES), SOME_CUES, st.sampled_from(Order), LIMITS)
def test_neighbours_in_time_are_those_of_brute_force(
    store_factory: StoreFactory, told: Story, anchor_cue: Cue, asked: list[Cue], order: Order, limit: int | None
) -> None:
    store = store_factory()
    model = tell(store, told)

    anchors = ordered(model.scan(anchor_cue), order)[:limit]
    query = Query(cue=anchor_cue, order=order, limit=limit)
    for cue, relation, same_region in product(asked, JoinRelation, (False, True)):
        candidates = model.scan(cue)
        expected = [_neighbour(anchor, candidates, relation, same_region=same_region) for anchor in anchors]
        pairs = list(store.join(Join(anchors=query, relation=relation, cue=cue, same_region=same_region)))
        assert same_events([anchor for anchor, _ in pairs], anchors)
        assert [other and other.id for _, other in pairs] == [other and other.id for other in expected]
        assert same_events([other for _, other in pairs if other], [other for other in expected if other])


def test_neighbours_lie_strictly_before_and_after(store: Store) -> None:
    here, elsewhere = Region.box(0, 0, 2, 2), Region.box(5, 5, 6, 6)
    tell(
        store,
        story(
            Event(type="Turn", interval=span(10, 12), region=here),
            Event(type="Contact", interval=span(0, 9), region=here),
            Event(type="Contact", interval=span(2, 9.999999), region=elsewhere),
            Event(type="Contact", interval=span(3, 10), region=here),
            Event(type="Contact", interval=span(4, None), region=here),
            Event(type="Contact", interval=span(12, 13), region=here),
            Event(type="Contact", interval=span(12.000001, 13), region=elsewhere),
            Event(type="Contact", interval=span(14, None), region=Region.box(2, 2, 3, 3)),
            types=["Turn", "Contact"],
        ),
    )
    turns = Recollector(store).recall(cues.exactly("Turn"))
    contact = cues.exactly("Contact")

    def begins(pairs: Iterator[tuple[StoredEvent, StoredEvent | None]]) -> list[datetime | None]:
        return [None if other is None else other.interval.begin for _, other in pairs]

    assert begins(turns.latest_before(contact)) == [at(2)]
    assert begins(turns.latest_before(contact, same_region=True)) == [at(0)]
    assert begins(turns.first_after(contact)) == [at(12.000001)]
    assert begins(turns.first_after(contact, same_region=True)) == [at(14)]
    assert begins(turns.latest_before(cues.exactly("Turn"))) == [None]
    contacts = Recollector(store).recall(contact)
    assert begins(contacts.first_after(cues.exactly("Turn"))) == [at(10), at(10), None, None, None, None, None]


# Single events, numbers, types


def test_events_are_found_by_id_and_by_uid(store: Store) -> None:
    model = tell(
        store, story(*(Event(type="Event", interval=span(second, 9), uid=UIDS[second]) for second in range(4)))
    )
    ids = ids_of(everything(store))

    assert same_events(store.get([ids[2], 999_999, ids[0]]), [model.stored(UIDS[0]), model.stored(UIDS[2])])
    assert store.get([]) == []
    recollector = Recollector(store)
    assert recollector.get(UIDS[1]).id == ids[1]
    assert recollector.get(ids[1]).uid == UIDS[1]
    for unknown in (UUID(int=99), 999_999, -1):
        with pytest.raises(UnknownEvent, match=str(unknown)):
            recollector.get(unknown)


@few_memories
@given(stories())
def test_statistics_count_what_is_there(store_factory: StoreFactory, told: Story) -> None:
    store = store_factory()
    model = tell(store, told)
    events = model.scan(cues.everything())

    found_statistics = store.statistics()
    places = [place for event in events for place in (event.region, event.subject) if place is not None]
    assert found_statistics.events == len(events)
    assert found_statistics.complex_events == sum(event.is_complex for event in events)
    assert found_statistics.open_events == sum(event.interval.is_open for event in events)
    assert found_statistics.links == sum(len(event.parts) for event in events)
    assert found_statistics.types == len(TYPE_NAMES)
    assert found_statistics.frames == len({place.frame for place in places})
    assert found_statistics.agents == len({event.agent for event in events if event.agent is not None})
    begins = [event.interval.begin for event in events]
    assert found_statistics.first_begin == min(begins, default=None)
    assert found_statistics.last_begin == max(begins, default=None)
    assert found_statistics.last_recorded_at == max((event.recorded_at for event in events), default=None)


@pytest.mark.parametrize("cue", [cues.exactly("Dance"), cues.is_a("Dance")])
def test_an_unknown_type_in_a_cue_is_an_error_wherever_it_stands(store: Store, cue: Cue) -> None:
    tell(store, story(types=["Event"]))

    for asked in (cue, ~cue, cues.any_of() & cue, cues.everything() | cue, cue & cues.agent("nobody")):
        for ask in (
            lambda asked=asked: list(store.find(Query(cue=asked))),
            lambda asked=asked: list(store.ids(Query(cue=asked))),
            lambda asked=asked: store.count(asked),
            lambda asked=asked: store.exists(asked),
            lambda asked=asked: store.groups(asked, Grouping.TYPE),
            lambda asked=asked: list(store.join(Join(anchors=Query(), relation=JoinRelation.BEFORE, cue=asked))),
        ):
            with pytest.raises(UnknownType, match="'Dance'"):
                ask()


# Streams


def test_a_stream_shows_one_moment_whatever_is_written_meanwhile(store: Store) -> None:
    uids = UIDS[:6]
    model = tell(store, story(*(Event(type="Event", interval=span(i, None), uid=uid) for i, uid in enumerate(uids))))
    expected = model.scan(cues.everything())

    stream = store.find(Query())
    read = [next(stream)]
    tell(store, story(Event(type="Event", interval=span(9, 9))))
    store.close_event(uids[4], at(99))
    read += stream
    assert same_events(read, expected)
    assert store.count(cues.everything()) == 7


def test_streams_may_be_read_in_turns_and_left(store: Store) -> None:
    tell(store, story(*(Event(type="Event", interval=span(second, second)) for second in range(20))))

    one, other, left = store.find(Query()), store.find(Query(order=Order.BEGIN_REVERSED)), store.find(Query())
    next(left)
    del left
    pairs = list(zip(one, other, strict=True))
    assert [first.id for first, _ in pairs] == [second.id for _, second in pairs][::-1]
    assert all(first.id < second.id for (first, _), (second, _) in pairwise(pairs))


def test_payloads_and_texts_come_back_as_they_were(store: Store) -> None:
    data = bytes(range(256)) * 40
    text = "  'quoted' \"twice\" \\ 100% {}\n\tø 😀 \u202e"
    event = Event(
        type=text,
        interval=span(0, 1),
        agent=text,
        features=[(text, text)],
        payload=Payload(data=data, media_type=text),
        region=Region.box(0, 0, 1, 1, frame=text),
        uid=UUID(int=1),
    )
    tell(store, story(event))

    (stored,) = everything(store)
    assert stored.as_event() == event
    assert type(stored.payload.data if stored.payload else None) is bytes


# Tables and explanations


@few_memories
@given(stories(), single_cues(TYPE_NAMES), st.sampled_from(Order), LIMITS)
def test_an_arrow_table_holds_the_same_events(
    store_factory: StoreFactory, told: Story, cue: Cue, order: Order, limit: int | None
) -> None:
    pytest.importorskip("pyarrow")
    import msgspec

    store = store_factory()
    expected = ordered(tell(store, told).scan(cue), order)[:limit]

    rows = store.arrow(Query(cue=cue, order=order, limit=limit)).read_all().to_pylist()
    assert [row["id"] for row in rows] == ids_of(expected)
    for row, event in zip(rows, expected, strict=True):
        assert UUID(bytes=row["uid"]) == event.uid if isinstance(row["uid"], bytes) else row["uid"] == event.uid
        assert (row["type"], row["agent"]) == (event.type, event.agent)
        assert (row["begin"], row["end"], row["recorded_at"]) == (
            event.interval.begin,
            event.interval.end,
            event.recorded_at,
        )
        for name in ("region", "subject"):
            place: Region | None = getattr(event, name)
            frame, wkb = row[f"{name}_frame"], row[name]
            assert (None if frame is None else Region.from_wkb(wkb, frame=frame)) == place
        pairs = [(name, type(value), value) for name, value in msgspec.json.decode(row["features"])]
        assert pairs == [(name, type(value), value) for name, value in event.features]
        assert row["payload"] == (None if event.payload is None else event.payload.data)
        assert row["media_type"] == (None if event.payload is None else event.payload.media_type)
        assert [UUID(bytes=part) for part in row["parts"]] == list(event.parts)
        assert {UUID(bytes=whole) for whole in row["wholes"]} == set(event.wholes)


@few_memories
@given(stories(), st.lists(single_cues(TYPE_NAMES), min_size=1, max_size=4))
def test_an_explanation_counts_what_each_condition_keeps(
    store_factory: StoreFactory, told: Story, conditions: list[Cue]
) -> None:
    store = store_factory()
    model = tell(store, told)
    cue = cues.all_of(*conditions)

    explanation = store.explain(Query(cue=cue))
    assert explanation.plan
    assert explanation.events == len(model.events)
    left = [condition.left for condition in explanation.conditions]
    assert left == sorted(left, reverse=True)
    assert left[-1:] == ([] if cue == cues.everything() else [len(model.scan(cue))])
    assert all(condition.left <= condition.alone <= explanation.events for condition in explanation.conditions)
    assert all(condition.condition for condition in explanation.conditions)
