"""What both SQLite sides do alike: a file, one transaction for a commit and one for a load, rows as tuples."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

from simulators.opponents.protocol import Question, Record, Workload
from simulators.opponents.sides.sqlite_tables import (
    DURABILITY,
    SEARCHES,
    Connection,
    Found,
    create,
    order_of,
    settle,
    values_of,
)

ROUNDING = 1e-3
"""Metres by which a box of float32 may be wider than its region, at most."""
FIRST_RADIUS = 1.0
"""Metres around a point in which the nearest are looked for first; then twice as many, and so on."""


class SqliteFile(ABC):
    """A file of SQLite through a connection; places are the sides' own."""

    durability: Mapping[str, str] = DURABILITY
    places: ClassVar[Mapping[str, str]]
    """The searches that speak of places."""

    def __init__(self, connection: Any, workload: Workload, mode: str, tables: Iterable[str]) -> None:
        self._connection: Connection = connection
        self._close = connection.close
        create(self._connection, workload, mode)
        for statement in tables:
            self._connection.execute(statement).fetchall()
        settle(self._connection)

    def commit(self, record: Record) -> object:
        """One transaction."""
        self._connection.execute("BEGIN")
        self._keep(record)
        return self._connection.execute("COMMIT")

    def load(self, records: Sequence[Record]) -> None:
        """One transaction for all, statistics for the planner, and a checkpoint."""
        self._connection.execute("BEGIN")
        for record in records:
            self._keep(record)
        self._connection.execute("COMMIT")
        settle(self._connection)

    def ask(self, question: Question) -> Sequence[Found]:
        """Rows as tuples."""
        values = values_of(question)
        if question.kind == "nearest":
            return self._nearest(question, values)
        if question.kind in self.places:
            return self._placed(question, values)
        return self._found(f"{SEARCHES[question.kind]}{order_of(question)}", values)

    def uid_of(self, row: Found) -> str:
        """Its uid."""
        return row.uid

    def close(self) -> None:
        """Close the file."""
        self._close()

    @abstractmethod
    def _keep(self, record: Record) -> None:
        """Write an event, within a transaction."""

    @abstractmethod
    def _found(self, search: str, values: Mapping[str, Any]) -> list[Found]:
        """The rows of a search."""

    @abstractmethod
    def _placed(self, question: Question, values: Mapping[str, Any]) -> list[Found]:
        """The answer to a question about a place."""

    @abstractmethod
    def _nearest(self, question: Question, values: Mapping[str, Any]) -> list[Found]:
        """The regions nearest to a point: boxes, each twice as large as the one before, until enough are that near."""


def square(x: float, y: float, radius: float) -> dict[str, float]:
    """The box around a point."""
    return {"west": x - radius, "east": x + radius, "south": y - radius, "north": y + radius}
