"""Rows as stored events: how each field is decoded from PostgreSQL's binary formats, when somebody looks at it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from enum import IntEnum
from typing import Any
from uuid import UUID

import msgspec

from elm.event import Payload
from elm.features import Feature
from elm.geometry import Region
from elm.interval import Interval
from elm.storage.binary import (
    ARRAY_HEADER,
    BOUNDED_RANGE,
    EPOCH,
    INT8,
    MICROSECOND,
    OPEN_RANGE,
    UPPER_INFINITE,
    UUID_ELEMENT,
)


class Column(IntEnum):
    """Where each value of an event stands in a row of `recall_statements.columns`."""

    ID = 0
    UID = 1
    TYPE_ID = 2
    PERIOD = 3
    FRAME_ID = 4
    REGION = 5
    SUBJECT_FRAME_ID = 6
    SUBJECT = 7
    FEATURES = 8
    AGENT = 9
    MEDIA_TYPE = 10
    PAYLOAD = 11
    PARTS = 12
    WHOLES = 13
    RECORDED_AT = 14


# Plain numbers: with a member of the enumeration a row is indexed at half the speed.
_ID, _UID, TYPE_ID, _PERIOD = Column.ID.value, Column.UID.value, Column.TYPE_ID.value, Column.PERIOD.value
FRAME_ID, _REGION = Column.FRAME_ID.value, Column.REGION.value
SUBJECT_FRAME_ID, _SUBJECT = Column.SUBJECT_FRAME_ID.value, Column.SUBJECT.value
_FEATURES, _AGENT = Column.FEATURES.value, Column.AGENT.value
_MEDIA_TYPE, PAYLOAD = Column.MEDIA_TYPE.value, Column.PAYLOAD.value
_PARTS, _WHOLES, _RECORDED_AT = Column.PARTS.value, Column.WHOLES.value, Column.RECORDED_AT.value


def moment(raw: bytes) -> datetime:
    """The instant of a timestamptz in PostgreSQL's binary format."""
    micros: int = INT8.unpack(raw)[0]
    return EPOCH + MICROSECOND * micros


def _interval(raw: bytes) -> Interval:
    if raw[0] & UPPER_INFINITE:
        _, _, begin = OPEN_RANGE.unpack(raw)
        return Interval(begin=EPOCH + MICROSECOND * begin, end=None)
    _, _, begin, _, end = BOUNDED_RANGE.unpack(raw)
    return Interval(begin=EPOCH + MICROSECOND * begin, end=EPOCH + MICROSECOND * end)


def uids_of(raw: bytes) -> tuple[UUID, ...]:
    """The elements of a uuid[] in PostgreSQL's binary format."""
    return tuple(UUID(bytes=uid) for _, uid in UUID_ELEMENT.iter_unpack(raw[ARRAY_HEADER.size :]))


def _features(raw: bytes) -> tuple[Feature, ...]:
    return tuple(map(tuple, msgspec.json.decode(raw)))


def decoders(types: Mapping[int, str], frames: Mapping[int, str]) -> dict[str, Callable[[Sequence[Any]], Any]]:
    """For each field of a stored event, what reads it from a row of `recall_statements.columns`."""

    def region(row: Sequence[Any], frame_id: int, wkb: int) -> Region | None:
        return None if row[frame_id] is None else Region.from_wkb(row[wkb], frame=frames[row[frame_id]])

    def payload(row: Sequence[Any]) -> Payload | None:
        return None if row[PAYLOAD] is None else Payload(data=row[PAYLOAD], media_type=row[_MEDIA_TYPE])

    return {
        "id": lambda row: row[_ID],
        "uid": lambda row: UUID(bytes=row[_UID]),
        "type": lambda row: types[row[TYPE_ID]],
        "interval": lambda row: _interval(row[_PERIOD]),
        "region": lambda row: region(row, FRAME_ID, _REGION),
        "subject": lambda row: region(row, SUBJECT_FRAME_ID, _SUBJECT),
        "features": lambda row: _features(row[_FEATURES]),
        "agent": lambda row: row[_AGENT],
        "payload": payload,
        "parts": lambda row: uids_of(row[_PARTS]),
        "wholes": lambda row: uids_of(row[_WHOLES]),
        "recorded_at": lambda row: moment(row[_RECORDED_AT]),
    }
