"""Rows of the database as Arrow columns without a Python object per value: bytes are joined, then reinterpreted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np

from elm.columns import BATCH, require_pyarrow, schema
from elm.storage.rows import BOUNDED_BYTES, FRAME_ID, SUBJECT_FRAME_ID, TYPE_ID, UPPER_INFINITE

_PG_EPOCH_MICROS = 946_684_800_000_000
"""PostgreSQL counts microseconds from 2000, Arrow from 1970."""

_PERIOD = np.dtype([("flags", "u1"), ("size", ">i4"), ("begin", ">i8"), ("size2", ">i4"), ("end", ">i8")])
_UID_HEADER, _UID_ITEM = 20, 20


def batches(
    rows: Iterator[Sequence[Any]],
    learn: Callable[[Sequence[Sequence[Any]]], None],
    types: Mapping[int, str],
    frames: Mapping[int, str],
) -> Iterator[Any]:
    """The rows of `recall_statements.columns` as record batches; `learn` has the names at hand that they mention."""
    pa, columns = require_pyarrow(), schema()
    while chunk := list(islice(rows, BATCH)):
        learn(chunk)
        yield pa.record_batch(_arrays(pa, columns, chunk, types, frames), schema=columns)


def _arrays(
    pa: Any, columns: Any, rows: list[Sequence[Any]], types: Mapping[int, str], frames: Mapping[int, str]
) -> list[Any]:
    given = list(zip(*rows, strict=True))
    moment = columns.field("begin").type
    period = np.frombuffer(b"".join(raw.ljust(BOUNDED_BYTES, b"\0") for raw in given[3]), dtype=_PERIOD)
    is_open = (period["flags"] & UPPER_INFINITE) != 0
    uids = pa.Array.from_buffers(pa.binary(16), len(rows), [None, pa.py_buffer(b"".join(given[1]))])
    uid_type = columns.field("uid").type
    learned = np.frombuffer(b"".join(given[14]), dtype=">i8")
    return [
        pa.array(given[0], pa.int64()),
        pa.ExtensionArray.from_storage(uid_type, uids) if isinstance(uid_type, pa.BaseExtensionType) else uids,
        _named(pa, given[TYPE_ID], types),
        pa.array(_micros(period["begin"])).view(moment),
        pa.array(_micros(period["end"]), mask=is_open).view(moment),
        pa.array(given[FRAME_ID + 1], pa.binary()),
        _named(pa, given[FRAME_ID], frames),
        pa.array(given[SUBJECT_FRAME_ID + 1], pa.binary()),
        _named(pa, given[SUBJECT_FRAME_ID], frames),
        pa.array(given[8], pa.string()),
        pa.array(given[9], pa.string()),
        pa.array(given[10], pa.string()),
        pa.array(given[11], pa.binary()),
        _uid_lists(pa, given[12]),
        _uid_lists(pa, given[13]),
        pa.array(_micros(learned)).view(moment),
    ]


def _micros(since_2000: Any) -> Any:
    return since_2000.astype(np.int64) + _PG_EPOCH_MICROS


def _named(pa: Any, numbers: Sequence[int | None], names: Mapping[int, str]) -> Any:
    return pa.array([None if number is None else names[number] for number in numbers], pa.string())


def _uid_lists(pa: Any, raws: Sequence[bytes]) -> Any:
    """Arrays of uuid[] in PostgreSQL's binary format: a header of 20 bytes, then (length, 16 bytes) each."""
    items = [raw[_UID_HEADER:] for raw in raws]
    counts = np.fromiter((len(item) // _UID_ITEM for item in items), dtype=np.int32, count=len(items))
    offsets = np.zeros(len(items) + 1, dtype=np.int32)
    np.cumsum(counts, out=offsets[1:])
    flat = np.frombuffer(b"".join(items), dtype=np.uint8).reshape(-1, _UID_ITEM)[:, 4:]
    values = pa.Array.from_buffers(pa.binary(16), len(flat), [None, pa.py_buffer(np.ascontiguousarray(flat))])
    return pa.ListArray.from_arrays(pa.array(offsets), values)
