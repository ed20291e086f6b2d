"""From nothing or from an older schema to the tables as they are declared, once, whoever else is doing the same."""

from __future__ import annotations

import os
import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from threading import Barrier
from typing import Any

import psycopg
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from geoalchemy2 import Geometry, alembic_helpers
from psycopg import sql
from sqlalchemy import NullPool, create_engine

import elm
from elm import cues
from elm.errors import InvalidValue, MemoryMissing, SchemaMismatch
from elm.event import Event
from elm.log import LogKind
from elm.query import Query
from elm.storage import migrate
from elm.storage.memory import MemoryStore
from elm.storage.postgres import PostgresStore
from elm.storage.tables import REVISION, metadata
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at, span
from tests.servers import MEMORY, Server

SOURCES = Path(elm.__file__).parents[1]

# Everything that a table consists of, as the server would write it down.
_CATALOGUE = {
    "columns": """
        SELECT c.relname, a.attname, row_number() OVER (PARTITION BY c.oid ORDER BY a.attnum),
               format_type(a.atttypid, a.atttypmod), l.collname, a.attnotnull, a.attidentity, a.attgenerated,
               a.attstorage, pg_get_expr(d.adbin, d.adrelid)
        FROM pg_attribute a JOIN pg_class c ON c.oid = a.attrelid LEFT JOIN pg_collation l ON l.oid = a.attcollation
             LEFT JOIN pg_attrdef d ON d.adrelid = c.oid AND d.adnum = a.attnum
        WHERE c.relnamespace = %(schema)s::regnamespace AND c.relkind IN ('r', 'p') AND a.attnum > 0
              AND NOT a.attisdropped
    """,
    "constraints": """
        SELECT c.relname, k.conname, k.contype, pg_get_constraintdef(k.oid), k.convalidated, k.condeferrable
        FROM pg_constraint k JOIN pg_class c ON c.oid = k.conrelid WHERE k.connamespace = %(schema)s::regnamespace
    """,
    "indexes": """
        SELECT c.relname, i.relname, pg_get_indexdef(i.oid), x.indisunique, x.indisvalid, i.reloptions
        FROM pg_index x JOIN pg_class i ON i.oid = x.indexrelid JOIN pg_class c ON c.oid = x.indrelid
        WHERE c.relnamespace = %(schema)s::regnamespace
    """,
    "tables": """
        SELECT c.relname, c.relkind, c.relpersistence, c.reloptions, c.relrowsecurity
        FROM pg_class c WHERE c.relnamespace = %(schema)s::regnamespace AND c.relkind NOT IN ('i')
    """,
    "triggers": """
        SELECT c.relname, t.tgname FROM pg_trigger t JOIN pg_class c ON c.oid = t.tgrelid
        WHERE c.relnamespace = %(schema)s::regnamespace AND NOT t.tgisinternal
    """,
}


def catalogue(dsn: str, schema: str) -> dict[str, list[tuple[Any, ...]]]:
    """What a schema consists of, the version table of the migrations aside, without the schema's own name."""
    quoted = f'"{schema}"'
    with psycopg.connect(dsn) as connection:
        return {
            kind: sorted(
                (
                    tuple(value.replace(f"{schema}.", "") if isinstance(value, str) else value for value in row)
                    for row in connection.execute(query.encode(), {"schema": quoted})
                    if row[0] != "alembic_version"
                ),
                key=repr,
            )
            for kind, query in _CATALOGUE.items()
        }


@pytest.fixture
def declared(dsn: str) -> str:
    """A schema made from the tables' declaration, beside the memory."""
    engine = create_engine(
        "postgresql+psycopg://",
        creator=lambda: psycopg.connect(dsn, options="-c search_path=declared,public"),
        poolclass=NullPool,
    )
    with psycopg.connect(dsn) as connection:
        connection.execute("CREATE SCHEMA declared")
    with engine.begin() as transaction:
        metadata.create_all(transaction)
    engine.dispose()
    return "declared"


@pytest.fixture
def stores(dsn: str) -> Iterator[Callable[[str], PostgresStore]]:
    """Opens memories of the database by name."""
    with ExitStack() as opened:

        def open_store(memory: str) -> PostgresStore:
            store = PostgresStore(dsn, memory)
            opened.callback(store.close)
            return store

        yield open_store


