"""Committing: once per uid and content, all or nothing, in any order, with extents that derive from the parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from elm import cues
from elm.errors import ConflictingContent, CycleRefused, ElmError, ExtentRefused, UnknownEvent, UnknownType
from elm.event import Event, StoredEvent
from elm.geometry import Region
from elm.interval import Interval
from elm.store import Arrival, Store
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.conftest import StoreFactory
from tests.contents import CONTENT_TYPES, ONE, OTHER_CONTENT, SAME_CONTENT, THREE, TWO, grasp
from tests.contract.telling import everything, few_memories, holds, is_clear, numbered, story, tell
from tests.model import same_events
from tests.strategies import UIDS, Story, stories

A, B, C, D, E, F = (UUID(int=number) for number in range(1, 7))
NOBODY = UUID(int=99)


def one(uid: UUID, begin: float = 0, end: float | None = 1, **fields: Any) -> Event:
    """An atomic event."""
    return Event(type="Event", uid=uid, interval=span(begin, end), **fields)


def whole(uid: UUID, *parts: UUID, **fields: Any) -> Event:
    """A complex event."""
    return Event(type="Event", uid=uid, parts=parts, **fields)


def get(store: Store, uid: UUID) -> StoredEvent:
    """The one event with this uid."""
    (event,) = [event for event in everything(store) if event.uid == uid]
    return event


@pytest.fixture
def typed(store: Store) -> Store:
    """An empty memory that knows the type Event."""
    store.add_types([EventType(name="Event")])
    return store


# One event


def test_a_commit_says_what_it_did_and_ids_grow(typed: Store) -> None:
    before = datetime.now(UTC)
    first = typed.commit(Arrival(event=one(B)))
    second = typed.commit(Arrival(event=one(A), recorded_at=at(5)))
    after = datetime.now(UTC)

    assert (first.uid, first.new, second.uid, second.new) == (B, True, A, True)
    assert first.id < second.id
    slack = timedelta(seconds=1)
    assert before - slack <= get(typed, B).recorded_at <= after + slack
    assert get(typed, A).recorded_at == at(5)
    assert [event.id for event in everything(typed)] == [first.id, second.id]


def test_the_same_event_again_is_there_already_and_nothing_changes(typed: Store) -> None:
    first = typed.commit(Arrival(event=one(A), recorded_at=at(5)))
    held = everything(typed)

    again = typed.commit(Arrival(event=one(A), recorded_at=at(6)))
    assert (again.id, again.uid, again.new) == (first.id, A, False)
    assert same_events(everything(typed), held)


def test_events_without_a_given_uid_are_new_every_time(typed: Store) -> None:
    ids = {typed.commit(Arrival(event=Event(type="Event", interval=span(0, 1)))).id for _ in range(3)}

    assert len(ids) == 3
    assert typed.count(cues.everything()) == 3


def test_the_same_content_however_written_is_there_already(store: Store) -> None:
    store.add_types([EventType(name=name) for name in CONTENT_TYPES])
    first = store.commit(Arrival(event=grasp()))
    held = everything(store)

    for why, build in SAME_CONTENT.items():
        again = store.commit(Arrival(event=build()))
        assert (again.id, again.new) == (first.id, False), why
    assert [each.new for each in store.commit_all([Arrival(event=build()) for build in SAME_CONTENT.values()])] == [
        False
    ] * len(SAME_CONTENT)
    report = store.load([Arrival(event=build()) for build in SAME_CONTENT.values()])
    assert (report.new, report.existing, report.refused) == (0, len(SAME_CONTENT), ())
    assert same_events(everything(store), held)


def test_other_content_under_the_same_uid_is_refused_whatever_differs(store: Store) -> None:
    store.add_types([EventType(name=name) for name in CONTENT_TYPES])
    for uid in (TWO, THREE):
        store.commit(Arrival(event=grasp(uid=uid)))
    store.commit(Arrival(event=grasp()))
    held = everything(store)

    for why, build in OTHER_CONTENT.items():
        with pytest.raises(ConflictingContent, match=str(ONE)):
            store.commit(Arrival(event=build()))
        with pytest.raises(ConflictingContent, match=str(ONE)):
            store.commit_all([Arrival(event=grasp(uid=NOBODY)), Arrival(event=build())])
        report = store.load([Arrival(event=build())])
        assert (report.new, report.existing, len(report.refused)) == (0, 0, 1), why
        assert str(ONE) in report.refused[0].reason, why
        assert same_events(everything(store), held), why


def test_numbers_texts_and_truth_values_of_one_look_are_kept_apart(typed: Store) -> None:
    values = [1, True, "1", 1.5, "true", 0, False, "", 2**53, 2**53 + 1, 2**63 - 1, -(2**63), 1e300, 5e-324, -0.0]
    event = one(A, features=[("v", value) for value in values])
    typed.commit(Arrival(event=event))

    stored = get(typed, A)
    assert [(name, type(value), value) for name, value in stored.features] == [
        (name, type(value), value) for name, value in event.features
    ]


# Refused, and then nothing happened


REFUSED: dict[str, tuple[type[ElmError], str, Event]] = {
    "unknown type": (UnknownType, "'Dance'", Event(type="Dance", uid=F, interval=span(0, 1))),
    "unknown type, by case": (UnknownType, "'event'", Event(type="event", uid=F, interval=span(0, 1))),
    "unknown part": (UnknownEvent, str(NOBODY), whole(F, A, NOBODY)),
    "content": (ConflictingContent, str(A), one(A, 0, 2)),
    "extent in time": (ExtentRefused, str(F), whole(F, A, interval=span(0, 2))),
    "extent in space": (ExtentRefused, str(F), whole(F, A, region=Region.box(0, 0, 1, 1))),
    "extent of the subject": (ExtentRefused, str(F), whole(F, A, subject=Region.box(0, 0, 1, 1))),
}


@pytest.mark.parametrize("why", REFUSED)
def test_a_refused_event_leaves_nothing_behind(typed: Store, why: str) -> None:
    error, named, event = REFUSED[why]
    typed.commit(Arrival(event=one(A)))
    held, statistics = everything(typed), typed.statistics()

    with pytest.raises(error, match=named) as caught:
        typed.commit(Arrival(event=event))
    assert is_clear(caught.value)
    assert same_events(everything(typed), held)
    assert replace(typed.statistics(), bytes=None) == replace(statistics, bytes=None)


@pytest.mark.parametrize("position", [0, 1, 2, 3])
@pytest.mark.parametrize("why", REFUSED)
def test_one_refused_event_refuses_all_of_a_call(typed: Store, why: str, position: int) -> None:
    error, named, event = REFUSED[why]
    typed.commit(Arrival(event=one(A)))
    held = everything(typed)
    batch = [one(B), whole(C, B, A), one(D)]
    batch.insert(position, event)

    with pytest.raises(error, match=named):
        typed.commit_all([Arrival(event=each) for each in batch])
    assert same_events(everything(typed), held)


# Several events at once


@pytest.mark.parametrize(
    "batch",
    [
        [one(A), one(B), whole(C, A, B), whole(D, C)],
        [whole(D, C), whole(C, A, B), one(B), one(A)],
        [whole(C, A, B), one(A), whole(D, C), one(B)],
        [whole(D, C, A), one(B), whole(C, B, A), one(A)],
    ],
)
def test_events_of_one_call_may_be_parts_of_each_other_in_any_order(typed: Store, batch: list[Event]) -> None:
    committed = typed.commit_all([Arrival(event=event, recorded_at=at(9)) for event in batch])

    assert [each.uid for each in committed] == [event.uid for event in batch]
    assert all(each.new for each in committed)
    ids = {each.uid: each.id for each in committed}
    assert all(ids[part] < ids[event.uid] for event in batch for part in event.parts)
    arrivals = [Arrival(event=event, recorded_at=at(9)) for event in batch]
    assert holds(typed, numbered([EventType(name="Event")], arrivals, typed))


@pytest.mark.parametrize(
    "batch",
    [
        [whole(A, B), whole(B, A)],
        [one(D), whole(A, B, D), whole(B, C), whole(C, A)],
        [whole(C, A), one(D), whole(B, C), whole(A, D, B), one(E)],
    ],
)
def test_a_cycle_of_parts_is_refused_and_nothing_kept(typed: Store, batch: list[Event]) -> None:
    with pytest.raises(CycleRefused) as caught:
        typed.commit_all([Arrival(event=event) for event in batch])
    assert any(str(uid) in str(caught.value) for uid in (A, B, C))
    assert everything(typed) == []
    # The names are free still.
    typed.commit_all([Arrival(event=one(uid)) for uid in (A, B, C, D, E)])
    assert typed.count(cues.everything()) == 5


def test_a_deep_chain_of_parts_is_committed_at_once(typed: Store) -> None:
    uids = [UUID(int=number) for number in range(1, 61)]
    chain = [one(uids[0]), *(whole(upper, lower) for lower, upper in pairwise(uids))]

    typed.commit_all([Arrival(event=event) for event in reversed(chain)])
    assert typed.count(cues.parts("superset", [uids[0]], transitive=True)) == 59
    assert typed.count(cues.time("equal", at(0), at(1))) == 60


def test_a_call_repeated_or_overlapping_adds_only_what_is_new(typed: Store) -> None:
    first = typed.commit_all([Arrival(event=event) for event in (whole(C, A, B), one(A), one(B))])

    again = typed.commit_all([Arrival(event=event) for event in (one(A), whole(C, B, A), one(B))])
    assert {each.uid: (each.id, each.new) for each in again} == {each.uid: (each.id, False) for each in first}
    more = typed.commit_all([Arrival(event=event) for event in (whole(E, C, D), one(D), one(A))])
    assert {each.uid: each.new for each in more} == {E: True, D: True, A: False}
    assert typed.count(cues.everything()) == 5


def test_an_event_twice_in_one_call_is_one_event(typed: Store) -> None:
    committed = typed.commit_all([Arrival(event=event) for event in (one(A), one(B), one(A))])

    assert len({each.id for each in committed}) == 2
    assert committed[0].id == committed[2].id
    assert sum(each.new for each in committed) == 2
    with pytest.raises(ConflictingContent, match=str(C)):
        typed.commit_all([Arrival(event=event) for event in (one(C), one(D), one(C, 0, 2))])
    assert typed.count(cues.everything()) == 2


def test_no_events_are_committed_as_nothing(typed: Store) -> None:
    assert typed.commit_all([]) == []
    assert everything(typed) == []


@few_memories
@given(stories(), st.randoms(use_true_random=False))
def test_however_a_story_is_told_the_same_events_are_held(
    store_factory: StoreFactory, told: Story, random: Any
) -> None:
    """One by one, all at once in any order, and loaded."""
    store = store_factory()
    model = tell(store, told)
    assert holds(store, model)

    shuffled = list(told.arrivals)
    random.shuffle(shuffled)
    at_once, loaded = store_factory(), store_factory()
    for other in (at_once, loaded):
        other.add_types(told.types)
    committed = at_once.commit_all(shuffled)
    assert [each.uid for each in committed] == [arrival.event.uid for arrival in shuffled]
    report = loaded.load(told.arrivals)
    assert (report.new, report.existing, report.refused) == (len(told.arrivals), 0, ())
    for other in (at_once, loaded):
        assert holds(other, numbered(told.types, told.arrivals, other))


@few_memories
@given(stories())
def test_what_was_recalled_is_the_same_content_again(store_factory: StoreFactory, told: Story) -> None:
    """With derived extents and agents, as an export would say it."""
    store = store_factory()
    model = tell(store, told)

    for event in everything(store):
        again = store.commit(Arrival(event=event.as_event()))
        assert (again.id, again.new) == (event.id, False)
    assert holds(store, model)
    copy = store_factory()
    copy.add_types(told.types)
    copy.commit_all([Arrival(event=event.as_event(), recorded_at=event.recorded_at) for event in everything(store)])
    copies = {event.uid: event.as_event() for event in everything(copy)}
    assert copies == {event.uid: event.as_event() for event in everything(store)}


# Derived extents

SQUARE = Region.box(0, 0, 2, 2)
NEXT = Region.box(4, 0, 6, 2)
BOTH = Region.box(0, 0, 6, 2)
ELSEWHERE = Region.box(0, 0, 2, 2, frame="odom")


def derive(store: Store, *parts: Event, **fields: Any) -> StoredEvent:
    """The whole of these parts, as the store holds it."""
    for part in parts:
        store.commit(Arrival(event=part))
    store.commit(Arrival(event=whole(F, *(part.uid for part in parts), **fields)))
    return get(store, F)


def test_the_interval_spans_the_parts(typed: Store) -> None:
    assert derive(typed, one(A, 3, 4), one(B, 1, 2), one(C, 2, 9)).interval == span(1, 9)


def test_the_interval_of_parts_with_a_gap_covers_the_gap(typed: Store) -> None:
    assert derive(typed, one(A, 1, 1), one(B, 100, 100)).interval == span(1, 100)


def test_a_whole_is_open_while_a_part_is(typed: Store) -> None:
    assert derive(typed, one(A, 3, 4), one(B, 1, None), one(C, 2, 9)).interval == span(1, None)


def test_a_whole_of_one_part_has_its_extents(typed: Store) -> None:
    stored = derive(typed, one(A, 1, 1, region=SQUARE, subject=NEXT, agent="a"))

    assert (stored.interval, stored.region, stored.subject, stored.agent) == (span(1, 1), SQUARE, NEXT, "a")


def test_region_and_subject_are_hulls_each_of_its_own(typed: Store) -> None:
    stored = derive(typed, one(A, region=SQUARE, subject=NEXT), one(B, region=NEXT), one(C))

    assert stored.region == BOTH
    assert stored.subject == NEXT


def test_the_hull_is_of_all_corners_and_without_holes(typed: Store) -> None:
    ring = Region(polygon=Polygon([(0, 0), (9, 0), (9, 9), (0, 9)], [[(1, 1), (2, 1), (2, 2)]]))
    spike = Region(polygon=Polygon([(9, 0), (12, 4), (9, 9)]))

    stored = derive(typed, one(A, region=ring), one(B, region=spike))
    assert stored.region == Region(polygon=Polygon([(0, 0), (9, 0), (12, 4), (9, 9), (0, 9)]))


def test_parts_without_region_are_ignored(typed: Store) -> None:
    assert derive(typed, one(A), one(B, region=SQUARE), one(C)).region == SQUARE


def test_parts_all_without_region_give_none(typed: Store) -> None:
    assert derive(typed, one(A), one(B)).region is None


def test_parts_in_several_frames_give_no_region(typed: Store) -> None:
    stored = derive(typed, one(A, region=SQUARE, subject=ELSEWHERE), one(B, region=ELSEWHERE))

    assert stored.region is None
    assert stored.subject == ELSEWHERE


def test_only_direct_parts_count_and_a_whole_without_region_is_ignored(typed: Store) -> None:
    """C's parts lie in two frames, so that it has no region, and D has that of its other part alone."""
    for event in (one(A, region=SQUARE), one(B, region=ELSEWHERE), whole(C, A, B), one(E, region=NEXT), whole(D, C, E)):
        typed.commit(Arrival(event=event))

    assert get(typed, C).region is None
    assert get(typed, D).region == NEXT


