"""Memories to measure in: in a real database, made for one measurement and dropped at its end, come what may."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from uuid import uuid4

import psycopg
from psycopg import sql

from elm.errors import DatabaseUnfit, DatabaseUnreachable
from elm.storage import IN_PROCESS, migrate, resolve_dsn

Connection = psycopg.Connection[Any]


def database(dsn: str | None) -> str:
    """The DSN given, else that of ELM_DSN or of the private cluster; a store in this process is refused."""
    chosen = resolve_dsn(dsn)
    if chosen == IN_PROCESS:
        raise DatabaseUnfit(f"{IN_PROCESS} has no statements to measure against: give --dsn a PostgreSQL database")
    return chosen


def connect(dsn: str) -> Connection:
    """A plain connection in autocommit mode, with nothing of elm's settings."""
    try:
        return psycopg.connect(dsn, autocommit=True)
    except psycopg.Error as error:
        raise DatabaseUnreachable(f"no connection for the measurement: {str(error).strip()}. Look at --dsn") from error


def with_setting(dsn: str, name: str, value: str) -> str:
    """The DSN, with a server setting that every connection through it begins with."""
    known = psycopg.conninfo.conninfo_to_dict(dsn).get("options") or ""
    return psycopg.conninfo.make_conninfo(dsn, options=f"{known} -c {name}={value}".strip())


def bare_schema(memory: str) -> str:
    """The schema beside a scratch memory for the tables that it is compared with."""
    return f"{memory}_bare"


@contextmanager
def scratch_memory(dsn: str) -> Iterator[str]:
    """The name of a new, empty memory, and an empty schema beside it; both are dropped at the end."""
    memory = f"bench_{uuid4().hex[:12]}"
    schemas = (memory, bare_schema(memory))
    try:
        migrate(dsn, memory)
        with connect(dsn) as connection:
            connection.execute(sql.SQL("CREATE SCHEMA {}").format(sql.Identifier(bare_schema(memory))))
        yield memory
    finally:
        with connect(dsn) as connection:
            for schema in schemas:
                connection.execute(sql.SQL("DROP SCHEMA IF EXISTS {} CASCADE").format(sql.Identifier(schema)))
