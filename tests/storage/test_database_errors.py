"""Databases that are away, closed to the user, unfit, or die at work: what is said, and that elm goes on afterwards."""

from __future__ import annotations

import os
import re
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from threading import Event as Signal
from threading import Thread
from typing import LiteralString
from uuid import UUID, uuid4

import psycopg
import pytest
from psycopg import sql
from psycopg.conninfo import make_conninfo

import elm
from elm import cues
from elm.errors import (
    CycleRefused,
    DatabaseUnfit,
    DatabaseUnreachable,
    ElmError,
    InvalidValue,
    MemoryMissing,
    SchemaMismatch,
    StoreFailure,
    UnknownEvent,
)
from elm.event import Event
from elm.query import Grouping, Join, JoinRelation, Query
from elm.storage import diagnose, migrate
from elm.storage.cluster import Cluster
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.servers import MEMORY, Server

_numbers = count(1)


def thing(name: str = "Thing") -> Event:
    return Event(type=name, interval=span(0, 1))


def begin(store: PostgresStore) -> Event:
    """The first write to a memory."""
    store.add_types([EventType(name="Thing")])
    event = thing()
    store.commit(Arrival(event=event))
    return event


@contextmanager
def opened(dsn: str, memory: str = MEMORY) -> Iterator[PostgresStore]:
    store = PostgresStore(dsn, memory)
    try:
        yield store
    finally:
        store.close()


@pytest.fixture
def admin(dsn: str) -> Iterator[Callable[..., None]]:
    """Runs statements in the test's database as its owner; {} stand for names."""
    with psycopg.connect(dsn, autocommit=True) as connection:

        def run(statement: LiteralString, *names: str) -> None:
            connection.execute(sql.SQL(statement).format(*map(sql.Identifier, names)))

        yield run


@pytest.fixture
def role(dsn: str, admin: Callable[..., None]) -> Iterator[str]:
    """A user who owns nothing."""
    name = f"visitor_{next(_numbers)}"
    admin("CREATE ROLE {} LOGIN", name)
    yield name
    admin("DROP OWNED BY {}", name)
    admin("DROP ROLE {}", name)


# Away


NOWHERE = {
    "a closed port": "postgresql://user@127.0.0.1:1/robots",
    "no socket": "postgresql:///robots?host=/nonexistent",
    "an unknown host": "host=elm.invalid dbname=robots",
    "a host that does not answer": "host=127.0.0.1 hostaddr=127.0.0.1 port=1 dbname=robots connect_timeout=2",
}


@pytest.mark.parametrize("address", NOWHERE.values(), ids=NOWHERE)
def test_no_server(address: str) -> None:
    with opened(address) as store:
        for ask in (
            lambda: store.count(cues.everything()),
            lambda: list(store.find(Query())),
            lambda: store.commit(Arrival(event=thing())),
            lambda: store.add_types([EventType(name="Thing")]),
            lambda: migrate(address, MEMORY),
        ):
            with pytest.raises(DatabaseUnreachable, match=r"no database at .*robots.*(elm up|--dsn)"):
                ask()
    found = dict(diagnose(address, MEMORY))
    assert found["connection"].startswith("FAILED: no database at ")


def test_no_such_database_or_user(postgres_server: Server) -> None:
    for address in (
        postgres_server.dsn("nowhere"),
        make_conninfo(postgres_server.dsn("postgres"), user="nobody in particular"),
    ):
        with pytest.raises(DatabaseUnreachable, match="does not exist"), opened(address) as store:
            store.count(cues.everything())


