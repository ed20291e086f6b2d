"""Rows as stored events: how each field is decoded from PostgreSQL's binary formats, when somebody looks at it."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID

import msgspec

from elm.event import Payload
from elm.features import Feature
from elm.geometry import Region
from elm.interval import Interval

# Where the columns of `recall_statements.columns` stand that are numbers of names.
TYPE_ID, FRAME_ID, SUBJECT_FRAME_ID = 2, 4, 6

_PG_EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
_INT64 = struct.Struct("!q")
_BOUNDED = struct.Struct("!Biqiq")
_OPEN = struct.Struct("!Biq")
UPPER_INFINITE = 0x10
"""The bit of a range's first byte that says it has no upper bound."""
BOUNDED_BYTES = _BOUNDED.size
"""How long a tstzrange with both bounds is in PostgreSQL's binary format."""


def moment(raw: bytes) -> datetime:
    """The instant of a timestamptz in PostgreSQL's binary format."""
    return _PG_EPOCH + timedelta(microseconds=_INT64.unpack(raw)[0])


def _interval(raw: bytes) -> Interval:
    if raw[0] & UPPER_INFINITE:
        _, _, begin = _OPEN.unpack(raw)
        return Interval(begin=_PG_EPOCH + timedelta(microseconds=begin), end=None)
    _, _, begin, _, end = _BOUNDED.unpack(raw)
    return Interval(begin=_PG_EPOCH + timedelta(microseconds=begin), end=_PG_EPOCH + timedelta(microseconds=end))


def uids_of(raw: bytes) -> tuple[UUID, ...]:
    """The elements of a uuid[] in PostgreSQL's binary format: a header of 20 bytes, then (length, 16 bytes) each."""
    return tuple(UUID(bytes=raw[at : at + 16]) for at in range(24, len(raw), 20))


def _features(raw: bytes) -> tuple[Feature, ...]:
    return tuple(map(tuple, msgspec.json.decode(raw)))


def decoders(types: Mapping[int, str], frames: Mapping[int, str]) -> dict[str, Callable[[Sequence[Any]], Any]]:
    """For each field of a stored event, what reads it from a row of `recall_statements.columns`."""

    def region(row: Sequence[Any], at: int) -> Region | None:
        return None if row[at] is None else Region.from_wkb(row[at + 1], frame=frames[row[at]])

    def payload(row: Sequence[Any]) -> Payload | None:
        return None if row[11] is None else Payload(data=row[11], media_type=row[10])

    return {
        "id": lambda row: row[0],
        "uid": lambda row: UUID(bytes=row[1]),
        "type": lambda row: types[row[TYPE_ID]],
        "interval": lambda row: _interval(row[3]),
        "region": lambda row: region(row, FRAME_ID),
        "subject": lambda row: region(row, SUBJECT_FRAME_ID),
        "features": lambda row: _features(row[8]),
        "agent": lambda row: row[9],
        "payload": payload,
        "parts": lambda row: uids_of(row[12]),
        "wholes": lambda row: uids_of(row[13]),
        "recorded_at": lambda row: moment(row[14]),
    }
