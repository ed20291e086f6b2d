"""The rooms that know SQL: the stores behind the ports of elm.store, and the private server they may run on."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from elm.errors import InvalidValue

if TYPE_CHECKING:
    from elm.log import LoggedStore

IN_PROCESS = "memory://"
"""The DSN of a store in this process."""


def resolve_dsn(dsn: str | None) -> str:
    """The DSN given, else ELM_DSN, else that of the private cluster, which is started for it."""
    if dsn == "":
        # As "$DATABASE" is in a shell that does not know it: another memory than was meant must not be written.
        raise InvalidValue("an empty DSN names no database: leave it out for ELM_DSN or elm's private cluster")
    if chosen := dsn or os.environ.get("ELM_DSN"):
        return chosen
    from elm.storage.cluster import Cluster

    cluster = Cluster.default()
    cluster.up()
    return cluster.dsn()


def open_store(dsn: str | None, memory: str) -> LoggedStore:
    """The store that a DSN names; nothing is created before the first write."""
    chosen = resolve_dsn(dsn)
    if chosen == IN_PROCESS:
        from elm.storage.memory import MemoryStore

        return MemoryStore(memory=memory)
    from elm.storage.postgres import PostgresStore

    return PostgresStore(chosen, memory)


def migrate(dsn: str | None, memory: str) -> str:
    """Create a memory, or bring its schema up to this elm's; says what was done."""
    chosen = resolve_dsn(dsn)
    if chosen == IN_PROCESS:
        return f"memory {memory!r} is in this process: it has no schema to migrate"
    from elm.storage.migrations import migrate as bring_up_to_date

    return bring_up_to_date(chosen, memory)


def diagnose(dsn: str | None, memory: str) -> list[tuple[str, str]]:
    """What a maintainer would ask about the database: each line a name and what was found, failures included."""
    from elm.storage.diagnosis import diagnose as ask

    return ask(dsn, memory)