def test_a_server_that_answers_is_not_told_to_be_away(cluster: Cluster) -> None:
    cluster.up()
    rules = cluster.home / "data" / "pg_hba.conf"
    rules.write_text(f"local all guarded scram-sha-256\nlocal all shut_out reject\n{rules.read_text()}")
    with psycopg.connect(cluster.dsn(), autocommit=True) as connection:
        connection.execute("CREATE ROLE guarded LOGIN PASSWORD 'right'")
        connection.execute("CREATE ROLE shut_out LOGIN")
        connection.execute("SELECT pg_reload_conf()")
    guarded = {word: {"user": "guarded", "password": word} for word in ("right", "wrong")}
    remedies = {
        make_conninfo(cluster.dsn("nowhere")): r'database "nowhere" does not exist.*createdb',
        make_conninfo(cluster.dsn(), user="nobody"): r'role "nobody" does not exist.*[Cc]orrect the user',
        make_conninfo(cluster.dsn(), user="shut_out"): r"[Cc]orrect the user.*pg_hba\.conf",
        make_conninfo(cluster.dsn(), user="guarded", passfile=os.devnull): r"asks for a password.*PGPASSWORD",
        make_conninfo(cluster.dsn(), **guarded["wrong"]): r"password authentication failed.*password",
        make_conninfo(cluster.dsn("nowhere"), **guarded["right"]): "createdb",
    }
    for address, remedy in remedies.items():
        with opened(address) as store, pytest.raises(DatabaseUnreachable, match=rf"the server of .*{remedy}") as error:
            store.count(cues.everything())
        assert not re.search("[Ss]tart the server|no database at", str(error.value))


def test_a_cue_of_more_values_than_a_statement_takes_is_refused(dsn: str) -> None:
    with opened(dsn) as store:
        begin(store)
        wide = cues.any_of(*(cues.agent(str(number)) for number in range(65_001)))
        half = cues.any_of(*(cues.agent(str(number)) for number in range(32_501)))
        with pytest.raises(InvalidValue, match=r"65001 values.*65000.*uids.*split"):
            store.count(wide)
        with pytest.raises(InvalidValue, match=r"65002 values"):
            next(store.join(Join(anchors=Query(cue=half), cue=half, relation=JoinRelation.BEFORE)))
        many = [UUID(int=number) for number in range(100_000)]
        assert store.count(cues.uid(*many)) == 0


@pytest.mark.parametrize(
    "address",
    ["nonsense", "host=", "postgresql://[::1", "postgresql://a b", "colour=red", "port=many", "mysql://here/there"],
)
def test_not_a_dsn(address: str) -> None:
    with pytest.raises(DatabaseUnreachable), opened(address) as store:
        store.count(cues.everything())
    assert any(line.startswith("FAILED: ") for _, line in diagnose(address, MEMORY))


SECRETS = {
    "in a URI": "postgresql://user:hunter2secret@127.0.0.1:1/robots",
    "in a URI's query": "postgresql://127.0.0.1:1/robots?user=x&password=hunter2secret&connect_timeout=2",
    "for a key": "postgresql://127.0.0.1:1/robots?sslpassword=hunter2secret",
    "as a keyword": "host=127.0.0.1 port=1 user=x password=hunter2secret dbname=robots",
    "quoted": "host=127.0.0.1 port=1 password='hunter2 \\'secret' dbname=robots",
    "with spaces around": "host=127.0.0.1 port=1 password = hunter2secret",
    "with an @": "postgresql://user:hunter2@secret@127.0.0.1:1/robots",
    "with a slash": "postgresql://user:hunter2/secret@127.0.0.1:1/robots",
    "with a question mark": "postgresql://user:hunter2?secret@127.0.0.1:1/robots",
    "with a colon": "postgresql://user:hunter2:secret@127.0.0.1:1/robots",
    "with a percent sign": "postgresql://user:hunter2%zzsecret@127.0.0.1:1/robots",
    "with a blank": "postgresql://user:hunter2 secret@127.0.0.1:1/robots",
    "unquoted": "host=127.0.0.1 port=1 password=hunter2 secret",
    "without its host": "postgresql://user:hunter2secret@[::1",
    "with a stray word": "host=127.0.0.1 port=1 password=hunter2secret stray",
}


