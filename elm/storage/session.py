"""What all calls on one memory in PostgreSQL share: its connections, its names, and whether its schema is fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any
from uuid import UUID

from elm.cues.algebra import UidCue
from elm.event import StoredEvent
from elm.interval import Window
from elm.query import Query
from elm.storage import recall_statements, schema
from elm.storage.connections import Connection, Connections
from elm.storage.cue_compiler import compile_cue
from elm.storage.names import NameCache
from elm.storage.rows import FRAME_ID, SUBJECT_FRAME_ID, TYPE_ID, decoders


class Session:
    """One memory of one database, as one process works with it; safe to share between threads."""

    def __init__(self, dsn: str, memory: str) -> None:
        self.dsn = dsn
        self.memory = schema.check_memory_name(memory)
        self.connections = Connections(dsn, memory)
        self.names = NameCache(self.connections, memory)
        self.decode = decoders(self.names.types, self.names.frames)
        self.statements = recall_statements.StatementCache()
        self._is_ready = False

    def ready_to_recall(self) -> None:
        """Refuse a memory that is missing or of another schema."""
        if not self._is_ready:
            with self.connections.recalling() as connection:
                schema.require(connection, self.memory)
            self._is_ready = True

    def ready_to_write(self) -> None:
        """Create a memory that is missing; refuse one of another schema."""
        if not self._is_ready:
            with self.connections.writing() as connection:
                revision = schema.revision_of(connection, self.memory)
            if revision is None:
                # Imported here: most commands never create a memory, and alembic takes its time to load.
                from elm.storage.migrations import migrate

                migrate(self.dsn, self.memory)
            else:
                schema.check_revision(revision, self.memory)
            self._is_ready = True

    def learn(self, rows: Sequence[Sequence[Any]], connection: Connection | None = None) -> None:
        """Have the names at hand that these rows of `recall_statements.columns` mention by number."""
        # Each looked up by itself: to subtract the names known, all 11,110 of them, would cost more than most recalls.
        types = {number for row in rows if (number := row[TYPE_ID]) not in self.names.types}
        met = {row[FRAME_ID] for row in rows} | {row[SUBJECT_FRAME_ID] for row in rows}
        frames = {number for number in met if number is not None and number not in self.names.frames}
        if not types and not frames:
            return
        if connection is not None:
            self.names.learn(connection, types, frames)
            return
        # The connection that streams is busy.
        with self.connections.recalling() as other:
            self.names.learn(other, types, frames)

    def type_names(self, connection: Connection, numbers: Iterable[int]) -> dict[int, str]:
        """The names of types by their numbers, these among them."""
        self.names.learn(connection, numbers, [])
        return self.names.types

    def frame_name(self, number: int) -> str:
        """The name of a frame; asked for over a connection of its own, for another may be busy."""
        if number not in self.names.frames:
            with self.connections.recalling() as other:
                self.names.learn(other, [], [number])
        return self.names.frames[number]

    def stored(self, connection: Connection, uids: Sequence[UUID]) -> Iterator[StoredEvent]:
        """The events with these uids, as the given connection's transaction sees them."""
        if not uids:
            return
        query = Query(cue=UidCue(uids=tuple(uids)))
        compiled = compile_cue(query.cue, self.names)
        text = self.statements.text(
            ("find", compiled.key, recall_statements.shape(query, pinned=True, near=Window())),
            lambda: recall_statements.find(compiled, query, pinned=True, near=Window()),
        )
        rows = connection.execute(text, compiled.values, binary=True).fetchall()
        self.learn(rows)
        for row in rows:
            yield StoredEvent.of_row(row, self.decode)
