"""The tables of both SQLite sides, and all questions but those about places."""

# ruff: noqa: S608 - statements are put together from the constants here

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from hashlib import blake2b
from itertools import starmap
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

from simulators.opponents.protocol import Question, Record, Workload
from simulators.opponents.sides.spelling import token

SCHEMA = """
CREATE TABLE type (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);
CREATE TABLE is_a (ancestor INTEGER NOT NULL, descendant INTEGER NOT NULL, PRIMARY KEY (ancestor, descendant))
    WITHOUT ROWID;
CREATE TABLE event (
    number INTEGER PRIMARY KEY, uid TEXT NOT NULL UNIQUE, type INTEGER NOT NULL, begins INTEGER NOT NULL,
    ends INTEGER NOT NULL, features TEXT NOT NULL, agent TEXT NOT NULL, media_type TEXT, payload BLOB NOT NULL,
    parts TEXT NOT NULL, digest BLOB NOT NULL, feature_set TEXT NOT NULL, name_set TEXT NOT NULL,
    feature_count INTEGER NOT NULL, name_count INTEGER NOT NULL, part_count INTEGER NOT NULL
);
CREATE INDEX event_type ON event (type, begins);
CREATE INDEX event_begins ON event (begins);
CREATE INDEX event_digest ON event (digest);
CREATE INDEX event_feature_set ON event (feature_set);
CREATE INDEX event_name_set ON event (name_set);
CREATE TABLE feature (token TEXT NOT NULL, number INTEGER NOT NULL, PRIMARY KEY (token, number)) WITHOUT ROWID;
CREATE TABLE feature_name (name TEXT NOT NULL, number INTEGER NOT NULL, PRIMARY KEY (name, number)) WITHOUT ROWID;
CREATE TABLE part (whole INTEGER NOT NULL, part INTEGER NOT NULL, PRIMARY KEY (whole, part)) WITHOUT ROWID;
CREATE INDEX part_part ON part (part, whole);
CREATE VIRTUAL TABLE period USING rtree (number, begins, ends);
"""
"""Periods have an R*Tree of one dimension: no B-tree finds what intersects a window."""

EPOCH = 1_767_225_600
"""Seconds since 1970 at the begin of 2026, from which the R*Trees count: their numbers are float32."""

# The wanted set comes as JSON.
_WANTED = "SELECT value FROM json_each(:wanted)"
_UIDS = f"SELECT number FROM event WHERE uid IN ({_WANTED})"

