"""A database for each side that works in PostgreSQL: its own, on the one server, dropped at the end."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from uuid import uuid4

import psycopg
from psycopg import sql

from elm.errors import DatabaseUnfit
from simulators.bench.scratch import connect

PREFIX = "bench_"


@contextmanager
def template(dsn: str) -> Iterator[str]:
    """The name of a new database with PostGIS, to make others from: a copy takes a tenth of the time."""
    with _database(dsn, "template", "template0") as (name, address):
        with connect(address) as connection:
            connection.execute("CREATE EXTENSION IF NOT EXISTS postgis")
        yield name


@contextmanager
def own_database(dsn: str, side: str, model: str) -> Iterator[str]:
    """The DSN of a new database like `model`; when it goes, so do the new roles that begin with the side's name."""
    with connect(dsn) as connection:
        known = _roles(connection, side)
    try:
        with _database(dsn, side, model) as (_, address):
            yield address
    finally:
        with connect(dsn) as connection:
            for role in _roles(connection, side) - known:
                connection.execute(sql.SQL("DROP ROLE {}").format(sql.Identifier(role)))


@contextmanager
def _database(dsn: str, what: str, model: str) -> Iterator[tuple[str, str]]:
    name = f"{PREFIX}{what}_{uuid4().hex[:12]}"
    with connect(dsn) as connection:
        try:
            connection.execute(
                sql.SQL("CREATE DATABASE {} TEMPLATE {}").format(sql.Identifier(name), sql.Identifier(model))
            )
        except psycopg.errors.InsufficientPrivilege as error:
            raise DatabaseUnfit(
                "each side is measured in a database of its own, which this user cannot create: "
                "give --dsn of one with CREATEDB, or leave it out for the private cluster"
            ) from error
    try:
        yield name, psycopg.conninfo.make_conninfo(dsn, dbname=name)
    finally:
        with connect(dsn) as connection:
            connection.execute(sql.SQL("DROP DATABASE IF EXISTS {} WITH (FORCE)").format(sql.Identifier(name)))


def size(dsn: str) -> int:
    """Bytes on disk of the database, as all its committed work stands."""
    with connect(dsn) as connection:
        row = connection.execute("SELECT pg_database_size(current_database())").fetchone()
    return int(row[0]) if row else 0


def _roles(connection: psycopg.Connection[tuple[object, ...]], side: str) -> set[str]:
    found = connection.execute("SELECT rolname FROM pg_roles WHERE starts_with(rolname, %s)", [side])
    return {str(name) for (name,) in found}
