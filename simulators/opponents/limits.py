"""What PostgreSQL itself takes for the same rows: the bare insert and commit, the bare COPY, the bare fetch by key.

No store on that server is faster than this, for it keeps the rows and can find nothing.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from time import perf_counter
from typing import Any
from uuid import UUID

import shapely

from elm.interval import from_micros
from simulators.bench.scratch import connect, with_setting
from simulators.bench.timing import seconds
from simulators.opponents.protocol import Record

_CREATE = """
CREATE TABLE bare_event (
    number integer PRIMARY KEY, uid uuid, type text, begins timestamptz, ends timestamptz, region bytea, features json,
    agent text, media_type text, payload bytea, parts uuid[]
)
"""
_INSERT = "INSERT INTO bare_event VALUES (%s, %s, %s, %s, %s, %s, %s, %s, %s, %s, %s)"
_FETCH = "SELECT * FROM bare_event WHERE number = ANY (%s)"


class Bare:
    """A table with all fields of the events and nothing but its primary key, through one connection."""

    def __init__(self, dsn: str, mode: str) -> None:
        setting = "on" if mode == "durable" else "off"
        self._connection = connect(with_setting(dsn, "synchronous_commit", setting))
        self._connection.execute(_CREATE)
        self._connection.execute("SET plan_cache_mode = force_generic_plan")

    def commit(self, record: Record) -> float:
        """Seconds of one insert with its commit, of a row that was made before."""
        row = _row(record)
        return seconds(lambda: self._connection.execute(_INSERT, row, prepare=True))

    def load(self, records: Sequence[Record]) -> float:
        """Seconds of one COPY, of rows that were put into COPY's binary format before."""
        with self._connection.transaction():
            self._connection.execute("CREATE TEMPORARY TABLE finished (LIKE bare_event) ON COMMIT DROP")
            with self._connection.cursor().copy("COPY finished FROM STDIN") as copy:
                for record in records:
                    copy.write_row(_row(record))
            with self._connection.cursor().copy("COPY finished TO STDOUT (FORMAT BINARY)") as copy:
                rows = b"".join(copy)
        begin = perf_counter()
        with self._connection.cursor().copy("COPY bare_event FROM STDIN (FORMAT BINARY)") as copy:
            copy.write(rows)
        taken = perf_counter() - begin
        self._connection.execute("VACUUM (ANALYZE) bare_event")
        return taken

    def fetch(self, numbers: Sequence[int]) -> float:
        """Seconds to fetch the rows of these keys as tuples."""
        asked = [list(numbers)]
        return seconds(lambda: self._connection.execute(_FETCH, asked, prepare=True, binary=True).fetchall())

    def close(self) -> None:
        """Let go of the connection."""
        self._connection.close()


def _row(record: Record) -> list[Any]:
    region = None if record.ring is None else shapely.to_wkb(shapely.Polygon(record.ring))
    begins, ends = from_micros(record.begin), from_micros(record.end)
    features = json.dumps(record.features, ensure_ascii=False)
    written = (record.agent, record.media_type, record.payload, list(map(UUID, record.parts)))
    return [record.number, UUID(record.uid), record.type, begins, ends, region, features, *written]
