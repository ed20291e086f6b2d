"""Loading a batch by COPY: atomic events at once, complex ones level by level, refusals told apart."""

from __future__ import annotations

from uuid import UUID

import psycopg

from elm.errors import ConflictingContent
from elm.storage import encoding
from elm.storage import write_statements as sql
from elm.storage.batch import Batch, parts_to_come
from elm.storage.connections import Connection
from elm.storage.event_writing import Stored, refuse_other, why_refused
from elm.storage.staging import copy, stage
from elm.store import BatchReport, Refusal

_ATTEMPTS = 10
"""How often a batch is begun anew because another process was committing one of its events."""
_CONTENT = encoding.COLUMNS.index("content")


def load(connection: Connection, batch: Batch, stored: Stored) -> BatchReport:
    """Keep what can be kept of a batch, in one transaction."""
    for attempt in range(_ATTEMPTS):
        try:
            with connection.transaction():
                return _load(connection, batch, stored)
        except psycopg.errors.UniqueViolation:
            # COPY cannot pass over a uid that another process committed since we looked; next time we see it.
            if attempt == _ATTEMPTS - 1:
                raise
    raise AssertionError("the last attempt returns or raises")


def _load(connection: Connection, batch: Batch, stored: Stored) -> BatchReport:
    refused = dict(batch.refused)
    fresh = _fresh(connection, batch, stored, refused)
    taken = _copy_atomic(connection, batch, [index for index in fresh if batch.heights[index] == 0])
    complex_ones = [index for index in fresh if batch.heights[index] > 0]
    if complex_ones:
        taken |= _insert_complex(connection, batch, complex_ones)
    for index in complex_ones:
        event = batch.arrivals[index].event
        if event.uid not in taken:
            refused[index] = str(why_refused(event, stored(event.parts)))
    lost = {batch.arrivals[index].event.uid for index in refused.keys() & batch.rows.keys()}
    doubles = {index for index in batch.repeats if batch.arrivals[index].event.uid in lost}
    refused |= dict.fromkeys(doubles, "the same event was refused earlier in this batch")
    reasons = tuple(Refusal(index=index, reason=refused[index]) for index in sorted(refused))
    existing = len(batch.arrivals) - len(taken) - len(reasons)
    return BatchReport(new=len(taken), existing=existing, refused=reasons)


def _fresh(connection: Connection, batch: Batch, stored: Stored, refused: dict[int, str]) -> list[int]:
    """The rows that are to be written: not in the memory yet, nor of other content, nor before their parts."""
    arrivals = batch.arrivals
    uids = [arrivals[index].event.uid for index in batch.rows]
    known = {UUID(bytes=uid): content for uid, content in connection.execute(sql.CONTENTS, [uids], binary=True)}
    present = [index for index in batch.rows if arrivals[index].event.uid in known]
    for index in present:
        event = arrivals[index].event
        if known[event.uid] != batch.rows[index][_CONTENT]:
            try:
                refuse_other(event, next(iter(stored([event.uid]))))
            except ConflictingContent as error:
                refused[index] = str(error)
    later = {index: parts for index, parts in parts_to_come(arrivals).items() if index in batch.rows}
    here = {each.uid for each in stored([uid for parts in later.values() for uid in parts])}
    for index, parts in later.items():
        if arrivals[index].event.uid not in known and (missing := parts - here):
            named = ", ".join(sorted(map(str, missing))[:5])
            refused[index] = f"its parts {named} stand later in the load: move the whole behind them"
    return [index for index in batch.rows if arrivals[index].event.uid not in known and index not in refused]


def _copy_atomic(connection: Connection, batch: Batch, indexes: list[int]) -> set[UUID]:
    if not indexes:
        return set()
    count = len(encoding.COLUMNS)
    copy(connection, sql.COPY_EVENTS, [encoding.copied(batch.rows[index], count) for index in indexes])
    uids = [batch.arrivals[index].event.uid for index in indexes]
    connection.execute(sql.LOG_COPIED, {"uids": uids, "now": batch.now})
    return set(uids)


def _insert_complex(connection: Connection, batch: Batch, indexes: list[int]) -> set[UUID]:
    stage(connection, [(index, batch.heights[index], batch.rows[index]) for index in indexes])
    connection.execute(sql.LOCK_OPEN_PARTS)
    taken: set[UUID] = set()
    for level in sorted({batch.heights[index] for index in indexes}):
        found = connection.execute(sql.LOAD_LEVEL, {"level": level, "now": batch.now}, binary=True)
        taken |= {UUID(bytes=uid) for _, uid, _ in found}
    return taken
