"""A side that dies when it is asked what was near."""

from __future__ import annotations

from collections.abc import Sequence

from simulators.opponents.protocol import Question, serve
from simulators.opponents.sides.sqlite_rtree import SqliteRtree
from simulators.opponents.sides.sqlite_tables import Found


class DyingSide(SqliteRtree):
    """SQLite, for a while."""

    name = "dying_side"
    title = "Mortal"

    def ask(self, question: Question) -> Sequence[Found]:
        """Rows, until places matter."""
        if question.kind == "near":
            raise MemoryError("this was too much")
        return super().ask(question)


if __name__ == "__main__":
    serve(DyingSide)