SEARCHES: Mapping[str, str] = MappingProxyType(
    {
        "type.exactly": "event e WHERE e.type = (SELECT id FROM type WHERE name = :type)",
        "type.latest": "event e WHERE e.type = (SELECT id FROM type WHERE name = :type)",
        "type.is_a": """
            (SELECT descendant FROM is_a WHERE ancestor = (SELECT id FROM type WHERE name = :type)) t
            CROSS JOIN event e ON e.type = t.descendant WHERE true
        """,
        "payload.equal": "event e WHERE e.digest = :digest AND e.payload = :payload",
        "time.equal": "event e WHERE e.begins = :begin AND e.ends = :end",
        "time.subset": "event e WHERE e.begins BETWEEN :begin AND :end AND e.ends <= :end",
        "time.superset": """
            period p CROSS JOIN event e ON e.number = p.number
            WHERE p.begins <= :begin_s AND p.ends >= :end_s AND e.begins <= :begin AND e.ends >= :end
        """,
        "time.intersects": """
            period p CROSS JOIN event e ON e.number = p.number
            WHERE p.begins <= :end_s AND p.ends >= :begin_s AND e.begins <= :end AND e.ends >= :begin
        """,
        "features.equal": "event e WHERE e.feature_set = :canonical",
        "feature_names.equal": "event e WHERE e.name_set = :canonical",
        "features.superset": """
            feature f CROSS JOIN event e ON e.number = f.number WHERE f.token = :first AND NOT EXISTS (
                SELECT 1 FROM json_each(:wanted) w
                WHERE NOT EXISTS (SELECT 1 FROM feature o WHERE o.token = w.value AND o.number = e.number))
        """,
        "feature_names.superset": """
            feature_name f CROSS JOIN event e ON e.number = f.number WHERE f.name = :first AND NOT EXISTS (
                SELECT 1 FROM json_each(:wanted) w
                WHERE NOT EXISTS (SELECT 1 FROM feature_name o WHERE o.name = w.value AND o.number = e.number))
        """,
        "features.subset": f"""
            (SELECT number, count(*) AS known FROM feature WHERE token IN ({_WANTED}) GROUP BY number
             UNION ALL SELECT number, 0 FROM event WHERE feature_set = '[]') f
            CROSS JOIN event e ON e.number = f.number WHERE f.known = e.feature_count
        """,
        "feature_names.subset": f"""
            (SELECT number, count(*) AS known FROM feature_name WHERE name IN ({_WANTED}) GROUP BY number
             UNION ALL SELECT number, 0 FROM event WHERE name_set = '[]') f
            CROSS JOIN event e ON e.number = f.number WHERE f.known = e.name_count
        """,
        "features.intersects": f"""
            (SELECT DISTINCT number FROM feature WHERE token IN ({_WANTED})) f
            CROSS JOIN event e ON e.number = f.number WHERE true
        """,
        "feature_names.intersects": f"""
            (SELECT DISTINCT number FROM feature_name WHERE name IN ({_WANTED})) f
            CROSS JOIN event e ON e.number = f.number WHERE true
        """,
        "parts.equal": f"""
            (SELECT whole, count(*) AS known FROM part WHERE part IN ({_UIDS}) GROUP BY whole) p
            CROSS JOIN event e ON e.number = p.whole WHERE p.known = :size AND e.part_count = :size
        """,
        "parts.superset": f"""
            (SELECT whole, count(*) AS known FROM part WHERE part IN ({_UIDS}) GROUP BY whole) p
            CROSS JOIN event e ON e.number = p.whole WHERE p.known = :size
        """,
        "parts.subset": f"""
            event e WHERE e.part_count = 0 OR
            NOT EXISTS (SELECT 1 FROM part p WHERE p.whole = e.number AND p.part NOT IN ({_UIDS}))
        """,
        "parts.intersects": f"""
            (SELECT DISTINCT whole FROM part WHERE part IN ({_UIDS})) p
            CROSS JOIN event e ON e.number = p.whole WHERE true
        """,
        "wholes.equal": f"""
            (SELECT part, count(*) AS known FROM part WHERE whole IN ({_UIDS}) GROUP BY part) p
            CROSS JOIN event e ON e.number = p.part
            WHERE p.known = :size AND (SELECT count(*) FROM part o WHERE o.part = e.number) = :size
        """,
        "wholes.superset": f"""
            (SELECT part, count(*) AS known FROM part WHERE whole IN ({_UIDS}) GROUP BY part) p
            CROSS JOIN event e ON e.number = p.part WHERE p.known = :size
        """,
        "wholes.subset": f"""
            event e WHERE NOT EXISTS (SELECT 1 FROM part p WHERE p.part = e.number AND p.whole NOT IN ({_UIDS}))
        """,
        "wholes.intersects": f"""
            (SELECT DISTINCT part FROM part WHERE whole IN ({_UIDS})) p
            CROSS JOIN event e ON e.number = p.part WHERE true
        """,
        "window": """
            period p CROSS JOIN event e ON e.number = p.number
            WHERE p.begins <= :end_s AND p.ends >= :begin_s AND e.begins <= :end AND e.ends >= :begin
        """,
    }
)
"""For each kind where its events are found; `CROSS JOIN` is SQLite's way to say which table comes first."""

IS_A = (
    "EXISTS (SELECT 1 FROM is_a i WHERE i.ancestor = (SELECT id FROM type WHERE name = :type)"
    " AND i.descendant = e.type)"
)
"""Whether an event is of a type or of one below it."""

COLUMNS = (
    "e.uid, (SELECT name FROM type WHERE id = e.type), e.begins, e.ends, e.features, e.agent, e.media_type, "
    "e.payload, e.parts"
)

_INSERTS = (
    """
    INSERT INTO event VALUES (
        :number, :uid, (SELECT id FROM type WHERE name = :type), :begins, :ends, :features, :agent, :media_type,
        :payload, :parts, :digest, :feature_set, :name_set, :feature_count, :name_count, :part_count)
    """,
    "INSERT INTO period VALUES (:number, :begins_s, :ends_s)",
    "INSERT INTO feature SELECT value, :number FROM json_each(:feature_set)",
    "INSERT INTO feature_name SELECT value, :number FROM json_each(:name_set)",
)
_PARTS = "INSERT INTO part SELECT :number, number FROM event WHERE uid IN (SELECT value FROM json_each(:parts))"

PRAGMAS: Mapping[str, str] = MappingProxyType(
    {
        "durable": "PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL",
        "relaxed": "PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL",
    }
)
DURABILITY: Mapping[str, str] = MappingProxyType(
    {
        "durable": "WAL, synchronous=FULL: a commit waits for the disk",
        "relaxed": "WAL, synchronous=NORMAL: the log is flushed at checkpoints",
    }
)
ROOMY = "PRAGMA cache_size=-262144; PRAGMA mmap_size=1073741824; PRAGMA temp_store=MEMORY"


