"""What a maintainer would ask about a database, answered line by line even where something is broken."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import psycopg

from elm.errors import DatabaseUnreachable, ElmError
from elm.storage import IN_PROCESS, resolve_dsn, schema
from elm.storage.connections import Connection, check_password, open_connection
from elm.storage.planning import RECALLING
from elm.storage.tables import REVISION

_SETTINGS = """
SELECT string_agg(name || '=' || setting || coalesce(unit, ''), ', ' ORDER BY name) FROM pg_settings
WHERE name IN ('shared_buffers', 'fsync', 'synchronous_commit', 'full_page_writes', 'max_connections',
               'max_wal_size', 'work_mem', 'TimeZone', 'server_encoding', 'jit', 'plan_cache_mode')
"""
_ASKED: tuple[tuple[str, str], ...] = (
    ("server", "SELECT version()"),
    ("PostGIS", "SELECT PostGIS_Full_Version()"),
    ("extensions", "SELECT string_agg(extname || ' ' || extversion, ', ' ORDER BY extname) FROM pg_extension"),
    ("settings", _SETTINGS),
    ("database size", "SELECT pg_size_pretty(pg_database_size(current_database()))"),
    ("connections", "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database()"),
)
_SIZES = """
SELECT coalesce(string_agg(c.relname || ' ' || pg_size_pretty(pg_total_relation_size(c.oid)) || ' (about '
       || greatest(c.reltuples, 0)::bigint || ' rows)', ', ' ORDER BY c.relname), 'none')
FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace WHERE n.nspname = %s AND c.relkind = 'r'
"""
_MEMORIES = """
SELECT coalesce(string_agg(n.nspname, ', ' ORDER BY n.nspname), 'none')
FROM pg_class c JOIN pg_namespace n ON n.oid = c.relnamespace WHERE c.relname = 'alembic_version'
"""


def diagnose(dsn: str | None, memory: str) -> list[tuple[str, str]]:
    """Name and finding of each question, passwords masked; a question that fails says so in its place."""
    lines: list[tuple[str, str]] = []
    try:
        chosen = resolve_dsn(dsn)
    except ElmError as error:
        return [("DSN", f"FAILED: {error}")]
    if chosen == IN_PROCESS:
        return [("DSN", chosen), ("store", "in this process, nothing to diagnose")]
    lines.append(("DSN", masked(chosen)))
    try:
        connection = open_connection(chosen, RECALLING, memory=memory)
    except ElmError as error:
        return [*lines, ("connection", f"FAILED: {error}")]
    with connection:
        asked = [(name, partial(_first, connection, statement)) for name, statement in _ASKED]
        asked.append(("memories", partial(_first, connection, _MEMORIES)))
        asked.append((f"memory {memory}", partial(_revision, connection, memory)))
        asked.append(("tables", partial(_first, connection, _SIZES, memory)))
        return lines + [(name, _answer(ask)) for name, ask in asked]


def masked(dsn: str) -> str:
    """A DSN with its secrets hidden; one that cannot be read is not shown at all, for any part may be one."""
    if dsn.startswith("memory:"):
        return dsn
    try:
        known = psycopg.conninfo.conninfo_to_dict(dsn)
        check_password(dsn)
    except (psycopg.ProgrammingError, DatabaseUnreachable):
        return "not shown: it is no DSN that libpq can read"
    return " ".join(f"{name}={'***' if 'password' in name else value}" for name, value in known.items())


def libpq_version() -> str:
    """The version of the client library, and how psycopg comes to it."""
    return f"{psycopg.pq.version()} ({psycopg.pq.__impl__})"


def _revision(connection: Connection, memory: str) -> str:
    revision = schema.revision_of(connection, memory)
    if revision is None:
        return "does not exist yet"
    return f"schema {revision}" + ("" if revision == REVISION else f" (this elm has {REVISION})")


def _first(connection: Connection, statement: str, *given: str) -> str:
    row = connection.execute(statement, given or None).fetchone()
    return str(row[0]) if row else "nothing"


def _answer(ask: Callable[[], str]) -> str:
    try:
        return ask()
    except (ElmError, psycopg.Error) as error:
        return f"FAILED: {str(error).strip().splitlines()[0]}"
