"""Why no connection to a database came about, in words that name the remedy: the server, the password or the DSN."""

from __future__ import annotations

import re

import psycopg

from elm.errors import DatabaseUnreachable

_ANSWERED = re.compile(r"\bFATAL:\s*(.*)")
"""What a server says that takes no connection; libpq puts the address in front of it."""


def unreachable(dsn: str, error: psycopg.OperationalError) -> DatabaseUnreachable:
    """The error to raise when the driver could not connect."""
    shown = psycopg.conninfo.conninfo_to_dict(dsn)
    host = str(shown.get("host") or "the local socket")
    dbname = shown.get("dbname")
    where = f"{host}, database {dbname or 'of the default name'!r}"
    # libpq's further lines ask whether the server is running, or tell of further addresses.
    lines = (str(error).strip() or "no answer").splitlines()
    said = next((found[1] for line in lines if (found := _ANSWERED.search(line))), None)
    if error.pgconn is not None and error.pgconn.needs_password:
        return DatabaseUnreachable(
            f"the server of {where} asks for a password: give it in the DSN (postgresql://user:password@...), "
            f"in PGPASSWORD or in ~/.pgpass"
        )
    if said is not None:
        return DatabaseUnreachable(f"the server of {where} answers: {said}. {_remedy(said)}")
    return DatabaseUnreachable(
        f"no database at {where}: {lines[0]}. Start the server, or correct the DSN "
        f"(--dsn or ELM_DSN; without one elm runs a private server: `elm up`)"
    )


def _remedy(said: str) -> str:
    if re.search(r'database ".*" does not exist', said):
        return "Create it (createdb), or correct the DSN (--dsn or ELM_DSN)"
    if "password authentication failed" in said:
        return "Correct the user or the password in the DSN, in PGPASSWORD or in ~/.pgpass"
    if "does not exist" in said or "authentication failed" in said or "pg_hba.conf" in said:
        return "Correct the user in the DSN (--dsn or ELM_DSN), or have the server let that user in (pg_hba.conf)"
    return "Try again, or correct the DSN (--dsn or ELM_DSN)"