@pytest.mark.parametrize("address", SECRETS.values(), ids=SECRETS)
def test_no_message_shows_the_password(address: str) -> None:
    said = [line for pair in diagnose(address, MEMORY) for line in pair]
    with opened(address) as store, pytest.raises(ElmError) as error:
        store.commit(Arrival(event=thing()))
    with pytest.raises(ElmError) as another:
        migrate(address, MEMORY)
    said += [str(error.value), str(another.value)]
    assert not [line for line in said if "hunter2" in line or "secret" in line]


def test_memory_that_does_not_exist_is_named(dsn: str) -> None:
    with opened(dsn, "kitchen") as store:
        for ask in (
            lambda: store.count(cues.everything()),
            lambda: store.get([1]),
            lambda: next(store.types()),
            store.statistics,
            lambda: next(store.find(Query())),
        ):
            with pytest.raises(MemoryMissing, match=r"'kitchen'.*elm migrate"):
                ask()
        begin(store)
        assert store.count(cues.everything()) == 1


def test_memory_that_does_not_exist_is_not_made_by_changing_it(dsn: str) -> None:
    with opened(dsn, "kitchem") as store:
        for change in (
            lambda: store.close_event(uuid4(), at(1)),
            lambda: store.log.rewind("reader", 0),
            lambda: store.log.remove("reader"),
        ):
            with pytest.raises(MemoryMissing, match=r"'kitchem'.*elm migrate"):
                change()
        store.finish_load()
        with psycopg.connect(dsn, autocommit=True) as connection:
            assert connection.execute("SELECT FROM pg_namespace WHERE nspname = 'kitchem'").rowcount == 0
        begin(store)
        with pytest.raises(UnknownEvent):
            store.close_event(uuid4(), at(1))


# Without rights


def test_user_who_may_not_create_a_memory(dsn: str, role: str) -> None:
    address = make_conninfo(dsn, user=role)
    with opened(address, "kitchen") as store:
        with pytest.raises(MemoryMissing):
            store.count(cues.everything())
        for write in (lambda: begin(store), lambda: migrate(address, "kitchen")):
            with pytest.raises(DatabaseUnfit, match=r"lacks rights.*'kitchen'.*CREATE on the database"):
                write()


def test_user_who_was_given_a_schema(dsn: str, role: str, admin: Callable[..., None]) -> None:
    admin("CREATE SCHEMA kitchen AUTHORIZATION {}", role)
    with opened(make_conninfo(dsn, user=role), "kitchen") as store:
        begin(store)
        assert store.count(cues.everything()) == 1


def test_user_who_may_not_look(dsn: str, role: str) -> None:
    with opened(dsn) as store:
        begin(store)
    with opened(make_conninfo(dsn, user=role)) as store:
        for ask in (lambda: store.count(cues.everything()), lambda: store.commit(Arrival(event=thing()))):
            with pytest.raises(DatabaseUnfit, match=rf"lacks rights.*'{MEMORY}'"):
                ask()


def test_user_who_may_only_read(dsn: str, role: str, admin: Callable[..., None]) -> None:
    with opened(dsn) as store:
        kept = begin(store)
        open_event = Event(type="Thing", interval=span(0, None))
        store.commit(Arrival(event=open_event))
    admin("GRANT USAGE ON SCHEMA {} TO {}", MEMORY, role)
    admin("GRANT SELECT ON ALL TABLES IN SCHEMA {} TO {}", MEMORY, role)
    with opened(make_conninfo(dsn, user=role)) as store:
        assert [event.uid for event in store.find(Query())] == [kept.uid, open_event.uid]
        assert store.count(cues.is_a("Thing")) == 2
        assert [each.name for each in store.types()] == ["Thing"]
        assert [group.key for group in store.groups(cues.everything(), Grouping.TYPE)] == ["Thing"]
        assert store.statistics().events == 2
        assert store.explain(Query()).events == 2
        for write in (
            lambda: store.commit(Arrival(event=thing())),
            lambda: store.commit_all([Arrival(event=thing()), Arrival(event=thing())]),
            lambda: store.load([Arrival(event=thing())]),
            lambda: store.close_event(open_event.uid, at(1)),
            lambda: store.add_types([EventType(name="Other")]),
            lambda: store.commit(Arrival(event=Event(type="Thing", parts=[kept.uid]))),
            lambda: store.commit(
                Arrival(event=Event(type="Thing", interval=span(0, 1), region=elm.Region.box(0, 0, 1, 1)))
            ),
        ):
            with pytest.raises(DatabaseUnfit, match=rf"lacks rights.*'{MEMORY}'"):
                write()
        assert store.count(cues.everything()) == 2


