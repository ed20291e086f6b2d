"""One memory is one schema: what it may be called, which revision it has, and whether this elm can work with it."""

from __future__ import annotations

import re
from pathlib import Path

import psycopg

from elm.errors import InvalidValue, MemoryMissing, SchemaMismatch
from elm.storage.connections import Connection
from elm.storage.tables import REVISION

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_.-]{0,47}")
_RESERVED = {"public", "information_schema", "topology", "tiger", "tiger_data"}
EXTENSIONS = ("postgis", "btree_gist")


def check_memory_name(name: str) -> str:
    """`name`, when it can be a memory's and its schema's."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InvalidValue(
            f"a memory's name is up to 48 letters, digits, '_', '-' and '.', a letter first, not {name!r}"
        )
    if name.lower() in _RESERVED or name.lower().startswith("pg_"):
        raise InvalidValue(f"{name!r} is a name that PostgreSQL keeps for itself: choose another")
    return name


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
