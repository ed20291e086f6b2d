"""Forgetting beside other writers: each pair in both orders; the first tombstone of a memory; and the upgrade."""

from __future__ import annotations

import runpy
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any
from uuid import UUID, uuid4

import psycopg
import pytest
from psycopg import sql

from elm import cues
from elm.errors import DatabaseUnfit, ForgottenEvent, StoreFailure, UnknownEvent
from elm.event import Event
from elm.forgetting import forget
from elm.geometry import Region
from elm.query import Query
from elm.storage import batch_forgetting, forgetting_statements, migrate, tombstone_rows
from elm.storage import write_statements as statements
from elm.storage.connections import open_connection
from elm.storage.planning import WRITING
from elm.storage.postgres import PostgresStore
from elm.storage.tables import REVISION
from elm.store import Arrival, Closed, Store
from elm.taxonomy import EventType
from elm.tombstone import RunTombstone, Tombstone
from tests.clock import at, span
from tests.servers import MEMORY
from tests.storage.test_concurrency import WAYS, WRITERS, Robots, arrivals, at_once, going_on, whole
from tests.storage.test_migrations import SOURCES, catalogue


def ended(begin: float = 0) -> Event:
    return Event(type="Thing", interval=span(begin, begin + 1))


@pytest.fixture
def robots(dsn: str) -> Iterator[Robots]:
    with ExitStack() as opened:
        yield Robots(dsn, opened)


@pytest.fixture
def threads() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(WRITERS) as pool:
        yield pool


@pytest.fixture(params=WAYS, ids=["commit", "commit_all", "load"])
def write(request: pytest.FixtureRequest) -> Callable[..., object]:
    way: Callable[..., object] = request.param
    return way


def tombstones(store: Store) -> set[UUID]:
    return {each.uid for each in store.tombstones()}


def uids(store: Store) -> set[UUID]:
    return {event.uid for event in store.find(Query())}


_DANGLING = """
SELECT count(*) FROM part l
WHERE NOT EXISTS (SELECT FROM event WHERE id = l.part_id) AND NOT EXISTS (SELECT FROM tombstone WHERE id = l.part_id)
   OR NOT EXISTS (SELECT FROM event WHERE id = l.whole_id)
"""
_UNLINKED = """
SELECT count(*) FROM event e, unnest(e.parts) AS named (uid)
WHERE NOT EXISTS (
    SELECT FROM part l WHERE l.whole_id = e.id
    AND (l.part_id = (SELECT id FROM event p WHERE p.uid = named.uid)
         OR l.part_id = (SELECT id FROM tombstone t WHERE t.uid = named.uid))
)
"""
_USELESS = "SELECT count(*) FROM tombstone t WHERE NOT EXISTS (SELECT FROM part WHERE part_id = t.id)"
BROKEN = (_DANGLING, _UNLINKED, _USELESS)
"""What there must be none of: links that lead nowhere, parts without a link, tombstones that are parts of nothing."""


def check_whole(robots: Robots) -> None:
    """No link leads nowhere, every part of every event is linked, and every tombstone is a part."""
    for query in BROKEN:
        assert robots._ask(query) == 0, query


def test_what_was_asked_before_the_first_tombstone_counts_it_afterwards(robots: Robots) -> None:
    """Statements on named relatives are planned once: that of every process must be planned anew."""
    part = ended()
    over = whole(part)
    robots.store.commit_all(arrivals(part, over))
    second = robots.another()
    asked = Query(cue=cues.parts("superset", [part.uid]))
    for store in (robots.store, second):
        for _ in range(3):
            assert [event.uid for event in store.find(asked)] == [over.uid]
    forget(robots.store, [part.uid])
    for store in (robots.store, second):
        assert [event.uid for event in store.find(asked)] == [over.uid]


# A part goes while its whole comes