def test_user_who_may_write_but_owns_nothing(dsn: str, role: str, admin: Callable[..., None]) -> None:
    with opened(dsn) as store:
        begin(store)
    admin("GRANT USAGE ON SCHEMA {} TO {}", MEMORY, role)
    admin("GRANT SELECT, INSERT, UPDATE ON ALL TABLES IN SCHEMA {} TO {}", MEMORY, role)
    with opened(make_conninfo(dsn, user=role)) as store:
        assert store.commit(Arrival(event=thing())).new
        with pytest.raises(DatabaseUnfit, match=r"sequence event_id_seq.*Grant.*on its sequences"):
            store.load([Arrival(event=thing())])
    admin("GRANT USAGE ON ALL SEQUENCES IN SCHEMA {} TO {}", MEMORY, role)
    with opened(make_conninfo(dsn, user=role)) as store:
        store.add_types([EventType(name="Other", parents=("Thing",))])
        part = Event(type="Other", interval=span(0, None), region=elm.Region.box(0, 0, 1, 1, frame="hall"))
        over = Event(type="Thing", parts=[part.uid])
        store.commit_all([Arrival(event=part), Arrival(event=over)])
        assert store.load([Arrival(event=thing())]).new == 1
        store.finish_load()
        assert store.close_event(part.uid, at(3)).wholes == (over.uid,)
        assert store.count(cues.everything()) == 5


def test_database_that_is_read_only(dsn: str) -> None:
    with opened(dsn) as store:
        begin(store)
    with opened(make_conninfo(dsn, options="-c default_transaction_read_only=on")) as store:
        assert store.count(cues.everything()) == 1
        with pytest.raises(DatabaseUnfit, match="read-only"):
            store.commit(Arrival(event=thing()))


# Unfit


@pytest.fixture
def bare(postgres_server: Server, role: str) -> Iterator[str]:
    """A database of `role` without any extension."""
    name = f"bare_{next(_numbers)}"
    with psycopg.connect(postgres_server.dsn("postgres"), autocommit=True) as connection:
        create = sql.SQL("CREATE DATABASE {} OWNER {} TEMPLATE template0")
        connection.execute(create.format(sql.Identifier(name), sql.Identifier(role)))
        yield postgres_server.dsn(name)
        connection.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))


def test_extensions_are_created_where_that_is_allowed(bare: str) -> None:
    with opened(bare) as store:
        begin(store)
        assert store.count(cues.everything()) == 1


def test_extension_that_only_a_superuser_may_create(bare: str, role: str) -> None:
    address = make_conninfo(bare, user=role)
    with opened(address) as store:
        with pytest.raises(MemoryMissing):
            store.count(cues.everything())
        with pytest.raises(DatabaseUnfit, match=r"extension postgis.*superuser.*CREATE EXTENSION postgis"):
            begin(store)
        with psycopg.connect(bare, autocommit=True) as connection:
            schemas = connection.execute("SELECT FROM pg_namespace WHERE nspname = %s", [MEMORY])
            assert schemas.rowcount == 0
            connection.execute("CREATE EXTENSION postgis")
        begin(store)
        assert store.count(cues.everything()) == 1


