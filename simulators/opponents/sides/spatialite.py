"""SpatiaLite: SQLite with exact polygons in SQL, through apsw, for Python's own sqlite3 often cannot load it.

The tables are those of the SQLite side, and with them the R*Tree of times; the region is a column of
SpatiaLite with its spatial index, whose R*Tree finds the boxes and whose GEOS functions test the polygons.
"""

# ruff: noqa: S608 - statements are put together from constants

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import apsw

from simulators.opponents.protocol import Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.spelling import polygon
from simulators.opponents.sides.sqlite_file import FIRST_RADIUS, ROUNDING, SqliteFile, square
from simulators.opponents.sides.sqlite_tables import COLUMNS, IS_A, Found, keep, order_of, row_of

_EXTENSION = "mod_spatialite"
_PLACE = (
    "SELECT InitSpatialMetaDataFull(1)",
    "CREATE TABLE place (number INTEGER PRIMARY KEY)",
    "SELECT AddGeometryColumn('place', 'region', -1, 'POLYGON', 'XY', 1)",
    "SELECT CreateSpatialIndex('place', 'region')",
)
_INSERT_PLACE = ("INSERT INTO place VALUES (:number, GeomFromWKB(:region, -1))",)
_INDEX = "idx_place_region b CROSS JOIN place p ON p.number = b.pkid CROSS JOIN event e ON e.number = b.pkid"
_MEETING = "b.xmin <= :east AND b.xmax >= :west AND b.ymin <= :north AND b.ymax >= :south"
_INSIDE = "b.xmin >= :west AND b.xmax <= :east AND b.ymin >= :south AND b.ymax <= :north"
_AROUND = "b.xmin <= :west AND b.xmax >= :east AND b.ymin <= :south AND b.ymax >= :north"
_NEAR = "ST_Distance(p.region, MakePoint(:x, :y)) <= :metres"
_ASKED = "GeomFromWKB(:region, -1)"
_LATELY = "e.begins <= :end AND e.ends >= :begin"
_PLACES: Mapping[str, str] = MappingProxyType(
    {
        "region.equal": f"{_INDEX} WHERE {_AROUND} AND ST_Equals(p.region, {_ASKED}) = 1",
        "region.subset": f"{_INDEX} WHERE {_INSIDE} AND CoveredBy(p.region, {_ASKED}) = 1",
        "region.superset": f"{_INDEX} WHERE {_AROUND} AND Covers(p.region, {_ASKED}) = 1",
        "region.intersects": f"{_INDEX} WHERE {_MEETING} AND ST_Intersects(p.region, {_ASKED}) = 1",
        "near": f"{_INDEX} WHERE {_MEETING} AND {_NEAR}",
        "near.lately": f"{_INDEX} WHERE {_MEETING} AND {_LATELY} AND {_NEAR}",
        "near.type": f"{_INDEX} WHERE {_MEETING} AND {IS_A} AND {_NEAR}",
    }
)
_NEAREST = (
    f"{_INDEX} WHERE {_MEETING} AND {_NEAR} ORDER BY ST_Distance(p.region, MakePoint(:x, :y)), e.number LIMIT :limit"
)


class SpatiaLite(SqliteFile):
    """A file of SpatiaLite, written and asked through apsw."""

    name = "spatialite"
    title = "SpatiaLite"
    why = (
        "SQLite in the user's own process, with exact polygons: no round trip to a server, one writer; its triggers "
        "check each polygon in SQL."
    )
    abilities = everything_but({}, filtered=("nearest",))
    places = _PLACES

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        connection = apsw.Connection(str(directory / "events.spatialite"))
        connection.enable_load_extension(True)
        connection.load_extension(_EXTENSION)
        super().__init__(connection, workload, mode, _PLACE)

    def version(self) -> str:
        """Those of SpatiaLite, its GEOS, and SQLite."""
        found = self._connection.execute("SELECT spatialite_version(), geos_version(), sqlite_version()").fetchall()
        spatialite, geos, sqlite = found[0]
        return f"{spatialite}, GEOS {geos}, SQLite {sqlite}"

    def _keep(self, record: Record) -> None:
        row = row_of(record)
        if record.ring is None:
            keep(self._connection, row, ())
        else:
            keep(self._connection, row | {"region": polygon(record.ring)}, _INSERT_PLACE)

    def _placed(self, question: Question, values: Mapping[str, Any]) -> list[Found]:
        return self._found(f"{_PLACES[question.kind]}{order_of(question)}", {**values, **_place(question)})

    def _found(self, search: str, values: Mapping[str, Any]) -> list[Found]:
        region = "p.region" if " place p " in search else "(SELECT region FROM place q WHERE q.number = e.number)"
        rows = self._connection.execute(f"SELECT {COLUMNS}, ST_AsBinary({region}) FROM {search}", values)
        return list(map(Found._make, rows))

    def _nearest(self, question: Question, values: Mapping[str, Any]) -> list[Found]:
        x, y = question.value["x"], question.value["y"]
        ((everything,),) = self._connection.execute("SELECT count(*) FROM place").fetchall()
        radius = FIRST_RADIUS
        while True:
            found = self._found(_NEAREST, {**values, **_around(x, y, radius)})
            if len(found) >= min(question.limit or everything, everything):
                return found
            radius *= 2


def _place(question: Question) -> dict[str, Any]:
    asked = question.value
    if question.kind.startswith("near"):
        return _around(asked["x"], asked["y"], asked["metres"])
    xs, ys = [x for x, _ in asked], [y for _, y in asked]
    wider = ROUNDING if question.kind == "region.subset" else 0.0
    box = {"west": min(xs) - wider, "south": min(ys) - wider, "east": max(xs) + wider, "north": max(ys) + wider}
    return {**box, "region": polygon(asked)}


def _around(x: float, y: float, metres: float) -> dict[str, float]:
    return {**square(x, y, metres), "x": x, "y": y, "metres": metres}


if __name__ == "__main__":
    serve(SpatiaLite)
