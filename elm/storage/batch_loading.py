"""Loading a batch by COPY: atomic events at once, complex ones level by level, with ids in the order given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from uuid import UUID

import psycopg

from elm.errors import ConflictingContent
from elm.event import content_hash
from elm.storage import staging
from elm.storage import write_statements as sql
from elm.storage.batch import Batch, parts_to_come
from elm.storage.connections import Connection, TransactionUndone
from elm.storage.event_writing import Stored, refuse_other, why_refused
from elm.storage.staging import Written
from elm.storage.tombstone_rows import forgotten_among
from elm.store import BatchReport, Refusal
from elm.tombstone import still_counts

_ATTEMPTS = 10
"""How often a batch is begun anew because another process was committing one of its events."""


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
    ids = dict(zip(fresh, staging.reserved_ids(connection, len(fresh)), strict=True))
    written = _copy_atomic(connection, batch, {index: ids[index] for index in fresh if batch.heights[index] == 0})
    complex_ones = {index: ids[index] for index in fresh if batch.heights[index] > 0}
    if complex_ones:
        own = {batch.arrivals[index].event.uid for index in fresh}
        parts = (part for index in complex_ones for part in batch.arrivals[index].event.parts)
        written += _insert_complex(connection, batch, complex_ones, [part for part in parts if part not in own])
    staging.log(connection, written, batch.now)
    taken = {each.id for each in written}
    for index, number in complex_ones.items():
        if number not in taken:
            event = batch.arrivals[index].event
            reason = why_refused(connection, event, stored(event.parts))
            if isinstance(reason, TransactionUndone):
                raise reason
            refused[index] = str(reason)
    lost = {batch.arrivals[index].event.uid for index in batch.rest if index in refused}
    doubles = {index for index in batch.repeats if batch.arrivals[index].event.uid in lost}
    refused |= dict.fromkeys(doubles, "the same event was refused earlier in this batch")
    reasons = tuple(Refusal(index=index, reason=refused[index]) for index in sorted(refused))
    existing = len(batch.arrivals) - len(taken) - len(reasons)
    return BatchReport(new=len(taken), existing=existing, refused=reasons)


def _fresh(connection: Connection, batch: Batch, stored: Stored, refused: dict[int, str]) -> list[int]:
    """The rows that are to be written: not in the memory yet, nor of other content, nor before their parts."""
    arrivals = batch.arrivals
    uids = [arrivals[index].event.uid for index in batch.rest]
    known = {UUID(bytes=uid): content for uid, content in connection.execute(sql.CONTENTS, {"uids": uids}, binary=True)}
    present = [index for index in batch.rest if arrivals[index].event.uid in known]
    for index in present:
        event = arrivals[index].event
        if known[event.uid] is None:
            refused[index] = still_counts(event.uid)
        elif known[event.uid] != content_hash(event):
            try:
                refuse_other(event, next(iter(stored([event.uid]))))
            except ConflictingContent as error:
                refused[index] = str(error)
    rest = set(batch.rest)
    later = {index: parts for index, parts in parts_to_come(arrivals).items() if index in rest}
    asked = [uid for parts in later.values() for uid in parts]
    here = {each.uid for each in stored(asked)}
    if asked:
        here |= forgotten_among(connection, asked)
    for index, parts in later.items():
        if arrivals[index].event.uid not in known and (missing := parts - here):
            named = ", ".join(sorted(map(str, missing))[:5])
            refused[index] = f"its parts {named} stand later in the load: move the whole behind them"
    return [index for index in batch.rest if arrivals[index].event.uid not in known and index not in refused]


def _copy_atomic(connection: Connection, batch: Batch, ids: Mapping[int, int]) -> list[Written]:
    arrivals = [(number, batch.arrivals[index]) for index, number in ids.items()]
    staging.copy_events(connection, ((number, batch.encode(arrival)) for number, arrival in arrivals))
    return [
        Written(number, arrival.event.interval is not None and arrival.event.interval.is_open, arrival.event.agent)
        for number, arrival in arrivals
    ]


def _insert_complex(
    connection: Connection, batch: Batch, ids: Mapping[int, int], outside: Sequence[UUID]
) -> list[Written]:
    """Write complex events, some of whose parts stand `outside` of the batch."""
    rows = ((number, batch.heights[index], batch.encode(batch.arrivals[index])) for index, number in ids.items())
    staging.stage(connection, rows)
    over_tombstones = staging.lock_parts(connection, outside)
    statement = sql.LOAD_LEVEL_OVER_TOMBSTONES if over_tombstones else sql.LOAD_LEVEL
    written: list[Written] = []
    for level in sorted({batch.heights[index] for index in ids}):
        found = connection.execute(statement, {"level": level}, binary=True)
        written += [Written(number, is_open, agent) for number, _, _, is_open, agent in found]
    return written