def test_postgis_in_a_schema_of_its_own(bare: str) -> None:
    with psycopg.connect(bare, autocommit=True) as connection:
        connection.execute('CREATE SCHEMA "Geo data"')
        connection.execute('CREATE EXTENSION postgis SCHEMA "Geo data"')
    with opened(bare) as store:
        begin(store)
        place = elm.Region.box(0, 0, 1, 1)
        store.commit(Arrival(event=Event(type="Thing", interval=span(0, 1), region=place)))
        assert store.count(cues.within(1, place)) == 1


@pytest.mark.parametrize("encoding", ["LATIN1", "SQL_ASCII"])
def test_database_that_cannot_hold_every_character(postgres_server: Server, encoding: str) -> None:
    name = f"bare_{next(_numbers)}"
    with psycopg.connect(postgres_server.dsn("postgres"), autocommit=True) as connection:
        create = sql.SQL("CREATE DATABASE {} TEMPLATE template0 ENCODING {} LOCALE 'C'")
        connection.execute(create.format(sql.Identifier(name), sql.Literal(encoding)))
        try:
            with opened(postgres_server.dsn(name)) as store, pytest.raises(DatabaseUnfit, match="UTF8"):
                begin(store)
        finally:
            connection.execute(sql.SQL("DROP DATABASE {} WITH (FORCE)").format(sql.Identifier(name)))


# Somebody else's


def test_schema_that_is_no_memory(dsn: str, admin: Callable[..., None]) -> None:
    admin("CREATE SCHEMA kitchen")
    with opened(dsn, "kitchen") as store:
        with pytest.raises(MemoryMissing, match="'kitchen'"):
            store.count(cues.everything())
        begin(store)
        assert store.count(cues.everything()) == 1


def test_schema_with_tables_of_another_program(dsn: str, admin: Callable[..., None]) -> None:
    admin("CREATE SCHEMA kitchen")
    admin("CREATE TABLE kitchen.event (id integer)")
    admin("INSERT INTO kitchen.event VALUES (7)")
    with opened(dsn, "kitchen") as store:
        with pytest.raises(MemoryMissing, match="'kitchen'"):
            store.count(cues.everything())
        with pytest.raises((DatabaseUnfit, SchemaMismatch), match="'kitchen'"):
            begin(store)
    with psycopg.connect(dsn) as connection:
        assert connection.execute("SELECT * FROM kitchen.event").fetchall() == [(7,)]


def test_migrations_of_another_program(dsn: str, admin: Callable[..., None]) -> None:
    admin("CREATE TABLE public.alembic_version (version_num varchar(32) NOT NULL)")
    admin("INSERT INTO public.alembic_version VALUES ('cafe')")
    with opened(dsn, "kitchen") as store:
        begin(store)
        assert store.count(cues.everything()) == 1
    with psycopg.connect(dsn) as connection:
        assert connection.execute("SELECT * FROM public.alembic_version").fetchall() == [("cafe",)]


