"""Python's own SQLite with its R*Tree: boxes in space and time are indexed, exact places are tested by shapely.

What a competent user does with what is at hand: one table of events with indexes on type, begin and the
payload's hash; tables of features, links and the closure of the types; the set of features also as one
canonical text, so that equal sets are found by an index; an R*Tree of boxes in x, y and time, and one of
times alone. Regions are kept as well-known binary: SQLite prunes by boxes, and shapely has the last word.
"""

# ruff: noqa: S608 - statements are put together from constants

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

import shapely

from simulators.opponents.protocol import Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.sqlite_file import FIRST_RADIUS, ROUNDING, SqliteFile, square
from simulators.opponents.sides.sqlite_tables import COLUMNS, IS_A, Found, keep, row_of

_PLACE = (
    "CREATE VIRTUAL TABLE box USING rtree (number, west, east, south, north, begins, ends)",
    "CREATE TABLE place (number INTEGER PRIMARY KEY, region BLOB NOT NULL)",
)
_INSERT_PLACE = (
    "INSERT INTO box VALUES (:number, :west, :east, :south, :north, :begins_s, :ends_s)",
    "INSERT INTO place VALUES (:number, :region)",
)
_REGION = "(SELECT region FROM place p WHERE p.number = e.number)"
_MEETING = "b.west <= :east AND b.east >= :west AND b.south <= :north AND b.north >= :south"
_INSIDE = "b.west >= :west AND b.east <= :east AND b.south >= :south AND b.north <= :north"
_AROUND = "b.west <= :west AND b.east >= :east AND b.south <= :south AND b.north >= :north"
_BOX = "box b CROSS JOIN event e ON e.number = b.number"
_LATELY = "b.begins <= :end_s AND b.ends >= :begin_s AND e.begins <= :end AND e.ends >= :begin"
_PLACES: Mapping[str, str] = MappingProxyType(
    {
        "region.equal": f"{_BOX} WHERE {_AROUND}",
        "region.subset": f"{_BOX} WHERE {_INSIDE}",
        "region.superset": f"{_BOX} WHERE {_AROUND}",
        "region.intersects": f"{_BOX} WHERE {_MEETING}",
        "near": f"{_BOX} WHERE {_MEETING}",
        "near.lately": f"{_BOX} WHERE {_MEETING} AND {_LATELY}",
        "near.type": f"{_BOX} WHERE {_MEETING} AND {IS_A}",
        "nearest": f"{_BOX} WHERE {_MEETING}",
    }
)

Test = Callable[[Any], bool]


class SqliteRtree(SqliteFile):
    """A file of SQLite, written and asked through Python's `sqlite3`."""

    name = "sqlite_rtree"
    title = "SQLite R*Tree"
    why = (
        "A library in the user's own process: no round trip to a server, so what is small and by key is hard to beat; "
        "it knows boxes only, and Python tests the polygons."
    )
    abilities = everything_but({}, filtered=tuple(_PLACES))
    places = _PLACES

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        connection = sqlite3.connect(directory / "events.sqlite", isolation_level=None)
        super().__init__(connection, workload, mode, _PLACE)

    def version(self) -> str:
        """Those of SQLite and shapely."""
        return f"{sqlite3.sqlite_version}, shapely {version('shapely')}"

    def _keep(self, record: Record) -> None:
        row = row_of(record)
        if record.ring is None:
            keep(self._connection, row, ())
            return
        region = shapely.Polygon(record.ring)
        west, south, east, north = region.bounds
        box = {"west": west, "south": south, "east": east, "north": north}
        keep(self._connection, row | box | {"region": region.wkb}, _INSERT_PLACE)

    def _placed(self, question: Question, values: Mapping[str, Any]) -> list[Found]:
        """Those of the boxes that shapely confirms."""
        box, test = _exact(question)
        # The limit counts what is confirmed.
        order = "" if question.limit is None else " ORDER BY e.begins, e.number"
        rows = self._rows(f"{_PLACES[question.kind]}{order}", {**values, **box})
        return list(islice(filter(lambda row: test(row.region), rows), question.limit))

    def _rows(self, search: str, values: Mapping[str, Any]) -> Iterable[Found]:
        return map(Found._make, self._connection.execute(f"SELECT {COLUMNS}, {_REGION} FROM {search}", values))

    def _found(self, search: str, values: Mapping[str, Any]) -> list[Found]:
        return list(self._rows(search, values))

    def _nearest(self, question: Question, values: Mapping[str, Any]) -> list[Found]:
        x, y = question.value["x"], question.value["y"]
        point, radius = shapely.Point(x, y), FIRST_RADIUS
        (everything,) = self._connection.execute("SELECT count(*) FROM place").fetchone()
        search = f"SELECT e.number, {_REGION} FROM {_PLACES['nearest']}"
        while True:
            rows = self._connection.execute(search, {**values, **square(x, y, radius)}).fetchall()
            distances = shapely.distance(shapely.from_wkb([region for _, region in rows]), point).tolist()
            ranked = sorted(zip(distances, (number for number, _ in rows), strict=True))
            near = [number for distance, number in ranked if distance <= radius][: question.limit]
            if len(near) == question.limit or len(rows) == everything:
                break
            radius *= 2
        return [row for number in near for row in self._found("event e WHERE e.number = :number", {"number": number})]


def _exact(question: Question) -> tuple[dict[str, float], Test]:
    """The box that finds candidates for a question about a place, and the test of a candidate's region."""
    asked = question.value
    if question.kind.startswith("near"):
        point, metres = shapely.Point(asked["x"], asked["y"]), asked["metres"]
        shapely.prepare(point)
        return square(asked["x"], asked["y"], metres), lambda region: bool(
            shapely.dwithin(shapely.from_wkb(region), point, metres)
        )
    polygon = shapely.Polygon(asked)
    shapely.prepare(polygon)
    west, south, east, north = polygon.bounds
    wider = ROUNDING if question.kind == "region.subset" else 0.0
    box = {"west": west - wider, "south": south - wider, "east": east + wider, "north": north + wider}
    tests: Mapping[str, Callable[[Any], Any]] = {
        "region.equal": polygon.equals,
        "region.subset": polygon.covers,
        "region.superset": polygon.covered_by,
        "region.intersects": polygon.intersects,
    }
    test = tests[question.kind]
    return box, lambda region: bool(test(shapely.from_wkb(region)))


if __name__ == "__main__":
    serve(SqliteRtree)
