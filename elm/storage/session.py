"""What all calls on one memory in PostgreSQL share: connections, names, whether its schema is fit, first looks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any
from uuid import UUID

from sqlalchemy import Select

from elm.cues.algebra import Cue, UidCue
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.query import Query
from elm.storage import first_look, forking, hints, recall_statements, schema
from elm.storage.connections import Connection, Connections
from elm.storage.cue_compiler import CompiledCue, compile_cue
from elm.storage.names import NameCache
from elm.storage.planning import Planning
from elm.storage.rows import FRAME_ID, SUBJECT_FRAME_ID, TYPE_ID, decoders
from elm.text import check_memory_name

MOST_VALUES = 65_000
"""Values that cues may have in one statement: of the 65,535 that PostgreSQL takes, a query has a few of its own."""


def check_values(given: int) -> None:
    """Refuse cues that have more values together than a statement can carry."""
    if given > MOST_VALUES:
        raise InvalidValue(
            f"a cue of {given} values is too much for one statement, which takes {MOST_VALUES}: name many events by "
            f"one cue of their uids, which counts as one value, or split the cue and recall by each part"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Looked:
    """The answer of a first look, and the statement that gave it."""

    text: str
    values: dict[str, Any]
    planning: Planning
    rows: list[Sequence[Any]]


class Session:
    """One memory of one database, as a process works with it; safe to share between threads, and with a fork."""

    def __init__(self, dsn: str, memory: str) -> None:
        self.dsn = dsn
        self.memory = check_memory_name(memory)
        self.connections = Connections(dsn, memory)
        self.names = NameCache(self.connections, memory)
        self.decode = decoders(self.names.types, self.names.frames)
        self.statements = recall_statements.StatementCache()
        self._is_ready = False
        forking.renewed_in_children(self)

    def begin_anew(self) -> None:
        """Have statements that nobody else is building; names and numbers stay what they are."""
        self.statements = recall_statements.StatementCache()

    def ready_to_recall(self) -> None:
        """Refuse a memory that is missing or of another schema."""
        if not self._is_ready:
            with self.connections.recalling() as connection:
                schema.require(connection, self.memory)
            self._is_ready = True

    def ready_to_change(self) -> None:
        """Refuse, over the connection that writes, a memory that is missing or of another schema."""
        if not self._is_ready:
            with self.connections.writing() as connection:
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

    def compiled(self, cue: Cue, *, prefix: str = "p") -> CompiledCue:
        """A cue as a condition in SQL, the names of whose values begin with `prefix`."""
        self.ready_to_recall()
        compiled = compile_cue(cue, self.names, prefix=prefix)
        check_values(len(compiled.values))
        return compiled

    def asked(
        self, kind: str, query: Query, build: Callable[..., Select[Any]], *, looked: bool = False
    ) -> tuple[str, dict[str, Any]]:
        """The statement of its `kind`, as `build` makes it, that answers a query whatever it asks for, and its values.

        With `looked` the query has some first looks, none of which answered it.
        """
        compiled = self.compiled(query.cue)
        pinned, near = hints.of_query(query)
        looked = looked and bool(first_look.looks(compiled, query))
        key = (kind, looked, compiled.key, recall_statements.shape(query, pinned=pinned, near=near))
        text = self.statements.text(key, lambda: build(compiled, query, pinned=pinned, near=near, looked=looked))
        return text, {**compiled.values, **recall_statements.parameters(query, near=near)}

    def look(self, kind: str, query: Query, wanted: first_look.Wanted) -> Looked | None:
        """The `wanted` columns of what a query asks for, if a first look of this kind answers it; None otherwise."""
        compiled = self.compiled(query.cue)
        pinned, near = hints.of_query(query)
        seen = 0
        for look in first_look.looks(compiled, query):
            if not first_look.is_worth(look, seen):
                continue
            shape = (first_look.is_small(query), recall_statements.shape(query, pinned=pinned, near=near))
            key = (kind, look, compiled.key, shape)
            text = self.statements.text(key, partial(first_look.look_for, look, compiled, query, wanted, near=near))
            own = {**recall_statements.parameters(query, near=near), **first_look.parameters(query)}
            values = {**compiled.values, **own}
            with self.connections.recalling(look.planning) as connection:
                rows = connection.execute(text, values, prepare=look.planning.prepare, binary=True).fetchall()
            if not rows or rows[0][-1] is None:
                found = [row for row in rows if row[0] is not None]
                return Looked(text=text, values=values, planning=look.planning, rows=found)
            seen = rows[0][-1]
        return None

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
        text, values = self.asked("find", Query(cue=UidCue(uids=tuple(uids))), recall_statements.find)
        rows = connection.execute(text, values, binary=True).fetchall()
        self.learn(rows)
        for row in rows:
            yield StoredEvent.of_row(row, self.decode)