def test_settings_of_the_user_change_nothing(dsn: str, admin: Callable[..., None]) -> None:
    name = psycopg.conninfo.conninfo_to_dict(dsn)["dbname"]
    settings: tuple[LiteralString, ...] = (
        "TimeZone = 'Asia/Kolkata'",
        "DateStyle = 'German'",
        "IntervalStyle = 'sql_standard'",
        "bytea_output = 'escape'",
        "client_encoding = 'LATIN1'",
        "standard_conforming_strings = off",
        "default_transaction_isolation = 'serializable'",
        "search_path = 'nowhere'",
        "extra_float_digits = -10",
    )
    for setting in settings:
        admin("ALTER DATABASE {} SET " + setting, str(name))
    event = Event(
        type="Ärger",
        interval=span(0, 4.000001),
        region=elm.Region.box(0.1, 0.2, 0.30000000000000004, 1),
        features=[("größe", 0.1), ("wort", "漢\\'")],
        payload=elm.Payload(data=b"\0\\\xff"),
        agent="österreichisch",
    )
    over = Event(type="Ärger", parts=[event.uid])
    for address in (dsn, make_conninfo(dsn, client_encoding="latin1")):
        with opened(address) as store:
            store.add_types([EventType(name="Ärger")])
            store.commit_all([Arrival(event=event), Arrival(event=over)])
            store.load([Arrival(event=each) for each in (event, over, Event(type="Ärger", interval=span(9, 9)))])
            (found,) = store.find(Query(cue=cues.feature("wort", "=", "漢\\'") & cues.lasting(">", at(4) - at(0))))
            assert found.as_event() == event
            assert store.get([found.id]) == [found]
            assert [group.key for group in store.groups(cues.uid(event.uid), Grouping.HOUR)] == [at(0)]


# Going on


def test_refused_calls_leave_the_connection_fit(dsn: str) -> None:
    """However many statements were run, and undone, before: what was prepared for the next ones is still there."""
    with opened(dsn) as store:
        begin(store)
        for number in range(20):
            going_on = Event(type="Thing", interval=span(0, None))
            store.commit_all([Arrival(event=going_on), Arrival(event=Event(type="Thing", parts=[going_on.uid]))])
            store.close_event(going_on.uid, at(1))
            store.load([Arrival(event=thing()), Arrival(event=thing("Nothing"))])
            with pytest.raises(UnknownEvent):
                store.commit_all([Arrival(event=thing()), Arrival(event=Event(type="Thing", parts=[uuid4()]))])
            with pytest.raises(CycleRefused):
                store.add_types([EventType(name="A", parents=("B",)), EventType(name="B", parents=("A",))])
            assert store.count(cues.everything()) == 4 + 3 * number


# Dying


def test_statement_that_is_cancelled(dsn: str) -> None:
    with opened(dsn) as store:
        begin(store)
    with opened(make_conninfo(dsn, options="-c statement_timeout=200")) as store:
        with psycopg.connect(dsn) as other:
            other.execute(sql.SQL("LOCK TABLE {}.event").format(sql.Identifier(MEMORY)))
            for ask in (
                lambda: store.count(cues.everything()),
                lambda: list(store.find(Query())),
                lambda: store.commit(Arrival(event=thing())),
                lambda: store.load([Arrival(event=thing())]),
            ):
                with pytest.raises(StoreFailure, match="cancelled a statement"):
                    ask()
        store.commit(Arrival(event=thing()))
        assert store.count(cues.everything()) == 2


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    """A server of these tests' own: they stop and kill it."""
    directory = Path(tempfile.mkdtemp(prefix="elm-test-")).resolve()
    directory.chmod(0o755)
    made = Cluster(home=directory / "home", settings={"fsync": "off"})
    try:
        made.up()
        yield made
    finally:
        made.down()
        shutil.rmtree(made.status().socket_directory, ignore_errors=True)
        shutil.rmtree(directory, ignore_errors=True)


def _stop(cluster: Cluster) -> None:
    cluster.down()


def _kill(cluster: Cluster) -> None:
    pid = cluster.status().pid
    assert pid is not None
    os.kill(pid, signal.SIGKILL)


@pytest.mark.parametrize("end", [_stop, _kill])
def test_server_that_is_started_again(cluster: Cluster, end: Callable[[Cluster], None]) -> None:
    cluster.up()
    with opened(cluster.dsn(), f"again_{end.__name__[1:]}") as store:
        begin(store)
        streams = [store.ids(Query()) for _ in range(3)]
        assert [next(stream) for stream in streams] == [1, 1, 1]
        for stream in streams:
            assert list(stream) == []
        end(cluster)
        with suppress(DatabaseUnreachable):
            store.count(cues.everything())
        cluster.up()
        said: list[str] = []
        calls = (lambda: store.commit(Arrival(event=thing())), lambda: list(store.find(Query())))
        for call in calls * 3:
            try:
                call()
            except DatabaseUnreachable as error:
                said.append(str(error))
        assert len(said) <= 1
        assert all("Try again" in message for message in said)
        assert store.count(cues.everything()) == 4 - len(said)


