"""elm, as its users use it: commits, loads and recalls Event objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from uuid import UUID

from shapely.geometry import Polygon

import elm
from elm.cli.diagnosis import elm_version
from elm.event import Event, Payload, StoredEvent
from elm.geometry import Region
from elm.interval import Interval, from_micros
from elm.taxonomy import EventType
from simulators.bench.scratch import connect, with_setting
from simulators.opponents.asking import recollection
from simulators.opponents.protocol import Question, Record, Workload, everything_but, serve


class ElmSide:
    """A memory in a database of its own."""

    name = "elm_side"
    title = "elm"
    why = (
        "One table of events with an index for each component of a cue, a stored closure of the types, "
        "one statement a recall."
    )
    durability: Mapping[str, str] = MappingProxyType(
        {
            "durable": "PostgreSQL, synchronous_commit=on: a commit waits for the disk",
            "relaxed": "PostgreSQL, synchronous_commit=off",
        }
    )
    abilities = everything_but({})

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        if dsn is None:
            raise ValueError("elm's side is given the DSN of a database of its own")
        self._dsn = with_setting(dsn, "synchronous_commit", "on" if mode == "durable" else "off")
        self._memory = elm.connect(self._dsn, "elm")
        self._memory.add_types(EventType(name=name, parents=parents) for name, parents in workload.types)

    def version(self) -> str:
        """Those of elm, PostgreSQL and PostGIS."""
        with connect(self._dsn) as connection:
            row = connection.execute("SELECT current_setting('server_version'), PostGIS_Lib_Version()").fetchone()
        assert row is not None  # noqa: S101 - a select without FROM has a row
        return f"{elm_version()}, PostgreSQL {row[0]}, PostGIS {row[1]}"

    def commit(self, record: Record) -> object:
        """Commit it as an event; of a complex one the extents derive anew."""
        return self._memory.commit(_event(record))

    def load(self, records: Sequence[Record]) -> object:
        """Load them as events; ends with VACUUM (ANALYZE)."""
        report = self._memory.load(map(_event, records))
        if report.new != len(records):
            raise ValueError(f"of {len(records):,} events elm kept {report.new:,} as new")
        return report

    def ask(self, question: Question) -> Sequence[StoredEvent]:
        """Recall the events as objects."""
        return list(recollection(self._memory, question))

    def uid_of(self, row: StoredEvent) -> str:
        """Its uid."""
        return row.uid.hex

    def close(self) -> None:
        """Close the memory."""
        self._memory.close()


def _event(record: Record) -> Event:
    is_complex = bool(record.parts)
    interval = Interval(begin=from_micros(record.begin), end=from_micros(record.end))
    region = None if record.ring is None or is_complex else Region(polygon=Polygon(record.ring))
    payload = (
        Payload(data=record.payload)
        if record.media_type is None
        else Payload(data=record.payload, media_type=record.media_type)
    )
    return Event(
        type=record.type,
        interval=None if is_complex else interval,
        region=region,
        features=record.features,
        agent=record.agent,
        payload=payload,
        parts=[UUID(hex=uid) for uid in record.parts],
        uid=UUID(hex=record.uid),
    )


if __name__ == "__main__":
    serve(ElmSide)
