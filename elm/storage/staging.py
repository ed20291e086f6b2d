"""Copying encoded events to the server: into their table, or into a temporary one from which statements take them."""

from __future__ import annotations

from collections.abc import Sequence

from elm.storage import encoding
from elm.storage import write_statements as sql
from elm.storage.connections import Connection


def stage(connection: Connection, rows: Sequence[tuple[int, int, encoding.Row]]) -> None:
    """Put rows, each with its number and its level, where the rest of the transaction finds them."""
    connection.execute(sql.CREATE_STAGING)
    count = 2 + len(encoding.COLUMNS)
    numbered = ((encoding.int4(number), encoding.int4(level), *row) for number, level, row in rows)
    copy(connection, sql.COPY_STAGING, [encoding.copied(row, count) for row in numbered])


def copy(connection: Connection, statement: str, rows: Sequence[bytes]) -> None:
    """Run a COPY with rows in its binary format."""
    with connection.cursor().copy(statement) as copying:
        copying.write(b"".join([encoding.COPY_BEGIN, *rows, encoding.COPY_END]))
