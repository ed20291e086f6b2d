"""DuckDB with its spatial extension: one wide table in a file, polygons under an R-tree, sets as list columns.

A type's kinds are a table of its closure, the wholes of an event a table of links. DuckDB compares lists as sets,
polygons exactly, all in SQL. It has no index for lists: what a digest of the set does not answer reads a column
of the whole table. It has none for the nearest polygon either: circles that grow until they hold enough use the
R-tree, and beat sorting all events by distance from some ten thousand on.

Every commit is flushed to the disk, and there is no setting that says otherwise: it has no relaxed mode.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import Any

import duckdb
import duckdb_extension_spatial
import pyarrow as pa

from simulators.opponents.protocol import Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.spelling import polygon, token

_TABLES = """
CREATE TABLE event (
    number BIGINT PRIMARY KEY,
    uid UUID NOT NULL,
    type VARCHAR NOT NULL,
    begin_time TIMESTAMP NOT NULL,
    end_time TIMESTAMP NOT NULL,
    region GEOMETRY,
    features VARCHAR NOT NULL,
    tokens VARCHAR[] NOT NULL,
    token_digest VARCHAR NOT NULL,
    names VARCHAR[] NOT NULL,
    name_digest VARCHAR NOT NULL,
    agent VARCHAR NOT NULL,
    payload BLOB NOT NULL,
    payload_digest VARCHAR NOT NULL,
    media_type VARCHAR,
    parts UUID[] NOT NULL
);
CREATE TABLE link (part UUID NOT NULL, whole UUID NOT NULL);
CREATE TABLE kind (type VARCHAR NOT NULL, ancestor VARCHAR NOT NULL);
CREATE INDEX event_region ON event USING RTREE (region);
CREATE INDEX event_uid ON event (uid);
CREATE INDEX event_type ON event (type);
CREATE INDEX event_tokens ON event (token_digest);
CREATE INDEX event_names ON event (name_digest);
CREATE INDEX event_payload ON event (payload_digest);
CREATE INDEX link_part ON link (part);
CREATE INDEX link_whole ON link (whole);
"""

_FIELDS = {
    "number": pa.int64(),
    "uid": pa.string(),
    "type": pa.string(),
    "begin_time": pa.int64(),
    "end_time": pa.int64(),
    "region": pa.binary(),
    "features": pa.string(),
    "tokens": pa.list_(pa.string()),
    "names": pa.list_(pa.string()),
    "agent": pa.string(),
    "payload": pa.binary(),
    "media_type": pa.string(),
    "parts": pa.list_(pa.string()),
}
_INSERT = """
INSERT INTO event
SELECT number, uid::UUID, type, make_timestamp(begin_time), make_timestamp(end_time), ST_GeomFromWKB(region),
    features, tokens, md5(to_json(tokens)), names, md5(to_json(names)), agent, payload, md5(payload), media_type,
    parts::UUID[]
"""
_INSERT_ONE = """
INSERT INTO event VALUES ($number, $uid, $type, make_timestamp($begin_time), make_timestamp($end_time),
    ST_GeomFromWKB($region::BLOB), $features, $tokens::VARCHAR[], md5(to_json($tokens::VARCHAR[])), $names::VARCHAR[],
    md5(to_json($names::VARCHAR[])), $agent, $payload::BLOB, md5($payload::BLOB), $media_type, $parts)
