"""What a memory in PostgreSQL forgets: the part of its store that has to do with tombstones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from uuid import UUID

from elm.geometry import Region
from elm.storage import batch_forgetting, tombstone_rows
from elm.storage.connections import repeated
from elm.storage.session import Session
from elm.store import BatchReport, ForgettingCount
from elm.tombstone import Forgotten, RunTombstone, Tombstone


class PostgresForgetting:
    """Forgetting, and the tombstones, over one schema of a PostgreSQL database."""

    _session: Session

    @repeated
    def forget(self, ids: Sequence[int], *, run: UUID, at: datetime) -> Forgotten:
        """Forget those of these events that have ended, in one transaction, as a piece of the forgetting `run`."""
        self._session.ready_to_write()
        with self._session.connections.writing() as connection:
            return batch_forgetting.forget(connection, ids, run, at, self._session.type_names)

    def would_forget(self, ids: Sequence[int]) -> Forgotten:
        """What forgetting these events would do; nothing is changed."""
        self._session.ready_to_recall()
        with self._session.connections.recalling() as connection:
            return batch_forgetting.would_forget(connection, ids, self._session.type_names)

    def tombstones(self, uids: Sequence[UUID] | None = None) -> Iterator[Tombstone]:
        """The tombstones of single events, by id; with `uids` those of these."""
        self._session.ready_to_recall()
        with self._session.connections.recalling() as connection:
            yield from tombstone_rows.tombstones(connection, uids, self._session.frame_name)

    def run_tombstones(self) -> Iterator[RunTombstone]:
        """What is left of the rest of each forgetting, oldest first."""
        self._session.ready_to_recall()
        with self._session.connections.recalling() as connection:
            yield from tombstone_rows.run_tombstones(connection, self._session.frame_name)

    def forgetting_count(self) -> ForgettingCount:
        """How often this memory has forgotten, and how much."""
        self._session.ready_to_recall()
        with self._session.connections.recalling() as connection:
            return tombstone_rows.count(connection)

    @repeated
    def keep_tombstones(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory; of an event that this one has, nothing is kept."""
        self._session.ready_to_write()
        named = {place.frame for each in given for place in _places(each)}
        numbers = self._session.names.frame_ids(named)
        with self._session.connections.writing() as connection:
            return tombstone_rows.keep(connection, given, self._session.frame_name, numbers.__getitem__)


def _places(given: Tombstone | RunTombstone) -> Iterator[Region]:
    if isinstance(given, Tombstone):
        yield from (place for place in (given.region, given.subject) if place is not None)
    else:
        yield from (*given.regions, *given.subjects)