def test_extents_derive_through_all_levels(typed: Store) -> None:
    levels = [one(A, 0, 1, region=SQUARE), one(B, 5, 6, region=NEXT), whole(C, A), whole(D, B), whole(E, C, D)]
    typed.commit_all([Arrival(event=event) for event in reversed(levels)])

    assert (get(typed, E).interval, get(typed, E).region) == (span(0, 6), BOTH)


@pytest.mark.parametrize(
    ("agents", "given_agent", "expected"),
    [
        (["a", "a"], None, "a"),
        (["a", "b"], None, None),
        ([None, None], None, None),
        (["a", "a"], "b", "b"),
        (["a", "b"], "c", "c"),
        ([None, None], "c", "c"),
    ],
)
def test_a_whole_without_agent_takes_the_common_one(
    typed: Store, agents: list[str | None], given_agent: str | None, expected: str | None
) -> None:
    parts = [one(uid, agent=agent) for uid, agent in zip((A, B), agents, strict=True)]

    assert derive(typed, *parts, agent=given_agent).agent == expected


def test_parts_keep_their_order_and_wholes_are_known(typed: Store) -> None:
    for event in (one(A), one(B), one(C), whole(D, C, A, B), whole(E, A, D)):
        typed.commit(Arrival(event=event))

    assert get(typed, D).parts == (C, A, B)
    assert get(typed, E).parts == (A, D)
    assert set(get(typed, A).wholes) == {D, E}
    assert (get(typed, D).wholes, get(typed, E).wholes) == ((E,), ())


