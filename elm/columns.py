"""Events as Arrow columns, places as GeoArrow WKB, which data frames and other languages read without loss."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any
from uuid import UUID

import msgspec

from elm.chunks import chunks_of
from elm.errors import MissingPackage
from elm.event import StoredEvent
from elm.geometry import Region

BATCH = 10_000
"""Events in a record batch unless asked otherwise, or large payloads fill it before."""


def require_pyarrow() -> Any:
    """The optional package pyarrow, or how to get it."""
    try:
        import pyarrow
    except ImportError as error:
        raise MissingPackage("Arrow tables need the package pyarrow: pip install 'elm-memory[arrow]'") from error
    return pyarrow


def schema() -> Any:
    """The pyarrow.Schema of events; `uid` is Arrow's UUID extension type where the pyarrow at hand has it."""
    pa = require_pyarrow()
    moment = pa.timestamp("us", tz="UTC")
    wkb = {"ARROW:extension:name": "geoarrow.wkb", "ARROW:extension:metadata": "{}"}
    return pa.schema(
        [
            pa.field("id", pa.int64(), nullable=False),
            pa.field("uid", pa.uuid() if hasattr(pa, "uuid") else pa.binary(16), nullable=False),
            pa.field("type", pa.string(), nullable=False),
            pa.field("begin", moment, nullable=False),
            pa.field("end", moment),
            pa.field("region", pa.binary(), metadata=wkb),
            pa.field("region_frame", pa.string()),
            pa.field("subject", pa.binary(), metadata=wkb),
            pa.field("subject_frame", pa.string()),
            pa.field("features", pa.string(), nullable=False),
            pa.field("agent", pa.string()),
            pa.field("media_type", pa.string()),
            pa.field("payload", pa.binary()),
            pa.field("parts", pa.list_(pa.binary(16)), nullable=False),
            pa.field("wholes", pa.list_(pa.binary(16)), nullable=False),
            pa.field("recorded_at", moment, nullable=False),
        ]
    )


def batches_of(events: Iterable[StoredEvent], size: int = BATCH) -> Iterator[Any]:
    """The events as pyarrow.RecordBatches of at most `size` rows, fewer of large payloads, each made when asked for."""
    pa, columns = require_pyarrow(), schema()
    for chunk in chunks_of(events, most=size, payload=_payload):
        values = _columns(chunk)
        yield pa.record_batch([_array(pa, values[field.name], field.type) for field in columns], schema=columns)


def reader_of(batches: Iterable[Any]) -> Any:
    """Record batches in `schema()` as one pyarrow.RecordBatchReader."""
    return require_pyarrow().RecordBatchReader.from_batches(schema(), batches)


def _columns(events: list[StoredEvent]) -> dict[str, list[Any]]:
    return {
        "id": [event.id for event in events],
        "uid": [event.uid.bytes for event in events],
        "type": [event.type for event in events],
        "begin": [event.interval.begin for event in events],
        "end": [event.interval.end for event in events],
        **_place("region", [event.region for event in events]),
        **_place("subject", [event.subject for event in events]),
        "features": [msgspec.json.encode(event.features).decode() for event in events],
        "agent": [event.agent for event in events],
        "media_type": [None if event.payload is None else event.payload.media_type for event in events],
        "payload": [*map(_payload, events)],
        "parts": [[part.bytes for part in event.parts] for event in events],
        "wholes": [[whole.bytes for whole in event.wholes] for event in events],
        "recorded_at": [event.recorded_at for event in events],
    }


def _payload(event: StoredEvent) -> bytes | None:
    return None if event.payload is None else event.payload.data


def _place(name: str, regions: list[Region | None]) -> dict[str, list[Any]]:
    return {
        name: [None if region is None else region.wkb for region in regions],
        f"{name}_frame": [None if region is None else region.frame for region in regions],
    }


def _array(pa: Any, values: list[Any], kind: Any) -> Any:
    if isinstance(kind, pa.BaseExtensionType):
        return pa.ExtensionArray.from_storage(kind, pa.array(values, kind.storage_type))
    return pa.array(values, kind)


def without_extensions(table: Any) -> Any:
    """A pyarrow.Table of events for programs that know no extension types: uids as text, WKB as plain binary."""
    pa = require_pyarrow()
    kinds = {"uid": pa.string(), "parts": pa.list_(pa.string()), "wholes": pa.list_(pa.string())}
    columns, fields = [], []
    for field, column in zip(table.schema, table.columns, strict=True):
        if isinstance(field.type, pa.BaseExtensionType):
            column = pa.chunked_array([chunk.storage for chunk in column.chunks], field.type.storage_type)
        kind = kinds.get(field.name, column.type)
        if field.name in kinds:
            column = pa.array(_texts(column.to_pylist()), kind)
        columns.append(column)
        fields.append(pa.field(field.name, kind, nullable=field.nullable))
    return pa.table(columns, schema=pa.schema(fields))


def _texts(values: list[Any]) -> list[Any]:
    return [[str(UUID(bytes=item)) for item in v] if isinstance(v, list) else str(UUID(bytes=v)) for v in values]