class Connection(Protocol):
    """What the two drivers have in common."""

    def execute(self, statement: str, values: Any = ..., /) -> Any:
        """Run one statement."""

    def executemany(self, statement: str, values: Iterable[Any], /) -> Any:
        """Run a statement for each of many values."""


class Found(NamedTuple):
    """A row of an answer."""

    uid: str
    type: str
    begins: int
    ends: int
    features: str
    agent: str
    media_type: str | None
    payload: bytes
    parts: str
    region: bytes | None


def create(connection: Connection, workload: Workload, mode: str) -> None:
    """The tables, and in them the types with their closure."""
    for pragma in (*PRAGMAS[mode].split(";"), *ROOMY.split(";")):
        connection.execute(pragma).fetchall()
    for statement in SCHEMA.split(";"):
        connection.execute(statement)
    ids = {name: number for number, (name, _) in enumerate(workload.types)}
    connection.execute("BEGIN")
    connection.executemany("INSERT INTO type VALUES (?, ?)", ((number, name) for name, number in ids.items()))
    connection.executemany(
        "INSERT INTO is_a VALUES (?, ?)",
        ((ids[above], ids[name]) for name, ancestors in workload.closure.items() for above in ancestors),
    )
    connection.execute("COMMIT")


def settle(connection: Connection) -> None:
    """Statistics for the planner, and the log written into the file and cut off."""
    for statement in ("ANALYZE", "PRAGMA wal_checkpoint(TRUNCATE)"):
        connection.execute(statement).fetchall()


def keep(connection: Connection, row: Mapping[str, Any], places: Sequence[str]) -> None:
    """Insert one event; `places` are the side's own statements for where it was."""
    for statement in (*_INSERTS, *places, *([_PARTS] if row["part_count"] else [])):
        connection.execute(statement, row)


def row_of(record: Record) -> dict[str, Any]:
    """An event as the statements take it."""
    tokens = _canonical(starmap(token, record.features))
    names = _canonical(name for name, _ in record.features)
    return {
        "number": record.number,
        "uid": record.uid,
        "type": record.type,
        "begins": record.begin,
        "ends": record.end,
        "begins_s": _seconds(record.begin),
        "ends_s": _seconds(record.end),
        "features": json.dumps(record.features, ensure_ascii=False),
        "agent": record.agent,
        "media_type": record.media_type,
        "payload": record.payload,
        "parts": json.dumps(record.parts),
        "digest": _digest(record.payload),
        "feature_set": json.dumps(tokens, ensure_ascii=False),
        "name_set": json.dumps(names, ensure_ascii=False),
        "feature_count": len(tokens),
        "name_count": len(names),
        "part_count": len(record.parts),
    }


def values_of(question: Question) -> dict[str, Any]:
    """What the statement of a question binds."""
    field, _, _ = question.kind.partition(".")
    asked = question.value
    found: dict[str, Any] = {} if question.limit is None else {"limit": question.limit}
    match field:
        case "type":
            return found | {"type": asked}
        case "payload":
            data = bytes.fromhex(asked)
            return found | {"payload": data, "digest": _digest(data)}
        case "features":
            return found | _wanted(_canonical(token(name, value) for name, value in asked))
        case "feature_names" | "parts" | "wholes":
            return found | _wanted(_canonical(asked))
        case "region":
            return found
        case _:
            times = {name: asked[name] for name in ("begin", "end", "type") if name in asked}
            return found | times | {f"{name}_s": _seconds(times[name]) for name in ("begin", "end") if name in times}


def order_of(question: Question) -> str:
    """The end of a question's statement."""
    match question.kind, question.limit:
        case _, None:
            return ""
        case "type.latest", _:
            return " ORDER BY e.begins DESC, e.number DESC LIMIT :limit"
        case _:
            return " ORDER BY e.begins, e.number LIMIT :limit"


def _canonical(texts: Iterable[str]) -> list[str]:
    return sorted(set(texts))


def _wanted(texts: list[str]) -> dict[str, Any]:
    whole = json.dumps(texts, ensure_ascii=False)
    return {"wanted": whole, "canonical": whole, "size": len(texts), "first": texts[0]}


def _digest(payload: bytes) -> bytes:
    return blake2b(payload, digest_size=16).digest()


def _seconds(micros: int) -> float:
    return micros / 1e6 - EPOCH
