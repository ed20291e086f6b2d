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
                return _kept(connection, batch, stored) if not batch.doubles else _in_pieces(connection, batch, stored)
        except psycopg.errors.UniqueViolation:
            # COPY cannot pass over a uid that another process committed since we looked; next time we see it.
            if attempt == _ATTEMPTS - 1:
                raise
    raise AssertionError("the last attempt returns or raises")


class _Undecided(Exception):
    """A row whose uid stands earlier, in a row that was refused: it is to be kept or refused for what it is itself."""

    def __init__(self, index: int) -> None:
        super().__init__()
        self.index = index


def _in_pieces(connection: Connection, batch: Batch, stored: Stored) -> BatchReport:
    """Keep what can be kept of a batch that has rows of the same uid, as if row came after row.

    It is one piece, unless the first of such rows is refused: then it is cut before the second.
    """
    reports: list[BatchReport] = []
    start, size = 0, len(batch.arrivals)
    while start < len(batch.arrivals):
        piece = batch.cut(start, min(start + size, len(batch.arrivals)))
        if start:
            staging.clear(connection)
        try:
            with connection.transaction():
                report = _kept(connection, piece, stored)
        except _Undecided as row:
            size = row.index
            continue
        refused = tuple(Refusal(index=start + each.index, reason=each.reason) for each in report.refused)
        reports.append(BatchReport(new=report.new, existing=report.existing, refused=refused))
        start += len(piece.arrivals)
        # Where one uid is refused, others may be soon: what is tried in vain is never more than what went well.
        size = 2 * len(piece.arrivals)
    return BatchReport(
        new=sum(report.new for report in reports),
        existing=sum(report.existing for report in reports),
        refused=tuple(refusal for report in reports for refusal in report.refused),
    )


def _kept(connection: Connection, batch: Batch, stored: Stored) -> BatchReport:
    refused = dict(batch.unknown)
    fresh, present = _looked_up(connection, batch, stored, refused)
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
    _compare_doubles(batch, present, stored, refused)
    reasons = tuple(Refusal(index=index, reason=refused[index]) for index in sorted(refused))
    existing = len(batch.arrivals) - len(taken) - len(reasons)
    return BatchReport(new=len(taken), existing=existing, refused=reasons)


def _looked_up(
    connection: Connection, batch: Batch, stored: Stored, refused: dict[int, str]
) -> tuple[list[int], set[int]]:
    """The rows to be written, and those whose uid the memory has; some of either kind may be refused by now."""
    arrivals = batch.arrivals
    uids = [arrivals[index].event.uid for index in batch.rest]
    known = {UUID(bytes=uid): content for uid, content in connection.execute(sql.CONTENTS, {"uids": uids}, binary=True)}
    present = [index for index in (*batch.rest, *batch.doubles) if arrivals[index].event.uid in known]
    for index in present:
        event = arrivals[index].event
        if known[event.uid] is None:
            refused[index] = still_counts(event.uid)
        elif known[event.uid] != content_hash(event):
            there = next(iter(stored([event.uid])), None)
            if there is None:
                raise TransactionUndone(f"event {event.uid} was forgotten meanwhile. Try again")
            try:
                refuse_other(event, there)
            except ConflictingContent as error:
                refused[index] = str(error)
    later = parts_to_come(batch)
    asked = [uid for parts in later.values() for uid in parts]
    here = {each.uid for each in stored(asked)}
    if asked:
        here |= forgotten_among(connection, asked)
    for index, parts in later.items():
        if arrivals[index].event.uid not in known and (missing := parts - here):
            named = ", ".join(sorted(map(str, missing))[:5])
            refused[index] = f"its parts {named} stand later in the load: move the whole behind them"
    fresh = [index for index in batch.rest if arrivals[index].event.uid not in known and index not in refused]
    return fresh, set(present)


def _compare_doubles(batch: Batch, present: set[int], stored: Stored, refused: dict[int, str]) -> None:
    """Refuse the rows whose uid was written for an earlier row, of other content; `_Undecided` if it was not."""
    for index, first in batch.doubles.items():
        if index in present:
            continue
        if first in refused:
            raise _Undecided(index)
        event, earlier = batch.arrivals[index].event, batch.arrivals[first].event
        if event is earlier or content_hash(event) == content_hash(earlier):
            continue
        # It may say of a whole what derives of it.
        if any(content_hash(there.as_event()) == content_hash(event) for there in stored([event.uid])):
            continue
        refused[index] = f"the uid {event.uid} stands earlier with other content: give one of them a new uid"


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