"""

_SELECT = """
SELECT uid, type, begin_time, end_time, ST_AsWKB(region), features, agent, payload, media_type, parts FROM event
"""
_WINDOW = "begin_time <= make_timestamp($end) AND end_time >= make_timestamp($begin)"
_POLYGON = "ST_GeomFromWKB($polygon)"
_POINT = "ST_Point($x, $y)"
# The R-tree serves ST_Intersects and not ST_DWithin.
_NEAR = f"""
ST_Intersects(region, ST_MakeEnvelope($x - $metres, $y - $metres, $x + $metres, $y + $metres))
AND ST_DWithin(region, {_POINT}, $metres)
"""
_IS_A = "type IN (SELECT type FROM kind WHERE ancestor = $type)"
_OF_ALL_WHOLES = """
uid IN (SELECT part FROM link WHERE whole IN (SELECT unnest($set::UUID[])) GROUP BY part HAVING count(*) = len($set))
"""
_OF_OTHERS = "SELECT part FROM link WHERE whole NOT IN (SELECT unnest($set::UUID[]))"
_CONDITIONS = {
    "type.exactly": "type = $type",
    "type.is_a": _IS_A,
    "payload.equal": "payload_digest = md5($payload::BLOB) AND payload = $payload::BLOB",
    "time.equal": "begin_time = make_timestamp($begin) AND end_time = make_timestamp($end)",
    "time.subset": "begin_time >= make_timestamp($begin) AND end_time <= make_timestamp($end)",
    "time.superset": "begin_time <= make_timestamp($begin) AND end_time >= make_timestamp($end)",
    "time.intersects": _WINDOW,
    "window": _WINDOW,
    "region.equal": f"ST_Equals(region, {_POLYGON})",
    "region.subset": f"ST_CoveredBy(region, {_POLYGON})",
    "region.superset": f"ST_Covers(region, {_POLYGON})",
    "region.intersects": f"ST_Intersects(region, {_POLYGON})",
    "wholes.equal": f"{_OF_ALL_WHOLES} AND uid NOT IN ({_OF_OTHERS})",
    "wholes.subset": f"uid NOT IN ({_OF_OTHERS})",
    "wholes.superset": _OF_ALL_WHOLES,
    "wholes.intersects": "uid IN (SELECT part FROM link WHERE whole IN (SELECT unnest($set::UUID[])))",
    "near": _NEAR,
    "near.lately": f"{_NEAR} AND {_WINDOW}",
    "near.type": f"{_NEAR} AND {_IS_A}",
    "type.latest": "type = $type",
}
_EQUAL = {
    "parts": "len(parts) = len($set) AND list_has_all(parts, $set::UUID[])",
    "features": "token_digest = md5(to_json($set::VARCHAR[])) AND tokens = $set::VARCHAR[]",
    "feature_names": "name_digest = md5(to_json($set::VARCHAR[])) AND names = $set::VARCHAR[]",
}
_NO_WHOLES = {
    "wholes.equal": "uid NOT IN (SELECT part FROM link)",
    "wholes.subset": "uid NOT IN (SELECT part FROM link)",
    "wholes.superset": "true",
    "wholes.intersects": "false",
}
_SETS = {"parts": ("parts", "UUID[]"), "features": ("tokens", "VARCHAR[]"), "feature_names": ("names", "VARCHAR[]")}
_ORDERS = {
    "type.latest": "begin_time DESC, number DESC",
    "nearest": f"ST_Distance(region, {_POINT}), number",
}
_CIRCLES = (2.0, 8.0, 32.0, 128.0, 1e10)
"""Radii in metres in which the nearest are looked for."""


class DuckDBSide:
    """A database file, with all that is indexable indexed."""

    name = "duckdb_side"
    title = "DuckDB + spatial"
    why = (
        "An analytical engine in the user's process: it loads whole columns several times as fast as elm loads "
        "events; but it plans every statement anew over a wide table, so that a commit takes three to four times "
        "elm's and a small answer about twice, and sets without a digest read a column of all events."
    )
    durability: Mapping[str, str] = MappingProxyType({"durable": "each commit flushes the write-ahead log to the disk"})
    abilities = everything_but({}, filtered=["nearest"])

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        self._connection = duckdb.connect(str(directory / "events.duckdb"))
        extension = next(Path(duckdb_extension_spatial.__file__).parent.rglob("spatial.duckdb_extension"))
        self._connection.load_extension(str(extension))
        self._connection.execute(_TABLES)
        # In this order the rows of an ancestor lie together, which serves a thousand of them better than an index.
        kinds = [(name, ancestor) for ancestor, names in workload.descendants.items() for name in names]
        below, above = zip(*sorted(kinds, key=itemgetter(1)), strict=True)
        closure = pa.table({"type": pa.array(below), "ancestor": pa.array(above)})
        self._insert("INSERT INTO kind SELECT type, ancestor", closure)

    def version(self) -> str:
        """DuckDB's; the extension is of the same release."""
        return str(duckdb.__version__)

    def commit(self, record: Record) -> object:
        """One row by a statement, and in the same transaction those of its links."""
        if not record.parts:
            return self._connection.execute(_INSERT_ONE, _row(record))
        self._connection.begin()
        self._connection.execute(_INSERT_ONE, _row(record))
        links = {"parts": list(record.parts), "whole": record.uid}
        self._connection.execute("INSERT INTO link SELECT unnest($parts::UUID[]), $whole::UUID", links)
        return self._connection.commit()

    def load(self, records: Sequence[Record]) -> object:
        """All rows from an Arrow table, in one transaction."""
        rows = [_row(record) for record in records]
        events = pa.table({name: pa.array([row[name] for row in rows], kind) for name, kind in _FIELDS.items()})
        self._connection.begin()
        self._insert(_INSERT, events)
        self._connection.execute(
            "INSERT INTO link SELECT unnest(parts), uid FROM event WHERE number BETWEEN ? AND ? AND len(parts) > 0",
            [records[0].number, records[-1].number],
        )
        return self._connection.commit()

    def ask(self, question: Question) -> Sequence[Any]:
        """Rows as tuples, fetched by one statement."""
        if question.kind == "nearest":
            return self._nearest(question)
        condition, values = _condition(question)
        return self._rows(question, condition, values)

    def _nearest(self, question: Question) -> list[Any]:
        """Those in the first circle that holds enough; in the last one are all events."""
        found: list[Any] = []
        for metres in _CIRCLES:
            found = self._rows(question, _NEAR, {**question.value, "metres": metres})
            if len(found) == question.limit:
                break
        return found

    def _rows(self, question: Question, condition: str, values: Mapping[str, Any]) -> list[Any]:
        statement = f"{_SELECT} WHERE {condition}"
        if question.limit is not None:
            order = _ORDERS.get(question.kind, "begin_time, number")
            statement = f"{statement} ORDER BY {order} LIMIT {question.limit}"
        rows: list[Any] = self._connection.execute(statement, values).fetchall()
        return rows

    def uid_of(self, row: Any) -> str:
        """Its first column."""
        return str(row[0].hex)

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def _insert(self, statement: str, table: pa.Table) -> None:
        self._connection.register("arrow_table", table)
        self._connection.execute(f"{statement} FROM arrow_table")
        self._connection.unregister("arrow_table")


