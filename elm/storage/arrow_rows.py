"""Rows of the database as Arrow columns without a Python object per value: bytes are joined, then reinterpreted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from elm.chunks import chunks_of
from elm.columns import BATCH, require_pyarrow, schema
from elm.interval import to_micros
from elm.storage.binary import (
    ARRAY_HEADER,
    BOUNDED_RANGE,
    BOUNDED_RANGE_FIELDS,
    EPOCH,
    UPPER_INFINITE,
    UUID_ELEMENT,
)
from elm.storage.rows import PAYLOAD, Column

_EPOCH_MICROS = to_micros(EPOCH)
"""PostgreSQL counts microseconds from 2000, Arrow from 1970."""
_PERIOD = np.dtype([*BOUNDED_RANGE_FIELDS])
_UID_BYTES = 16


def batches(
    rows: Iterator[Sequence[Any]],
    learn: Callable[[Sequence[Sequence[Any]]], None],
    types: Mapping[int, str],
    frames: Mapping[int, str],
) -> Iterator[Any]:
    """The rows of `recall_statements.columns` as record batches; `learn` has the names at hand that they mention."""
    pa, columns = require_pyarrow(), schema()
    for chunk in chunks_of(rows, most=BATCH, payload=itemgetter(PAYLOAD)):
        learn(chunk)
        yield pa.record_batch(_arrays(pa, columns, chunk, types, frames), schema=columns)


def _arrays(
    pa: Any, columns: Any, rows: list[Sequence[Any]], types: Mapping[int, str], frames: Mapping[int, str]
) -> list[Any]:
    given = dict(zip(Column, zip(*rows, strict=True), strict=True))
    placed: dict[Any, str | None] = {None: None, **frames}
    moment = columns.field("begin").type
    periods = b"".join(raw.ljust(BOUNDED_RANGE.size, b"\0") for raw in given[Column.PERIOD])
    period = np.frombuffer(periods, dtype=_PERIOD)
    is_open = (period["flags"] & UPPER_INFINITE) != 0
    uids = pa.Array.from_buffers(pa.binary(_UID_BYTES), len(rows), [None, pa.py_buffer(b"".join(given[Column.UID]))])
    uid_type = columns.field("uid").type
    learned = np.frombuffer(b"".join(given[Column.RECORDED_AT]), dtype=">i8")
    return [
        pa.array(given[Column.ID], pa.int64()),
        pa.ExtensionArray.from_storage(uid_type, uids) if isinstance(uid_type, pa.BaseExtensionType) else uids,
        _named(pa, given[Column.TYPE_ID], types),
        pa.array(_micros(period["begin"])).view(moment),
        pa.array(_micros(period["end"]), mask=is_open).view(moment),
        pa.array(given[Column.REGION], pa.binary()),
        _named(pa, given[Column.FRAME_ID], placed),
        pa.array(given[Column.SUBJECT], pa.binary()),
        _named(pa, given[Column.SUBJECT_FRAME_ID], placed),
        pa.array(given[Column.FEATURES], pa.string()),
        pa.array(given[Column.AGENT], pa.string()),
        pa.array(given[Column.MEDIA_TYPE], pa.string()),
        pa.array(given[Column.PAYLOAD], pa.binary()),
        _uid_lists(pa, given[Column.PARTS]),
        _uid_lists(pa, given[Column.WHOLES]),
        pa.array(_micros(learned)).view(moment),
    ]


def _micros(since_2000: Any) -> Any:
    return since_2000.astype(np.int64) + _EPOCH_MICROS


def _named(pa: Any, numbers: Sequence[Any], names: Mapping[Any, str | None]) -> Any:
    return pa.array([*map(names.__getitem__, numbers)], pa.string())


def _uid_lists(pa: Any, raws: Sequence[bytes]) -> Any:
    """Arrays of uuid[] in PostgreSQL's binary format; of each element the size comes before the uid."""
    items = [raw[ARRAY_HEADER.size :] for raw in raws]
    sizes = np.fromiter(map(len, items), dtype=np.int32, count=len(items))
    offsets = np.zeros(len(items) + 1, dtype=np.int32)
    np.cumsum(sizes // UUID_ELEMENT.size, out=offsets[1:])
    elements = np.frombuffer(b"".join(items), dtype=np.uint8).reshape(-1, UUID_ELEMENT.size)
    flat = np.ascontiguousarray(elements[:, -_UID_BYTES:])
    values = pa.Array.from_buffers(pa.binary(_UID_BYTES), len(flat), [None, pa.py_buffer(flat)])
    return pa.ListArray.from_arrays(pa.array(offsets), values)
