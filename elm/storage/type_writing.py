"""Adding event types to a memory in the database: names, is-a links, and what the closure gains by them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from elm.storage.connections import Connection
from elm.store import TypesAdded
from elm.taxonomy import EventType, Taxonomy, parents_first

# The links and the closure must agree: whoever extends them waits for whoever is doing so. Readers do not wait.
_LOCK = "LOCK TABLE type_parent IN SHARE ROW EXCLUSIVE MODE"

_KNOWN = "SELECT id, name FROM event_type WHERE name = ANY(%s)"

# A part of the hierarchy that is closed upwards: the types named, what is below them, and all ancestors of those.
_LINKS = """
WITH touched AS (
    SELECT DISTINCT descendant_id AS id FROM type_closure WHERE ancestor_id = ANY(%(extended)s)
    UNION SELECT unnest(%(named)s::integer[])
), around AS (
    SELECT DISTINCT ancestor_id AS id FROM type_closure WHERE descendant_id IN (SELECT id FROM touched)
)
SELECT c.id, c.name, p.name FROM around
JOIN event_type c ON c.id = around.id
LEFT JOIN type_parent l ON l.child_id = c.id
LEFT JOIN event_type p ON p.id = l.parent_id
"""

_ADD_NAMES = "INSERT INTO event_type (name) SELECT unnest(%s::text[]) RETURNING id, name"
_COPY_LINKS = "COPY type_parent (child_id, parent_id) FROM STDIN (FORMAT BINARY)"
_COPY_CLOSURE = "COPY type_closure (ancestor_id, descendant_id) FROM STDIN (FORMAT BINARY)"

_EVERY = """
SELECT c.name, coalesce(array_agg(p.name ORDER BY p.id) FILTER (WHERE p.id IS NOT NULL), '{}')
FROM event_type c
LEFT JOIN type_parent l ON l.child_id = c.id
LEFT JOIN event_type p ON p.id = l.parent_id
GROUP BY c.id, c.name ORDER BY c.id
"""


def add_types(connection: Connection, types: Sequence[EventType]) -> TypesAdded:
    """Add types and parents in one transaction.

    The part of the hierarchy around the types named is read, grown in memory by the same `Taxonomy` that
    the in-process store uses, and what it gained is copied back: the cost follows from what is new.
    """
    with connection.transaction():
        connection.execute(_LOCK)
        names = list(dict.fromkeys(name for each in types for name in (each.name, *each.parents)))
        ids = {name: number for number, name in connection.execute(_KNOWN, [names]).fetchall()}
        known = set(ids)
        extended = [ids[each.name] for each in types if each.parents and each.name in known]
        around = _around(connection, extended, list(ids.values()), ids)
        links = {(each.name, parent) for each in around for parent in each.parents}
        taxonomy = Taxonomy(around)
        grown = taxonomy.add(types)
        fresh = list(dict.fromkeys(each.name for each in types if each.name not in known))
        ids |= {name: number for number, name in connection.execute(_ADD_NAMES, [fresh]).fetchall()}
        added = dict.fromkeys(
            (each.name, parent) for each in types for parent in each.parents if (each.name, parent) not in links
        )
        _copy(connection, _COPY_LINKS, ((ids[child], ids[parent]) for child, parent in added))
        _copy(connection, _COPY_CLOSURE, ((ids[above], ids[below]) for above, below in grown))
    return TypesAdded(types=len(fresh), links=len(added), closure=len(grown))


def _around(connection: Connection, extended: list[int], named: list[int], ids: dict[str, int]) -> list[EventType]:
    parents: dict[str, list[str]] = {}
    rows = connection.execute(_LINKS, {"extended": extended, "named": named}).fetchall() if named else []
    for number, name, parent in rows:
        ids[name] = number
        parents.setdefault(name, [])
        if parent is not None:
            parents[name].append(parent)
    return [EventType(name=name, parents=tuple(above)) for name, above in parents.items()]


def _copy(connection: Connection, statement: str, rows: Iterable[tuple[int, int]]) -> None:
    with connection.cursor().copy(statement) as copy:
        copy.set_types(["int4", "int4"])
        for row in rows:
            copy.write_row(row)


def every_type(connection: Connection) -> Iterator[EventType]:
    """All types, parents first."""
    rows = connection.execute(_EVERY).fetchall()
    return iter(parents_first([EventType(name=name, parents=tuple(parents)) for name, parents in rows]))
