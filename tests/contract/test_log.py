"""The log: what is committed enters it once, parts first, and consumers read it from where they were."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from itertools import islice
from typing import Any, cast
from uuid import UUID, uuid4

import pytest

from elm import cues
from elm.app import Memory
from elm.errors import (
    ConflictingContent,
    ConsumerBusy,
    ElmError,
    InvalidValue,
    PositionLost,
    StoreClosed,
    UnknownConsumer,
    UnknownEvent,
    UnknownType,
)
from elm.event import Event, StoredEvent
from elm.log import Advance, Log, LogEntry, LogKind, Progress, Tick
from elm.query import Query
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.conftest import StoreFactory
from tests.stories import story

COMMIT, OPEN, CLOSE = LogKind.COMMIT, LogKind.OPEN, LogKind.CLOSE


@pytest.fixture
def memory(store_factory: StoreFactory) -> Memory:
    """An empty memory that knows two types."""
    opened = Memory(store_factory())
    opened.add_types([EventType(name="Thing"), EventType(name="Other")])
    return opened


def thing(*parts: Event, end: float | None = 1, **fields: Any) -> Event:
    """An event, complex when it is given parts."""
    if parts:
        return Event(type="Thing", parts=[part.uid for part in parts], **fields)
    return Event(type="Thing", interval=span(0, end), **fields)


def entries(log: Log) -> list[LogEntry]:
    """The whole log."""
    return log.read(0, log.head())


def told(log: Log) -> list[tuple[LogKind, UUID]]:
    """Kind and event of each entry, in order."""
    return [(entry.kind, entry.event.uid) for entry in entries(log) if entry.event is not None]


def arrivals(*events: Event) -> list[Arrival]:
    return [Arrival(event=event) for event in events]


def advance(name: str, before: int, position: int, **more: Any) -> Advance:
    return Advance(name=name, before=before, position=position, **more)


Write = Callable[[Memory, Sequence[Event]], object]
WRITES: dict[str, Write] = {
    "commit": lambda memory, events: [memory.commit(event) for event in events],
    "commit_all": lambda memory, events: memory.commit_all(events),
    "load": lambda memory, events: memory.load(events),
    "advance": lambda memory, events: memory.log.advance([], arrivals(*events)),
}


@pytest.fixture(params=WRITES)
def write(request: pytest.FixtureRequest) -> Write:
    return WRITES[request.param]


# Entries


def test_an_empty_log(memory: Memory) -> None:
    assert memory.log.head() == 0
    assert memory.log.read(0, 100) == []
    assert memory.log.consumers() == []
    assert memory.log.definitions() == {}


def test_each_new_event_enters_the_log_once(memory: Memory, write: Write) -> None:
    first, second, third = thing(agent="armar6"), thing(agent="ärger 'n"), thing()
    before = datetime.now(UTC)
    write(memory, [first, second])
    write(memory, [first, third])
    found = entries(memory.log)
    assert [entry.position for entry in found] == [1, 2, 3]
    assert {entry.event for entry in found} == set(memory.recall())
    assert sorted((str(entry.agent), entry.event.agent) for entry in found if entry.event) == sorted(
        (str(event.agent), event.agent) for event in (first, second, third)
    )
    assert [(entry.kind, entry.deadline) for entry in found] == [(COMMIT, None)] * 3
    slack = timedelta(seconds=1)
    assert all(before - slack <= entry.at <= datetime.now(UTC) + slack for entry in found)


def test_kinds_tell_what_was_open_when_it_came(memory: Memory, write: Write) -> None:
    """Of wholes it derives; and it stays so after they closed, when the events themselves tell otherwise."""
    ended, going_on = thing(), thing(end=None)
    over, under = thing(ended, going_on), thing(ended)
    top = thing(over)
    write(memory, [ended, going_on, over, under, top])
    kinds = {uid: kind for kind, uid in told(memory.log)}
    expected = {ended.uid: COMMIT, going_on.uid: OPEN, over.uid: OPEN, under.uid: COMMIT, top.uid: OPEN}
    assert kinds == expected
    memory.close_event(going_on.uid, at(5))
    assert told(memory.log)[5:] == [(CLOSE, going_on.uid), (CLOSE, over.uid), (CLOSE, top.uid)]
    assert {uid: kind for kind, uid in told(memory.log)[:5]} == expected
    assert all(entry.event is not None and not entry.event.interval.is_open for entry in entries(memory.log))


def test_read_gives_pages_of_what_was_brought_in(memory: Memory) -> None:
    memory.commit_all([thing() for _ in range(10)])
    log = memory.log
    assert log.head() == 10
    assert [entry.position for entry in log.read(0, 4)] == [1, 2, 3, 4]
    assert [entry.position for entry in log.read(7, 4)] == [8, 9, 10]
    assert log.read(10, 4) == log.read(99, 4) == log.read(3, 0) == []
    assert log.read(2, 3) == log.read(0, 10)[2:5]
    for wrong in (-1, 2**63, True):
        with pytest.raises(InvalidValue):
            log.read(wrong, 1)
        with pytest.raises(InvalidValue):
            log.read(0, wrong)


def test_what_is_refused_leaves_no_entry(memory: Memory, write: Write) -> None:
    kept = thing()
    memory.commit(kept)
    other = Event(type="Thing", interval=span(0, 2), uid=kept.uid)
    for wrong in (other, Event(type="Thing", parts=[uuid4()]), Event(type="Nothing", interval=span(0, 1))):
        try:
            write(memory, [wrong])
        except ElmError:
            continue
    assert told(memory.log) == [(COMMIT, kept.uid)]


def test_clocks_have_entries_of_their_own(memory: Memory) -> None:
    event = thing(agent="a")
    memory.commit(event)
    memory.log.write([Tick(agent="a", deadline=at(7)), Tick(agent=None, deadline=at(3))])
    memory.punctuate(at(9), "a")
    memory.punctuate(at(10))
    found = entries(memory.log)
    assert [(entry.position, entry.kind, entry.agent, entry.deadline) for entry in found] == [
        (1, COMMIT, "a", None),
        (2, LogKind.TICK, "a", at(7)),
        (3, LogKind.TICK, None, at(3)),
        (4, LogKind.PUNCTUATION, "a", at(9)),
        (5, LogKind.PUNCTUATION, None, at(10)),
    ]
    assert [entry.event is None for entry in found] == [False, True, True, True, True]
    with pytest.raises(InvalidValue, match="naive"):
        memory.punctuate(datetime(2026, 1, 1))  # noqa: DTZ001 - a naive one is the point


@pytest.mark.parametrize("seed", range(3))
def test_positions_are_dense_and_causal(memory: Memory, seed: int) -> None:
    """Whoever asks for the head, and when; parts come and close before their wholes, each once."""
    chance = random.Random(seed)
    events = story(chance, thing)
    going_on = [event.uid for event in events if event.interval and event.interval.is_open]
    for event in events:
        chance.choice(list(WRITES.values()))(memory, [event])
        if chance.random() < 0.3:
            memory.log.head()
    for uid in chance.sample(going_on, len(going_on)):
        memory.close_event(uid, at(9))
    found = entries(memory.log)
    assert [entry.position for entry in found] == list(range(1, len(found) + 1))
    place = {known: number for number, known in enumerate(told(memory.log))}
    assert len(place) == len(found)
    came = {uid: number for (kind, uid), number in place.items() if kind is not CLOSE}
    opened = {uid for kind, uid in place if kind is OPEN}
    assert came.keys() == {event.uid for event in events}
    assert {uid for kind, uid in place if kind is CLOSE} == opened >= set(going_on)
    for event in events:
        for part in event.parts:
            assert came[part] < came[event.uid]
            assert part not in opened or (event.uid in opened and place[CLOSE, part] < place[CLOSE, event.uid])


# Consumers


def test_a_consumer_keeps_its_place(memory: Memory) -> None:
    log = memory.log
    memory.commit_all([thing() for _ in range(5)])
    assert log.head() == 5
    assert log.consumer("b") is None
    before = datetime.now(UTC) - timedelta(seconds=1)
    new = log.register("b", position=2)
    assert (new.name, new.position, new.checkpoint, new.state, new.report) == ("b", 2, 2, None, {})
    assert before <= new.updated_at <= datetime.now(UTC) + timedelta(seconds=1)
    assert log.register("b") == log.register("b", position=4) == log.consumer("b") == new
    log.register("ä")
    log.register("a")
    assert [consumer.name for consumer in log.consumers()] == ["a", "b", "ä"]
    log.remove("b")
    log.remove("b")
    assert log.consumer("b") is None
    assert [consumer.name for consumer in log.consumers()] == ["a", "ä"]


def test_an_advance_moves_position_report_and_with_a_state_the_checkpoint(memory: Memory) -> None:
    log = memory.log
    memory.commit_all([thing() for _ in range(5)])
    log.head()
    log.register("a")
    log.advance([advance("a", 0, 2, report={"late": 1, "by": ["x", None, 0.5]})])
    first = log.consumer("a")
    assert first is not None
    assert (first.position, first.checkpoint, first.state) == (2, 0, None)
    assert first.report == {"late": 1, "by": ["x", None, 0.5]}
    log.advance([advance("a", 2, 4, state=b"\0\xff", report={"late": 2})])
    log.advance([advance("a", 4, 5), advance("a", 5, 5, state=b"")])
    log.register("b", position=4)
    log.advance([advance("b", 4, 5, state=b"s"), advance("a", 5, 5)])
    assert [(each.name, each.position, each.checkpoint, each.state, each.report) for each in log.consumers()] == [
        ("a", 5, 5, b"", {}),
        ("b", 5, 5, b"s", {}),
    ]


def test_progress_tells_all_of_consumers_but_what_they_know(memory: Memory) -> None:
    log = memory.log
    memory.commit_all([thing() for _ in range(5)])
    log.head()
    for name in ("b", "a"):
        log.register(name)
    log.advance([advance("b", 0, 4, state=b"s", report={"late": 2})])
    assert log.progress() == [
        Progress(name=each.name, position=each.position, report=each.report, updated_at=each.updated_at)
        for each in log.consumers()
    ]
    assert [(each.name, each.position, each.report) for each in log.progress()] == [
        ("a", 0, {}),
        ("b", 4, {"late": 2}),
    ]


@pytest.mark.parametrize("count", [1, 100])
def test_results_are_kept_together_with_the_step(memory: Memory, count: int) -> None:
    """They may be parts of each other in any order, and what is there already is not there twice."""
    log = memory.log
    seen = [thing(agent="a") for _ in range(count)]
    memory.commit_all(seen)
    log.register("a", position=log.head())
    wholes = [thing(event) for event in seen]
    top = thing(*wholes)
    done = log.advance([advance("a", count, count)], arrivals(top, *wholes, seen[0], top))
    assert [one.uid for one in done] == [event.uid for event in (top, *wholes, seen[0], top)]
    assert [one.new for one in done] == [True] * (count + 1) + [False, False]
    stored = memory.get(top.uid)
    assert (stored.id, stored.parts, stored.agent) == (done[0].id, top.parts, "a")
    assert told(log)[-1] == (COMMIT, top.uid)
    again = log.advance([], arrivals(*wholes, top))
    assert [(one.id, one.new) for one in again] == [(one.id, False) for one in (*done[1 : count + 1], done[0])]
    assert log.head() == 2 * count + 1


def _refused(memory: Memory, seen: Event) -> dict[str, tuple[type[ElmError], list[Event]]]:
    return {
        "other content": (ConflictingContent, [Event(type="Thing", interval=span(0, 2), uid=seen.uid)]),
        "unknown part": (UnknownEvent, [Event(type="Thing", parts=[uuid4()])]),
        "unknown type": (UnknownType, [Event(type="Nothing", interval=span(0, 1))]),
    }


@pytest.mark.parametrize("reason", ["other content", "unknown part", "unknown type"])
@pytest.mark.parametrize("more", [0, 50])
def test_a_refused_result_leaves_the_consumer_where_it_was(memory: Memory, reason: str, more: int) -> None:
    log = memory.log
    seen = thing()
    memory.commit(seen)
    log.head()
    log.register("a")
    before = log.consumer("a")
    expected, events = _refused(memory, seen)[reason]
    with pytest.raises(expected):
        log.advance(
            [advance("a", 0, 1, state=b"s", report={"x": 1})], arrivals(*[thing() for _ in range(more)], *events)
        )
    assert log.consumer("a") == before
    assert told(log) == [(COMMIT, seen.uid)]


@pytest.mark.parametrize("count", [1, 50])
def test_who_lost_its_position_keeps_nothing(memory: Memory, count: int) -> None:
    log = memory.log
    memory.commit_all([thing(), thing()])
    log.head()
    for name in ("a", "b", "c"):
        log.register(name)
    log.advance([advance("b", 0, 1)])
    before = log.consumers()
    with pytest.raises(PositionLost, match="'b' is at position 1, not at 0"):
        log.advance(
            [advance("a", 0, 2), advance("b", 0, 2), advance("c", 0, 2)], arrivals(*[thing() for _ in range(count)])
        )
    assert log.consumers() == before
    assert log.head() == 2


def test_positions_that_cannot_be(memory: Memory) -> None:
    log = memory.log
    memory.commit(thing())
    assert log.head() == 1
    log.register("a", position=1)
    known = log.consumers()
    with pytest.raises(InvalidValue, match=r"'b' cannot be at position 2: the log ends at 1"):
        log.register("b", position=2)
    with pytest.raises(InvalidValue, match="the log ends at 1"):
        log.rewind("a", 2)
    with pytest.raises(InvalidValue, match="the log ends at 1"):
        log.advance([advance("a", 1, 2)], arrivals(thing()))
    for call in (lambda: log.rewind("b", 0), lambda: log.advance([advance("b", 0, 0)], arrivals(thing()))):
        with pytest.raises(UnknownConsumer, match=r"no consumer 'b': register it"):
            call()
    for position in (-1, 2**63):
        with pytest.raises(InvalidValue):
            log.register("a", position=position)
        with pytest.raises(InvalidValue):
            log.rewind("a", position)
    for name in ("", "\0", "a\x1fb", "x" * 501):
        with pytest.raises(InvalidValue, match="name of a consumer"):
            log.register(name)
        with pytest.raises(InvalidValue, match="name of a consumer"), log.exclusive(name):
            pass
    assert log.consumers() == known
    assert log.head() == 1


def test_rewind_begins_again_without_state(memory: Memory) -> None:
    log = memory.log
    memory.commit_all([thing() for _ in range(4)])
    log.head()
    log.register("a")
    log.advance([advance("a", 0, 4, state=b"s", report={"x": 1})])
    log.rewind("a", 1)
    found = log.consumer("a")
    assert found is not None
    assert (found.position, found.checkpoint, found.state) == (1, 1, None)
    log.advance([advance("a", 1, 3)])
    log.rewind("a", 4)
    assert [each.position for each in log.consumers()] == [4]


def test_the_first_fingerprint_of_a_definition_stays(memory: Memory) -> None:
    memory.log.define({"fall/1": "abc", "wave/1": "x"})
    memory.log.define({"fall/1": "other", "fall/2": "def"})
    memory.log.define({})
    assert memory.log.definitions() == {"fall/1": "abc", "fall/2": "def", "wave/1": "x"}


def test_a_name_is_held_by_one(memory: Memory) -> None:
    log = memory.log
    with log.exclusive("a"), log.exclusive("A"), log.exclusive("ä 'n"):
        with pytest.raises(ConsumerBusy, match="'a'"), log.exclusive("a"):
            pass
        with pytest.raises(ConsumerBusy), log.exclusive("ä 'n"):
            pass
    with pytest.raises(ZeroDivisionError), log.exclusive("a"):
        raise ZeroDivisionError
    with log.exclusive("a"):
        pass


# Waiting


def test_waiting_ends_when_there_is_more(memory: Memory) -> None:
    log = memory.log
    memory.commit(thing())
    assert log.wait(0, 0)
    begun = time.monotonic()
    assert log.wait(0, 60)
    assert time.monotonic() - begun < 10
    begun = time.monotonic()
    assert not log.wait(1, 0.2)
    assert 0.19 <= time.monotonic() - begun < 10
    assert not log.wait(7, 0)


@pytest.mark.parametrize("news", ["commit", "commit_all", "load", "close", "tick", "advance"])
def test_whatever_is_written_wakes_who_waits(memory: Memory, news: str) -> None:
    going_on = thing(end=None)
    memory.commit(going_on)
    writes: dict[str, Callable[[], object]] = {
        "commit": lambda: memory.commit(thing()),
        "commit_all": lambda: memory.commit_all([thing()]),
        "load": lambda: memory.load([thing()]),
        "close": lambda: memory.close_event(going_on.uid, at(5)),
        "tick": lambda: memory.punctuate(at(5)),
        "advance": lambda: memory.log.advance([], arrivals(thing())),
    }
    with ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(memory.log.wait, memory.log.head(), 60)
        time.sleep(0.05)
        assert not waiting.done()
        writes[news]()
        assert waiting.result(timeout=10)
    assert memory.log.head() == 2


def test_closing_the_memory_ends_the_waiting(memory: Memory) -> None:
    with ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(memory.log.wait, memory.log.head(), 60)
        time.sleep(0.05)
        memory.close()
        with pytest.raises(StoreClosed):
            waiting.result(timeout=10)


def test_a_closed_memory_has_no_log(memory: Memory) -> None:
    log = memory.log
    memory.close()
    calls: list[Callable[[], object]] = [
        log.head,
        lambda: log.read(0, 1),
        lambda: log.write([Tick(agent=None, deadline=at(0))]),
        log.consumers,
        log.progress,
        lambda: log.consumer("a"),
        lambda: log.register("a"),
        lambda: log.advance([]),
        lambda: log.rewind("a", 0),
        lambda: log.remove("a"),
        log.definitions,
        lambda: log.define({"a": "b"}),
        lambda: log.wait(0, 0),
        lambda: log.exclusive("a").__enter__(),
        memory.subscribe,
    ]
    for call in calls:
        with pytest.raises(StoreClosed):
            call()


# Subscriptions


def uids(events: Iterator[StoredEvent]) -> list[UUID]:
    return [event.uid for event in events]


def test_a_subscription_begins_with_what_comes(memory: Memory) -> None:
    memory.commit(thing())
    events = memory.subscribe(timeout=0)
    since_begin = memory.subscribe(since=0, timeout=0)
    late = memory.commit_all([thing(), thing()])
    assert uids(events) == [one.uid for one in late]
    assert len(uids(since_begin)) == 3
    assert uids(memory.subscribe(timeout=0)) == []
    assert uids(memory.subscribe(since=2, timeout=0)) == [late[1].uid]


def test_a_subscription_waits_for_more(memory: Memory) -> None:
    first, *later = [thing() for _ in range(4)]
    memory.commit(first)
    events = memory.subscribe(since=0, timeout=30)
    assert next(events).uid == first.uid
    with ThreadPoolExecutor(1) as threads:
        for event in later:
            waiting = threads.submit(next, events)
            time.sleep(0.05)
            assert not waiting.done()
            memory.commit(event)
            assert waiting.result(timeout=10).uid == event.uid
    begun = time.monotonic()
    assert uids(memory.subscribe(timeout=0.2)) == []
    assert 0.19 <= time.monotonic() - begun < 10


def test_a_subscription_without_timeout_ends_with_the_memory(memory: Memory) -> None:
    event = thing()
    memory.commit(event)
    events = memory.subscribe(since=0, name="a")
    with ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(uids, events)
        time.sleep(0.1)
        assert not waiting.done()
        memory.close()
        assert waiting.result(timeout=10) == [event.uid]


def test_time_that_the_reader_takes_is_not_waiting(memory: Memory) -> None:
    memory.commit_all([thing(), thing()])
    events = memory.subscribe(since=0, timeout=0.1)
    next(events)
    next(events)
    time.sleep(0.2)
    memory.commit(thing())
    assert len(uids(events)) == 1


def test_an_event_that_was_open_comes_again_when_it_closes(memory: Memory) -> None:
    going_on, ended = thing(end=None), thing()
    events = memory.subscribe(timeout=0.1)
    memory.commit_all([going_on, ended])
    found = list(islice(events, 2))
    assert {(event.uid, event.interval.is_open) for event in found} == {(going_on.uid, True), (ended.uid, False)}
    memory.close_event(going_on.uid, at(5))
    (closed,) = events
    assert (closed.uid, closed.interval) == (going_on.uid, span(0, 5))


def test_clocks_are_no_events(memory: Memory) -> None:
    memory.punctuate(at(5))
    event = thing()
    memory.commit(event)
    memory.punctuate(at(6))
    assert uids(memory.subscribe(since=0, timeout=0)) == [event.uid]


def test_a_cue_decides_what_is_seen(memory: Memory) -> None:
    """Whatever it asks for, also kin: the same as a recall."""
    parts = [thing(agent="a"), thing(agent="b"), Event(type="Other", interval=span(3, 4))]
    over = thing(*parts[:2])
    memory.commit_all([*parts, over, thing(over, parts[2])])
    for cue in (
        cues.everything(),
        cues.any_of(),
        cues.is_a("Other"),
        cues.agent("a") | cues.time("during", at(2), None),
        ~cues.agent("a"),
        cues.parts("intersects", [parts[0].uid]),
        cues.parts("intersects", [parts[0].uid], transitive=True),
        cues.wholes("intersects", [over.uid]),
        cues.uid(over.uid) & cues.exactly("Thing"),
    ):
        found = list(memory.subscribe(cue, since=0, timeout=0))
        assert {event.id for event in found} == set(memory.recall(cue).ids())
        assert found == sorted(found, key=lambda event: event.id)
    with pytest.raises(UnknownType, match="Nothing"):
        memory.subscribe(cues.is_a("Nothing"))
    for wrong in (-1, float("nan")):
        with pytest.raises(InvalidValue, match="timeout"):
            memory.subscribe(timeout=wrong)
    with pytest.raises(InvalidValue, match="position"):
        memory.subscribe(since=-1)


def test_a_named_subscription_goes_on_where_it_was(memory: Memory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each page counts when all of it was handed over: what was begun comes again."""
    monkeypatch.setattr("elm.subscription.PAGE", 3)
    events = [thing() for _ in range(8)]
    for event in events:
        memory.commit(event)
    known = [event.uid for event in events]
    first = cast("Any", memory.subscribe(name="a", since=0, timeout=0))
    assert uids(islice(first, 5)) == known[:5]
    with pytest.raises(ConsumerBusy):
        next(memory.subscribe(name="a"))
    first.close()
    assert uids(memory.subscribe(name="a", timeout=0)) == known[3:]
    assert uids(memory.subscribe(name="a", since=0, timeout=0)) == []
    late = thing()
    memory.commit(late)
    assert uids(memory.subscribe(name="a", timeout=0)) == [late.uid]
    found = memory.log.consumer("a")
    assert found is not None
    assert found.position == memory.log.head() == 9


def test_a_named_subscription_passes_over_what_does_not_match(memory: Memory) -> None:
    memory.commit_all([thing() for _ in range(5)])
    assert uids(memory.subscribe(cues.any_of(), name="a", since=0, timeout=0)) == []
    assert [consumer.position for consumer in memory.log.consumers()] == [5]


def test_a_named_subscription_that_another_moved_says_so(memory: Memory) -> None:
    memory.commit_all([thing(), thing()])
    events = memory.subscribe(name="a", since=0, timeout=0)
    next(events)
    memory.log.advance([advance("a", 0, 1)])
    with pytest.raises(PositionLost):
        list(events)


def test_events_read_from_the_log_are_those_recalled(memory: Memory) -> None:
    memory.commit_all([thing(features={"a": 1}, agent="x"), thing(payload=None)])
    by_id = {event.id: event for event in memory.store.find(Query())}
    assert [entry.event for entry in entries(memory.log)] == [by_id[number] for number in sorted(by_id)]
