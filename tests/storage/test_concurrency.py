"""Writers that meet: closes, commits, loads and type changes at once, each pair in both orders, then at random."""

from __future__ import annotations

import random
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from threading import Barrier
from typing import Any, LiteralString
from uuid import uuid4

import psycopg
import pytest
from psycopg import sql

from elm import cues
from elm.errors import ConflictingContent, CycleRefused, InvalidValue, UnknownEvent
from elm.event import Event
from elm.query import Order, Query
from elm.storage.postgres import PostgresStore
from elm.store import Arrival, Closed, Committed, Store
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.servers import MEMORY

WRITERS = 8


def going_on(begin: float = 0) -> Event:
    return Event(type="Thing", interval=span(begin, None))


def whole(*parts: Event) -> Event:
    return Event(type="Thing", parts=[part.uid for part in parts])


def arrivals(*events: Event) -> list[Arrival]:
    return [Arrival(event=event) for event in events]


_WAITING = """
SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock'
"""
_OPEN_FOR_EVER = """
SELECT count(*) FROM event w WHERE parts <> '{}' AND upper_inf(period) AND NOT EXISTS (
    SELECT 1 FROM part JOIN event p ON p.id = part_id WHERE whole_id = w.id AND upper_inf(p.period)
)
"""
_CLOSURE = """
SELECT a.name, d.name FROM type_closure
JOIN event_type a ON a.id = ancestor_id JOIN event_type d ON d.id = descendant_id
"""


class Robots:
    """One memory, written to over several connections, and looked at from outside."""

    def __init__(self, dsn: str, opened: ExitStack) -> None:
        # A writer that waits for ever is a failure, not a hanging test; those that wait for each other soon know.
        options = "-c lock_timeout=20s -c deadlock_timeout=20ms"
        self._dsn = psycopg.conninfo.make_conninfo(dsn, options=options)
        self._opened = opened
        watch = psycopg.connect(dsn, autocommit=True, options=f"-c search_path={MEMORY}")
        self._watch = opened.enter_context(watch)
        self.store = self.another()
        self.store.add_types([EventType(name="Thing")])
        watch.execute(
            "CREATE FUNCTION stop() RETURNS trigger LANGUAGE plpgsql AS"
            " 'BEGIN PERFORM pg_advisory_xact_lock_shared(1); RETURN NULL; END'"
        )

    def another(self) -> PostgresStore:
        """A store over the memory with connections of its own."""
        store = PostgresStore(self._dsn, MEMORY)
        self._opened.callback(store.close)
        return store

    @contextmanager
    def stopped_at(self, table: str, only: Event | None = None) -> Iterator[None]:
        """Whoever inserts into `table` (or only this event) waits thereafter, amid the transaction, till the end.

        For `log_inbox` that is when a commit, a close, or a load has done all else.
        """
        trigger = sql.SQL("CREATE TRIGGER stop AFTER INSERT ON {} FOR EACH ROW {} EXECUTE FUNCTION stop()")
        when = sql.SQL("WHEN (NEW.uid = {})").format(only.uid) if only else sql.SQL("")
        self._watch.execute(trigger.format(sql.Identifier(table), when))
        self._watch.execute("SELECT pg_advisory_lock(1)")
        try:
            yield
        finally:
            self._watch.execute("SELECT pg_advisory_unlock(1)")

    def wait_for_locks(self, *waiting: Future[Any]) -> None:
        """Return once each of these has a statement that waits for a lock."""
        for _ in range(2_000):
            if self._ask(_WAITING) == len(waiting):
                return
            for each in waiting:
                assert not each.done(), f"it did not wait: {each.exception() or each.result()}"
            time.sleep(0.002)
        raise AssertionError("they do not wait for locks")

    def count(self, table: str) -> int:
        return self._ask(sql.SQL("SELECT count(*) FROM {}").format(sql.Identifier(table)))

    def open_for_ever(self) -> int:
        """How many wholes are still going on though none of their parts is."""
        return self._ask(_OPEN_FOR_EVER)

    def closure(self) -> set[tuple[str, str]]:
        """The stored pairs (ancestor, descendant)."""
        return set(self._watch.execute(_CLOSURE).fetchall())

    def _ask(self, query: LiteralString | sql.Composed) -> int:
        row = self._watch.execute(query).fetchone()
        assert row is not None
        return int(row[0])


