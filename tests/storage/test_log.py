"""The log in PostgreSQL: what open transactions, other processes, lost connections and a restore make of it."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from pathlib import Path
from statistics import median
from threading import Barrier
from threading import Event as Flag
from typing import Any
from uuid import uuid4

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo

from elm import cues
from elm.app import Memory
from elm.errors import ConsumerBusy, DatabaseUnfit, DatabaseUnreachable, MemoryMissing, PositionLost, StoreFailure
from elm.event import Event
from elm.log import Advance, LogEntry, LogKind
from elm.query import Query
from elm.recognition import RecognitionManager
from elm.recognizers import Session
from elm.storage import postgres_log
from elm.storage.encoding import COLUMNS
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.servers import MEMORY, Server
from tests.storage.cutting import Cutter

Open = Callable[..., PostgresStore]


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def another(dsn: str, opened: ExitStack) -> Open:
    """Opens stores over the memory, each as another process would."""

    def open_store(address: str = dsn, memory: str = MEMORY) -> PostgresStore:
        store = PostgresStore(address, memory)
        opened.callback(store.close)
        return store

    return open_store


@pytest.fixture
def store(another: Open) -> PostgresStore:
    """A memory that knows the type Thing."""
    found = another()
    found.add_types([EventType(name="Thing")])
    return found


@pytest.fixture
def session(dsn: str, opened: ExitStack) -> Callable[[], psycopg.Connection[Any]]:
    """Opens connections into the memory."""

    def connect() -> psycopg.Connection[Any]:
        return opened.enter_context(psycopg.connect(dsn, options=f"-c search_path={MEMORY},public"))

    return connect


def thing(*parts: Event, end: float | None = 1) -> Event:
    if parts:
        return Event(type="Thing", parts=[part.uid for part in parts])
    return Event(type="Thing", interval=span(0, end))


def commit(store: PostgresStore, *events: Event) -> None:
    store.commit_all([Arrival(event=event) for event in events])


def entries(store: PostgresStore) -> list[LogEntry]:
    return store.log.read(0, store.log.head())


# Open transactions


_COPY_OF_THE_FIRST = sql.SQL(
    "WITH new AS (INSERT INTO event ({columns}) SELECT {values} FROM event WHERE id = 1 RETURNING id)"
    " INSERT INTO log_inbox (event_id, kind, at) SELECT id, 1, now() FROM new"
).format(
    columns=sql.SQL(", ").join(map(sql.Identifier, COLUMNS)),
    values=sql.SQL(", ").join(sql.Placeholder("uid") if name == "uid" else sql.Identifier(name) for name in COLUMNS),
)


def test_transactions_that_commit_out_of_order(
    store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    """Ids are drawn before the commit: a reader that goes by them would lose the slow ones."""
    store.commit(Arrival(event=thing()))
    slow, slower = session(), session()
    uids = {each: uuid4() for each in (slow, slower)}
    for each, uid in uids.items():
        each.execute(_COPY_OF_THE_FIRST, {"uid": uid})
    quick = thing()
    store.commit(Arrival(event=quick))
    assert store.log.head() == 2
    slower.commit()
    assert store.log.head() == 3
    last = thing()
    store.commit(Arrival(event=last))
    assert store.log.head() == 4
    slow.commit()
    assert [entry.position for entry in entries(store)] == [1, 2, 3, 4, 5]
    found = [entry.event for entry in entries(store)[1:]]
    assert [event.uid for event in found if event] == [quick.uid, uids[slower], last.uid, uids[slow]]
    assert [event.id for event in found if event] == [4, 3, 5, 2]


def test_a_subscription_skips_no_slow_commit(
    store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    store.commit(Arrival(event=thing()))
    events = Memory(store).subscribe(since=0, timeout=20)
    assert next(events).id == 1
    slow, uid = session(), uuid4()
    slow.execute(_COPY_OF_THE_FIRST, {"uid": uid})
    store.commit(Arrival(event=thing()))
    assert next(events).id == 3
    slow.commit()
    assert next(events).uid == uid


def test_writers_do_not_wait_for_who_brings_the_log_up_to_date(
    store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    sequencing = session()
    sequencing.execute("SELECT seq FROM log_head FOR UPDATE")
    with ThreadPoolExecutor(1) as threads:
        commit(store, thing())
        head = threads.submit(store.log.head)
        commit(store, thing())
        assert not head.done()
        sequencing.commit()
        assert head.result(timeout=10) == 2


def test_the_log_grows_in_pieces(store: PostgresStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(postgres_log, "SEQUENCED_AT_ONCE", 4)
    for count in (0, 3, 4, 5, 8, 30):
        events = [thing() for _ in range(count)]
        before = store.log.head()
        commit(store, *events)
        assert store.log.head() == before + count
        found = store.log.read(before, 100)
        assert [entry.position for entry in found] == list(range(before + 1, before + count + 1))
        assert [entry.event.uid for entry in found if entry.event] == [event.uid for event in events]


def test_pieces_go_by_the_order_of_writing(
    store: PostgresStore, session: Callable[[], psycopg.Connection[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not by where the rows lie in the table, which reuses the room of those that left."""
    monkeypatch.setattr(postgres_log, "SEQUENCED_AT_ONCE", 4)
    numbers = list(range(1, 31))
    with session() as writing:
        writing.cursor().executemany(
            "INSERT INTO log_inbox (n, kind, at, deadline) OVERRIDING SYSTEM VALUE VALUES (%s, 4, now(), %s)",
            [(number, at(number)) for number in reversed(numbers)],
        )
    assert [entry.deadline for entry in entries(store)] == [at(number) for number in numbers]


