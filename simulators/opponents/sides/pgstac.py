"""pgstac: events as STAC items, which PostgreSQL and PostGIS keep and search, on the server that elm is measured on.

An item has a polygon, a begin and an end, and properties. As a competent user would, all that is searched for
is declared as queryable and indexed: the type, the types above it, features and their names as arrays under
GIN, the uids of the parts, a hash of the payload. Statistics of partitions go through pgstac's queue instead of
delaying every item, and the server does not compile its short statements (`jit=off`).

pgstac knows degrees only: metres are multiplied by a power of two, small enough for the map to fit; that changes
no digit of a coordinate, and since PostGIS computes with degrees as with any plane, no answer. An item does not
know what it is part of: that takes several searches.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from math import ceil, log2
from pathlib import Path
from types import MappingProxyType
from typing import Any

import psycopg
import shapely
from psycopg.types.json import Json, Jsonb
from pypgstac.db import PgstacDB
from pypgstac.load import Loader, Methods
from pypgstac.migrate import Migrate

from simulators.opponents.protocol import Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.cql import Item, cql, digest, ids, named, timestamp, tokens, when

_COLLECTION = "events"
_SETTINGS = "-c jit=off -c pgstac.use_queue=true"
_MOST = 10_000
"""Items that a search is asked for at most: pgstac's own default is ten."""
_LATITUDE = 80.0
"""Greatest coordinate in degrees, either way."""
_FIRST_RADIUS = 1.0
_SORTED = [{"field": "datetime", "direction": "asc"}, {"field": "id", "direction": "asc"}]
_LATEST = [{"field": "datetime", "direction": "desc"}, {"field": "id", "direction": "desc"}]
_ARRAY = {"type": "array", "items": {"type": "string"}}
_QUERYABLES = MappingProxyType(
    {
        "kind": {"type": "string"},
        "digest": {"type": "string"},
        "kinds": _ARRAY,
        "tokens": _ARRAY,
        "names": _ARRAY,
        "parts": _ARRAY,
    }
)
_SETS = MappingProxyType(
    {"equal": "a_equals", "subset": "a_contained_by", "superset": "a_contains", "intersects": "a_overlaps"}
)
_PLACES = MappingProxyType(
    {"equal": "s_equals", "subset": "s_within", "superset": "s_contains", "intersects": "s_intersects"}
)
"""Between polygons within is what covered by is, and contains what covers is."""