@pytest.fixture
def robots(dsn: str) -> Iterator[Robots]:
    with ExitStack() as opened:
        yield Robots(dsn, opened)


@pytest.fixture
def threads() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(WRITERS) as pool:
        yield pool


def is_open(store: Store, event: Event) -> bool:
    (found,) = store.find(Query(cue=cues.uid(event.uid)))
    return found.interval.is_open


def at_once(threads: ThreadPoolExecutor, actions: Sequence[Callable[[], Any]]) -> list[Any]:
    """What each action returned or raised, all let go at one moment."""
    barrier = Barrier(len(actions))

    def run(action: Callable[[], Any]) -> Any:
        barrier.wait(timeout=30)
        try:
            return action()
        except Exception as error:
            return error

    return [future.result() for future in [threads.submit(run, each) for each in actions]]


# Closing


def test_two_parts_closed_at_once_close_their_whole(robots: Robots, threads: ThreadPoolExecutor) -> None:
    one, other = going_on(), going_on()
    both = whole(one, other)
    robots.store.commit_all(arrivals(one, other, both))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        first_close = threads.submit(robots.store.close_event, one.uid, at(1))
        robots.wait_for_locks(first_close)
        second_close = threads.submit(second.close_event, other.uid, at(2))
        robots.wait_for_locks(first_close, second_close)
    assert first_close.result() == Closed(new=True, wholes=())
    assert second_close.result() == Closed(new=True, wholes=(both.uid,))
    assert not is_open(robots.store, both)


def test_closing_does_not_depend_on_the_isolation_that_a_database_has_by_default(
    robots: Robots, threads: ThreadPoolExecutor, dsn: str
) -> None:
    with psycopg.connect(dsn, autocommit=True) as connection:
        name = sql.Identifier(connection.info.dbname)
        connection.execute(sql.SQL("ALTER DATABASE {} SET default_transaction_isolation = 'serializable'").format(name))
    stores = [robots.another() for _ in range(4)]
    for _ in range(10):
        parts = [going_on() for _ in stores]
        over = whole(*parts)
        robots.store.commit_all(arrivals(*parts, over))
        done = at_once(threads, [partial(s.close_event, p.uid, at(1)) for s, p in zip(stores, parts, strict=True)])
        assert not [each for each in done if isinstance(each, Exception)]
        assert not is_open(robots.store, over)


def test_many_parts_closed_at_once_close_all_above_them(robots: Robots, threads: ThreadPoolExecutor) -> None:
    stores = [robots.another() for _ in range(WRITERS)]
    for _ in range(20):
        parts = [going_on() for _ in stores]
        halves = [whole(*parts[:5]), whole(*parts[3:])]
        top = whole(*halves, parts[0])
        robots.store.commit_all(arrivals(*parts, *halves, top))
        closes = [
            partial(store.close_event, part.uid, at(1 + number))
            for number, (store, part) in enumerate(zip(stores, parts, strict=True))
        ]
        closed = at_once(threads, closes)
        assert sorted(uid for each in closed for uid in each.wholes) == sorted(each.uid for each in (*halves, top))
        (found,) = robots.store.find(Query(cue=cues.uid(top.uid)))
        assert found.interval == span(0, WRITERS)


def _commit(store: Store, *events: Event) -> object:
    return [store.commit(arrival) for arrival in arrivals(*events)]


def _commit_all(store: Store, *events: Event) -> object:
    return store.commit_all(arrivals(*events))


def _load(store: Store, *events: Event) -> object:
    return store.load(arrivals(*events))


WAYS: tuple[Callable[..., object], ...] = (_commit, _commit_all, _load)
"""Whatever writes events."""


@pytest.fixture(params=WAYS, ids=["commit", "commit_all", "load"])
def write(request: pytest.FixtureRequest) -> Callable[..., object]:
    way: Callable[..., object] = request.param
    return way