def test_many_bring_the_log_up_to_date_while_many_write(another: Open, store: PostgresStore) -> None:
    """All see one order that only grows at its end, without gaps, parts before their wholes."""
    readers, writers, rounds = 3, 3, 40
    barrier, done = Barrier(readers + writers), Flag()

    def write(mine: PostgresStore) -> None:
        barrier.wait(timeout=60)
        for _ in range(rounds):
            part = thing(end=None)
            commit(mine, part)
            commit(mine, thing(part), thing())
            mine.close_event(part.uid, at(2))

    def read(mine: PostgresStore) -> list[tuple[int, LogKind, int]]:
        barrier.wait(timeout=60)
        seen: list[tuple[int, LogKind, int]] = []
        while True:
            is_last = done.is_set()
            mine.log.head()
            seen += [
                (entry.position, entry.kind, entry.event.id)
                for entry in mine.log.read(len(seen), 17)
                if entry.event is not None
            ]
            if is_last and len(seen) == mine.log.head():
                return seen

    with ThreadPoolExecutor(readers + writers) as threads:
        reading = [threads.submit(read, another()) for _ in range(readers)]
        writing = [threads.submit(write, another()) for _ in range(writers)]
        for each in writing:
            each.result(timeout=60)
        done.set()
        logs = [each.result(timeout=60) for each in reading]
    assert logs[0] == logs[1] == logs[2]
    assert [position for position, _, _ in logs[0]] == list(range(1, writers * rounds * 5 + 1))
    place = {(kind is LogKind.CLOSE, number): position for position, kind, number in logs[0]}
    assert len(place) == len(logs[0])
    ids = {event.uid: event.id for event in store.find(Query())}
    wholes = [event for event in store.find(Query()) if event.is_complex]
    assert len(wholes) == writers * rounds
    for whole in wholes:
        part = ids[whole.parts[0]]
        assert place[False, part] < place[False, whole.id] < place[True, whole.id]
        assert place[True, part] < place[True, whole.id]


# Consumers


