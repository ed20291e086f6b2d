"""Committing several events in one transaction: one after the other, or where they are many by COPY."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from uuid import UUID

from elm.storage import write_statements as sql
from elm.storage.batch import levels
from elm.storage.connections import Connection
from elm.storage.event_writing import Stored, commit, encoded, same_or_refused, wholes_last
from elm.storage.names import NameCache
from elm.storage.staging import stage
from elm.store import Arrival, Committed

MANY = 16
"""From how many events on a COPY and a statement for each level take less time than one statement for each event."""


class Together:
    """Events to be committed in one transaction, encoded before it begins; they may be parts of each other."""

    def __init__(self, arrivals: Sequence[Arrival], names: NameCache) -> None:
        self._asked = [arrival.event.uid for arrival in arrivals]
        self._now = datetime.now(UTC)
        ordered = wholes_last(arrivals)
        self._events = [arrival.event for arrival in ordered]
        self._rows = encoded(ordered, names, self._now)

    def commit(self, connection: Connection, stored: Stored) -> list[Committed]:
        """Write them within the transaction of the connection; what became of each, in the order given."""
        done = self._staged(connection) if len(self._events) >= MANY else self._one_by_one(connection)
        answers = []
        for event in self._events:
            if event.uid not in done:
                done[event.uid] = same_or_refused(event, stored)
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
        stage(connection, list(zip(range(len(heights)), heights, self._rows, strict=True)))
        found = connection.execute(sql.COMMIT_STAGED, {"now": self._now}, binary=True).fetchall()
        if above := sorted(set(heights) - {0}):
            connection.execute(sql.LOCK_OPEN_PARTS)
        for level in above:
            found += connection.execute(sql.COMMIT_LEVEL, {"level": level, "now": self._now}, binary=True).fetchall()
        return {
            (uid := UUID(bytes=raw)): Committed(id=number, uid=uid, new=not existed) for number, raw, existed in found
        }
