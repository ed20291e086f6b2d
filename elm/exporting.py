"""Writing recalled events for others to read: JSON Lines, GeoJSON, CSV and GeoParquet."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Iterator
from typing import Any, BinaryIO, TypeVar

import msgspec

from elm.columns import without_extensions
from elm.cues.algebra import And
from elm.errors import MissingPackage
from elm.event import StoredEvent
from elm.exchange import event_to_json, to_line, tombstone_to_json
from elm.fields import time_text
from elm.geometry import Region
from elm.recollector import Recollection
from elm.tombstone import RunTombstone, Tombstone

_CHUNK = 1_000
_Item = TypeVar("_Item")

Exported = StoredEvent | Tombstone | RunTombstone
"""What stands on the lines of an export."""

CSV_COLUMNS = (
    *("id", "uid", "type", "begin", "end", "region", "region_frame", "subject", "subject_frame", "features", "agent"),
    *("media_type", "payload_bytes", "parts", "wholes", "recorded_at"),
)


def with_parts(recollection: Recollection) -> Iterator[Exported]:
    """The events of a recollection and all they are made of, in id order: parts stand before their wholes.

    Before them come the tombstones of those parts that were forgotten; of all events all tombstones, also those
    of each forgetting.
    """
    store, query = recollection.store, recollection.query
    if query.cue == And() and query.limit is None and query.after is None:
        return store.everything()
    return store.with_parts(query)


def jsonl(events: Iterable[Exported]) -> Iterator[bytes]:
    """One JSON object a line, in the exchange format that `elm load` reads."""
    for event in events:
        told = event_to_json(event) if isinstance(event, StoredEvent) else tombstone_to_json(event)
        yield to_line(told).encode() + b"\n"


def geojson(events: Iterable[StoredEvent]) -> Iterator[bytes]:
    """One FeatureCollection: the region as geometry, all else as properties; of payloads their size only.

    Coordinates are metres of the frame that the properties name, though programs may take them for degrees.
    """
    yield b'{"type": "FeatureCollection", "features": ['
    separator = b"\n"
    for event in events:
        yield separator + msgspec.json.encode(_feature(event))
        separator = b",\n"
    yield b"\n]}\n"


def comma_separated(events: Iterable[StoredEvent]) -> Iterator[bytes]:
    """A table with a header (RFC 4180): places as WKT, features as JSON, uids of one cell separated by spaces."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(CSV_COLUMNS)
    for event in events:
        writer.writerow(_cells(event))
        yield _drained(text)
    if text.tell():
        yield _drained(text)


def write_parquet(recollection: Recollection, sink: BinaryIO, *, progress: Callable[[int], None] | None = None) -> int:
    """Write the events as GeoParquet 1.1; returns how many.

    The columns are those of `Recollection.to_arrow`, uids as text: few programs know more of Arrow than that.
    `progress` is told the number of events written so far.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise MissingPackage("parquet needs the package pyarrow: pip install 'elm-memory[arrow]'") from error
    reader = recollection.to_arrow()
    plain = without_extensions(reader.schema.empty_table()).schema
    schema = plain.with_metadata({b"geo": _geoparquet()})
    written = 0
    with parquet.ParquetWriter(sink, schema, compression="zstd") as writer:
        for batch in reader:
            writer.write_table(without_extensions(pyarrow.Table.from_batches([batch])))
            written += batch.num_rows
            if progress is not None:
                progress(written)
    return written


def _geoparquet() -> bytes:
    # No coordinate reference system: the frame of each row says whose metres they are.
    column = {"encoding": "WKB", "geometry_types": ["Polygon"], "crs": None, "edges": "planar"}
    places = {"region": column, "subject": column}
    return msgspec.json.encode({"version": "1.1.0", "primary_column": "region", "columns": places})


def _feature(event: StoredEvent) -> dict[str, Any]:
    shown = event_to_json(event)
    begin, end = shown.pop("interval")
    region = shown.pop("region")
    payload = event.payload
    if payload is not None:
        shown["payload"] = {"media_type": payload.media_type, "bytes": len(payload.data)}
    return {
        "type": "Feature",
        "id": shown["uid"],
        "geometry": None if region is None else region["polygon"],
        "properties": {**shown, "begin": begin, "end": end, "frame": None if region is None else region["frame"]},
    }


def _cells(event: StoredEvent) -> list[object]:
    interval, payload = event.interval, event.payload
    return [
        event.id,
        event.uid,
        event.type,
        time_text(interval.begin),
        None if interval.end is None else time_text(interval.end),
        *_place_cells(event.region),
        *_place_cells(event.subject),
        msgspec.json.encode(event.features).decode(),
        event.agent,
        None if payload is None else payload.media_type,
        None if payload is None else len(payload.data),
        " ".join(map(str, event.parts)),
        " ".join(map(str, event.wholes)),
        time_text(event.recorded_at),
    ]


def _place_cells(region: Region | None) -> tuple[str | None, str | None]:
    return (None, None) if region is None else (region.polygon.wkt, region.frame)


def _drained(text: io.StringIO) -> bytes:
    written = text.getvalue().encode()
    text.seek(0)
    text.truncate()
    return written
