"""A memory in PostgreSQL with PostGIS: one schema, every call one transaction, every answer one statement."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from functools import partial
from itertools import islice
from typing import Any
from uuid import UUID

import psycopg

from elm.cues.algebra import Cue
from elm.errors import MemoryMissing
from elm.event import StoredEvent
from elm.query import MOST_ID, ByFeature, Explanation, Group, Grouping, Join, Query
from elm.storage import batch_loading, event_writing, grouping, hints, recall_statements, type_writing
from elm.storage import write_statements as sql
from elm.storage.batch import made_ready
from elm.storage.connections import Connection, repeated
from elm.storage.explaining import explain
from elm.storage.first_look import AT_ONCE, is_small
from elm.storage.one_moment import by_ids, everything, one_moment, pieces, with_parts
from elm.storage.planning import Planning
from elm.storage.postgres_forgetting import PostgresForgetting
from elm.storage.postgres_log import PostgresLog
from elm.storage.rows import moment
from elm.storage.session import Session, check_values
from elm.storage.writing_together import Together
from elm.store import Arrival, BatchReport, Closed, Committed, Statistics, TypesAdded
from elm.taxonomy import EventType
from elm.tombstone import RunTombstone, Tombstone

_CHUNKED = psycopg.capabilities.has_stream_chunked()


class PostgresStore(PostgresForgetting):
    """The `Store` over one schema of a PostgreSQL database; safe to share between threads and with a forked process."""

    def __init__(self, dsn: str, memory: str) -> None:
        self._session = Session(dsn, memory)
        self.memory = memory
        self.log = PostgresLog(self._session)
        self._connections = self._session.connections
        self._names = self._session.names

    # Types

    def add_types(self, types: Sequence[EventType]) -> TypesAdded:
        """Add types and parents, in any order; cycles and unknown parents refuse the whole call."""
        self._session.ready_to_write()
        with self._connections.writing() as connection:
            return type_writing.add_types(connection, types)

    def types(self) -> Iterator[EventType]:
        """All types, parents first."""
        self._session.ready_to_recall()
        with self._connections.recalling() as connection:
            return type_writing.every_type(connection)

    # Writing

    @repeated
    def commit(self, arrival: Arrival) -> Committed:
        """Keep one event whose parts are all in the memory."""
        self._session.ready_to_write()
        now = datetime.now(UTC)
        (row,) = event_writing.encoded([arrival], self._names, now)
        with self._connections.writing() as connection:
            done = event_writing.commit(connection, arrival.event, row, now)
            if done is None:
                stored = partial(self._session.stored, connection)
                return event_writing.same_or_refused(connection, arrival.event, stored)
            self.log.tell(connection)
        return done

    @repeated
    def commit_all(self, arrivals: Sequence[Arrival]) -> list[Committed]:
        """Keep all or none; events may be parts of each other in any order."""
        self._session.ready_to_write()
        together = Together(arrivals, self._names)
        with self._connections.writing() as connection:
            with connection.transaction():
                done = together.commit(connection, partial(self._session.stored, connection))
            self.log.tell(connection)
        return done

    @repeated
    def load(self, arrivals: Sequence[Arrival]) -> BatchReport:
        """Keep what can be kept of a batch whose parts come before their wholes or are in the memory."""
        self._session.ready_to_write()
        if not arrivals:
            return BatchReport(new=0, existing=0, refused=())
        batch = made_ready(arrivals, self._names)
        with self._connections.writing() as connection:
            report = batch_loading.load(connection, batch, partial(self._session.stored, connection))
            self.log.tell(connection)
        return report

    def finish_load(self) -> None:
        """Bring the planner's statistics up to date, and what it may read from indexes alone."""
        try:
            self._session.ready_to_change()
        except MemoryMissing:
            # A load of nothing creates no memory.
            return
        with self._connections.writing() as connection:
            connection.execute(sql.TIDY)

    @repeated
    def close_event(self, uid: UUID, end: datetime) -> Closed:
        """End an open event and recompute the extents of all its wholes; the same end again changes nothing."""
        self._session.ready_to_change()
        with self._connections.writing() as connection:
            with connection.transaction():
                closed = event_writing.close(connection, uid, end)
            if closed is not None:
                self.log.tell(connection)
                return closed
            stored = next(self._session.stored(connection, [uid]), None)
            return event_writing.why_not_closed(connection, uid, end, stored)

    # Recalling

    def find(self, query: Query) -> Iterator[StoredEvent]:
        """The events a query asks for, streamed from one consistent view."""
        if hints.is_planned_once(query):
            text, values = self._session.asked("find", query, recall_statements.find)
            return self._events(text, values, Planning.ONCE)
        return self._found(query)

    def _found(self, query: Query) -> Iterator[StoredEvent]:
        looked = self._session.look("find", query, recall_statements.columns)
        if looked is not None:
            self._session.learn(looked.rows)
            decode = self._session.decode
            yield from (StoredEvent.of_row(row, decode) for row in looked.rows)
            return
        text, values = self._session.asked("find", query, recall_statements.find, looked=True)
        if hints.is_pinned(query.cue) or is_small(query):
            yield from self._events(text, values, Planning.ANEW)
        else:
            yield from self._streamed_events(text, values)

    def with_parts(self, query: Query) -> Iterator[StoredEvent | Tombstone]:
        """The events a query asks for and all they are made of, by id, after the tombstones of forgotten parts."""
        return with_parts(self._session, query)

    def everything(self) -> Iterator[StoredEvent | Tombstone | RunTombstone]:
        """All that the memory holds, as of one moment: tombstones of forgettings, those of events, events by id."""
        return everything(self._session)

    def ids(self, query: Query) -> Iterator[int]:
        """Their ids alone."""
        looked = self._session.look("ids", query, recall_statements.only_id)
        if looked is not None:
            yield from (row[0] for row in looked.rows)
            return
        text, values = self._session.asked("ids", query, recall_statements.find_ids, looked=True)
        with self._connections.recalling() as connection:
            for row in self._stream(connection, text, values):
                yield row[0]

    def count(self, cue: Cue) -> int:
        """How many events match."""
        compiled = self._session.compiled(cue)
        text = self._session.statements.text(("count", compiled.key), lambda: recall_statements.count(compiled))
        return int(self._one(text, compiled.values)[0])

    def exists(self, cue: Cue) -> bool:
        """Whether any event matches."""
        compiled = self._session.compiled(cue)
        text = self._session.statements.text(("exists", compiled.key), lambda: recall_statements.any_match(compiled))
        return bool(self._all(text, compiled.values))

    def get(self, ids: Sequence[int]) -> list[StoredEvent]:
        """The events with these ids, in id order; unknown ids are left out."""
        self._session.ready_to_recall()
        text = self._session.statements.text("by id", recall_statements.by_ids)
        possible = [number for number in ids if 0 < number <= MOST_ID]
        return list(self._events(text, {"ids": possible}, Planning.ONCE))

    def groups(self, cue: Cue, by: Grouping | ByFeature) -> list[Group]:
        """The matching events by key, keys in ascending order, None last."""
        compiled = self._session.compiled(cue)
        key = ("groups", compiled.key, by if isinstance(by, Grouping) else "feature")
        text = self._session.statements.text(key, lambda: recall_statements.groups(compiled, by))
        values = compiled.values if isinstance(by, Grouping) else {**compiled.values, "feature_name": by.name}
        with self._connections.recalling() as connection:
            rows = connection.execute(text, values, binary=True).fetchall()
            if by is Grouping.TYPE:
                self._names.learn(connection, [row[0] for row in rows], [])
            if by is Grouping.FRAME:
                self._names.learn(connection, [], [row[0] for row in rows])
        return grouping.merged(rows, by, self._names)

    def join(self, join: Join) -> Iterator[tuple[StoredEvent, StoredEvent | None]]:
        """Each anchor, in order, with the neighbour found for it."""
        anchors, other = self._session.compiled(join.anchors.cue), self._session.compiled(join.cue, prefix="n")
        check_values(len(anchors.values) + len(other.values))
        pinned, near = hints.of_query(join.anchors)
        shape = recall_statements.shape(join.anchors, pinned=pinned, near=near)
        key = ("join", anchors.key, other.key, join.relation, join.same_region, shape)
        text = self._session.statements.text(
            key, lambda: recall_statements.join(anchors, other, join, pinned=pinned, near=near)
        )
        own = recall_statements.parameters(join.anchors, near=near)
        values = {**anchors.values, **other.values, **own}
        with one_moment(self._session) as connection:
            for pairs in pieces(connection, text, values, size=AT_ONCE):
                wanted = {number for pair in pairs for number in pair if number is not None}
                known = {event.id: event for event in by_ids(self._session, connection, sorted(wanted))}
                for anchor, neighbour in pairs:
                    yield known[anchor], known[neighbour] if neighbour is not None else None

    def explain(self, query: Query) -> Explanation:
        """How the query is answered, by the statement that does it in the end; it is run for that."""
        return explain(self._session, query)

    def arrow(self, query: Query) -> Any:
        """The events as a pyarrow.RecordBatchReader in the schema of `elm.columns`."""

        from elm.columns import reader_of
        from elm.storage import arrow_rows

        text, values = self._session.asked("find", query, recall_statements.find)

        def batches() -> Iterator[Any]:
            with self._connections.recalling() as connection:
                rows = self._stream(connection, text, values)
                yield from arrow_rows.batches(rows, self._session.learn, self._names.types, self._names.frames)

        return reader_of(batches())

    def statistics(self) -> Statistics:
        """What the memory holds, in numbers."""
        self._session.ready_to_recall()
        row = self._one(recall_statements.STATISTICS, {"memory": self.memory})
        times = [None if raw is None else moment(raw) for raw in row[7:10]]
        return Statistics(
            events=row[0],
            complex_events=row[1],
            open_events=row[2],
            links=row[3],
            types=row[4],
            frames=row[5],
            agents=row[6],
            first_begin=times[0],
            last_begin=times[1],
            last_recorded_at=times[2],
            bytes=int(row[10]),
            forgotten=row[11],
            tombstones=row[12],
        )

    def close(self) -> None:
        """Let go of connections; further calls are refused."""
        self._connections.close()

    # How statements are run

    def _events(self, text: str, values: dict[str, Any], planning: Planning) -> Iterator[StoredEvent]:
        """A few events, fetched at once."""
        with self._connections.recalling(planning) as connection:
            rows = connection.execute(text, values, prepare=planning.prepare, binary=True).fetchall()
            self._session.learn(rows, connection)
        decode = self._session.decode
        for row in rows:
            yield StoredEvent.of_row(row, decode)

    def _streamed_events(self, text: str, values: dict[str, Any]) -> Iterator[StoredEvent]:
        decode = self._session.decode
        with self._connections.recalling() as connection:
            stream = self._stream(connection, text, values)
            while chunk := list(islice(stream, AT_ONCE)):
                self._session.learn(chunk)
                for row in chunk:
                    yield StoredEvent.of_row(row, decode)

    def _stream(self, connection: Connection, text: str, values: dict[str, Any]) -> Iterator[Sequence[Any]]:
        size = AT_ONCE if _CHUNKED else 1
        return connection.cursor().stream(text, values, binary=True, size=size)

    def _all(self, text: str, values: dict[str, Any]) -> list[Any]:
        with self._connections.recalling() as connection:
            return connection.execute(text, values, binary=True).fetchall()

    def _one(self, text: str, values: dict[str, Any]) -> Any:
        return self._all(text, values)[0]
