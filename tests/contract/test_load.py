"""Loading: what cannot be kept is refused with its reason, and all the rest is kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.errors import ElmError
from elm.event import Event, StoredEvent
from elm.exchange import event_from_json, event_to_json, parse_json, to_line
from elm.geometry import Region
from elm.query import Query
from elm.storage.memory import MemoryStore
from elm.store import Arrival, Store
from elm.taxonomy import EventType
from elm.writer import LoadReport, Writer
from tests.clock import at, span
from tests.conftest import StoreFactory
from tests.contract.telling import everything, few_memories, holds, numbered, story, tell
from tests.model import same_events
from tests.strategies import TYPE_NAMES, Story, stories

A, B, C, D, E, F = (UUID(int=number) for number in range(1, 7))
NOBODY = UUID(int=99)


def one(uid: UUID, end: float | None = 1, **fields: Any) -> Event:
    """An atomic event."""
    return Event(**{"type": "Event", "uid": uid, "interval": span(0, end), **fields})


def whole(uid: UUID, *parts: UUID, **fields: Any) -> Event:
    """A complex event."""
    return Event(type="Event", uid=uid, parts=parts, **fields)


def arrivals(*events: Event) -> list[Arrival]:
    return [Arrival(event=event, recorded_at=at(9)) for event in events]


@pytest.fixture
def typed(store: Store) -> Store:
    """An empty memory that knows the type Event."""
    store.add_types([EventType(name="Event")])
    return store


def test_a_load_is_held_like_commits(typed: Store) -> None:
    batch = arrivals(one(A), one(B, None), whole(C, A, B), whole(D, C))

    report = typed.load(batch)
    typed.finish_load()
    assert (report.new, report.existing, report.refused) == (4, 0, ())
    assert holds(typed, numbered([EventType(name="Event")], batch, typed))


def test_an_empty_load_is_nothing(typed: Store) -> None:
    report = typed.load([])
    typed.finish_load()

    assert (report.new, report.existing, report.refused) == (0, 0, ())
    assert everything(typed) == []


def test_what_is_refused_is_named_with_its_reason_and_the_rest_is_kept(typed: Store) -> None:
    typed.commit(Arrival(event=one(A)))
    refused = {
        1: (one(B, type="Dance"), "'Dance'"),
        3: (whole(C, A, NOBODY), str(NOBODY)),
        4: (one(A, 2), str(A)),
        6: (whole(D, A, interval=span(0, 2)), str(D)),
        7: (whole(E, A, region=Region.box(0, 0, 1, 1)), str(E)),
    }
    kept = {0: one(UUID(int=10)), 2: whole(UUID(int=11), A), 5: one(UUID(int=12)), 8: one(UUID(int=13))}
    batch = [(refused | {index: (event, "") for index, event in kept.items()})[index][0] for index in range(9)]

    report = typed.load(arrivals(*batch))
    assert (report.new, report.existing) == (4, 0)
    assert [refusal.index for refusal in report.refused] == sorted(refused)
    for refusal in report.refused:
        assert refused[refusal.index][1] in refusal.reason
    assert {event.uid for event in everything(typed)} == {A, *(event.uid for event in kept.values())}


def test_a_whole_of_a_refused_part_is_refused_and_so_is_its_whole(typed: Store) -> None:
    report = typed.load(
        arrivals(one(A, type="Dance"), one(B), whole(C, B, A), whole(D, C), whole(E, B), whole(F, D, E))
    )

    assert [refusal.index for refusal in report.refused] == [0, 2, 3, 5]
    assert report.new == 2
    assert {event.uid for event in everything(typed)} == {B, E}
    assert str(A) in report.refused[1].reason
    assert str(C) in report.refused[2].reason


def test_a_part_that_comes_behind_its_whole_does_not_count(typed: Store) -> None:
    report = typed.load(arrivals(whole(C, A), one(A)))

    assert [refusal.index for refusal in report.refused] == [0]
    assert str(A) in report.refused[0].reason
    assert {event.uid for event in everything(typed)} == {A}
    assert typed.load(arrivals(whole(C, A), one(A))).new == 1


def test_events_that_are_part_of_each_other_are_refused(typed: Store) -> None:
    report = typed.load(arrivals(one(C), whole(A, B, C), whole(B, A)))

    assert [refusal.index for refusal in report.refused] == [1, 2]
    assert {event.uid for event in everything(typed)} == {C}


def test_the_same_load_again_finds_everything_there(typed: Store) -> None:
    batch = arrivals(one(A), one(B, None), whole(C, A, B))
    typed.load(batch)
    held = everything(typed)

    report = typed.load(batch)
    assert (report.new, report.existing, report.refused) == (0, 3, ())
    more = typed.load([*batch, *arrivals(one(D), whole(E, C, D))])
    assert (more.new, more.existing, more.refused) == (2, 3, ())
    assert same_events(everything(typed)[:2], held[:2])


def test_an_event_twice_in_one_load_is_there_the_second_time(typed: Store) -> None:
    report = typed.load(arrivals(one(A), one(A), one(A, 2), one(A)))

    assert (report.new, report.existing) == (1, 2)
    assert [refusal.index for refusal in report.refused] == [2]
    assert [event.interval for event in everything(typed)] == [span(0, 1)]


def test_times_of_recording_are_kept(typed: Store) -> None:
    typed.load([Arrival(event=one(A), recorded_at=at(-5)), Arrival(event=one(B), recorded_at=at(7))])

    assert {event.uid: event.recorded_at for event in everything(typed)} == {A: at(-5), B: at(7)}


def test_a_stream_of_several_batches_goes_on_behind_refused_events(typed: Store) -> None:
    """Parts may stand in an earlier batch; a refused one is missing in a later batch too."""
    stream = [one(A), one(B, type="Dance"), whole(C, A), whole(D, B), one(E), whole(F, C, D), whole(UUID(int=7), C, E)]
    seen: list[tuple[UUID, str]] = []
    progress: list[int] = []

    report = Writer(typed).load(
        iter(stream),
        batch=2,
        refused=lambda arrival, reason: seen.append((arrival.event.uid, reason)),
        progress=progress.append,
    )
    assert (report.read, report.new, report.existing, report.refused) == (7, 4, 0, 3)
    assert [uid for uid, _ in seen] == [B, D, F]
    assert all(reason for _, reason in seen)
    assert progress == [2, 4, 6, 7]
    assert {event.uid for event in everything(typed)} == {A, C, E, UUID(int=7)}


@few_memories
@given(stories(), st.sets(st.integers(0, 9), max_size=4), st.integers(1, 11))
def test_whatever_is_broken_the_rest_is_kept(
    store_factory: StoreFactory, told: Story, broken: set[int], batch: int
) -> None:
    """Events of an unknown type are refused, with all that is made of them; the rest is as it would be without."""
    store = store_factory()
    store.add_types(told.types)
    stream = [
        replace(arrival, event=replace(arrival.event, type="Dance" if index in broken else arrival.event.type))
        for index, arrival in enumerate(told.arrivals)
    ]
    refused: set[UUID] = set()
    for arrival in stream:
        if arrival.event.type not in TYPE_NAMES or refused & set(arrival.event.parts):
            refused.add(arrival.event.uid)
    kept = [arrival for arrival in stream if arrival.event.uid not in refused]

    seen: list[UUID] = []
    report = Writer(store).load(stream, batch=batch, refused=lambda arrival, _: seen.append(arrival.event.uid))
    assert (report.new, report.existing, report.refused) == (len(kept), 0, len(refused))
    assert set(seen) == refused
    assert {event.uid for event in everything(store)} == {arrival.event.uid for arrival in kept}
    assert holds(store, numbered(told.types, kept, store))


# Rows that repeat a uid


def test_a_whole_that_came_too_early_is_kept_when_it_comes_again(typed: Store) -> None:
    """A file that was appended to itself."""
    report = typed.load(arrivals(whole(C, A, B), one(A), one(B), whole(C, A, B), one(A), whole(D, C)))

    assert [refusal.index for refusal in report.refused] == [0]
    assert (report.new, report.existing) == (4, 1)
    assert [event.uid for event in everything(typed)] == [A, B, C, D]


def test_a_row_that_is_corrected_further_down_is_kept(typed: Store) -> None:
    report = typed.load(
        arrivals(
            one(A, type="Dance"), one(A), one(A, 2),
            whole(C, A, interval=span(0, 2)), whole(D, C), whole(C, A, interval=span(0, 1)), whole(D, C), whole(C, A),
        )
    )  # fmt: skip

    assert [refusal.index for refusal in report.refused] == [0, 2, 3, 4]
    assert (report.new, report.existing) == (3, 1)
    assert [event.uid for event in everything(typed)] == [A, C, D]


def test_a_row_that_is_wrong_again_and_again_is_refused_each_time(typed: Store) -> None:
    """Until it is there: what is given of a whole beyond its parts is no content of its own."""
    wrong = [whole(C, A, interval=span(0, end)) for end in range(2, 60)]
    report = typed.load(arrivals(one(A), *wrong, whole(C, A), *wrong))

    assert (report.new, report.existing, len(report.refused)) == (2, len(wrong), len(wrong))
    assert [event.uid for event in everything(typed)] == [A, C]


GONE, OVER, CLOSED = UUID(int=20), UUID(int=21), UUID(int=22)
"""A forgotten event, the whole that keeps its tombstone, and an event that was open when it was committed."""


def lived(store: Store) -> Store:
    """A memory that rows may meet in."""
    store.add_types([EventType(name="Event")])
    for event in (one(GONE), whole(OVER, GONE), one(CLOSED, None)):
        store.commit(Arrival(event=event, recorded_at=at(9)))
    store.close_event(CLOSED, at(3))
    (gone,) = store.ids(Query(cue=cues.uid(GONE)))
    assert store.forget([gone], run=UUID(int=30), at=at(9)).events == 1
    return store


def test_a_whole_of_a_forgotten_part_is_kept_though_the_part_is_refused(store: Store) -> None:
    report = lived(store).load(arrivals(one(GONE), whole(D, GONE)))

    assert [refusal.index for refusal in report.refused] == [0]
    assert report.new == 1


UIDS = st.sampled_from([A, B, C, D, GONE, OVER, CLOSED])
ROWS = st.one_of(
    st.builds(one, UIDS, st.sampled_from([1, 3, None]), type=st.sampled_from(["Event", "Event", "Dance"])),
    st.builds(
        lambda uid, parts, given: whole(uid, *sorted(parts - {uid}), **given),
        UIDS,
        st.sets(UIDS, min_size=2, max_size=3),
        st.sampled_from([{}, {}, {"interval": span(0, 1)}, {"interval": span(0, 3)}]),
    ),
)


@few_memories
@given(st.lists(ROWS, max_size=14), st.integers(2, 15))
def test_what_becomes_of_a_row_depends_on_the_rows_before_it_alone(
    store_factory: StoreFactory, rows: list[Event], batch: int
) -> None:
    """And not on where a batch begins: it is what would become of it if the rows were committed one by one."""
    judge = lived(MemoryStore())
    fates: list[bool | None] = []
    for arrival in arrivals(*rows):
        try:
            fates.append(judge.commit(arrival).new)
        except ElmError:
            fates.append(None)

    for size in (1, batch):
        store = lived(store_factory())
        report, refused = loaded(store, arrivals(*rows), size)
        assert [index in refused for index in range(len(rows))] == [fate is None for fate in fates]
        assert (report.new, report.existing) == (fates.count(True), fates.count(False))
        assert same_but_ids(everything(store)) == same_but_ids(everything(judge))


def loaded(store: Store, stream: list[Arrival], size: int) -> tuple[LoadReport, set[int]]:
    """What a load in batches of a size reports, and the places in the stream of what it refuses."""
    place = {id(arrival): index for index, arrival in enumerate(stream)}
    refused: set[int] = set()
    report = Writer(store).load(stream, batch=size, refused=lambda arrival, _: refused.add(place[id(arrival)]))
    return report, refused


def same_but_ids(events: list[StoredEvent]) -> list[Event]:
    return [event.as_event() for event in events]


@few_memories
@given(stories())
def test_an_export_is_loaded_back_whole(store_factory: StoreFactory, told: Story) -> None:
    store, copy = store_factory(), store_factory()
    model = tell(store, told)
    copy.add_types(told.types)

    lines = [to_line(event_to_json(event)) for event in everything(store)]
    read = [event_from_json(parse_json(line, what="a line")) for line in lines]
    report = copy.load([Arrival(event=each.event, recorded_at=each.recorded_at) for each in read])
    assert (report.new, report.existing, report.refused) == (len(lines), 0, ())
    assert holds(copy, numbered(told.types, told.arrivals, copy))
    again = store.load([Arrival(event=each.event, recorded_at=each.recorded_at) for each in read])
    assert (again.new, again.existing, again.refused) == (0, len(lines), ())
    assert holds(store, model)


def test_a_long_load_in_small_batches_is_all_there(typed: Store) -> None:
    events: list[Event] = []
    for number in range(1, 1_001):
        uid = UUID(int=number)
        parts = tuple(UUID(int=number - back) for back in range(1, 10)) if number % 10 == 0 else ()
        events.append(whole(uid, *parts) if parts else one(uid, features={"number": number}))

    report = Writer(typed).load(events, batch=77)
    assert (report.read, report.new, report.refused) == (1_000, 1_000, 0)
    assert typed.count(cues.feature_names("superset", ["number"])) == 900
    assert typed.count(cues.parts("superset", [UUID(int=1)])) == 1
    assert typed.statistics().links == 900


def test_a_load_beside_commits_keeps_ids_growing(typed: Store) -> None:
    tell(typed, story(one(A)))
    typed.load(arrivals(one(B), one(C)))
    typed.commit(Arrival(event=one(D)))

    assert [event.uid for event in everything(typed)] == [A, B, C, D]
