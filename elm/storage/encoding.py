"""Events as rows: the columns that are written, each in PostgreSQL's binary format, ready to be sent as they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from uuid import UUID

import msgspec

from elm.event import Event, content_hash
from elm.features import Feature, ends, fold, name_tokens
from elm.geometry import Region
from elm.interval import Interval
from elm.storage.binary import (
    ARRAY_HEADER,
    BOTH_INCLUSIVE,
    BOUNDED_RANGE,
    EMPTY_ARRAY,
    EPOCH,
    INT2,
    INT4,
    INT8,
    LOWER_INCLUSIVE_UPPER_INFINITE,
    MICROSECOND,
    OPEN_RANGE,
    TEXT_TYPE,
    UUID_ELEMENT,
    UUID_TYPE,
)

COLUMNS = (
    "uid",
    "type_id",
    "period",
    "frame_id",
    "region",
    "subject_frame_id",
    "subject",
    "feature_tokens",
    "feature_names",
    "features",
    "agent",
    "media_type",
    "payload",
    "parts",
    "recorded_at",
    "content",
    "feature_ends",
)
"""The order in which a row's values stand, and the parameters $1, $2 ... of the write statements."""

Row = tuple[bytes | None, ...]

int2: Callable[[int], bytes] = INT2.pack
"""An integer of 16 bits."""
int4: Callable[[int], bytes] = INT4.pack
"""An integer of 32 bits."""
int8: Callable[[int], bytes] = INT8.pack
"""An integer of 64 bits."""
_bounded, _open = BOUNDED_RANGE.pack, OPEN_RANGE.pack
_array, _no_array, _uuid_element = ARRAY_HEADER.pack, EMPTY_ARRAY.pack, UUID_ELEMENT.pack


def timestamp(moment: datetime) -> bytes:
    """A UTC datetime as timestamptz."""
    return int8((moment - EPOCH) // MICROSECOND)


def period(interval: Interval) -> bytes:
    """An interval as tstzrange: both ends inclusive, or no upper end."""
    begin = (interval.begin - EPOCH) // MICROSECOND
    if interval.end is None:
        return _open(LOWER_INCLUSIVE_UPPER_INFINITE, 8, begin)
    return _bounded(BOTH_INCLUSIVE, 8, begin, 8, (interval.end - EPOCH) // MICROSECOND)


def uuids(uids: Sequence[UUID]) -> bytes:
    """Several uids as uuid[]."""
    if not uids:
        return _no_array(0, 0, UUID_TYPE)
    return _array(1, 0, UUID_TYPE, len(uids), 1) + b"".join([_uuid_element(16, uid.bytes) for uid in uids])


def texts(values: Sequence[str]) -> bytes:
    """Several texts as text[]."""
    if not values:
        return _no_array(0, 0, TEXT_TYPE)
    items = [_array(1, 0, TEXT_TYPE, len(values), 1)]
    for value in values:
        data = value.encode()
        items += (int4(len(data)), data)
    return b"".join(items)


def row(event: Event, *, types: Mapping[str, int], frames: Mapping[str, int], recorded_at: datetime) -> Row:
    """The values of an event's `COLUMNS`; None is NULL. Extents of a complex event are those given, if any."""
    payload, feature_tokens = event.payload, sorted(map(fold, event.canonical_features))
    return (
        event.uid.bytes,
        int4(types[event.type]),
        None if event.interval is None else period(event.interval),
        *_place(event.region, frames),
        *_place(event.subject, frames),
        texts(feature_tokens),
        texts(name_tokens(name for name, _ in event.features)),
        _features(event.features),
        None if event.agent is None else event.agent.encode(),
        None if payload is None else payload.media_type.encode(),
        None if payload is None else payload.data,
        uuids(event.parts),
        timestamp(recorded_at),
        content_hash(event),
        int8(ends(feature_tokens)),
    )


def _features(features: Sequence[Feature]) -> bytes:
    """The pairs as JSON, each number with all its digits: SQL compares what it reads there exactly."""
    exact = [
        (name, msgspec.Raw(f"{int(value)}.0".encode()))
        if isinstance(value, float) and abs(value) >= _SHORTENED
        else (name, value)
        for name, value in features
    ]
    return msgspec.json.encode(exact)


_SHORTENED = 2.0**53
"""From here on floats are integers of which the shortest text that names them leaves digits out."""


def _place(region: Region | None, frames: Mapping[str, int]) -> tuple[bytes | None, bytes | None]:
    return (None, None) if region is None else (int4(frames[region.frame]), region.wkb)


COPY_BEGIN = b"PGCOPY\n\xff\r\n\x00" + bytes(8)
"""What a binary COPY begins with."""
COPY_END = b"\xff\xff"
"""What a binary COPY ends with."""


def copied(values: Row) -> bytes:
    """One row of values in the format of a binary COPY."""
    pieces = [len(values).to_bytes(2)]
    for value in values:
        pieces += (b"\xff\xff\xff\xff",) if value is None else (int4(len(value)), value)
    return b"".join(pieces)