def test_part_forgotten_while_its_whole_is_written(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    """The forgetting waits, and then sees the whole."""
    part = ended()
    over = whole(part)
    robots.store.commit_all(arrivals(part))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(write, robots.store, over)
        robots.wait_for_locks(writing)
        forgetting = threads.submit(forget, second, [part.uid])
        robots.wait_for_locks(writing, forgetting)
    writing.result()
    assert (forgetting.result().events, forgetting.result().tombstones) == (1, 1)
    assert (uids(second), tombstones(second)) == ({over.uid}, {part.uid})
    check_whole(robots)


@pytest.mark.parametrize("has_whole", [False, True], ids=["anonymous", "with a whole"])
def test_whole_written_while_its_part_is_forgotten(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object], has_whole: bool
) -> None:
    """The whole waits, and then sees the tombstone, or that its part is gone."""
    part, last = ended(), ended()
    over, beside = whole(part), whole(part, last)
    robots.store.commit_all(arrivals(part, last, *([beside] if has_whole else [])))
    if has_whole:
        # Of the memory's first tombstone all writers are waited for: not here.
        forget(robots.store, [last.uid])
    second = robots.another()
    with robots.stopped_at("forgetting"):
        forgetting = threads.submit(forget, robots.store, [part.uid])
        robots.wait_for_locks(forgetting)
        writing = threads.submit(write, second, over)
        robots.wait_for_locks(forgetting, writing)
    assert (forgetting.result().events, forgetting.result().tombstones) == (1, int(has_whole))
    if has_whole:
        writing.result()
        assert over.uid in uids(second)
        assert part.uid in tombstones(second)
    else:
        assert over.uid not in uids(second)
        error = writing.exception()
        reasons = [str(error)] if error else [refusal.reason for refusal in writing.result().refused]  # type: ignore[attr-defined]
        assert all(str(part.uid) in reason for reason in reasons)
    check_whole(robots)