def test_part_closed_while_its_whole_is_written(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    part = going_on()
    over = whole(part)
    robots.store.commit_all(arrivals(part))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(write, robots.store, over)
        robots.wait_for_locks(writing)
        closing = threads.submit(second.close_event, part.uid, at(1))
        robots.wait_for_locks(writing, closing)
    writing.result()
    assert closing.result() == Closed(new=True, wholes=(over.uid,))
    assert not is_open(robots.store, over)


def test_whole_written_while_its_part_is_closed(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    part = going_on()
    over = whole(part)
    robots.store.commit_all(arrivals(part))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        closing = threads.submit(robots.store.close_event, part.uid, at(1))
        robots.wait_for_locks(closing)
        writing = threads.submit(write, second, over)
        robots.wait_for_locks(closing, writing)
    assert closing.result() == Closed(new=True, wholes=())
    writing.result()
    assert not is_open(robots.store, over)


def test_part_closed_while_the_whole_of_its_whole_is_written(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    part = going_on()
    over = whole(part)
    top = whole(over)
    robots.store.commit_all(arrivals(part, over))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(write, robots.store, top)
        robots.wait_for_locks(writing)
        closing = threads.submit(second.close_event, part.uid, at(1))
        robots.wait_for_locks(writing, closing)
    writing.result()
    assert closing.result() == Closed(new=True, wholes=(over.uid, top.uid))
    assert not is_open(robots.store, top)


def test_whole_of_a_whole_written_while_the_part_is_closed(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    part = going_on()
    over = whole(part)
    top = whole(over)
    robots.store.commit_all(arrivals(part, over))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        closing = threads.submit(robots.store.close_event, part.uid, at(1))
        robots.wait_for_locks(closing)
        writing = threads.submit(write, second, top)
        robots.wait_for_locks(closing, writing)
    assert closing.result() == Closed(new=True, wholes=(over.uid,))
    writing.result()
    assert not is_open(robots.store, top)


def test_closes_and_writes_of_wholes_race(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    closer, writer = robots.another(), robots.another()
    for _ in range(40):
        part, beside = going_on(), going_on()
        over = whole(part, beside)
        top = whole(over)
        robots.store.commit_all(arrivals(part, beside, *([over] if part.uid.int % 2 else [])))
        robots.store.close_event(beside.uid, at(2))
        events = [top] if part.uid.int % 2 else [over, top]
        done = at_once(threads, [partial(write, writer, *events), partial(closer.close_event, part.uid, at(1))])
        assert not [each for each in done if isinstance(each, Exception)]
        assert robots.open_for_ever() == 0


def test_the_same_end_from_many_is_one_close(robots: Robots, threads: ThreadPoolExecutor) -> None:
    part = going_on()
    over = whole(part)
    robots.store.commit_all(arrivals(part, over))
    stores = [robots.another() for _ in range(WRITERS)]
    closed = at_once(threads, [partial(store.close_event, part.uid, at(1)) for store in stores])
    assert sorted(closed, key=lambda each: each.new) == [
        *[Closed(new=False, wholes=())] * (WRITERS - 1),
        Closed(new=True, wholes=(over.uid,)),
    ]
    assert robots.count("log_inbox") == 4


def test_of_two_ends_one_wins(robots: Robots, threads: ThreadPoolExecutor) -> None:
    part = going_on()
    robots.store.commit_all(arrivals(part))
    stores = [robots.another() for _ in range(WRITERS)]
    closed = at_once(threads, [partial(store.close_event, part.uid, at(n)) for n, store in enumerate(stores)])
    (winner,) = [number for number, each in enumerate(closed) if isinstance(each, Closed)]
    assert [type(each) for each in closed].count(InvalidValue) == WRITERS - 1
    (found,) = robots.store.find(Query(cue=cues.uid(part.uid)))
    assert found.interval == span(0, winner)
    assert robots.count("log_inbox") == 2


# Committing the same


@pytest.mark.parametrize("is_complex", [False, True], ids=["atomic", "complex"])
def test_one_event_from_many_is_stored_once(robots: Robots, threads: ThreadPoolExecutor, is_complex: bool) -> None:
    part = going_on()
    robots.store.commit_all(arrivals(part))
    event = whole(part) if is_complex else going_on()
    writes: list[Callable[[], Any]] = []
    for number in range(WRITERS):
        store = robots.another()
        writes.append(
            partial(store.commit, Arrival(event=event))
            if number % 2
            else lambda store=store: store.commit_all(arrivals(event))[0]  # type: ignore[misc]
        )
    done = at_once(threads, writes)
    assert all(isinstance(each, Committed) for each in done), done
    assert sorted(each.new for each in done) == [False] * (WRITERS - 1) + [True]
    assert len({each.id for each in done}) == 1
    assert robots.count("event") == 2
    assert robots.count("part") == is_complex
    assert robots.count("log_inbox") == 2


def test_one_batch_from_many_is_stored_once(robots: Robots, threads: ThreadPoolExecutor) -> None:
    parts = [going_on() for _ in range(20)]
    batch = [*parts, *(whole(*parts[n : n + 3]) for n in range(10))]
    stores = [robots.another() for _ in range(WRITERS)]
    reports = at_once(threads, [partial(store.load, arrivals(*batch)) for store in stores])
    assert sorted((each.new, each.existing, each.refused) for each in reports) == [
        *[(0, 30, ())] * (WRITERS - 1),
        (30, 0, ()),
    ]
    assert (robots.count("event"), robots.count("part"), robots.count("log_inbox")) == (30, 30, 30)


def test_of_two_contents_one_wins(robots: Robots, threads: ThreadPoolExecutor) -> None:
    uid = uuid4()
    stores = [robots.another() for _ in range(WRITERS)]
    events = [Event(type="Thing", interval=span(number, None), uid=uid) for number in range(WRITERS)]
    writes = [partial(store.commit, Arrival(event=event)) for store, event in zip(stores, events, strict=True)]
    done = at_once(threads, writes)
    (winner,) = [number for number, each in enumerate(done) if isinstance(each, Committed)]
    assert [type(each) for each in done].count(ConflictingContent) == WRITERS - 1
    (found,) = robots.store.find(Query())
    assert found.interval == events[winner].interval
    assert robots.count("log_inbox") == 1


# Committing what belongs together


def test_whole_is_refused_until_its_part_is_committed(robots: Robots, threads: ThreadPoolExecutor) -> None:
    part = going_on()
    over = whole(part)
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        committing = threads.submit(robots.store.commit, Arrival(event=part))
        robots.wait_for_locks(committing)
        with pytest.raises(UnknownEvent, match=str(part.uid)):
            second.commit(Arrival(event=over))
        (refusal,) = second.load(arrivals(over)).refused
        assert str(part.uid) in refusal.reason
    assert committing.result().new
    assert second.commit(Arrival(event=over)).new
    assert robots.count("log_inbox") == 2


@pytest.mark.parametrize("write", [_commit_all, _load], ids=["commit_all", "load"])
def test_part_committed_after_the_id_of_its_whole_was_reserved(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    """The call begins anew: its ids and log entries stand behind those of the part."""
    part = going_on()
    over, beside = whole(part), [going_on() for _ in range(20)]
    second = robots.another()
    with robots.stopped_at("event", only=beside[0]):
        writing = threads.submit(write, robots.store, *beside, over)
        robots.wait_for_locks(writing)
        committed = second.commit(Arrival(event=part))
    writing.result()
    events = list(robots.store.find(Query(order=Order.ID)))
    assert [event.uid for event in events] == [event.uid for event in (part, *beside, over)]
    assert events[0].id == committed.id
    log = robots.store.log
    assert [entry.event for entry in log.read(0, log.head())] == events


def test_part_and_whole_race(robots: Robots, threads: ThreadPoolExecutor) -> None:
    first, second = robots.another(), robots.another()
    for number in range(1, 61):
        part = going_on()
        over = whole(part)
        committed, refused_or_committed = at_once(
            threads, [partial(first.commit, Arrival(event=part)), partial(second.commit, Arrival(event=over))]
        )
        assert isinstance(committed, Committed)
        if isinstance(refused_or_committed, Committed):
            assert refused_or_committed.id > committed.id
        else:
            assert isinstance(refused_or_committed, UnknownEvent)
            robots.store.commit(Arrival(event=over))
        assert (robots.count("event"), robots.count("part")) == (2 * number, number)


# Types


def test_second_link_waits_for_the_first(robots: Robots, threads: ThreadPoolExecutor) -> None:
    robots.store.add_types([EventType(name=name) for name in "ABC"])
    second = robots.another()
    with robots.stopped_at("type_closure"):
        upper = threads.submit(robots.store.add_types, [EventType(name="B", parents=("A",))])
        robots.wait_for_locks(upper)
        lower = threads.submit(second.add_types, [EventType(name="C", parents=("B",))])
        robots.wait_for_locks(upper, lower)
    assert (upper.result().closure, lower.result().closure) == (1, 2)
    assert {("A", "B"), ("B", "C"), ("A", "C")} <= robots.closure()


def test_links_that_would_make_a_ring_together(robots: Robots, threads: ThreadPoolExecutor) -> None:
    robots.store.add_types([EventType(name=name) for name in "AB"])
    second = robots.another()
    with robots.stopped_at("type_closure"):
        there = threads.submit(robots.store.add_types, [EventType(name="B", parents=("A",))])
        robots.wait_for_locks(there)
        back = threads.submit(second.add_types, [EventType(name="A", parents=("B",))])
        robots.wait_for_locks(there, back)
    assert there.result().links == 1
    with pytest.raises(CycleRefused):
        back.result()
    assert ("B", "A") not in robots.closure()


def test_closure_after_links_from_many(robots: Robots, threads: ThreadPoolExecutor) -> None:
    chance = random.Random(1)
    names = [f"T{number:02}" for number in range(30)]
    links = [(names[child], names[chance.randrange(child)]) for child in range(1, 30) for _ in range(2)]
    chance.shuffle(links)
    stores = [robots.another() for _ in range(WRITERS)]

    def add(store: Store, own: Sequence[tuple[str, str]]) -> None:
        for child, parent in own:
            store.add_types([EventType(name=parent), EventType(name=child, parents=(parent,))])

    actions = [partial(add, store, links[number::WRITERS]) for number, store in enumerate(stores)]
    assert at_once(threads, actions) == [None] * WRITERS
    above = {name: {name} for name in ["Thing", *names]}
    for child, parent in sorted(links):
        above[child] |= above[parent]
    assert robots.closure() == {(ancestor, name) for name, found in above.items() for ancestor in found}


# Everything at once


def test_no_writer_waits_for_ever(robots: Robots, threads: ThreadPoolExecutor) -> None:
    """Two hundred times four writers commit, load and close the same few events in orders of their own."""
    chance = random.Random(2)
    stores = [robots.another() for _ in range(4)]
    for _ in range(200):
        parts = [going_on(number) for number in range(4)]
        lower = [whole(*chance.sample(parts, 2)) for _ in range(2)]
        upper = [whole(chance.choice(lower), chance.choice(parts)) for _ in range(2)]
        robots.store.commit_all(arrivals(*parts, *chance.sample(lower, chance.randrange(3))))
        actions: list[Callable[[], Any]] = []
        for store in stores:
            events = chance.sample([*parts, *lower, *upper], 5)
            match chance.choice(["close", "commit_all", "load"]):
                case "close":
                    actions.append(partial(store.close_event, chance.choice(parts).uid, at(9)))
                case "commit_all":
                    actions.append(partial(store.commit_all, arrivals(*lower, *events)))
                case _:
                    actions.append(partial(store.load, arrivals(*lower, *sorted(events, key=lambda e: bool(e.parts)))))
        done = at_once(threads, actions)
        assert not [each for each in done if isinstance(each, Exception) and not isinstance(each, UnknownEvent)]
        assert robots.open_for_ever() == 0