@pytest.mark.parametrize("name", [None, "reader"])
@pytest.mark.parametrize("end", [_stop, _kill])
def test_subscription_outlives_its_server(cluster: Cluster, end: Callable[[Cluster], None], name: str | None) -> None:
    cluster.up()
    with elm.connect(cluster.dsn(), f"subscribed_{end.__name__[1:]}_{name or 'unnamed'}") as memory:
        memory.add_type("Thing")
        seen: list[int] = []
        subscription = memory.subscribe(since=0, name=name, timeout=60)

        def committed() -> int:
            return memory.commit(Event(type="Thing", interval=span(0, 1))).id

        first = committed()
        seen.append(next(subscription).id)
        end(cluster)
        waiting = ThreadPoolExecutor(1)
        following = waiting.submit(lambda: [next(subscription).id for _ in range(2)])
        time.sleep(0.5)
        assert not following.done()
        cluster.up()
        with suppress(DatabaseUnreachable):
            # The first call hears of the connection that was lost.
            memory.recall().count()
        later = [committed(), committed()]
        seen += following.result(timeout=60)
        waiting.shutdown()
        assert seen == [first, *later]
        assert isinstance(subscription, Generator)
        subscription.close()
        if name is not None:
            # What was not handed over with its whole page comes again.
            assert [event.id for event in memory.subscribe(name=name, timeout=0)] in (later, later[1:])


def test_server_that_dies_while_results_are_read(cluster: Cluster) -> None:
    cluster.up()
    with opened(cluster.dsn(), "reading") as store:
        begin(store)
        store.load([Arrival(event=Event(type="Thing", interval=span(n, n + 1))) for n in range(20_000)])
        reading = store.find(Query())
        next(reading)
        cluster.down()
        with pytest.raises(DatabaseUnreachable):
            list(reading)
        cluster.up()
        assert len(list(store.find(Query()))) == 20_001


def test_server_killed_during_a_load(cluster: Cluster) -> None:
    cluster.up()
    batch = 200
    events: list[Event] = []
    for group in range(400):
        parts = [Event(type="Thing", interval=span(group + n, group + n + 1)) for n in range(9)]
        events += [*parts, Event(type="Thing", parts=[part.uid for part in parts])]
    with elm.connect(cluster.dsn(), "killed") as memory:
        memory.add_type("Thing")
        underway = Signal()

        def killer() -> None:
            underway.wait(timeout=60)
            _kill(cluster)

        thread = Thread(target=killer)
        thread.start()
        done = 0

        def progress(number: int) -> None:
            nonlocal done
            done = number
            if number >= 3 * batch:
                underway.set()

        with pytest.raises(DatabaseUnreachable):
            memory.load(events, batch=batch, progress=progress)
        thread.join()
        cluster.up()
        with suppress(DatabaseUnreachable):
            memory.recall().exists()
        kept = memory.recall().count()
        assert kept in (done, done + batch)
        assert [event.uid for event in memory.recall(order="id")] == [event.uid for event in events[:kept]]
        statistics = memory.statistics()
        assert (statistics.complex_events, statistics.links) == (kept // 10, 9 * (kept // 10))
        with psycopg.connect(cluster.dsn(), options="-c search_path=killed") as connection:
            logged = connection.execute("SELECT event_id FROM log_inbox ORDER BY n").fetchall()
            assert [number for (number,) in logged] == [event.id for event in memory.recall(order="id")]
        report = memory.load(events, batch=batch)
        assert (report.new, report.existing) == (len(events) - kept, kept)
