"""Committing several events in one transaction: one after the other, or where they are many by COPY."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from uuid import UUID

from elm.errors import ConflictingContent
from elm.event import content_hash
from elm.storage import staging
from elm.storage import write_statements as sql
from elm.storage.batch import levels
from elm.storage.connections import Connection
from elm.storage.event_writing import Stored, commit, encoded, same_or_refused
from elm.storage.names import NameCache
from elm.storage.parts_first import parts_first
from elm.storage.staging import Written
from elm.store import Arrival, Committed

MANY = 16
"""From how many events on a COPY and a statement for each level take less time than one statement for each event."""


class Together:
    """Events to be committed in one transaction, encoded before it begins; they may be parts of each other."""

    def __init__(self, arrivals: Sequence[Arrival], names: NameCache) -> None:
        self._asked = [arrival.event.uid for arrival in arrivals]
        self._now = datetime.now(UTC)
        once = _once(arrivals)
        self._events = parts_first(arrival.event for arrival in once.values())
        self._rows = encoded([once[event.uid] for event in self._events], names, self._now)

    def commit(self, connection: Connection, stored: Stored) -> list[Committed]:
        """Write them within the transaction of the connection; what became of each, in the order given."""
        done = self._staged(connection) if len(self._events) >= MANY else self._one_by_one(connection)
        answers = []
        for event in self._events:
            if event.uid not in done:
                done[event.uid] = same_or_refused(connection, event, stored)
        for uid in self._asked:
            answers.append(done[uid])
            # The same event once more in one call was there already.
            done[uid] = replace(done[uid], new=False)
        return answers

    def _one_by_one(self, connection: Connection) -> dict[UUID, Committed]:
        done: dict[UUID, Committed] = {}
        for event, row in zip(self._events, self._rows, strict=True):
            committed = commit(connection, event, row, self._now)
            if committed is not None:
                done[event.uid] = committed
        return done

    def _staged(self, connection: Connection) -> dict[UUID, Committed]:
        heights = levels(self._events)
        ids = staging.reserved_ids(connection, len(heights))
        staging.stage(connection, zip(ids, heights, self._rows, strict=True))
        found = connection.execute(sql.COMMIT_STAGED, binary=True).fetchall()
        if above := sorted(set(heights) - {0}):
            own = {UUID(bytes=raw) for _, raw, existed, *_ in found if not existed}
            outside = [part for event in self._events for part in event.parts if part not in own]
            over_tombstones = staging.lock_parts(connection, outside)
            statement = sql.COMMIT_LEVEL_OVER_TOMBSTONES if over_tombstones else sql.COMMIT_LEVEL
            for level in above:
                found += connection.execute(statement, {"level": level}, binary=True).fetchall()
        written = [Written(number, is_open, agent) for number, _, existed, is_open, agent in found if not existed]
        staging.log(connection, written, self._now)
        return {
            (uid := UUID(bytes=raw)): Committed(id=number, uid=uid, new=not existed)
            for number, raw, existed, *_ in found
        }


def _once(arrivals: Iterable[Arrival]) -> dict[UUID, Arrival]:
    """The arrivals by uid; another event under a uid that stands before is refused."""
    known: dict[UUID, Arrival] = {}
    for arrival in arrivals:
        event = arrival.event
        first = known.setdefault(event.uid, arrival).event
        if first is not event and content_hash(first) != content_hash(event):
            raise ConflictingContent(f"two different events of one call have the uid {event.uid}: give one a new uid")
    return known
