"""Committing many events at once: by COPY the memory becomes what it becomes one event after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from threading import Barrier
from uuid import uuid4

import pytest
from hypothesis import given

from elm.errors import ConflictingContent, CycleRefused, ElmError, ExtentRefused, UnknownEvent
from elm.event import Event
from elm.geometry import Region
from elm.storage import writing_together
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.contract.telling import everything, few_memories, holds, numbered
from tests.strategies import Story, stories


@pytest.fixture
def open_store(dsn: str) -> Iterator[Callable[[], PostgresStore]]:
    """Opens an empty memory at every call."""
    opened: list[PostgresStore] = []
    numbers = count(1)

    def make() -> PostgresStore:
        while opened:
            opened.pop().close()
        opened.append(PostgresStore(dsn, f"m{next(numbers)}"))
        return opened[-1]

    yield make
    while opened:
        opened.pop().close()


@pytest.fixture
def store(open_store: Callable[[], PostgresStore]) -> PostgresStore:
    """An empty memory that knows the type Thing, and that copies also a single event."""
    found = open_store()
    found.add_types([EventType(name="Thing")])
    return found


@pytest.fixture(autouse=True)
def _even_one_is_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing_together, "MANY", 1)


def thing(*parts: Event, end: float | None = 1, **fields: object) -> Event:
    if parts:
        return Event(type="Thing", parts=[part.uid for part in parts], **fields)  # type: ignore[arg-type]
    return Event(type="Thing", interval=span(0, end), **fields)  # type: ignore[arg-type]


def arrivals(*events: Event) -> list[Arrival]:
    return [Arrival(event=event) for event in events]


@few_memories
@given(story=stories())
def test_random_memories(open_store: Callable[[], PostgresStore], story: Story) -> None:
    """Told at once, in reverse, then again in two calls, which change nothing."""
    store = open_store()
    store.add_types(story.types)
    done = store.commit_all(story.arrivals[::-1])
    assert [(one.uid, one.new) for one in done] == [(arrival.event.uid, True) for arrival in story.arrivals[::-1]]
    model = numbered(story.types, story.arrivals, store)
    assert holds(store, model)
    half = len(story.arrivals) // 2
    again = [*store.commit_all(story.arrivals[:half]), *store.commit_all(story.arrivals[half:])]
    assert again == [type(one)(id=one.id, uid=one.uid, new=False) for one in reversed(done)]
    assert holds(store, model)
    assert store.log.head() == len(story.arrivals)


def test_what_is_there_and_what_is_new(store: PostgresStore) -> None:
    parts = [thing(), thing(end=None), thing()]
    store.commit_all(arrivals(parts[0], parts[1]))
    store.close_event(parts[1].uid, at(5))
    over = thing(*parts)
    top = thing(over, parts[0])
    exported = Event(type="Thing", interval=span(0, 5), uid=parts[1].uid)
    done = store.commit_all(arrivals(top, over, exported, parts[2], parts[0], over))
    assert [one.uid for one in done] == [each.uid for each in (top, over, exported, parts[2], parts[0], over)]
    assert [one.new for one in done] == [True, True, False, True, False, False]
    assert [each.uid for each in everything(store)] == [each.uid for each in (*parts, over, top)]
    assert {each.uid: each.interval for each in everything(store)}[top.uid] == span(0, 5)


def test_what_is_refused_leaves_nothing(store: PostgresStore) -> None:
    known, other = thing(), thing()
    store.commit_all(arrivals(known, other))
    extents = Event(type="Thing", parts=[known.uid], region=Region.box(0, 0, 1, 1))
    ring = [uuid4(), uuid4()]
    refused: list[tuple[type[ElmError], list[Event]]] = [
        (ConflictingContent, [Event(type="Thing", interval=span(0, 2), uid=known.uid)]),
        (ConflictingContent, [thing(other, uid=known.uid)]),
        (UnknownEvent, [thing(thing())]),
        (ExtentRefused, [extents]),
        (CycleRefused, [Event(type="Thing", uid=ring[i], parts=[ring[1 - i]]) for i in (0, 1)]),
    ]
    for error, events in refused:
        first = thing()
        with pytest.raises(error):
            store.commit_all(arrivals(first, *events, thing(first)))
        assert [each.uid for each in everything(store)] == [known.uid, other.uid]
    assert store.log.head() == 2


def test_the_same_events_from_several_processes(dsn: str, store: PostgresStore) -> None:
    """In different orders: those who come second find what is there."""
    parts = [thing(end=None if number % 2 else 1) for number in range(10)]
    events = [*parts, *(thing(*parts[number : number + 3]) for number in range(8))]
    barrier = Barrier(3)
    stores = [PostgresStore(dsn, store.memory) for _ in range(3)]

    def write(number: int) -> list[bool]:
        turned = events[number * 5 :] + events[: number * 5]
        barrier.wait(timeout=60)
        return [one.new for one in stores[number].commit_all(arrivals(*turned))]

    with ThreadPoolExecutor(3) as threads:
        new = list(threads.map(write, range(3), timeout=60))
    for each in stores:
        each.close()
    assert sum(map(sum, new)) == len(events)
    assert store.log.head() == len(events) == len(everything(store))


def test_parts_that_close_meanwhile_leave_no_whole_open(dsn: str, store: PostgresStore) -> None:
    other = PostgresStore(dsn, store.memory)
    for _ in range(20):
        part = thing(end=None)
        store.commit(Arrival(event=part))
        barrier = Barrier(2)

        def close(part: Event = part, barrier: Barrier = barrier) -> None:
            barrier.wait(timeout=60)
            other.close_event(part.uid, at(5))

        with ThreadPoolExecutor(1) as threads:
            closing = threads.submit(close)
            barrier.wait(timeout=60)
            store.commit_all(arrivals(*[thing(part) for _ in range(5)]))
            closing.result(timeout=60)
    other.close()
    assert store.statistics().open_events == 0