def _condition(question: Question) -> tuple[str, dict[str, Any]]:
    """The condition of a question, and its values by name."""
    kind, value = question.kind, question.value
    field, _, relation = kind.partition(".")
    if field in _SETS:
        return _set_condition(field, relation, value)
    if field == "wholes":
        return (_CONDITIONS[kind], {"set": value}) if value else (_NO_WHOLES[kind], {})
    if field == "region":
        return _CONDITIONS[kind], {"polygon": polygon(value)}
    if field == "payload":
        return _CONDITIONS[kind], {"payload": bytes.fromhex(value)}
    if field == "type":
        return _CONDITIONS[kind], {"type": value}
    return _CONDITIONS[kind], dict(value)


def _set_condition(field: str, relation: str, value: Sequence[Any]) -> tuple[str, dict[str, Any]]:
    """The relation of a list column, which has no repetitions, to a set."""
    column, kind = _SETS[field]
    tokens = [token(name, given) for name, given in value] if field == "features" else value
    given = f"$set::{kind}"
    relations = {
        "equal": _EQUAL[field],
        "subset": f"list_has_all({given}, {column})",
        "superset": f"list_has_all({column}, {given})",
        "intersects": f"list_has_any({column}, {given})",
    }
    return relations[relation], {"set": sorted(set(tokens))}


def _row(record: Record) -> dict[str, Any]:
    return {
        "number": record.number,
        "uid": record.uid,
        "type": record.type,
        "begin_time": record.begin,
        "end_time": record.end,
        "region": None if record.ring is None else polygon(record.ring),
        "features": json.dumps(record.features),
        "tokens": sorted({token(name, value) for name, value in record.features}),
        "names": sorted({name for name, _ in record.features}),
        "agent": record.agent,
        "payload": record.payload,
        "media_type": record.media_type,
        "parts": list(record.parts),
    }


if __name__ == "__main__":
    serve(DuckDBSide)
