"""The best statement that a person would write by hand for each class of cues, fetching the same columns."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

from elm.event import StoredEvent
from elm.features import name_tokens, tokens
from elm.storage.connections import open_connection
from elm.storage.planning import RECALLING
from simulators.bench.scratch import Connection, connect

# Regions as they are stored: in psycopg's binary results that is their WKB.
COLUMNS = """
SELECT e.id, e.uid, t.name AS type, lower(e.period) AS begin, upper(e.period) AS end,
       f.name AS frame, e.region, s.name AS subject_frame, e.subject,
       e.features, e.agent, e.media_type, e.payload, e.parts, e.recorded_at
FROM event e
JOIN event_type t ON t.id = e.type_id
LEFT JOIN frame f ON f.id = e.frame_id
LEFT JOIN frame s ON s.id = e.subject_frame_id
"""
ORDER = " ORDER BY lower(e.period), e.id"

CONDITIONS = MappingProxyType(
    {
        "type.exactly": "e.type_id = (SELECT id FROM event_type WHERE name = %(type)s)",
        "type.is_a": """
            e.type_id IN (SELECT descendant_id FROM type_closure
                          WHERE ancestor_id = (SELECT id FROM event_type WHERE name = %(type)s))
        """,
        "payload.equal": "sha256(e.payload) = sha256(%(payload)s) AND e.payload = %(payload)s",
        # The index on begins beats the one on periods where begins alone leave few events.
        "time.equal": "lower(e.period) = %(begin)s AND upper(e.period) = %(end)s",
        "time.subset": "lower(e.period) BETWEEN %(begin)s AND %(end)s AND upper(e.period) <= %(end)s",
        "time.superset": "e.period @> tstzrange(%(begin)s, %(end)s, '[]')",
        "time.intersects": "e.period && tstzrange(%(begin)s, %(end)s, '[]')",
        "region.equal": "f.name = %(frame)s AND ST_Equals(e.region, ST_GeomFromWKB(%(region)s))",
        "region.subset": "f.name = %(frame)s AND ST_CoveredBy(e.region, ST_GeomFromWKB(%(region)s))",
        "region.superset": "f.name = %(frame)s AND ST_Covers(e.region, ST_GeomFromWKB(%(region)s))",
        "region.intersects": "f.name = %(frame)s AND ST_Intersects(e.region, ST_GeomFromWKB(%(region)s))",
        # One of the parts leads to the few events that can have all of them; = ANY(ARRAY(...)) is planned fastest.
        "parts.equal": """
            e.id = ANY (ARRAY(SELECT l.whole_id FROM part l JOIN event p ON p.id = l.part_id
                              WHERE p.uid = (%(parts)s::uuid[])[1]))
            AND e.parts @> %(parts)s AND e.parts <@ %(parts)s
        """,
        "parts.subset": "e.parts <@ %(parts)s",
        "parts.superset": """
            e.id = ANY (ARRAY(SELECT l.whole_id FROM part l JOIN event p ON p.id = l.part_id
                              WHERE p.uid = (%(parts)s::uuid[])[1]))
            AND e.parts @> %(parts)s
        """,
        "parts.intersects": """
            e.id = ANY (ARRAY(SELECT l.whole_id FROM part l JOIN event p ON p.id = l.part_id
                              WHERE p.uid = ANY (%(parts)s)))
        """,
        "wholes.equal": """
            e.id = ANY (ARRAY(SELECT l.part_id FROM part l JOIN event w ON w.id = l.whole_id
                              WHERE w.uid = (%(wholes)s::uuid[])[1]))
            AND ARRAY(SELECT l.whole_uid FROM part l WHERE l.part_id = e.id) @> %(wholes)s
            AND ARRAY(SELECT l.whole_uid FROM part l WHERE l.part_id = e.id) <@ %(wholes)s
        """,
        "wholes.subset": """
            NOT EXISTS (SELECT FROM part l WHERE l.part_id = e.id AND l.whole_uid <> ALL (%(wholes)s))
        """,
        "wholes.superset": """
            e.id = ANY (ARRAY(SELECT l.part_id FROM part l JOIN event w ON w.id = l.whole_id
                              WHERE w.uid = (%(wholes)s::uuid[])[1]))
            AND ARRAY(SELECT l.whole_uid FROM part l WHERE l.part_id = e.id) @> %(wholes)s
        """,
        "wholes.intersects": """
            e.id = ANY (ARRAY(SELECT l.part_id FROM part l JOIN event w ON w.id = l.whole_id
                              WHERE w.uid = ANY (%(wholes)s)))
        """,
        "features.equal": "e.feature_tokens = %(features)s::text[]",
        "features.subset": "e.feature_tokens <@ %(features)s::text[]",
        "features.superset": "e.feature_tokens @> %(features)s::text[]",
        "features.intersects": "e.feature_tokens && %(features)s::text[]",
        "feature_names.equal": """
            hash_array(e.feature_names) + (cardinality(e.feature_names)::bigint << 32)
                = hash_array(%(feature_names)s::text[]) + (cardinality(%(feature_names)s::text[])::bigint << 32)
            AND (e.feature_names = %(feature_names)s::text[]) IS TRUE
        """,
        # Each subset of the names is looked for as a whole; IS TRUE keeps the planner off the inverted index.
        "feature_names.subset": """
            hash_array(e.feature_names) + (cardinality(e.feature_names)::bigint << 32) = ANY (ARRAY(
                SELECT hash_array(names) + (cardinality(names)::bigint << 32)
                FROM generate_series(0, (1 << cardinality(%(feature_names)s::text[])) - 1) AS s (number),
                     LATERAL (SELECT ARRAY(SELECT n FROM unnest(%(feature_names)s::text[]) WITH ORDINALITY AS u (n, i)
                                           WHERE number >> (i - 1)::integer & 1 = 1 ORDER BY i)) AS t (names)
            )) AND (e.feature_names <@ %(feature_names)s::text[]) IS TRUE
        """,
        # Only the same set and larger ones can hold the names: where few are larger, that is found soonest.
        "feature_names.superset": """
            e.feature_names @> %(feature_names)s::text[]
            AND (hash_array(e.feature_names) + (cardinality(e.feature_names)::bigint << 32)
                     > (cardinality(%(feature_names)s::text[])::bigint << 32) + 2147483647
                 OR hash_array(e.feature_names) + (cardinality(e.feature_names)::bigint << 32)
                     = hash_array(%(feature_names)s::text[]) + (cardinality(%(feature_names)s::text[])::bigint << 32))
        """,
        "feature_names.intersects": "e.feature_names && %(feature_names)s::text[]",
    }
)
"""For each class the condition on an event `e`; parts and wholes are those of an event that has some."""

EVERYTHING = COLUMNS + ORDER


def statement(name: str) -> str:
    """The statement for a class of cues."""
    return COLUMNS + " WHERE " + CONDITIONS[name] + ORDER


def values(name: str, event: StoredEvent) -> dict[str, Any]:
    """What the statement for a class binds when the cue is made of a field of this event."""
    field = name.partition(".")[0]
    match field:
        case "time":
            return {"begin": event.interval.begin, "end": event.interval.end}
        case "region" if event.region is not None:
            return {"frame": event.region.frame, "region": event.region.wkb}
        case "payload" if event.payload is not None:
            return {"payload": event.payload.data}
        case "features":
            return {"features": tokens(event.features)}
        case "feature_names":
            return {"feature_names": name_tokens(known for known, _ in event.features)}
        case "parts" | "wholes":
            return {field: list(getattr(event, field))}
        case _:
            return {field: getattr(event, field)}


def like_elm(dsn: str, memory: str) -> Connection:
    """A plain connection with the session settings that elm recalls with, and psycopg's own way of loading values."""
    with open_connection(dsn, RECALLING, memory=memory) as model:
        chosen = model.execute("SELECT name, setting FROM pg_settings WHERE source = 'session'").fetchall()
    connection = connect(dsn)
    for name, setting in chosen:
        connection.execute("SELECT set_config(%s, %s, false)", [name, setting])
    return connection