def test_progress_is_told_without_reading_what_consumers_know(
    store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    recognizer = Session(name="s", version=1, type="Found", cue=cues.is_a("Thing"), gap=timedelta(seconds=1))
    commit(store, thing())
    manager = RecognitionManager(store, [recognizer])
    manager.catch_up()
    with session() as connection:
        connection.execute("ALTER TABLE consumer RENAME COLUMN state TO hidden")
    with pytest.raises(StoreFailure, match='"state" does not exist'):
        store.log.consumers()
    ((progress,), (status,)) = store.log.progress(), manager.status()
    assert (progress.position, status.position, status.fed) == (1, 1, 0)


@pytest.mark.parametrize("call", ["rewind", "remove"])
def test_what_changes_consumers_creates_no_memory(
    another: Open, session: Callable[[], psycopg.Connection[Any]], call: str
) -> None:
    log = another(memory="misspelt").log
    with pytest.raises(MemoryMissing, match="misspelt"):
        log.rewind("a", 0) if call == "rewind" else log.remove("a")
    assert session().execute("SELECT to_regnamespace('misspelt')").fetchone() == (None,)


def test_of_several_processes_one_goes_on(another: Open, store: PostgresStore) -> None:
    """Each commits its results with its advance: all but one find their position lost, and their results nowhere."""
    commit(store, *[thing() for _ in range(30)])
    store.log.head()
    store.log.register("a")
    count = 4
    barrier = Barrier(count)
    stores = [another() for _ in range(count)]

    def work(mine: PostgresStore) -> int:
        won = 0
        for position in range(30):
            barrier.wait(timeout=60)
            try:
                results = [Arrival(event=thing()), Arrival(event=thing())]
                mine.log.advance([Advance(name="a", before=position, position=position + 1)], results)
                won += 1
            except PositionLost:
                pass
        return won

    with ThreadPoolExecutor(count) as threads:
        won = sum(threads.map(work, stores, timeout=120))
    assert won == 30
    assert store.log.head() == 30 + 2 * 30
    assert [(each.name, each.position) for each in store.log.consumers()] == [("a", 30)]


def test_a_name_is_held_by_one_process(another: Open, store: PostgresStore) -> None:
    other = another()
    with store.log.exclusive("a"):
        with pytest.raises(ConsumerBusy, match="'a'"), other.log.exclusive("a"):
            pass
        with other.log.exclusive("b"):
            pass
        with another(memory="kitchen").log.exclusive("a"):
            pass
    with other.log.exclusive("a"), pytest.raises(ConsumerBusy), store.log.exclusive("a"):
        pass


def test_a_lost_connection_lets_go_of_the_name(
    another: Open, store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    other = another()
    with store.log.exclusive("a"):
        with pytest.raises(ConsumerBusy), other.log.exclusive("a"):
            pass
        killed = session().execute(
            "SELECT pg_terminate_backend(l.pid, 10000) FROM pg_locks l JOIN pg_stat_activity a USING (pid)"
            " WHERE l.locktype = 'advisory' AND a.datname = current_database()"
        )
        assert killed.fetchall() == [(True,)]
        with other.log.exclusive("a"), pytest.raises(ConsumerBusy), store.log.exclusive("a"):
            pass


@pytest.mark.parametrize("count", [2, 20])
@pytest.mark.parametrize("is_heard", [True, False], ids=["answer-lost", "words-lost"])
def test_an_advance_happens_whole_or_not_at_all(
    dsn: str, another: Open, store: PostgresStore, count: int, is_heard: bool
) -> None:
    """The connection breaks before (or right after) each message of the call in turn, until it does not break."""
    commit(store, thing(end=None))
    store.log.head()
    outcomes = []
    for number in range(1, 1_000):
        name = f"consumer {number}"
        store.log.register(name)
        parts = [thing() for _ in range(count - 1)]
        results = [*parts, thing(*parts)]
        advance = Advance(name=name, before=0, position=1, state=b"s", report={"n": number})
        before = store.statistics().events
        with Cutter(dsn) as cutter:
            mine = another(cutter.dsn)
            mine.commit(Arrival(event=thing()))
            before += 1
            cutter.cut(number, is_heard=is_heard)
            try:
                mine.log.advance([advance], [Arrival(event=event) for event in results])
                is_cut = False
            except DatabaseUnreachable:
                is_cut = True
            mine.close()
        cutter.wait_for_the_server()
        found = store.log.consumer(name)
        assert found is not None
        is_kept = found.position == 1
        assert (found.checkpoint, found.state, found.report) == ((1, b"s", {"n": number}) if is_kept else (0, None, {}))
        assert store.statistics().events == before + (count if is_kept else 0)
        assert is_kept or is_cut
        outcomes.append((is_cut, is_kept))
        if not is_cut:
            break
    assert outcomes[-1] == (False, True)
    assert outcomes[0] == (True, False)
    assert len(outcomes) > 10
    # Once all that matters was said, the advance holds though nobody heard of it.
    assert [kept for _, kept in outcomes] == sorted(kept for _, kept in outcomes)


# Waiting


def _latencies(waits: PostgresStore, write: Callable[[], object], times: int) -> list[float]:
    """Seconds from the end of a write until who waits for it goes on."""
    found = []
    with ThreadPoolExecutor(1) as threads:
        for _ in range(times):

            def wait(head: int = waits.log.head()) -> float:
                assert waits.log.wait(head, 60)
                return time.monotonic()

            waiting = threads.submit(wait)
            time.sleep(0.05)
            write()
            written = time.monotonic()
            found.append(waiting.result(timeout=60) - written)
    return found


def test_a_commit_wakes_who_waits_elsewhere(
    another: Open, store: PostgresStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(postgres_log, "POLL", 1.0)
    assert median(_latencies(another(), lambda: commit(store, thing()), 9)) < 0.05


def test_a_commit_that_nobody_told_of_is_found(
    another: Open, store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    silent = session()
    silent.autocommit = True
    write = lambda: silent.execute("INSERT INTO log_inbox (kind, at) VALUES (4, now())")  # noqa: E731
    assert median(_latencies(another(), write, 9)) < 0.05


@pytest.mark.parametrize("name", ["Elm", "armar-7", "lab.kitchen", "a" * 48])
def test_whatever_a_memory_is_called_its_commits_wake(
    another: Open, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(postgres_log, "POLL", 1.0)
    store = another(memory=name)
    store.add_types([EventType(name="Thing")])
    assert median(_latencies(another(memory=name), lambda: commit(store, thing()), 3)) < 0.05


def test_few_commits_are_told_of(store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]) -> None:
    """One in every ten milliseconds, and none of them alters the commit itself."""
    listening = session()
    listening.autocommit = True
    listening.execute(f'LISTEN "elm_{MEMORY}"'.encode())
    begun = time.monotonic()
    for _ in range(200):
        store.commit(Arrival(event=thing()))
    lasted = time.monotonic() - begun
    heard = list(listening.notifies(timeout=0.2))
    assert 1 <= len(heard) <= lasted / 0.01 + 1
    assert len(heard) < 100


def test_waiting_goes_on_when_the_server_hangs_up(
    another: Open, store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    waits, watch = another(), session()
    watch.autocommit = True
    head = waits.log.head()
    with ThreadPoolExecutor(1) as threads:
        for _ in range(2):
            waiting = threads.submit(waits.log.wait, head, 60)
            time.sleep(0.1)
            killed = watch.execute(
                "SELECT pg_terminate_backend(pid, 10000) FROM pg_stat_activity"
                " WHERE application_name = 'elm' AND datname = current_database()"
            ).fetchall()
            assert killed
            time.sleep(0.1)
            assert not waiting.done()
            store.commit(Arrival(event=thing()))
            assert waiting.result(timeout=10)
            head = waits.log.head()


def test_who_no_longer_waits_does_not_listen(
    store: PostgresStore, session: Callable[[], psycopg.Connection[Any]]
) -> None:
    """A connection that listens and is not read from would keep the server from forgetting news."""
    assert not store.log.wait(0, 0)
    with store._connections.recalling() as connection:
        assert connection.execute("SELECT pg_listening_channels()").fetchall() == []


# Without rights


@pytest.fixture
def grant(dsn: str, session: Callable[[], psycopg.Connection[Any]]) -> Iterator[Callable[..., str]]:
    """Gives a role rights to all tables of the memory; its address."""
    owner, role = session(), f"log_visitor_{uuid4().hex[:8]}"
    owner.autocommit = True
    owner.execute(f"CREATE ROLE {role} LOGIN; GRANT USAGE ON SCHEMA {MEMORY} TO {role}".encode())

    def give(rights: str, *tables: str) -> str:
        on = ", ".join(tables) or f"ALL TABLES IN SCHEMA {MEMORY}"
        owner.execute(f"GRANT {rights} ON {on} TO {role}".encode())
        return make_conninfo(dsn, user=role)

    yield give
    owner.execute(f"DROP OWNED BY {role}; DROP ROLE {role}".encode())


@pytest.mark.parametrize("kind", ["without rights", "in a transaction that only reads"])
def test_who_may_only_read_reads_what_has_entered_the_log(
    another: Open, store: PostgresStore, grant: Callable[..., str], dsn: str, kind: str
) -> None:
    reading = make_conninfo(dsn, options="-c default_transaction_read_only=on")
    reader = another(grant("SELECT") if kind == "without rights" else reading)
    commit(store, thing(), thing())
    assert reader.log.head() == 0
    assert not reader.log.wait(0, 0.1)
    assert store.log.head() == 2
    store.log.register("a", position=1)
    commit(store, thing())
    assert reader.log.head() == 2
    assert reader.log.wait(1, 0)
    assert reader.log.read(0, 9) == store.log.read(0, 9)
    assert [each.position for each in reader.log.progress()] == [1]
    with ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(reader.log.wait, 2, 60)
        time.sleep(0.05)
        assert not waiting.done()
        store.log.head()
        assert waiting.result(timeout=10)
    assert len(entries(reader)) == 3
    for write in (lambda: reader.log.register("b"), lambda: reader.log.remove("a")):
        with pytest.raises(DatabaseUnfit):
            write()
    assert reader.log.wait(2, 0)


@pytest.mark.parametrize("some", [("INSERT", "log_inbox"), ("UPDATE", "log_head"), ("INSERT", "consumer")])
def test_who_may_write_some_of_the_log_hears_what_is_missing(
    another: Open, store: PostgresStore, grant: Callable[..., str], some: tuple[str, str]
) -> None:
    """And does not wait for others, who perhaps never come, to do what is its own to do."""
    rights, table = some
    grant("SELECT")
    writer = another(grant(rights, f"{MEMORY}.{table}"))
    commit(store, thing())
    with pytest.raises(DatabaseUnfit, match=rf"lacks rights.*'{MEMORY}'"):
        writer.log.head()


# A restore


@contextmanager
def _database(server: Server, name: str) -> Iterator[str]:
    with psycopg.connect(server.dsn("postgres"), autocommit=True) as connection:
        connection.execute(sql.SQL("CREATE DATABASE {}").format(sql.Identifier(name)))
        try:
            yield server.dsn(name)
        finally:
            connection.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))


def test_a_restored_memory_has_the_same_log(
    postgres_server: Server, dsn: str, another: Open, store: PostgresStore, tmp_path: Path
) -> None:
    """With its positions, consumers and what has not entered the log yet, though all ids of transactions are others."""
    if shutil.which("pg_dump") is None or shutil.which("pg_restore") is None:
        pytest.skip("pg_dump and pg_restore are not on the PATH")
    open_part = thing(end=None)
    commit(store, thing(), open_part)
    store.log.head()
    store.close_event(open_part.uid, at(5))
    store.log.register("a")
    store.log.advance(
        [Advance(name="a", before=0, position=2, state=b"\0s", report={"x": 1})], [Arrival(event=thing())]
    )
    store.log.define({"fall/1": "abc"})
    dump = tmp_path / "memory.dump"
    subprocess.run(["pg_dump", "--format=custom", f"--file={dump}", dsn], check=True)
    with _database(postgres_server, "elm_restored") as address:
        subprocess.run(["pg_restore", f"--dbname={address}", str(dump)], check=True)
        restored = another(address)
        known = restored.log.read(0, 100)
        assert [(entry.position, entry.kind) for entry in known] == [(1, LogKind.COMMIT), (2, LogKind.OPEN)]
        assert entries(restored) == entries(store)
        assert restored.log.consumers() == store.log.consumers()
        assert restored.log.definitions() == {"fall/1": "abc"}
        restored.commit(Arrival(event=thing()))
        assert restored.log.head() == store.log.head() + 1 == 5
        restored.close()