def schemas(dsn: str) -> set[str]:
    with psycopg.connect(dsn) as connection:
        rows = connection.execute("SELECT nspname FROM pg_namespace WHERE nspname !~ '^pg_'").fetchall()
    return {name for (name,) in rows}


def begin(store: PostgresStore, *types: str) -> Event:
    """Some types and an event of the first."""
    store.add_types([EventType(name=name) for name in types])
    event = Event(type=types[0], interval=span(0, 1), region=elm.Region.box(0, 0, 1, 1))
    store.commit(Arrival(event=event))
    return event


# What they make


@pytest.mark.parametrize("kind", _CATALOGUE)
def test_migrations_make_what_is_declared(dsn: str, declared: str, kind: str) -> None:
    assert catalogue(dsn, MEMORY)[kind] == catalogue(dsn, declared)[kind]


def test_catalogue_tells_schemas_apart(dsn: str, declared: str) -> None:
    with psycopg.connect(dsn) as connection:
        for change in (
            "ALTER TABLE declared.event ALTER COLUMN agent DROP NOT NULL, ALTER COLUMN media_type SET NOT NULL",
            'ALTER TABLE declared.event_type ALTER COLUMN name TYPE text COLLATE "POSIX"',
            "DROP INDEX declared.event_period_idx",
            "CREATE INDEX event_period_idx ON declared.event (period)",
            "ALTER TABLE declared.part DROP CONSTRAINT part_part_before_whole_check",
            "ALTER INDEX declared.event_feature_names_idx RESET (gin_pending_list_limit)",
        ):
            before = catalogue(dsn, declared)
            connection.execute(change.encode())
            connection.commit()
            assert catalogue(dsn, declared) != before


def _is_ours(entry: Any, name: str | None, kind: str, reflected: bool, compared: Any) -> bool:
    if kind == "table" and name in ("alembic_version", "spatial_ref_sys"):
        return False
    shown: bool = alembic_helpers.include_object(entry, name, kind, reflected, compared)  # type: ignore[no-untyped-call]
    return shown


def _is_other_type(_context: Any, _column: Any, _declared: Any, found: Any, declared: Any) -> bool | None:
    """Whether types differ; None leaves the answer to alembic, to whom no SRID and SRID 0 are not the same."""
    if not (isinstance(found, Geometry) and isinstance(declared, Geometry)):
        return None
    return (found.geometry_type, max(found.srid, 0)) != (declared.geometry_type, max(declared.srid, 0))


def test_alembic_finds_nothing_to_do(dsn: str) -> None:
    engine = create_engine(
        "postgresql+psycopg://",
        creator=lambda: psycopg.connect(dsn, options=f"-c search_path={MEMORY},public"),
        poolclass=NullPool,
    )
    with engine.connect() as connection:
        options = {"include_object": _is_ours, "compare_type": _is_other_type, "compare_server_default": True}
        context = MigrationContext.configure(connection, opts=options)
        assert compare_metadata(context, metadata) == []
    engine.dispose()


def test_text_is_ordered_by_code_point(dsn: str) -> None:
    """Whatever the locale of the database, text compares as in Python."""
    with psycopg.connect(dsn) as connection:
        loose = connection.execute(
            "SELECT c.relname, a.attname FROM pg_attribute a JOIN pg_class c ON c.oid = a.attrelid"
            " LEFT JOIN pg_collation l ON l.oid = a.attcollation"
            " WHERE c.relnamespace = %s::regnamespace AND c.relkind = 'r' AND c.relname <> 'alembic_version'"
            " AND a.attnum > 0 AND a.atttypid IN ('text'::regtype, 'text[]'::regtype, 'varchar'::regtype)"
            " AND l.collname IS DISTINCT FROM 'C'",
            [MEMORY],
        ).fetchall()
    assert loose == []


# Once