@pytest.mark.parametrize("write", WAYS, ids=["commit", "commit_all", "load"])
def test_whole_with_extents_written_among_many_while_its_part_is_forgotten(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    """Its extents agree with what is a tombstone by the time that the lock is had."""
    part, last = ended(), ended(2)
    robots.store.commit_all(arrivals(part, last, whole(part, last)))
    forget(robots.store, [last.uid])
    over = Event(type="Thing", interval=span(0, 1), parts=[part.uid])
    second = robots.another()
    with robots.stopped_at("forgetting"):
        forgetting = threads.submit(forget, robots.store, [part.uid])
        robots.wait_for_locks(forgetting)
        writing = threads.submit(write, second, *(ended() for _ in range(20)), over)
        robots.wait_for_locks(forgetting, writing)
    assert forgetting.result().tombstones == 1
    writing.result()
    assert over.uid in uids(second)
    check_whole(robots)


def test_whole_written_while_the_last_whole_of_its_tombstone_is_forgotten(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    part = ended()
    over, another = whole(part), whole(part)
    robots.store.commit_all(arrivals(part, over))
    forget(robots.store, [part.uid])
    second = robots.another()
    with robots.stopped_at("forgetting"):
        forgetting = threads.submit(forget, robots.store, [over.uid])
        robots.wait_for_locks(forgetting)
        writing = threads.submit(write, second, another)
        robots.wait_for_locks(forgetting, writing)
    assert forgetting.result().dissolved == 1
    refused = writing.exception() or [refusal.reason for refusal in writing.result().refused]  # type: ignore[attr-defined]
    assert str(part.uid) in str(refused)
    assert uids(second) == tombstones(second) == set()


def test_last_whole_of_a_tombstone_forgotten_while_another_is_written(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    part = ended()
    over, another = whole(part), whole(part)
    robots.store.commit_all(arrivals(part, over))
    forget(robots.store, [part.uid])
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(write, robots.store, another)
        robots.wait_for_locks(writing)
        forgetting = threads.submit(forget, second, [over.uid])
        robots.wait_for_locks(writing, forgetting)
    writing.result()
    assert (forgetting.result().events, forgetting.result().dissolved) == (1, 0)
    assert (uids(second), tombstones(second)) == ({another.uid}, {part.uid})
    check_whole(robots)


def test_an_event_beside_its_tombstone_is_the_part_of_new_wholes(
    robots: Robots, dsn: str, write: Callable[..., object]
) -> None:
    """As a commit in flight leaves it that began before the event was forgotten, and ended after."""
    part, other = ended(), ended(5)
    robots.store.commit_all(arrivals(part, other, whole(part)))
    forget(robots.store, [part.uid])
    with psycopg.connect(dsn, options=f"-c search_path={MEMORY}") as connection:
        connection.execute("UPDATE tombstone SET uid = %s", [other.uid])
    over = whole(other)
    write(robots.store, over, *(ended() for _ in range(20)))
    (found,) = robots.store.find(Query(cue=cues.uid(over.uid)))
    assert found.interval == span(5, 6)


@pytest.mark.parametrize("later", [False, True], ids=["before it", "behind it"])
def test_an_event_beside_its_tombstone_is_forgotten_into_it(robots: Robots, dsn: str, later: bool) -> None:
    part, other = ended(), ended()
    over, beside = whole(part), whole(other)
    robots.store.commit_all(arrivals(*([other, part] if later else [part, other]), over, beside))
    forget(robots.store, [part.uid])
    with psycopg.connect(dsn, options=f"-c search_path={MEMORY}") as connection:
        connection.execute("UPDATE tombstone SET uid = %s", [other.uid])
        connection.execute("UPDATE event SET parts = ARRAY[%s] WHERE uid = %s", [other.uid, over.uid])
    assert forget(robots.store, [other.uid]).tombstones == 1
    assert {each.uid for each in robots.store.find(Query(cue=cues.parts("equal", [other.uid])))} == {
        over.uid,
        beside.uid,
    }
    check_whole(robots)
    assert forget(robots.store, [over.uid]).dissolved == 0
    assert forget(robots.store, [beside.uid]).dissolved == 1
    check_whole(robots)


# Closing


def test_open_event_closed_while_it_is_to_be_forgotten(robots: Robots, threads: ThreadPoolExecutor) -> None:
    part = going_on()
    over = whole(part)
    robots.store.commit_all(arrivals(part, over))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        closing = threads.submit(robots.store.close_event, part.uid, at(1))
        robots.wait_for_locks(closing)
        forgetting = threads.submit(forget, second, cues.everything())
        robots.wait_for_locks(closing, forgetting)
    assert closing.result() == Closed(new=True, wholes=(over.uid,))
    assert forgetting.result().events == 2
    assert uids(second) == set()


def test_event_closed_while_a_part_beside_it_is_forgotten(robots: Robots, threads: ThreadPoolExecutor) -> None:
    part, beside = going_on(), ended(7)
    over = whole(part, beside)
    robots.store.commit_all(arrivals(part, beside, over))
    second = robots.another()
    with robots.stopped_at("forgetting"):
        forgetting = threads.submit(forget, robots.store, [beside.uid])
        robots.wait_for_locks(forgetting)
        closing = threads.submit(second.close_event, part.uid, at(1))
        assert closing.result() == Closed(new=True, wholes=(over.uid,))
    assert forgetting.result().tombstones == 1
    (found,) = robots.store.find(Query(cue=cues.uid(over.uid)))
    assert found.interval == span(0, 8)


# The first tombstone


def test_writers_at_work_are_waited_for_before_the_first_tombstone(robots: Robots, threads: ThreadPoolExecutor) -> None:
    """A statement that was planned when there were none would not find it."""
    part, other = ended(), ended()
    robots.store.commit_all(arrivals(part, whole(part)))
    second = robots.another()
    second.commit(Arrival(event=ended()))
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(second.commit, Arrival(event=other))
        robots.wait_for_locks(writing)
        forgetting = threads.submit(forget, robots.store, [part.uid])
        robots.wait_for_locks(writing, forgetting)
        assert tombstones(robots.another()) == set()
    writing.result()
    assert forgetting.result().tombstones == 1
    # Its statements were prepared before.
    with pytest.raises(ForgottenEvent):
        second.commit(Arrival(event=part))
    with pytest.raises(ForgottenEvent):
        second.commit_all(arrivals(part, *(ended() for _ in range(20))))
    assert second.commit(Arrival(event=whole(part))).new


def test_tombstones_of_another_memory_wait_for_writers_at_work_too(robots: Robots, threads: ThreadPoolExecutor) -> None:
    """Also where a forgetting has begun to wait before."""
    part = ended()
    robots.store.commit_all(arrivals(part, whole(part)))
    first, second, third = (robots.another() for _ in range(3))
    given = Tombstone(uid=uuid4(), interval=span(0, 1), run=uuid4())
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(third.commit, Arrival(event=ended()))
        robots.wait_for_locks(writing)
        forgetting = threads.submit(forget, first, [part.uid])
        robots.wait_for_locks(writing, forgetting)
        keeping = threads.submit(second.keep_tombstones, [given])
        robots.wait_for_locks(writing, forgetting, keeping)
        assert tombstones(robots.store) == set()
    assert forgetting.result().tombstones == keeping.result().new == 1
    assert tombstones(robots.store) == {part.uid, given.uid}


def test_who_forgets_after_one_that_was_killed_before_it_had_waited_waits(
    robots: Robots, threads: ThreadPoolExecutor, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = ended()
    robots.store.commit_all(arrivals(part, whole(part)))
    second = robots.another()
    with robots.stopped_at("log_inbox"):
        writing = threads.submit(second.commit, Arrival(event=ended()))
        robots.wait_for_locks(writing)
        with monkeypatch.context() as killed:
            killed.setattr(forgetting_statements, "WAIT_FOR_WRITERS", "SELECT 1 / 0")
            with pytest.raises(StoreFailure):
                forget(robots.store, [part.uid])
        forgetting = threads.submit(forget, robots.store, [part.uid])
        robots.wait_for_locks(writing, forgetting)
    assert forgetting.result().tombstones == 1


def test_who_may_not_admit_the_first_tombstone_is_told_who_may(dsn: str, robots: Robots) -> None:
    part = ended()
    robots.store.commit_all(arrivals(part, whole(part)))
    # Roles belong to the whole server.
    robot = f"robot_{uuid4().hex}"
    with psycopg.connect(dsn, autocommit=True) as connection:
        for statement in (
            "CREATE ROLE {0}",
            "GRANT ALL ON SCHEMA {1} TO {0}",
            "GRANT ALL ON ALL TABLES IN SCHEMA {1} TO {0}",
            "GRANT ALL ON ALL SEQUENCES IN SCHEMA {1} TO {0}",
        ):
            connection.execute(sql.SQL(statement).format(sql.Identifier(robot), sql.Identifier(MEMORY)))
        store = PostgresStore(psycopg.conninfo.make_conninfo(dsn, options=f"-c role={robot}"), MEMORY)
        try:
            with pytest.raises(DatabaseUnfit, match="as that user once"):
                forget(store, [part.uid])
            assert uids(store) >= {part.uid}
            forget(robots.store, [part.uid])
            assert forget(store, cues.everything()).events == 1
        finally:
            store.close()
            connection.execute(sql.SQL("DROP OWNED BY {0}; DROP ROLE {0}").format(sql.Identifier(robot)))


def test_many_forget_at_once(robots: Robots, threads: ThreadPoolExecutor) -> None:
    parts = [ended(number) for number in range(40)]
    wholes = [whole(*parts[number : number + 3]) for number in range(0, 30, 2)]
    robots.store.commit_all(arrivals(*parts, *wholes))
    stores = [robots.another() for _ in range(4)]
    chosen = [each.uid for each in parts[::2]]
    done = at_once(threads, [partial(forget, store, chosen, batch=3) for store in stores])
    assert not [each for each in done if isinstance(each, Exception)], done
    assert sum(each.events for each in done) == len(chosen)
    done = at_once(threads, [partial(forget, store, cues.everything(), batch=4) for store in stores])
    assert sum(each.events for each in done) == len(parts) + len(wholes) - len(chosen)
    assert uids(robots.store) == tombstones(robots.store) == set()
    assert robots.store.statistics().forgotten == len(parts) + len(wholes)


def test_forgetting_and_writing_wholes_race(
    robots: Robots, threads: ThreadPoolExecutor, write: Callable[..., object]
) -> None:
    forgetter, writer, another = robots.another(), robots.another(), robots.another()
    for _ in range(25):
        parts = [ended(number) for number in range(3)]
        lower = whole(*parts[:2])
        robots.store.commit_all(arrivals(*parts, lower))
        over = [whole(parts[1], parts[2]), whole(lower, parts[0])]
        actions: list[Callable[[], Any]] = [
            partial(forget, forgetter, [parts[1].uid, lower.uid], batch=1),
            partial(write, writer, *over),
            partial(forget, another, [parts[0].uid, parts[2].uid]),
        ]
        done = at_once(threads, actions)
        assert not [each for each in done if isinstance(each, Exception) and not isinstance(each, UnknownEvent)], done
        check_whole(robots)


def test_an_event_that_is_forgotten_amid_a_load_of_another_of_its_uid(
    robots: Robots, threads: ThreadPoolExecutor, dsn: str
) -> None:
    """The load has seen the event, waits to read it, and finds it gone: it begins anew."""
    event = ended()
    (kept,) = robots.store.commit_all(arrivals(event))
    other = Event(type="Thing", interval=span(5, 6), uid=event.uid)
    with psycopg.connect(dsn, options=f"-c search_path={MEMORY},public") as connection:
        connection.execute("LOCK TABLE part IN ACCESS EXCLUSIVE MODE")
        loading = threads.submit(robots.store.load, arrivals(other))
        robots.wait_for_locks(loading)
        batch_forgetting.forget(connection, [kept.id], uuid4(), at(9), lambda *_: {1: "Thing"})
    report = loading.result()
    assert (report.new, report.existing, report.refused) == (1, 0, ())
    (found,) = robots.store.find(Query())
    assert found.interval == other.interval


# Stopped


def test_a_batch_that_fails_changes_nothing_and_can_be_repeated(
    robots: Robots, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = [ended(number) for number in range(6)]
    robots.store.commit_all(arrivals(*parts, whole(*parts[:3])))
    everything = list(robots.store.find(Query()))
    remove = forgetting_statements.REMOVE_EVENTS
    monkeypatch.setattr(forgetting_statements, "REMOVE_EVENTS", "SELECT 1 / 0")
    with pytest.raises(StoreFailure):
        forget(robots.store, cues.everything(), batch=4)
    assert list(robots.store.find(Query())) == everything
    assert tombstones(robots.store) == set()
    assert list(robots.store.run_tombstones()) == []
    monkeypatch.setattr(forgetting_statements, "REMOVE_EVENTS", remove)
    assert forget(robots.store, [part.uid for part in parts], batch=4).tombstones == 3


def test_a_forgetting_that_was_stopped_goes_on_when_it_is_repeated(robots: Robots) -> None:
    parts = [ended(number) for number in range(9)]
    robots.store.commit_all(arrivals(*parts, whole(*parts[:4])))

    def stop(done: int) -> None:
        if done >= 4:
            raise KeyboardInterrupt

    named = [part.uid for part in parts]
    with pytest.raises(KeyboardInterrupt):
        forget(robots.store, named, batch=2, progress=stop)
    assert robots.count("event") == 6
    check_whole(robots)
    again = forget(robots.store, named, batch=2)
    assert (again.events, again.unknown) == (5, 4)
    assert tombstones(robots.store) == {part.uid for part in parts[:4]}
    assert [run.events for run in robots.store.run_tombstones()] == [4, 1]


# What keeping tombstones costs


def test_keeping_tombstones_reads_no_runs_but_theirs(robots: Robots, dsn: str) -> None:
    frames = ["hall", "yard"]
    there = [Event(type="Thing", interval=span(0, 1), region=Region.box(0, 0, 1, 1, frame=name)) for name in frames]
    robots.store.commit_all(arrivals(*there))
    for event in there:
        forget(robots.store, [event.uid])
    first, second = robots.store.run_tombstones()
    single = Tombstone(uid=uuid4(), interval=span(0, 1), run=second.run)
    with open_connection(dsn, WRITING, memory=MEMORY) as connection:
        numbers: dict[str, int] = dict(connection.execute("SELECT name, id FROM frame").fetchall())
        asked: list[int] = []

        def frame(number: int) -> str:
            asked.append(number)
            return robots.store._session.frame_name(number)

        cases: list[tuple[list[Tombstone | RunTombstone], list[int]]] = [
            ([single], []),
            ([first, single], [numbers["hall"]]),
            ([second], [numbers["yard"]]),
        ]
        for given, looked_up in cases:
            asked.clear()
            tombstone_rows.keep(connection, given, frame, numbers.__getitem__)
            assert asked == looked_up
        other = replace(second, events=7)
        report = tombstone_rows.keep(connection, [first, other, second], frame, numbers.__getitem__)
    assert (report.new, report.existing, [refusal.index for refusal in report.refused]) == (0, 2, [1])


# What it costs where nothing was forgotten


def _plan(connection: psycopg.Connection[Any], name: str) -> list[str]:
    values = sql.SQL(", ").join(map(sql.Literal, [None] * 18))
    text = sql.SQL("EXPLAIN (COSTS OFF) EXECUTE {} ({})").format(sql.Identifier(name), values)
    return [line for (line,) in connection.execute(text)]


@pytest.mark.parametrize("name", ["COMMIT_ATOMIC", "COMMIT_COMPLEX"])
def test_a_commit_looks_for_tombstones_only_when_there_were_some(dsn: str, robots: Robots, name: str) -> None:
    options = f"-c search_path={MEMORY},public -c plan_cache_mode=force_generic_plan"
    with psycopg.connect(dsn, autocommit=True, options=options) as connection:
        connection.execute(f"PREPARE committing AS {getattr(statements, name)}".encode())
        assert not [line for line in _plan(connection, "committing") if "tombstone" in line]
        part = ended()
        robots.store.commit_all(arrivals(part, ended(), whole(part)))
        forget(robots.store, [part.uid])
        assert [line for line in _plan(connection, "committing") if "tombstone" in line]


# From the schema before


def test_the_schema_before_gains_tombstones_and_keeps_its_events(dsn: str) -> None:
    versions = SOURCES / "alembic" / "versions"
    with psycopg.connect(dsn) as connection:
        connection.execute("CREATE SCHEMA old")
        connection.execute("SET search_path = old, public")
        for script in ("0001_memory.py", "0002_log.py"):
            for statement in runpy.run_path(str(versions / script))["STATEMENTS"]:
                connection.execute(statement)
        connection.execute("CREATE TABLE alembic_version (version_num varchar(32) PRIMARY KEY)")
        connection.execute("INSERT INTO alembic_version VALUES ('0002')")
    with ExitStack() as opened:
        now, old = PostgresStore(dsn, MEMORY), PostgresStore(dsn, "old")
        opened.callback(now.close)
        opened.callback(old.close)
        now.add_types([EventType(name="Thing")])
        parts = [ended(number) for number in range(3)]
        over = whole(*parts)
        now.commit_all(arrivals(*parts, over))
        with psycopg.connect(dsn, options="-c search_path=old") as connection:
            for table in ("event_type", "type_closure", "event", "part", "log_inbox"):
                copied = sql.SQL("INSERT INTO {0} OVERRIDING SYSTEM VALUE SELECT * FROM {1}.{0}")
                connection.execute(copied.format(sql.Identifier(table), sql.Identifier(MEMORY)))
        assert migrate(dsn, "old") == f"migrated memory 'old' from schema 0002 to {REVISION}"
        for kind, found in catalogue(dsn, "old").items():
            assert found == catalogue(dsn, MEMORY)[kind]
        assert list(old.find(Query())) == list(now.find(Query()))
        for store in (now, old):
            assert forget(store, [parts[0].uid]).tombstones == 1
            assert tombstones(store) == {parts[0].uid}
        assert list(old.find(Query())) == list(now.find(Query()))
        assert old.log.read(0, old.log.head()) == now.log.read(0, now.log.head())


def test_one_memory_forgets_and_others_do_not_notice(dsn: str) -> None:
    with ExitStack() as opened:
        stores = [PostgresStore(dsn, name) for name in (MEMORY, "kitchen")]
        part = ended()
        over = whole(part)
        for store in stores:
            opened.callback(store.close)
            store.add_types([EventType(name="Thing")])
            store.commit_all(arrivals(part, over))
        forget(stores[0], [part.uid])
        assert uids(stores[1]) == {part.uid, over.uid}
        assert not stores[1].commit(Arrival(event=part)).new
        assert list(stores[1].run_tombstones()) == []
        assert stores[1].forget([1], run=uuid4(), at=at(0)).tombstones == 1
