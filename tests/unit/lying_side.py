"""A side that knows better: it leaves events out where a window is asked for, and is not durable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from simulators.opponents.protocol import Question, serve
from simulators.opponents.sides.sqlite_rtree import SqliteRtree
from simulators.opponents.sides.sqlite_tables import Found


class LyingSide(SqliteRtree):
    """SQLite, but for the truth."""

    name = "lying_side"
    title = "Liar"
    durability: Mapping[str, str] = {"relaxed": "not at all"}

    def ask(self, question: Question) -> Sequence[Found]:
        """All rows, but one of those in a window."""
        found = super().ask(question)
        return found[1:] if question.kind == "window" else found


if __name__ == "__main__":
    serve(LyingSide)
