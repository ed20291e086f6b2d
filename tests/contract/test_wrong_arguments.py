"""What callers hand over by mistake is refused by name, in every store, and nothing is written."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any
from uuid import UUID

import numpy as np
import pytest

from elm import cues
from elm.app import Memory, connect
from elm.cues.algebra import And, Cue
from elm.cues.relations import Place
from elm.errors import InvalidValue, UnknownEvent
from elm.event import Event
from elm.geometry import Region
from elm.interval import Interval
from elm.log import LoggedStore
from elm.query import ByFeature, Cursor, Join, Nearest, Order, Query
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span

A, NEW = UUID(int=1), UUID(int=9)
BOX = Region.box(0, 0, 1, 1)
NAIVE = at(0).replace(tzinfo=None)
EVENT = Event(type="Event", uid=NEW, interval=span(5, 6))


def wrong(given: object) -> Any:
    """Anything in the place of anything."""
    return given


@pytest.fixture
def memory(store: LoggedStore) -> Memory:
    """A memory of three events of one type."""
    memory = Memory(store)
    memory.add_type("Event")
    memory.commit_all(Event(type="Event", uid=UUID(int=n), interval=Interval.since(at(n))) for n in (1, 2, 3))
    return memory


MISTAKES: list[tuple[str, str, Callable[[Memory], object]]] = [
    # Recalling.
    ("a text for a cue", "a cue", lambda m: m.recall(wrong("Event"))),
    ("several cues", "a cue", lambda m: m.recall(wrong([cues.is_a("Event")]))),
    ("no kind of cue", "a cue", lambda m: m.recall(Cue())),
    ("a kind of cue", "a cue", lambda m: m.recall(wrong(Cue))),
    ("a text for a limit", "limit", lambda m: m.recall(limit=wrong("5"))),
    ("a float for a limit", "limit", lambda m: m.recall(limit=wrong(2.0))),
    ("not a number", "limit", lambda m: m.recall(limit=wrong(float("nan")))),
    ("a truth value for a limit", "limit", lambda m: m.recall(limit=True)),
    ("a truth value of numpy", "limit", lambda m: m.recall(limit=wrong(np.True_))),
    ("numbers for a limit", "limit", lambda m: m.recall(limit=wrong(np.array([1])))),
    ("less than nothing", "limit", lambda m: m.recall(limit=-1)),
    ("a text for a cursor", r"Cursor\.parse", lambda m: m.recall(after=wrong("1.2"))),
    ("a time for a cursor", "Cursor", lambda m: m.recall(after=wrong(at(0)))),
    ("no order", "order", lambda m: m.recall(order=wrong(None))),
    ("near a text", "Region", lambda m: m.recall(order=Nearest(to=wrong("x")))),
    ("near nobody's place", "place", lambda m: m.recall(order=Nearest(to=BOX, place=wrong("here")))),
    ("a text for the neighbours", "a cue", lambda m: m.recall().latest_before(wrong("Event"))),
    ("no neighbours", "a cue", lambda m: m.recall().first_after(wrong(None))),
    ("a text for yes", "same_region", lambda m: m.recall().latest_before(And(), same_region=wrong("no"))),
    ("half a page", "size of a page", lambda m: m.recall().page(wrong(2.5))),
    ("an empty page", "size of a page", lambda m: m.recall().page(0)),
    ("a text for a size", "size of a page", lambda m: m.recall().page(wrong("2"))),
    ("a truth value for a size", "size of a page", lambda m: m.recall().page(True)),
    ("a page of everything", "size of a page", lambda m: m.recall().page(2**63 - 1)),
    ("a page after a text", "Cursor", lambda m: m.recall().page(2, after=wrong("1.2"))),
    ("a page after no text", "Cursor", lambda m: m.recall().page(2, after=wrong(""))),
    ("groups by a number", "feature to group by", lambda m: m.recall().groups(ByFeature(name=wrong(5)))),
    ("groups by no name", "feature to group by", lambda m: m.recall().groups(ByFeature(name=""))),
    ("groups by nothing", "group by", lambda m: m.recall().groups(wrong(None))),
    ("groups by the name of a feature", r"elm\.ByFeature", lambda m: m.recall().groups(wrong("feature:colour"))),
    ("nearest to nothing", r"elm\.Nearest", lambda m: m.recall(order=wrong("nearest"))),
    ("a text for a uid", "uid", lambda m: m.get("Event")),
    ("an event for its uid", "uid", lambda m: m.get(wrong(m.get(A)))),
    ("a truth value for an id", "id", lambda m: m.get(True)),
    ("a float for an id", "id", lambda m: m.get(wrong(1.0))),
    ("no name", "uid", lambda m: m.get(wrong(None))),
    # Writing.
    ("a text for an event", "Event", lambda m: m.commit(wrong("x"))),
    ("no event", "Event", lambda m: m.commit(wrong(None))),
    ("several events for one", "Event", lambda m: m.commit(wrong([EVENT]))),
    ("an event that is stored", "as_event", lambda m: m.commit(wrong(m.get(A)))),
    ("a text for a time", "recorded_at", lambda m: m.commit(EVENT, recorded_at=wrong("now"))),
    ("a naive time", "naive", lambda m: m.commit(EVENT, recorded_at=NAIVE)),
    ("one event for several", "several", lambda m: m.commit_all(wrong(EVENT))),
    ("a text for events", "several", lambda m: m.commit_all(wrong("ab"))),
    ("no events", "several", lambda m: m.commit_all(wrong(None))),
    ("an event and something else", "Event", lambda m: m.commit_all([EVENT, wrong(5)])),
    ("a text for the uid to close", "uid", lambda m: m.close_event("Event", at(9))),
    ("an event to close", "uid", lambda m: m.close_event(wrong(m.get(A)), at(9))),
    ("a truth value to close", "uid", lambda m: m.close_event(True, at(9))),
    ("a naive end", "naive", lambda m: m.close_event(A, NAIVE)),
    ("no end", "end of an event", lambda m: m.close_event(A, wrong(None))),
    ("two ends", "end of an event", lambda m: m.close_event(A, wrong((at(8), at(9))))),
    ("one event to load", "several", lambda m: m.load(wrong(EVENT))),
    ("a text to load", "several", lambda m: m.load(wrong("ab"))),
    ("nothing to load", "several", lambda m: m.load(wrong(None))),
    ("texts to load", "Event", lambda m: m.load([EVENT, wrong("x")])),
    ("an arrival of what is stored", "as_event", lambda m: m.load([Arrival(event=wrong(m.get(A)))])),
    ("an arrival of a text", "Event", lambda m: m.load([EVENT, Arrival(event=wrong("x"))])),
    ("an arrival at a text", "recorded_at", lambda m: m.load([Arrival(event=EVENT, recorded_at=wrong("x"))])),
    ("an arrival at a naive time", "naive", lambda m: m.load([Arrival(event=EVENT, recorded_at=NAIVE)])),
    ("a batch below nothing", "batch", lambda m: m.load([EVENT], batch=-3)),
    ("an empty batch", "batch", lambda m: m.load([EVENT], batch=0)),
    ("half a batch", "batch", lambda m: m.load([EVENT], batch=wrong(2.5))),
    ("a truth value for a batch", "batch", lambda m: m.load([EVENT], batch=True)),
    ("a number that is told", "progress", lambda m: m.load([EVENT], progress=wrong(5))),
    ("a list that is told", "refused", lambda m: m.load([EVENT], refused=wrong([]))),
    ("texts for tombstones", "tombstones", lambda m: m.writer.keep_tombstones([wrong("x")])),
    ("no tombstones", "tombstones", lambda m: m.writer.keep_tombstones(wrong(None))),
    ("names for types", "EventType", lambda m: m.add_types([wrong("Other")])),
    ("a name for types", "event types", lambda m: m.add_types(wrong("Other"))),
    ("one type for several", "event types", lambda m: m.add_types(wrong(EventType(name="Other")))),
    ("no types", "event types", lambda m: m.add_types(wrong(None))),
    ("a list of parents", "parent", lambda m: m.add_type("Other", wrong(["Event"]))),
    ("lists for uids to forget", "uid", lambda m: m.forget(wrong([[]]))),
    ("a number that a forgetting tells", "progress", lambda m: m.forget([A], progress=wrong(5))),
    ("a question instead of an order", "dry_run", lambda m: m.forget(cues.uid(A), dry_run=wrong(None))),
    ("no recognizers", "recognizers", lambda m: m.recognition(wrong(None))),
    ("a number of recognizers", "recognizers", lambda m: m.recognize(wrong(5))),
]


def refusal(memory: Memory, call: Callable[[Memory], object]) -> str:
    try:
        return f"answered: {call(memory)!r:.80}"
    except InvalidValue as error:
        return str(error)


def test_mistakes_are_refused_by_name_and_nothing_is_written(memory: Memory) -> None:
    told = {mistake: (named, refusal(memory, call)) for mistake, named, call in MISTAKES}

    assert len(told) == len(MISTAKES)
    assert {
        mistake: said
        for mistake, (named, said) in told.items()
        if said.startswith("answered") or not re.search(named, said)
    } == {}
    assert [event.uid.int for event in memory.recall()] == [1, 2, 3]
    assert all(event.interval.is_open for event in memory.recall())
    assert [each.name for each in memory.types()] == ["Event"]


def test_batches_before_a_mistake_are_kept(memory: Memory) -> None:
    with pytest.raises(InvalidValue, match="Event"):
        memory.load([EVENT, EVENT, wrong("x")], batch=2)
    assert memory.get(NEW).as_event() == EVENT


def test_integers_of_numpy_are_numbers(memory: Memory) -> None:
    """They are what tables of results hold."""
    first = memory.get(A)

    assert memory.get(wrong(np.int64(first.id))) == first
    assert [event.uid.int for event in memory.recall(limit=wrong(np.int64(2)))] == [1, 2]
    page = memory.recall().page(wrong(np.uint8(2)))
    assert page.cursor is not None
    assert [event.uid.int for event in memory.recall().page(after=page.cursor).events] == [3]
    assert [event.uid.int for event in memory.recall(after=Cursor(begin=at(1), id=wrong(np.int64(first.id))))] == [2, 3]
    assert memory.load([EVENT], batch=wrong(np.int32(1))).new == 1


def test_names_of_orders_and_places_are_what_they_name(memory: Memory) -> None:
    memory.commit(Event(type="Event", uid=NEW, interval=span(5, 6), subject=BOX))

    assert Query(order=wrong("-begin")).order is Order.BEGIN_REVERSED
    assert Nearest(to=BOX, place=wrong("subject")).place is Place.SUBJECT
    assert [event.uid for event in memory.recall(order=Nearest(to=BOX, place=wrong("subject")))] == [NEW]
    anchors = Query(cue=cues.uid(NEW))
    (pair,) = memory.store.join(Join(anchors=anchors, relation=wrong("before"), cue=cues.uid(A)))
    assert pair[1] is None


def test_events_are_named_by_uid_its_text_or_id(memory: Memory) -> None:
    first = memory.get(A)

    assert memory.get(str(A)) == memory.get(first.id) == first
    assert [event.uid for event in memory.recall(cues.uid(str(A)))] == [A]
    assert memory.close_event(str(A), at(9)).new
    assert memory.get(A).interval.end == at(9)
    second = memory.get(UUID(int=2))
    assert memory.close_event(second.id, at(9)).new
    assert memory.get(second.id).interval.end == at(9)
    with pytest.raises(UnknownEvent):
        memory.close_event(999_999, at(9))
    assert memory.forget([str(A)]).events == 1


def test_a_recollection_is_true_where_there_is_any_event(memory: Memory) -> None:
    assert memory.recall()
    assert memory.recall(cues.uid(A), order="id", limit=1)
    assert not memory.recall(cues.agent("nobody"))
    assert not memory.recall(limit=0)


def test_what_another_memory_has_stored_is_loaded_as_it_stands(memory: Memory) -> None:
    other = connect("memory://")
    other.add_type("Event")
    other.commit(EVENT, recorded_at=at(-7))
    other.commit(Event(type="Event", uid=UUID(int=10), parts=[NEW]), recorded_at=at(-6))

    report = memory.load(other.recall(order="id"))
    assert (report.new, report.refused) == (2, 0)
    assert memory.get(NEW).as_event() == EVENT
    assert [memory.get(UUID(int=n)).recorded_at for n in (9, 10)] == [at(-7), at(-6)]
    assert memory.load(other.recall(order="id")).existing == 2
