"""How a query is answered: the statement that does it in the end, its plan as run, and what each condition removes."""

from __future__ import annotations

from typing import Any

from elm.cues.codec import cue_to_json
from elm.exchange import to_line
from elm.query import ConditionRows, Explanation, Query
from elm.storage import hints, recall_statements
from elm.storage.planning import Planning
from elm.storage.session import Session


def explain(session: Session, query: Query) -> Explanation:
    """How a query is answered; it is run for that."""
    text, values, planning = _answering(session, query)
    parts = hints.conjuncts(query.cue)
    compiled = [session.compiled(part, prefix=f"c{index}_") for index, part in enumerate(parts)]
    removed = str(recall_statements.removed(compiled).compile(dialect=recall_statements.DIALECT))
    with session.connections.recalling(planning) as connection:
        plan = connection.execute(f"EXPLAIN (ANALYZE, BUFFERS) {text}", values).fetchall()
    with session.connections.recalling() as connection:
        given = {name: value for each in compiled for name, value in each.values.items()}
        counts = connection.execute(removed, given).fetchone()
    assert counts is not None  # noqa: S101 - a count always has a row
    return Explanation(
        sql=text,
        parameters=values,
        plan="\n".join(line for (line,) in plan),
        events=counts[0],
        conditions=tuple(
            ConditionRows(condition=to_line(cue_to_json(part)), alone=counts[1 + 2 * index], left=counts[2 + 2 * index])
            for index, part in enumerate(parts)
        ),
    )


def _answering(session: Session, query: Query) -> tuple[str, dict[str, Any], Planning]:
    """The statement that answers a query, its values, and how it is planned."""
    if hints.is_planned_once(query):
        return *session.asked("find", query, recall_statements.find), Planning.ONCE
    looked = session.look("find", query, recall_statements.columns)
    if looked is not None:
        return looked.text, looked.values, looked.planning
    return *session.asked("find", query, recall_statements.find, looked=True), Planning.ANEW
