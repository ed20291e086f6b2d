"""Recognition in a memory that forgets: holes of the log are counted, and what was found does not come back."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from datetime import timedelta
from random import Random
from uuid import UUID, uuid4

import pytest

from elm import cues
from elm.errors import ForgottenEvent
from elm.event import Event, StoredEvent
from elm.forgetting import forget
from elm.interval import Interval
from elm.log import LoggedStore, LogKind, Tick
from elm.query import Query
from elm.recognition import RecognitionManager, Timing, replay
from elm.recognizers import Pattern, step
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at
from tests.conftest import StoreFactory
from tests.recognition.scenes import TYPES, recognizers, stream

SECOND = timedelta(seconds=1)
PATIENCE = 30.0
PAIR = Pattern(
    name="pair",
    version=1,
    type="Pair",
    elements=[step("a", cues.exactly("A")), step("b", cues.exactly("B"))],
    within=60 * SECOND,
)


@pytest.fixture
def memory(store: LoggedStore) -> LoggedStore:
    store.add_types([EventType(name=name) for name in ("A", "B", "Whole")])
    return store


def instant(kind: str, second: float) -> Event:
    return Event(type=kind, interval=Interval.at(at(second)), agent="r")


def tell(store: LoggedStore, *events: Event) -> None:
    """Commit events, and promise that nothing before the last of them is to come."""
    store.commit_all([Arrival(event=event) for event in events])
    last = max(event.interval.begin for event in events if event.interval is not None)
    store.log.write([Tick(agent="r", deadline=last + SECOND / 10, kind=LogKind.PUNCTUATION)])


def over(*parts: Event | StoredEvent) -> Event:
    return Event(type="Whole", parts=[part.uid for part in parts])


def pairs(store: LoggedStore) -> list[StoredEvent]:
    return list(store.find(Query(cue=cues.exactly("Pair"))))


def until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, "it does not happen"
        time.sleep(0.01)


def forget_at_once(store: LoggedStore, event: Event | StoredEvent) -> None:
    """Forget an event, whoever holds it: as when that was asked before it was held."""
    (number,) = store.ids(Query(cue=cues.uid(event.uid)))
    assert store.forget([number], run=uuid4(), at=at(0)).events == 1


# Replay


def test_a_replay_holds_up_to_the_first_entry_that_was_forgotten(store_factory: StoreFactory) -> None:
    timing = Timing(lateness=2 * SECOND, simulated=True)
    events = stream(Random(7), 120)
    store, prefix = store_factory(), store_factory()
    for each in (store, prefix):
        each.add_types(TYPES)
    store.commit_all([Arrival(event=event) for event in events])
    whole = replay(store, recognizers(), timing=timing, commit=False)
    assert whole.forgotten is None
    forget(store, [events[80].uid])
    ended = replay(store, recognizers(), timing=timing, commit=False)

    position = next(entry.position for entry in store.log.read(0, 200) if entry.is_forgotten)
    assert (ended.forgotten, ended.entries) == (position, position - 1)
    prefix.commit_all([Arrival(event=event) for event in events[: position - 1]])
    expected = replay(prefix, recognizers(), timing=timing, commit=False)
    assert ended.found == expected.found
    assert 0 < len(ended.found) < len(whole.found)
    assert ended.missing == ()
    complete = replay(store, recognizers(), timing=timing, complete=True, commit=False)
    assert complete.forgotten == position
    behind = replay(store, recognizers(), timing=timing, since=position, commit=False)
    assert (behind.forgotten, behind.entries) == (None, len(events) - position)


def test_a_replay_does_not_bring_back_a_result_that_still_counts(memory: LoggedStore) -> None:
    tell(memory, instant("A", 1), instant("B", 2))
    manager = RecognitionManager(memory, [PAIR])
    manager.catch_up()
    (found,) = pairs(memory)
    tell(memory, Event(type="A", interval=Interval.at(at(3)), agent="r"))
    memory.commit(Arrival(event=over(found)))
    forget(memory, [found.uid])
    with pytest.raises(ForgottenEvent):
        memory.commit(Arrival(event=found.as_event()))
    compared = replay(memory, [PAIR], commit=False)
    again = replay(memory, [PAIR])

    assert compared == again
    assert (again.found, again.new) == ((found.uid,), ())
    assert pairs(memory) == []
    # The entry of the result itself is the first that was forgotten.
    assert again.forgotten == 4
    (consumer,) = memory.log.consumers()
    memory.log.rewind(consumer.name, 0)
    assert manager.catch_up() > 0
    (status,) = manager.status()
    assert (status.is_failing, status.lag, status.forgotten) == (False, 0, 1)
    assert pairs(memory) == []


# Live


def test_entries_that_were_forgotten_are_counted_and_passed_over(memory: LoggedStore) -> None:
    lost = instant("A", 1)
    tell(memory, lost, instant("B", 2))
    forget(memory, [lost.uid])
    tell(memory, instant("A", 3), instant("B", 4))
    manager = RecognitionManager(memory, [PAIR])
    manager.catch_up()

    (status,) = manager.status()
    assert (status.forgotten, status.lag, status.found, status.is_failing) == (1, 0, 1, False)
    assert [event.interval.begin for event in pairs(memory)] == [at(3)]
    manager.catch_up()
    assert manager.status()[0].forgotten == 1


def test_what_a_recognizer_holds_is_not_forgotten(memory: LoggedStore) -> None:
    first, other = instant("A", 2), instant("B", 1)
    tell(memory, other, first)
    RecognitionManager(memory, [PAIR]).catch_up()
    for dry_run in (True, False):
        done = forget(memory, cues.everything(), dry_run=dry_run)
        assert (done.events, done.held) == (1, 1)
    second = instant("B", 3)
    tell(memory, second)
    RecognitionManager(memory, [PAIR]).catch_up()

    assert [event.parts for event in pairs(memory)] == [(first.uid, second.uid)]
    done = forget(memory, [first.uid, second.uid])
    assert (done.events, done.tombstones, done.held) == (2, 2, 0)


def test_a_checkpoint_that_names_what_was_forgotten_goes_on_without(
    memory: LoggedStore, caplog: pytest.LogCaptureFixture
) -> None:
    first = instant("A", 1)
    tell(memory, first)
    RecognitionManager(memory, [PAIR]).catch_up()
    forget_at_once(memory, first)
    tell(memory, instant("B", 2), instant("A", 3), instant("B", 4))
    with caplog.at_level(logging.WARNING):
        manager = RecognitionManager(memory, [PAIR])
        manager.catch_up()

    assert "without what was unfinished with 1 events that were forgotten" in caplog.text
    (status,) = manager.status()
    assert (status.is_failing, status.lag, status.failures) == (False, 0, 0)
    assert [event.interval.begin for event in pairs(memory)] == [at(3)]


def test_only_the_agent_whose_event_was_forgotten_begins_anew(memory: LoggedStore) -> None:
    mine, other = instant("A", 1), Event(type="A", interval=Interval.at(at(1)), agent="s")
    tell(memory, mine, other)
    memory.log.write([Tick(agent="s", deadline=at(2), kind=LogKind.PUNCTUATION)])
    RecognitionManager(memory, [PAIR]).catch_up()
    forget_at_once(memory, mine)
    tell(memory, instant("B", 5), Event(type="B", interval=Interval.at(at(5)), agent="s"))
    memory.log.write([Tick(agent="s", deadline=at(6), kind=LogKind.PUNCTUATION)])
    RecognitionManager(memory, [PAIR]).catch_up()

    assert [event.agent for event in pairs(memory)] == ["s"]


@pytest.mark.parametrize("has_whole", [True, False], ids=["tombstone", "anonymous"])
def test_an_event_forgotten_while_a_running_recognizer_has_it(memory: LoggedStore, has_whole: bool) -> None:
    """Of a tombstone a result is made as of any part; without one it is not, and the recognizer goes on."""
    first, second = instant("A", 1), instant("B", 2)
    manager = RecognitionManager(memory, [PAIR])
    manager.start()
    try:
        tell(memory, first)
        if has_whole:
            memory.commit(Arrival(event=over(first)))
        head = memory.log.head()
        until(lambda: bool(manager.status()) and manager.status()[0].position >= head)
        forget_at_once(memory, first)
        tell(memory, second)
        tell(memory, instant("A", 3), instant("B", 4))
        until(lambda: bool(pairs(memory)) and manager.status()[0].lag == 0)
    finally:
        manager.stop()

    found: list[tuple[UUID, ...]] = [event.parts for event in pairs(memory)]
    assert ((first.uid, second.uid) in found) is has_whole
    assert len(found) == 1 + has_whole
    (status,) = manager.status()
    assert (status.is_failing, status.lag) == (False, 0)
    assert bool(status.failures) is not has_whole
