"""One memory is one schema: which revision it has, and whether this elm can work with it."""

from __future__ import annotations

from pathlib import Path

import psycopg

from elm.errors import MemoryMissing, SchemaMismatch
from elm.storage.connections import Connection
from elm.storage.tables import REVISION


def revision_of(connection: Connection, memory: str) -> str | None:
    """The revision of a memory's schema; None when there is no such memory."""
    row = connection.execute(
        "SELECT 1 FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace"
        " WHERE n.nspname = %s AND c.relname = 'alembic_version'",
        [memory],
    ).fetchone()
    if row is None:
        return None
    version = connection.execute(
        psycopg.sql.SQL("SELECT version_num FROM {}.alembic_version").format(psycopg.sql.Identifier(memory))
    ).fetchone()
    return str(version[0]) if version else None


def require(connection: Connection, memory: str) -> None:
    """Refuse to work with a memory that is missing, or whose schema is not the one this elm knows."""
    revision = revision_of(connection, memory)
    if revision is None:
        raise MemoryMissing(
            f"there is no memory {memory!r} yet: the first write creates it, or `elm migrate --memory {memory}` does"
        )
    check_revision(revision, memory)


def check_revision(revision: str, memory: str) -> None:
    """Refuse a schema that is older or newer than this elm."""
    if revision == REVISION:
        return
    if revision in older_revisions():
        raise SchemaMismatch(
            f"memory {memory!r} has the older schema {revision} (this elm has {REVISION}): "
            f"run `elm migrate --memory {memory}`"
        )
    raise SchemaMismatch(f"memory {memory!r} has the newer schema {revision} (this elm has {REVISION}): upgrade elm")


def older_revisions() -> set[str]:
    """The revisions that this elm can migrate from."""
    names = {script.name.partition("_")[0] for script in (scripts() / "versions").glob("[0-9]*.py")}
    return names - {REVISION}


def scripts() -> Path:
    """Where the migrations are: elm/_migrations in the wheel, at the top level in a checkout."""
    shipped = Path(__file__).parents[1] / "_migrations"
    return shipped if shipped.is_dir() else Path(__file__).parents[2] / "alembic"
