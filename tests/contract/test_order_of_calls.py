"""The order within a call: ids and log entries follow the order given, but a whole stands behind its parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm.event import Event, StoredEvent
from elm.log import LoggedStore, LogKind
from elm.storage.memory import MemoryStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import span
from tests.conftest import StoreFactory
from tests.contract.telling import everything, few_memories

Write = Callable[[LoggedStore, Sequence[Event]], object]


def arrivals(events: Sequence[Event]) -> list[Arrival]:
    return [Arrival(event=event) for event in events]


AT_ONCE: dict[str, Write] = {
    "commit_all": lambda store, events: store.commit_all(arrivals(events)),
    "advance": lambda store, events: store.log.advance([], arrivals(events)),
}
WRITES: dict[str, Write] = {**AT_ONCE, "load": lambda store, events: store.load(arrivals(events))}


@pytest.fixture(params=WRITES)
def write(request: pytest.FixtureRequest) -> Write:
    return WRITES[request.param]


@pytest.fixture(params=AT_ONCE)
def write_at_once(request: pytest.FixtureRequest) -> Write:
    return AT_ONCE[request.param]


@pytest.fixture(params=[0, 30], ids=["few", "many"])
def more(request: pytest.FixtureRequest) -> list[Event]:
    """Events that make a call a long one, which is written by other statements."""
    return [atomic() for _ in range(request.param)]


@pytest.fixture
def typed(store: LoggedStore) -> LoggedStore:
    """An empty memory that knows the type Event."""
    return prepared(store)


def prepared(store: LoggedStore) -> LoggedStore:
    store.add_types([EventType(name="Event")])
    return store


def atomic(end: float | None = 1, **fields: Any) -> Event:
    return Event(type="Event", interval=span(0, end), **fields)


def whole(*parts: Event, **fields: Any) -> Event:
    return Event(type="Event", parts=[part.uid for part in parts], **fields)


def logged(store: LoggedStore) -> list[tuple[LogKind, StoredEvent]]:
    """Kind and event of each entry, in order."""
    entries = store.log.read(0, store.log.head())
    return [(entry.kind, entry.event) for entry in entries if entry.event is not None]


def order(store: LoggedStore) -> list[UUID]:
    """The uids by id, which are those by position in the log."""
    by_id = [event.uid for event in everything(store)]
    assert [event.uid for _, event in logged(store)] == by_id
    return by_id


def uids(*events: Event) -> list[UUID]:
    return [event.uid for event in events]


def test_wholes_stand_where_they_were_given(typed: LoggedStore, write: Write, more: list[Event]) -> None:
    """Between atomic events, and above each other."""
    one, two, three, four = (atomic() for _ in range(4))
    pair = whole(one, two)
    top = whole(pair, one)
    other = whole(three)
    above = whole(top, other, two)
    events = [*more[:7], one, two, pair, top, three, other, *more[7:], above, four]
    write(typed, events)
    assert order(typed) == uids(*events)


def test_a_second_call_goes_on_behind_the_first(typed: LoggedStore, write: Write, more: list[Event]) -> None:
    first = [atomic(), *more]
    second = [whole(*first[-2:]), atomic()]
    third = [whole(second[0], second[1]), atomic(), *(whole(event) for event in more)]
    for events in (first, second, third):
        write(typed, events)
    assert order(typed) == uids(*first, *second, *third)


def test_a_whole_that_comes_too_early_follows_its_last_part(
    typed: LoggedStore, write_at_once: Write, more: list[Event]
) -> None:
    one, two, three, four = (atomic() for _ in range(4))
    pair, single = whole(two, one), whole(one)
    top = whole(pair, three)
    write_at_once(typed, [*more, top, pair, one, four, single, two, three])
    assert order(typed) == uids(*more, one, four, single, two, pair, three, top)


def test_of_wholes_that_wait_for_the_same_part_the_first_comes_first(
    typed: LoggedStore, write_at_once: Write, more: list[Event]
) -> None:
    part, last = atomic(), atomic()
    wholes = [whole(part) for _ in range(3)]
    above = whole(wholes[1])
    write_at_once(typed, [above, *wholes, part, last, *more])
    assert order(typed) == uids(part, wholes[0], wholes[1], above, wholes[2], last, *more)


def test_what_is_there_already_leaves_no_trace_in_the_order(
    typed: LoggedStore, write: Write, more: list[Event]
) -> None:
    old = [atomic(), atomic()]
    old.append(whole(*old))
    typed.commit_all(arrivals(old))
    new = [atomic(), whole(old[0]), atomic(), whole(old[2])]
    write(typed, [new[0], *old[:2], new[1], *more, new[0], new[2], old[2], new[3], old[0], new[1]])
    assert order(typed) == uids(*old, *new[:2], *more, *new[2:])


def test_a_whole_waits_also_for_a_part_that_is_there_already(
    typed: LoggedStore, write_at_once: Write, more: list[Event]
) -> None:
    """Where a whole stands depends on what the call says, not on what the memory holds."""
    part = atomic()
    typed.commit(Arrival(event=part))
    over, beside = whole(part), atomic()
    write_at_once(typed, [over, beside, part, *more])
    assert order(typed) == uids(part, beside, over, *more)


def test_of_a_load_only_what_is_kept_stands_in_the_order(typed: LoggedStore, more: list[Event]) -> None:
    known = atomic()
    typed.commit(Arrival(event=known))
    one, two, three = (atomic() for _ in range(3))
    late, untyped = atomic(), Event(type="Nothing", interval=span(0, 1))
    other = Event(type="Event", uid=known.uid, interval=span(0, 2))
    over, above, beside = whole(one, known), whole(two), whole(three)
    refused = [whole(late), untyped, whole(untyped), other]
    top = whole(over, above)
    report = typed.load(
        arrivals([one, refused[0], over, *more, refused[1], two, refused[2], above, known, three, refused[3], top])
        + arrivals([beside, late])
    )
    assert (report.existing, len(report.refused)) == (1, 4)
    assert order(typed) == uids(known, one, over, *more, two, above, three, top, beside, late)


def test_entries_say_what_derives(typed: LoggedStore, write: Write, more: list[Event]) -> None:
    """Kind and agent, each at its place."""
    ended, going_on, other = atomic(agent="a"), atomic(None, agent="a"), atomic(agent="b")
    over, closed, mixed = whole(ended, going_on), whole(ended), whole(ended, other)
    above, named = whole(over, closed), whole(mixed, agent="c")
    write(typed, [ended, going_on, over, *more, closed, other, mixed, above, named])
    found = [(kind, event.uid, event.agent) for kind, event in logged(typed)]
    plain = [(LogKind.COMMIT, event.uid, None) for event in more]
    assert found == [
        (LogKind.COMMIT, ended.uid, "a"),
        (LogKind.OPEN, going_on.uid, "a"),
        (LogKind.OPEN, over.uid, "a"),
        *plain,
        (LogKind.COMMIT, closed.uid, "a"),
        (LogKind.COMMIT, other.uid, "b"),
        (LogKind.COMMIT, mixed.uid, None),
        (LogKind.OPEN, above.uid, "a"),
        (LogKind.COMMIT, named.uid, "c"),
    ]
    entries = typed.log.read(0, typed.log.head())
    assert [entry.agent for entry in entries] == [agent for _, _, agent in found]


@dataclass(frozen=True, kw_only=True)
class Telling:
    """Events of a random partonomy: some are there before, and all come in an order of their own, some twice."""

    before: list[Event]
    asked: list[Event]


@st.composite
def tellings(draw: st.DrawFn) -> Telling:
    events: list[Event] = []
    for number in range(draw(st.integers(1, 24))):
        uid, is_complex = UUID(int=number + 1), draw(st.booleans())
        if events and is_complex:
            parts = draw(st.lists(st.sampled_from(events), min_size=1, max_size=4, unique_by=lambda part: part.uid))
            events.append(whole(*parts, uid=uid))
        else:
            events.append(atomic(draw(st.sampled_from([None, 1])), uid=uid))
    before = events[: draw(st.integers(0, len(events)))]
    again = draw(st.lists(st.sampled_from(events), max_size=3))
    return Telling(before=before, asked=draw(st.permutations([*events, *again])))


def as_wanted(events: Sequence[Event]) -> list[Event]:
    """Each time the first event of all whose parts among them are there."""
    waiting = {event.uid: event for event in events}
    found: list[Event] = []
    while waiting:
        first = next(event for event in waiting.values() if waiting.keys().isdisjoint(event.parts))
        found.append(waiting.pop(first.uid))
    return found


@few_memories
@given(tellings())
@pytest.mark.parametrize("way", AT_ONCE)
def test_every_store_gives_the_same_order(store_factory: StoreFactory, way: str, telling: Telling) -> None:
    stores = [prepared(store_factory()), prepared(MemoryStore())]
    for store in stores:
        store.commit_all(arrivals(telling.before))
        AT_ONCE[way](store, telling.asked)
    known = set(uids(*telling.before))
    expected = [*telling.before, *(event for event in as_wanted(telling.asked) if event.uid not in known)]
    assert [order(store) for store in stores] == [uids(*expected)] * 2


@few_memories
@given(tellings())
def test_every_store_loads_in_the_order_given(store_factory: StoreFactory, telling: Telling) -> None:
    """What comes before its parts is refused, and with it what has it as a part."""
    asked = list({event.uid: event for event in telling.asked}.values())
    stores = [prepared(store_factory()), prepared(MemoryStore())]
    reports = []
    for store in stores:
        store.commit_all(arrivals(telling.before))
        reports.append(store.load(arrivals(asked)))
    known = uids(*telling.before)
    kept, refused = list(known), []
    for index, event in enumerate(asked):
        if event.uid in known:
            continue
        if set(event.parts) <= set(kept):
            kept.append(event.uid)
        else:
            refused.append(index)
    assert [[refusal.index for refusal in report.refused] for report in reports] == [refused] * 2
    assert [order(store) for store in stores] == [kept] * 2