# Given extents

GIVEN: list[tuple[str, dict[str, Any], bool]] = [
    ("the derived ones", {"interval": span(1, 5), "region": BOTH, "subject": SQUARE}, True),
    ("the interval alone", {"interval": span(1, 5)}, True),
    ("the region alone", {"region": BOTH}, True),
    ("in another zone", {"interval": Interval(begin=at(1), end=at(5))}, True),
    ("the region from another corner", {"region": Region(polygon=Polygon([(6, 2), (6, 0), (0, 0), (0, 2)]))}, True),
    ("the region within a micrometre", {"region": Region.box(0, 0, 6, 2.0000005)}, True),
    ("a begin a microsecond early", {"interval": span(0.999999, 5)}, False),
    ("an end a microsecond late", {"interval": span(1, 5.000001)}, False),
    ("an end a microsecond early", {"interval": span(1, 4.999999)}, False),
    ("an open end", {"interval": span(1, None)}, False),
    ("the region off by a millimetre", {"region": Region.box(0, 0, 6, 2.001)}, False),
    ("the region in another frame", {"region": Region.box(0, 0, 6, 2, frame="odom")}, False),
    ("a region that covers the derived one", {"region": Region.box(-5, -5, 9, 9)}, False),
    ("a subject off by a millimetre", {"subject": Region.box(0, 0, 2.001, 2)}, False),
    ("region and subject swapped", {"region": SQUARE, "subject": BOTH}, False),
]