class Pgstac:
    """A collection of items in a database of its own, loaded and searched through `pypgstac`."""

    name = "pgstac"
    title = "pgstac"
    why = (
        "The same server and the same kinds of indexes, behind a catalogue's interface: each search is JSON that "
        "functions in the database turn into SQL, and each item is JSON put together anew."
    )
    durability: Mapping[str, str] = MappingProxyType(
        {
            "durable": "PostgreSQL, synchronous_commit=on: a commit waits for the disk",
            "relaxed": "PostgreSQL, synchronous_commit=off",
        }
    )
    abilities = everything_but(
        {"wholes.subset": "an item does not know what it is part of"},
        filtered=(
            *("near", "near.lately", "near.type", "nearest"),
            *("wholes.equal", "wholes.superset", "wholes.intersects"),
        ),
    )

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        if dsn is None:
            raise ValueError("pgstac is given the DSN of a database of its own")
        setting = "on" if mode == "durable" else "off"
        conninfo = psycopg.conninfo.make_conninfo(dsn, options=f"-c synchronous_commit={setting} {_SETTINGS}")
        self._closure = workload.closure
        farthest = max((abs(number) for r in workload.records for c in r.ring or () for number in c), default=1.0)
        self._scale = 2.0 ** -max(0, ceil(log2(farthest / _LATITUDE)))
        self._db = PgstacDB(dsn=conninfo)
        Migrate(self._db).run_migration()
        self._loader = Loader(self._db)
        self._loader.load_collections(iter([_collection()]), Methods.insert)
        for name, definition in _QUERYABLES.items():
            index = "GIN" if definition is _ARRAY else "BTREE"
            call = "SELECT upsert_queryable(%s, %s::jsonb, NULL, %s)"
            self._db.connect().execute(call, [name, Json(definition), index])

    def version(self) -> str:
        """Those of pypgstac, which is that of the schema, and of PostgreSQL."""
        return f"{version('pypgstac')}, PostgreSQL {self._db.query_one('SHOW server_version')}"

    def commit(self, record: Record) -> object:
        """Create one item."""
        return self._db.connect().execute("SELECT create_item(%s)", [Jsonb(self._item(record))])

    def load(self, records: Sequence[Record]) -> object:
        """pypgstac's bulk loader, then what was left to the queue, and statistics for the planner."""
        self._loader.load_items(map(self._item, records), Methods.insert)
        self._db.connect().execute("CALL run_queued_queries()")
        return self._db.connect().execute("VACUUM ANALYZE")

    def ask(self, question: Question) -> Sequence[Item]:
        """Items as dictionaries; places that CQL2 cannot say are searched by box and tested by shapely."""
        kind, asked = question.kind, question.value
        if kind == "nearest":
            return self._nearest(asked, question.limit)
        if kind == "type.latest":
            return self._search(cql("=", named("kind"), asked), _LATEST, question.limit)
        if kind.startswith("wholes"):
            return self._parts_of(kind, asked, question.limit)
        if not kind.startswith("near"):
            return self._search(self._filter(kind, asked), _SORTED, question.limit)
        point, metres = shapely.Point(asked["x"], asked["y"]), asked["metres"]
        found = self._search(self._near(kind, asked), _SORTED, None)
        polygons = [self._metric(item) for item in found]
        tested = shapely.dwithin(polygons, point, metres)
        return [item for item, is_near in zip(found, tested, strict=True) if is_near][: question.limit]

    def uid_of(self, row: Item) -> str:
        """The item's id."""
        return str(row["id"])

    def close(self) -> None:
        """Close the connection."""
        self._db.close()

    def _search(self, cql: Item, order: list[Item], limit: int | None) -> list[Item]:
        search = {
            "collections": [_COLLECTION],
            "filter-lang": "cql2-json",
            "filter": cql,
            "sortby": order,
            "limit": limit or _MOST,
        }
        found: Any = self._db.query_one("SELECT search(%s)", [Jsonb(search)])
        return list(found["features"])

    def _filter(self, kind: str, asked: Any) -> Item:
        field, _, relation = kind.partition(".")
        match field:
            case "type" if relation == "exactly":
                return cql("=", named("kind"), asked)
            case "type":
                return cql("a_contains", named("kinds"), [asked])
            case "payload":
                return cql("=", named("digest"), digest(bytes.fromhex(asked)))
            case "time" | "window":
                return when(relation or "intersects", asked)
            case "region":
                return cql(_PLACES[relation], named("geometry"), self._polygon(asked))
            case "features":
                return cql(_SETS[relation], named("tokens"), tokens(asked))
            case "feature_names":
                return cql(_SETS[relation], named("names"), sorted(set(asked)))
            case "parts":
                return cql(_SETS[relation], named("parts"), sorted(set(asked)))
            case _:
                raise ValueError(f"pgstac is not told how to search for {kind!r}")

    def _near(self, kind: str, asked: Any) -> Item:
        box = self._box(asked["x"], asked["y"], asked["metres"])
        match kind:
            case "near":
                return box
            case "near.lately":
                return cql("and", box, when("intersects", asked))
            case _:
                return cql("and", box, self._filter("type.is_a", asked["type"]))

    def _nearest(self, asked: Any, limit: int | None) -> list[Item]:
        """Boxes around the point, each twice as large as the one before, until enough items are that near."""
        x, y, radius = asked["x"], asked["y"], _FIRST_RADIUS
        while True:
            found = self._search(self._box(x, y, radius), _SORTED, None)
            polygons = [self._metric(item) for item in found]
            distances = shapely.distance(polygons, shapely.Point(x, y))
            ranked = sorted(
                (distance, item["properties"]["number"], item)
                for distance, item in zip(distances, found, strict=True)
                if distance <= radius
            )
            if len(ranked) >= (limit or _MOST) or radius * self._scale > _LATITUDE:
                return [item for _, _, item in ranked][:limit]
            radius *= 2

    def _parts_of(self, kind: str, wholes: Sequence[str], limit: int | None) -> list[Item]:
        """What the wholes have as parts, by their ids: of all wholes, or of some; and of no others, where equal."""
        lists = [item["properties"]["parts"] for item in self._search(ids(wholes), _SORTED, None)]
        wanted = set(wholes)
        found = {uid for parts in lists for uid in parts}
        if kind != "wholes.intersects":
            found = found.intersection(*lists) if len(lists) == len(wanted) else set()
        if kind == "wholes.equal" and found:
            holders = self._search(cql("a_overlaps", named("parts"), sorted(found)), _SORTED, None)
            found -= {uid for item in holders if item["id"] not in wanted for uid in item["properties"]["parts"]}
        return self._search(ids(sorted(found)), _SORTED, limit) if found else []

    def _item(self, record: Record) -> Item:
        return {
            "type": "Feature",
            "stac_version": "1.0.0",
            "id": record.uid,
            "collection": _COLLECTION,
            "geometry": None if record.ring is None else self._polygon(record.ring),
            "properties": {
                "datetime": timestamp(record.begin),
                "start_datetime": timestamp(record.begin),
                "end_datetime": timestamp(record.end),
                "number": record.number,
                "kind": record.type,
                "kinds": self._closure[record.type],
                "features": record.features,
                "tokens": tokens(record.features),
                "names": sorted({name for name, _ in record.features}),
                "agent": record.agent,
                "media_type": record.media_type,
                "payload": b64encode(record.payload).decode(),
                "digest": digest(record.payload),
                "parts": sorted(record.parts),
            },
            "assets": {},
            "links": [],
        }

    def _polygon(self, ring: Sequence[Sequence[float]]) -> Item:
        return {"type": "Polygon", "coordinates": [[[x * self._scale, y * self._scale] for x, y in ring]]}

    def _box(self, x: float, y: float, radius: float) -> Item:
        west, east, south, north = x - radius, x + radius, y - radius, y + radius
        ring = [(west, south), (east, south), (east, north), (west, north), (west, south)]
        return cql("s_intersects", named("geometry"), self._polygon(ring))

    def _metric(self, item: Item) -> shapely.Polygon:
        """Where it was, in metres again."""
        return shapely.Polygon([(x / self._scale, y / self._scale) for x, y in item["geometry"]["coordinates"][0]])


def _collection() -> Item:
    return {
        "id": _COLLECTION,
        "type": "Collection",
        "stac_version": "1.0.0",
        "description": "What a robot did",
        "license": "proprietary",
        "extent": {"spatial": {"bbox": [[-180, -90, 180, 90]]}, "temporal": {"interval": [[None, None]]}},
        "links": [],
    }


if __name__ == "__main__":
    serve(Pgstac)
