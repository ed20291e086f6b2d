"""Creating a memory's schema and bringing it up to date, by the migrations that ship with elm."""

from __future__ import annotations

from threading import Lock

import psycopg
from alembic.config import Config
from sqlalchemy import Connection as SqlConnection
from sqlalchemy import NullPool, create_engine
from sqlalchemy.exc import DBAPIError

from alembic import command
from elm.errors import DatabaseUnfit
from elm.storage.connections import Connection, open_connection, translated
from elm.storage.installation import EXTENSIONS
from elm.storage.schema import check_revision, older_revisions, revision_of, scripts
from elm.storage.tables import REVISION
from elm.text import check_memory_name

_LOCK = 0x656C6D  # "elm": creating and migrating memories of one database take turns
_ALONE = Lock()  # alembic keeps the connection that it works on in a global of the process


def migrate(dsn: str, memory: str) -> str:
    """Create the memory, or bring its schema up to this elm's; says what was done."""
    check_memory_name(memory)
    connection = open_connection(dsn, {})
    connection.autocommit = False
    engine = create_engine("postgresql+psycopg://", creator=lambda: connection, poolclass=NullPool)
    with translated(memory):
        try:
            with engine.begin() as transaction:
                return _migrate(transaction, memory)
        except DBAPIError as error:
            if isinstance(error.orig, psycopg.Error):
                raise error.orig from error
            raise
        finally:
            engine.dispose()
            connection.close()


def _migrate(transaction: SqlConnection, memory: str) -> str:
    driver = transaction.connection.driver_connection
    assert isinstance(driver, psycopg.Connection)  # noqa: S101 - the engine was made with psycopg
    # CREATE ... IF NOT EXISTS races with itself: two processes that open a new memory must take turns.
    driver.execute("SELECT pg_advisory_xact_lock(%s)", [_LOCK])
    before = revision_of(driver, memory)
    if before == REVISION:
        return f"memory {memory!r} is up to date (schema {REVISION})"
    if before is None:
        _provide_extensions(driver)
        _provide_schema(driver, memory)
    elif before not in older_revisions():
        check_revision(before, memory)
    homes = driver.execute(
        "SELECT DISTINCT n.nspname FROM pg_extension e JOIN pg_namespace n ON n.oid = e.extnamespace"
        " WHERE e.extname = ANY(%s)",
        [list(EXTENSIONS)],
    ).fetchall()
    path = psycopg.sql.SQL(", ").join(psycopg.sql.Identifier(name) for name in (memory, *(row[0] for row in homes)))
    driver.execute(psycopg.sql.SQL("SET LOCAL search_path = {}").format(path))
    config = _config()
    config.attributes.update(connection=transaction, memory=memory)
    with _ALONE:
        command.upgrade(config, "head")
    if before is None:
        return f"created memory {memory!r} (schema {REVISION})"
    return f"migrated memory {memory!r} from schema {before} to {REVISION}"


def _provide_schema(driver: Connection, memory: str) -> None:
    # Whoever was given an empty schema may lack the right to create one.
    if driver.execute("SELECT FROM pg_namespace WHERE nspname = %s", [memory]).rowcount == 0:
        driver.execute(psycopg.sql.SQL("CREATE SCHEMA {}").format(psycopg.sql.Identifier(memory)))
        return
    tables = "SELECT FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace WHERE n.nspname = %s"
    if driver.execute(tables, [memory]).rowcount:
        raise DatabaseUnfit(
            f"the database has a schema {memory!r} that is no memory and has tables of its own: "
            f"choose another name for the memory"
        )


def _provide_extensions(driver: Connection) -> None:
    known = {row[0] for row in driver.execute("SELECT extname FROM pg_extension").fetchall()}
    for name in EXTENSIONS:
        if name in known:
            continue
        try:
            with driver.transaction():
                driver.execute(
                    psycopg.sql.SQL("CREATE EXTENSION {} SCHEMA public").format(psycopg.sql.Identifier(name))
                )
        except psycopg.errors.InsufficientPrivilege as error:
            raise DatabaseUnfit(
                f"the database lacks the extension {name}, and its user may not create it: "
                f"let a superuser run CREATE EXTENSION {name} in this database"
            ) from error
        except (psycopg.errors.UndefinedFile, psycopg.errors.FeatureNotSupported) as error:
            package = "postgresql-NN-postgis-3" if name == "postgis" else "postgresql-contrib"
            raise DatabaseUnfit(
                f"the database server does not have the extension {name}: "
                f"install it there (Debian, Ubuntu: {package}) and try again"
            ) from error


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(scripts()).replace("%", "%%"))
    return config