def _by_commit(store: Store, event: Event) -> None:
    store.commit(Arrival(event=event))


def _by_commit_all(store: Store, event: Event) -> None:
    store.commit_all([Arrival(event=event)])


def _by_load(store: Store, event: Event) -> None:
    for refusal in store.load([Arrival(event=event)]).refused:
        raise ExtentRefused(refusal.reason)


WRITERS: list[Callable[[Store, Event], None]] = [_by_commit, _by_commit_all, _by_load]


@pytest.mark.parametrize("write", WRITERS)
def test_given_extents_are_the_derived_ones_or_refused(typed: Store, write: Callable[[Store, Event], None]) -> None:
    for part in (one(A, 1, 2, region=SQUARE, subject=SQUARE), one(B, 3, 5, region=NEXT)):
        typed.commit(Arrival(event=part))

    for number, (why, extents, accepted) in enumerate(GIVEN, start=10):
        event = whole(UUID(int=number), A, B, **extents)
        if accepted:
            write(typed, event)
            stored = get(typed, event.uid)
            assert (stored.interval, stored.region, stored.subject) == (span(1, 5), BOTH, SQUARE), why
        else:
            held = everything(typed)
            with pytest.raises(ExtentRefused, match=str(event.uid)):
                write(typed, event)
            assert same_events(everything(typed), held), why


