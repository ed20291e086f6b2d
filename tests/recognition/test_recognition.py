"""Recognition as a whole: whatever the batches, crashes and order of arrival, the results are those of a replay."""

from __future__ import annotations

from contextlib import suppress
from datetime import timedelta
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from elm.event import Event
from elm.log import LoggedStore, LogKind, Tick
from elm.recognition import RecognitionManager, Timing, replay
from elm.store import Arrival
from tests.clock import at
from tests.conftest import StoreFactory
from tests.recognition.scenes import AGENTS, SECOND, TYPES, recognizers, results, shuffled, stream

LATENESS = 3 * SECOND
TIMING = Timing(lateness=LATENESS, idle=timedelta(days=1))


class Killed(BaseException):
    """The process is no more."""


class DeadlyLog:
    """A log whose process is killed at one of its calls: before it, or after it was done."""

    def __init__(self, log: Any, lives: int, *, after: bool) -> None:
        self._log = log
        self._lives = lives
        self._after = after

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._log, name)

        def call(*args: Any, **named: Any) -> Any:
            self._lives -= 1
            if self._lives == 0 and not self._after:
                raise Killed
            answer = method(*args, **named)
            if self._lives == 0:
                raise Killed
            return answer

        return call


class DeadlyStore:
    """A store with a deadly log."""

    def __init__(self, store: LoggedStore, lives: int, *, after: bool) -> None:
        self._store = store
        self.log = DeadlyLog(store.log, lives, after=after)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._store, name)


def commit(store: LoggedStore, events: list[Event]) -> None:
    store.commit_all([Arrival(event=event) for event in events])


def finish(store: LoggedStore, until: float = 10_000) -> None:
    """Promise that nothing more comes."""
    store.log.write([Tick(agent=agent, deadline=at(until), kind=LogKind.PUNCTUATION) for agent in AGENTS])


def begin(store: LoggedStore) -> None:
    """Make types and agents known: an agent that is heard of later may be late across agents."""
    store.add_types(TYPES)
    finish(store, -1_000)


def manager(store: LoggedStore, *, batch: int = 100, timing: Timing = TIMING) -> RecognitionManager:
    return RecognitionManager(store, recognizers(), timing=timing, batch=batch)


def check_replay(store: LoggedStore, timing: Timing = TIMING) -> None:
    """A replay of the log finds what is there: nothing more, nothing less, and with the same content."""
    found = replay(store, recognizers(), timing=timing)
    assert (found.new, found.missing) == ((), ())


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32), late=st.booleans())
def test_batches_crashes_and_restarts_change_nothing(store_factory: StoreFactory, seed: int, late: bool) -> None:
    chance = Random(seed)
    store = store_factory()
    begin(store)
    events = stream(chance, 40)
    # With `late`, some arrive after they may: they are not fed, in a replay neither.
    waiting = shuffled(chance, events, LATENESS * (3 if late else 1))
    while waiting:
        some = chance.randrange(1, 15)
        commit(store, waiting[:some])
        del waiting[:some]
        deadly = DeadlyStore(store, chance.randrange(1, 30), after=chance.random() < 0.5)
        with suppress(Killed):
            manager(deadly, batch=chance.randrange(1, 12)).catch_up()
    finish(store)
    manager(store, batch=chance.randrange(1, 50)).catch_up()
    check_replay(store)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32))
def test_order_of_arrival_changes_nothing(store_factory: StoreFactory, seed: int) -> None:
    chance = Random(seed)
    events = stream(chance, 40)
    found = []
    for _ in range(2):
        store = store_factory()
        begin(store)
        arriving = shuffled(chance, events, LATENESS)
        while arriving:
            some = chance.randrange(1, 15)
            commit(store, arriving[:some])
            del arriving[:some]
            manager(store, batch=chance.randrange(1, 12)).catch_up()
        finish(store)
        manager(store).catch_up()
        found.append(results(store))
        assert not any(each.late for each in manager(store).status())
    assert found[0] == found[1]


def test_the_scene_finds_results_of_every_kind() -> None:
    """What the properties above are about happens in their streams."""
    from elm.storage.memory import MemoryStore

    kinds = set()
    for seed in range(10):
        chance = Random(seed)
        store = MemoryStore()
        store.add_types(TYPES)
        commit(store, shuffled(chance, stream(chance, 40), LATENESS))
        finish(store)
        manager(store).catch_up()
        kinds |= {kind for _, kind, *_ in results(store)}
    assert kinds == {"Pair", "HalfPair", "Pairs", "Run", "Met", "elm.Deadline"}


@pytest.mark.parametrize("complete", [False, True])
def test_complete_replay_adds_what_came_too_late(store_factory: StoreFactory, complete: bool) -> None:
    chance = Random(7)
    events = stream(chance, 60)
    in_order, disordered = store_factory(), store_factory()
    for store, arriving in ((in_order, events), (disordered, shuffled(chance, events, LATENESS * 10))):
        begin(store)
        commit(store, arriving)
        finish(store)
    manager(in_order).catch_up()
    manager(disordered).catch_up()
    assert results(in_order) != results(disordered)
    found = replay(disordered, recognizers(), timing=TIMING, complete=complete)
    lacking = {uid for uid, *_ in results(in_order)} - {uid for uid, *_ in results(disordered)}
    assert (lacking == set()) is complete
    assert bool(found.new) is complete
