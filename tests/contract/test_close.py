"""Closing: the end of an event still going on, and of all the wholes that wait for it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.errors import ConflictingContent, ElmError, InvalidValue, UnknownEvent
from elm.event import Event
from elm.geometry import Region
from elm.store import Arrival, Store
from elm.writer import Writer
from tests.clock import ZERO, at, span
from tests.conftest import StoreFactory
from tests.contract.telling import everything, few_memories, holds, is_clear, story, tell
from tests.model import Model, same_events
from tests.strategies import Story, stories

P, Q, R, S, T, U = (UUID(int=number) for number in range(1, 7))
NOBODY = UUID(int=99)


def one(uid: UUID, begin: float, end: float | None, **fields: Any) -> Event:
    """An atomic event."""
    return Event(type="Event", uid=uid, interval=span(begin, end), **fields)


def whole(uid: UUID, *parts: UUID) -> Event:
    """A complex event."""
    return Event(type="Event", uid=uid, parts=parts)


def intervals(store: Store) -> dict[UUID, Any]:
    """Which event was when."""
    return {event.uid: event.interval for event in everything(store)}


def test_closing_ends_an_open_event_and_changes_nothing_else(store: Store) -> None:
    region = Region.box(0, 0, 1, 1)
    model = tell(store, story(one(P, 1, None, region=region, features={"a": 1}, agent="x"), one(Q, 2, None)))

    closed = store.close_event(P, at(5))
    model.close(P, at(5))
    assert (closed.new, closed.wholes) == (True, ())
    assert holds(store, model)
    assert store.count(cues.time("finishes", None, at(5))) == 1
    assert store.count(cues.lasting("=", at(4) - ZERO)) == 1


def test_an_open_event_may_end_at_the_instant_of_its_begin(store: Store) -> None:
    tell(store, story(one(P, 1, None)))

    assert store.close_event(P, at(1)).new
    assert intervals(store) == {P: span(1, 1)}


def test_the_same_end_again_changes_nothing(store: Store) -> None:
    tell(store, story(one(P, 1, None), whole(Q, P)))
    store.close_event(P, at(5))
    held = everything(store)

    again = store.close_event(P, at(5))
    assert (again.new, again.wholes) == (False, ())
    assert same_events(everything(store), held)


def test_an_event_that_was_never_open_closes_only_with_the_end_it_has(store: Store) -> None:
    tell(store, story(one(P, 1, 5)))

    assert not store.close_event(P, at(5)).new
    with pytest.raises(ElmError, match=str(P)) as caught:
        store.close_event(P, at(6))
    assert is_clear(caught.value)
    assert intervals(store) == {P: span(1, 5)}


@pytest.mark.parametrize("end", [4, 4.999999, 5.000001, 6])
def test_another_end_is_refused(store: Store, end: float) -> None:
    tell(store, story(one(P, 1, None), whole(Q, P)))
    store.close_event(P, at(5))
    held = everything(store)

    with pytest.raises(ElmError, match=str(P)) as caught:
        store.close_event(P, at(end))
    assert is_clear(caught.value)
    assert same_events(everything(store), held)


def test_an_end_before_the_begin_is_refused(store: Store) -> None:
    tell(store, story(one(P, 1, None), whole(Q, P)))
    held = everything(store)

    with pytest.raises(InvalidValue):
        store.close_event(P, at(0.999999))
    assert same_events(everything(store), held)
    assert store.close_event(P, at(1)).new


def test_an_unknown_event_cannot_be_closed(store: Store) -> None:
    tell(store, story(one(P, 1, None)))

    with pytest.raises(UnknownEvent, match=str(NOBODY)):
        store.close_event(NOBODY, at(5))
    assert intervals(store) == {P: span(1, None)}


def test_a_naive_end_is_refused(store: Store) -> None:
    tell(store, story(one(P, 1, None)))

    with pytest.raises(InvalidValue, match="naive"):
        Writer(store).close(P, at(5).replace(tzinfo=None))


def test_a_whole_ends_by_its_parts_and_cannot_be_ended_itself(store: Store) -> None:
    tell(store, story(one(P, 1, None), whole(Q, P)))
    held = everything(store)

    with pytest.raises(ElmError, match=str(Q)) as caught:
        store.close_event(Q, at(5))
    assert is_clear(caught.value)
    assert same_events(everything(store), held)


def test_the_extents_of_all_wholes_follow_parts_first(store: Store) -> None:
    """Q in R in S, and Q in S directly: S is open for P still, which is in T with Q."""
    model = tell(
        store,
        story(
            one(P, 0, None),
            one(Q, 1, None),
            one(U, 2, 3),
            whole(R, Q, U),
            whole(S, R, Q),
            whole(T, P, Q),
        ),
    )

    closed = store.close_event(Q, at(9))
    model.close(Q, at(9))
    assert closed.wholes == (R, S)
    assert intervals(store) == {
        P: span(0, None),
        Q: span(1, 9),
        U: span(2, 3),
        R: span(1, 9),
        S: span(1, 9),
        T: span(0, None),
    }
    last = store.close_event(P, at(5))
    model.close(P, at(5))
    assert last.wholes == (T,)
    assert intervals(store)[T] == span(0, 9)
    assert holds(store, model)


def test_a_whole_ends_with_the_latest_part_not_with_the_last_one_closed(store: Store) -> None:
    tell(store, story(one(P, 0, None), one(Q, 1, None), whole(R, P, Q)))

    assert store.close_event(P, at(9)).wholes == ()
    assert store.close_event(Q, at(4)).wholes == (R,)
    assert intervals(store)[R] == span(0, 9)


def test_a_part_that_ends_before_another_was_closed_leaves_the_whole_open(store: Store) -> None:
    tell(store, story(one(P, 0, None), one(Q, 1, None), whole(R, P, Q), whole(S, R)))

    assert store.close_event(P, at(9)).wholes == ()
    assert (intervals(store)[R], intervals(store)[S]) == (span(0, None), span(0, None))
    assert store.close_event(Q, at(99)).wholes == (R, S)


def test_a_chain_of_wholes_closes_from_below(store: Store) -> None:
    uids = [UUID(int=number) for number in range(1, 31)]
    chain = [one(uids[0], 0, None), *(whole(upper, lower) for lower, upper in pairwise(uids))]
    tell(store, story(*chain))

    assert store.close_event(uids[0], at(7)).wholes == tuple(uids[1:])
    assert set(intervals(store).values()) == {span(0, 7)}


def test_closed_events_are_the_same_content_as_they_were_born_and_as_they_are(store: Store) -> None:
    tell(store, story(one(P, 1, None), whole(Q, P)))
    store.close_event(P, at(5))

    for event in (one(P, 1, None), one(P, 1, 5), whole(Q, P)):
        assert not store.commit(Arrival(event=event)).new
        assert not store.commit_all([Arrival(event=event)])[0].new
        assert store.load([Arrival(event=event)]).existing == 1
    for event in (one(P, 1, 6), one(P, 2, None)):
        with pytest.raises(ConflictingContent):
            store.commit(Arrival(event=event))
        assert len(store.load([Arrival(event=event)]).refused) == 1
    assert intervals(store) == {P: span(1, 5), Q: span(1, 5)}


def test_a_whole_committed_after_the_close_is_closed(store: Store) -> None:
    tell(store, story(one(P, 1, None)))
    store.close_event(P, at(5))
    store.commit(Arrival(event=whole(Q, P)))

    assert intervals(store)[Q] == span(1, 5)


@few_memories
@given(stories(), st.data())
def test_whatever_is_closed_in_any_order_the_memory_is_as_it_must_be(
    store_factory: StoreFactory, told: Story, data: st.DataObject
) -> None:
    store = store_factory()
    model = tell(store, told)
    still_open = [uid for uid, event in model.events.items() if not event.is_complex and model.interval(uid).is_open]

    for uid in data.draw(st.permutations(still_open)):
        end = model.interval(uid).begin + (at(data.draw(st.integers(0, 3))) - ZERO)
        open_before = _open(model)
        closed = store.close_event(uid, end)
        model.close(uid, end)
        assert closed.new
        assert len(closed.wholes) == len(set(closed.wholes))
        assert {uid, *closed.wholes} == open_before - _open(model)
        for place, each in enumerate(closed.wholes):
            assert not set(model.events[each].parts) & set(closed.wholes[place:])
        assert holds(store, model)


def _open(model: Model) -> set[UUID]:
    return {uid for uid in model.events if model.interval(uid).is_open}