def test_migrating_again_changes_nothing(dsn: str, stores: Callable[[str], PostgresStore]) -> None:
    assert migrate(dsn, "kitchen") == f"created memory 'kitchen' (schema {REVISION})"
    event = begin(stores("kitchen"), "Thing")
    before = catalogue(dsn, "kitchen")
    assert migrate(dsn, "kitchen") == f"memory 'kitchen' is up to date (schema {REVISION})"
    assert catalogue(dsn, "kitchen") == before
    assert [found.uid for found in stores("kitchen").find(Query())] == [event.uid]


def _start(script: str, *arguments: str, sources: Path = SOURCES) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", script, *arguments],
        # Python looks for modules in its working directory first.
        cwd=sources,
        env={**os.environ, "PYTHONPATH": str(sources)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


_MIGRATE = "import sys; from elm.storage import migrate; print(migrate(*sys.argv[1:]))"


@pytest.mark.parametrize("extensions", [True, False], ids=["prepared", "bare"])
def test_processes_that_create_the_same_memory(postgres_server: Server, dsn: str, extensions: bool) -> None:
    if not extensions:
        with psycopg.connect(dsn, autocommit=True) as connection:
            connection.execute(f"DROP SCHEMA {MEMORY} CASCADE".encode())
            connection.execute("DROP EXTENSION postgis, btree_gist")
    running = [_start(_MIGRATE, dsn, "kitchen") for _ in range(3)]
    said = [process.communicate(timeout=120) for process in running]
    assert sorted(out.split()[0] for out, _ in said) == ["created", "memory", "memory"], said
    migrate(dsn, "pantry")
    assert catalogue(dsn, "kitchen") == catalogue(dsn, "pantry")


def test_threads_that_create_memories_of_several_databases(postgres_server: Server) -> None:
    """The migration library keeps its state in the process: each memory must still get its own tables."""
    with ExitStack() as opened, ThreadPoolExecutor(4) as threads:
        databases = [opened.enter_context(postgres_server.database()) for _ in range(4)]
        for turn in range(3):
            barrier = Barrier(len(databases))

            def create(database: str, memory: str = f"m{turn}", barrier: Barrier = barrier) -> str:
                barrier.wait(timeout=60)
                return migrate(database, memory)

            done = list(threads.map(create, databases))
            assert done == [f"created memory 'm{turn}' (schema {REVISION})"] * 4
        expected = catalogue(databases[0], MEMORY)
        for database in databases:
            for turn in range(3):
                assert catalogue(database, f"m{turn}") == expected


def test_first_writes_from_many_stores(dsn: str) -> None:
    """A memory that does not exist is created by whoever writes first; the others find it."""
    with ExitStack() as opened, ThreadPoolExecutor(4) as threads:
        stores = [PostgresStore(dsn, "kitchen") for _ in range(4)]
        for store in stores:
            opened.callback(store.close)
        barrier = Barrier(len(stores))

        def write(store: PostgresStore) -> None:
            barrier.wait(timeout=60)
            store.add_types([EventType(name="Thing")])

        list(threads.map(write, stores))
        assert [each.name for each in stores[0].types()] == ["Thing"]


# Whose schema is older, newer, or not there


def test_reading_creates_nothing(dsn: str, stores: Callable[[str], PostgresStore]) -> None:
    before = schemas(dsn)
    with pytest.raises(MemoryMissing, match="kitchen"):
        stores("kitchen").count(cues.everything())
    assert schemas(dsn) == before


def test_memory_of_a_newer_elm(dsn: str, stores: Callable[[str], PostgresStore]) -> None:
    store = stores(MEMORY)
    event = begin(store, "Thing")
    with psycopg.connect(dsn, options=f"-c search_path={MEMORY}") as connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
    before = catalogue(dsn, MEMORY)
    late = stores(MEMORY)
    for call in (
        lambda: late.count(cues.everything()),
        lambda: late.commit(Arrival(event=event)),
        lambda: late.add_types([EventType(name="Other")]),
        lambda: migrate(dsn, MEMORY),
    ):
        with pytest.raises(SchemaMismatch, match=rf"'{MEMORY}' has the newer schema 9999 .*{REVISION}.*upgrade elm"):
            call()
    assert catalogue(dsn, MEMORY) == before


_LATER = '''
"""Adds a column."""

from alembic import op

revision = "9000"
down_revision = "{revision}"


def upgrade() -> None:
    op.execute("ALTER TABLE event ADD COLUMN mood text COLLATE \\"C\\" DEFAULT 'calm'")
    op.execute("{second}")
'''


@pytest.fixture
def later_elm(tmp_path: Path) -> Callable[[str], Path]:
    """The sources of an elm with one more migration, laid out as in the wheel."""

    def make(second: str) -> Path:
        place = tmp_path / str(len(list(tmp_path.iterdir())))
        shutil.copytree(SOURCES / "elm", place / "elm", ignore=shutil.ignore_patterns("__pycache__", "data"))
        shutil.copytree(SOURCES / "alembic", place / "elm" / "_migrations")
        migration = place / "elm" / "_migrations" / "versions" / "9000_later.py"
        migration.write_text(_LATER.format(revision=REVISION, second=second))
        tables = place / "elm" / "storage" / "tables.py"
        text, replaced = re.subn(r'^REVISION = ".*"', 'REVISION = "9000"', tables.read_text(), flags=re.MULTILINE)
        assert replaced == 1
        tables.write_text(text)
        return place

    return make


def _said(script: str, *arguments: str, sources: Path) -> str:
    out, err = _start(script, *arguments, sources=sources).communicate(timeout=120)
    return out + err.strip().rpartition("\n")[2]


_COUNT = (
    "import sys; from elm import cues; from elm.storage import open_store;"
    "print(open_store(*sys.argv[1:]).count(cues.everything()))"
)


def test_memory_of_an_older_elm(
    dsn: str, stores: Callable[[str], PostgresStore], later_elm: Callable[[str], Path]
) -> None:
    event = begin(stores(MEMORY), "Thing")
    later = later_elm("SELECT 1")
    refused = (
        f"memory {MEMORY!r} has the older schema {REVISION} (this elm has 9000): run `elm migrate --memory {MEMORY}`"
    )
    assert _said(_COUNT, dsn, MEMORY, sources=later).endswith(f"SchemaMismatch: {refused}")
    done = _said(_MIGRATE, dsn, MEMORY, sources=later)
    assert done == f"migrated memory {MEMORY!r} from schema {REVISION} to 9000\n"
    assert _said(_COUNT, dsn, MEMORY, sources=later) == "1\n"
    with psycopg.connect(dsn, options=f"-c search_path={MEMORY}") as connection:
        assert connection.execute("SELECT uid, mood FROM event").fetchall() == [(event.uid, "calm")]
    with pytest.raises(SchemaMismatch, match=r"newer schema 9000.*upgrade elm"):
        stores(MEMORY).count(cues.everything())


def test_migration_that_fails_leaves_the_memory_as_it_was(
    dsn: str, stores: Callable[[str], PostgresStore], later_elm: Callable[[str], Path]
) -> None:
    event = begin(stores(MEMORY), "Thing")
    before = catalogue(dsn, MEMORY)
    said = _said(_MIGRATE, dsn, MEMORY, sources=later_elm("SELECT 1 / 0"))
    assert "StoreFailure" in said
    assert catalogue(dsn, MEMORY) == before
    assert [found.uid for found in stores(MEMORY).find(Query())] == [event.uid]


# From one schema to the next


@pytest.fixture
def first_schema(dsn: str) -> str:
    """A memory as the first migration made it, without events."""
    script = runpy.run_path(str(SOURCES / "alembic" / "versions" / "0001_memory.py"))
    with psycopg.connect(dsn) as connection:
        connection.execute("CREATE SCHEMA old")
        connection.execute("SET search_path = old, public")
        for statement in script["STATEMENTS"]:
            connection.execute(statement)
        connection.execute("CREATE TABLE alembic_version (version_num varchar(32) PRIMARY KEY)")
        connection.execute("INSERT INTO alembic_version VALUES ('0001')")
    return "old"


def test_the_first_schema_gains_a_log_and_keeps_its_inbox(
    dsn: str, first_schema: str, stores: Callable[[str], PostgresStore]
) -> None:
    """Which did not tell open events from others: those that were closed later were open, and those that still are."""
    now = stores(MEMORY)
    now.add_types([EventType(name="Thing")])
    ended, closed, going_on = (Event(type="Thing", interval=span(0, end)) for end in (1, None, None))
    events = [
        *(ended, closed, going_on),
        *(Event(type="Thing", parts=[part.uid], agent="a") for part in (ended, closed, going_on)),
    ]
    for event in events:
        now.commit(Arrival(event=event))
    now.close_event(closed.uid, at(5))
    with psycopg.connect(dsn, options=f"-c search_path={first_schema}") as connection:
        for table in ("event_type", "type_closure", "event", "part"):
            copied = sql.SQL("INSERT INTO {0} OVERRIDING SYSTEM VALUE SELECT * FROM {1}.{0}")
            connection.execute(copied.format(sql.Identifier(table), sql.Identifier(MEMORY)))
        inbox = sql.SQL(
            "INSERT INTO log_inbox (event_id, kind, agent, at)"
            " SELECT event_id, CASE kind WHEN 3 THEN 1 ELSE kind END, agent, at FROM {}.log_inbox ORDER BY n"
        )
        connection.execute(inbox.format(sql.Identifier(MEMORY)))
        kinds = connection.execute("SELECT kind FROM log_inbox ORDER BY n").fetchall()
        assert [kind for (kind,) in kinds] == [1, 1, 1, 1, 1, 1, 2, 2]
    assert migrate(dsn, first_schema) == f"migrated memory {first_schema!r} from schema 0001 to {REVISION}"
    for kind, found in catalogue(dsn, first_schema).items():
        assert found == catalogue(dsn, MEMORY)[kind]
    old = stores(first_schema)
    assert old.log.head() == now.log.head() == 8
    assert old.log.read(0, 100) == now.log.read(0, 100)
    opened = {entry.event.uid for entry in old.log.read(0, 100) if entry.event and entry.kind is LogKind.OPEN}
    assert opened == {closed.uid, going_on.uid, events[4].uid, events[5].uid}
    assert old.log.register("a", position=8).position == 8


# Side by side


NAMES = ("elm", "Elm", "armar-7", "lab.kitchen", "A", "a" * 48, "select", "Table_1")


def test_memories_of_one_database_know_nothing_of_each_other(dsn: str, stores: Callable[[str], PostgresStore]) -> None:
    memories = {name: stores(name) for name in NAMES}
    events = {name: begin(store, f"Type of {number}") for number, (name, store) in enumerate(memories.items())}
    for number, (name, store) in enumerate(memories.items()):
        (found,) = store.find(Query())
        assert (found.uid, found.id, found.type) == (events[name].uid, 1, f"Type of {number}")
        assert [each.name for each in store.types()] == [f"Type of {number}"]
        statistics = store.statistics()
        assert (statistics.events, statistics.types, statistics.frames) == (1, 1, 1)
        assert store.count(cues.within(1, elm.Region.box(0, 0, 1, 1))) == 1
    assert schemas(dsn) >= set(NAMES)
    catalogues = [catalogue(dsn, name) for name in NAMES[2:4]]
    assert [{kind: len(rows) for kind, rows in each.items()} for each in catalogues] == [
        {kind: len(rows) for kind, rows in catalogue(dsn, MEMORY).items()}
    ] * 2


def test_the_same_event_in_two_memories(stores: Callable[[str], PostgresStore]) -> None:
    kitchen, pantry = stores("kitchen"), stores("Kitchen")
    event = begin(kitchen, "Thing", "Other")
    pantry.add_types([EventType(name="Thing")])
    assert pantry.count(cues.everything()) == 0
    assert pantry.commit(Arrival(event=event)).new
    assert (kitchen.count(cues.everything()), pantry.count(cues.everything())) == (1, 1)


@pytest.mark.parametrize(
    "name",
    [
        "",
        "1st",
        "_x",
        "a b",
        "a;b",
        'a"b',
        "a'b",
        "ärger",
        "a" * 49,
        "public",
        "Public",
        "pg_x",
        "PG_catalog",
        "../x",
        5,
    ],
)
def test_names_that_are_refused(dsn: str, name: Any) -> None:
    before = schemas(dsn)
    for call in (partial(PostgresStore, dsn, name), partial(migrate, dsn, name), partial(MemoryStore, name)):
        with pytest.raises(InvalidValue, match="name"):
            call()
    assert schemas(dsn) == before