@pytest.mark.parametrize("write", WRITERS)
@pytest.mark.parametrize("name", ["region", "subject"])
def test_a_region_is_refused_where_the_parts_have_none_together(
    typed: Store, write: Callable[[Store, Event], None], name: str
) -> None:
    places: list[dict[str, Any]] = [{}, {name: SQUARE}, {name: ELSEWHERE}]
    for uid, place in zip((A, B, C), places, strict=True):
        typed.commit(Arrival(event=one(uid, **place)))

    for parts in ((A,), (B, C)):
        extent: dict[str, Any] = {name: SQUARE}
        with pytest.raises(ExtentRefused):
            write(typed, whole(F, *parts, **extent))
    assert typed.count(cues.everything()) == 3


def test_an_open_whole_may_be_given_as_open(typed: Store) -> None:
    typed.commit(Arrival(event=one(A, 1, None)))

    typed.commit(Arrival(event=whole(B, A, interval=span(1, None))))
    with pytest.raises(ExtentRefused, match=str(C)):
        typed.commit(Arrival(event=whole(C, A, interval=span(1, 5))))
    assert get(typed, B).interval == span(1, None)


def test_the_story_of_a_part_may_be_told_twice_with_its_whole(typed: Store) -> None:
    """What is there already may stand in a call beside what is new."""
    tell(typed, story(one(UIDS[0]), one(UIDS[1])))

    committed = typed.commit_all([Arrival(event=whole(UIDS[2], UIDS[0], UIDS[1])), Arrival(event=one(UIDS[0]))])
    assert [each.new for each in committed] == [True, False]
