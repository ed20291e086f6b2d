"""DimOS: its memory of observations in SQLite, each with a time, a pose, tags and a pickled object.

An event is an observation in one stream, at its begin and its region's centroid, with all that is known of it as
its data. DimOS finds by time, by distance of the pose and by tags that are equal, and each tag has an index of its
own. So what is to be found becomes a tag: type and uid, digests of payload and sets, and what an event has several
of (features, their names, the kinds of its type) by its position among them, which takes a search for each
position. Links are observations of a second stream, tagged with both ends. Python has the last word about
polygons, ends and sets; what no tag can say (subsets) DimOS's `filter` asks of every observation, in Python too.

There is no index on time: it is added by hand, through a connection of one's own, once the stream is there.
There are no batches either: each append is a transaction, and a link's is not that of its event.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from hashlib import blake2b
from importlib.metadata import version
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pysqlite3
import shapely

from simulators.opponents.protocol import KINDS, Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.exact import Facts, fitting, related
from simulators.opponents.sides.points import Extents, Search, search_of
from simulators.opponents.sides.spelling import token

_NATIVE = ("type.exactly", "type.latest")
_FIRST_RADIUS = 2.0
"""Metres within which the nearest are looked for first; then four times as far."""
_FARTHEST = 1e5


class DimosSide:
    """Two streams in a file of SQLite."""

    name = "dimos_side"
    title = "DimOS memory"
    why = (
        "A library in the user's own process: equal tags are found in a tenth of a server's round trip; but each "
        "tag is one more index to write and each append a transaction, so that it loads at a third of elm's rate, "
        "and what is no equal tag goes through Python, observation by observation."
    )
    durability: Mapping[str, str] = MappingProxyType(
        {
            "durable": "SQLite's WAL with synchronous=FULL, set on DimOS's private connections for want of an option",
            "relaxed": "SQLite's WAL with synchronous=NORMAL, as DimOS sets it: the last commits may be lost",
        }
    )
    abilities = everything_but({}, filtered=[kind for kind in KINDS if kind not in _NATIVE])

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        file = directory / "memory.db"
        self._store = _store(file)
        self._events = self._store.stream("events", dict, eager_blobs=True)
        self._links = self._store.stream("links", int)
        own = pysqlite3.connect(file)
        own.execute("CREATE INDEX events_ts ON events (ts)")
        own.close()
        self._synchronous = "FULL" if mode == "durable" else "NORMAL"
        self._set_synchronous(self._synchronous)
        self._kinds = workload.closure
        self._extents = Extents()
        self._most: dict[str, int] = {}

    def version(self) -> str:
        """Those of DimOS and SQLite."""
        return f"{version('dimos')}, SQLite {pysqlite3.sqlite_version}"

    def commit(self, record: Record) -> object:
        """One observation, and one for each link."""
        data = {name: getattr(record, name) for name in Record.__slots__ if name != "ring"}
        data["region"] = None if record.ring is None else shapely.Polygon(record.ring).wkb
        when = record.begin / 1e6
        self._events.append(data, ts=when, pose=self._extents.note(record), tags=self._tags(record))
        for ordinal, part in enumerate(record.parts):
            self._links.append(ordinal, ts=when, tags={"part": part, "whole": record.uid})
        return None

    def load(self, records: Sequence[Record]) -> object:
        """One by one; flushed to the disk at the end in place of after each."""
        self._set_synchronous("NORMAL")
        for record in records:
            self.commit(record)
        _connection(self._events).execute("PRAGMA wal_checkpoint(FULL)").fetchall()
        self._set_synchronous(self._synchronous)
        return None

    def ask(self, question: Question) -> Sequence[Any]:
        """Observations, with all that is known of them as their data."""
        value = question.value
        field, _, relation = question.kind.partition(".")
        match field:
            case "type" if relation == "is_a":
                return self._first_of(question, self._tagged("kind", value))
            case "type":
                return self._first_of(question, [self._events.tags(type=value)])
            case "payload":
                return self._first_of(question, [self._events.tags(payload=_digest(bytes.fromhex(value)))])
            case "time" | "window":
                return self._first_of(question, [self._begun(self._events, question)])
            case "region" | "near":
                return self._first_of(question, self._around(search_of(question), question))
            case "nearest":
                return self._nearest(question)
            case "features":
                return self._with(question, relation, [token(name, given) for name, given in value])
            case "feature_names":
                return self._with(question, relation, value)
            case _:
                return self._related(question, relation)

    def uid_of(self, row: Any) -> str:
        """That in its data."""
        uid: str = row.data["uid"]
        return uid

    def close(self) -> None:
        """Close the file."""
        self._store.stop()

    def _tags(self, record: Record) -> dict[str, str]:
        several = {
            "kind": self._kinds[record.type],
            "features": sorted({token(name, value) for name, value in record.features}),
            "feature_names": sorted({name for name, _ in record.features}),
        }
        tags = {"uid": record.uid, "type": record.type, "payload": _digest(record.payload)}
        for name, texts in several.items():
            self._most[name] = max(self._most.get(name, 0), len(texts))
            tags |= {f"{name}_{position}": text for position, text in enumerate(texts)}
        tags |= {name: _digest_of(several[name]) for name in ("features", "feature_names")}
        return tags

    def _tagged(self, name: str, text: str) -> Iterator[Any]:
        """The streams of observations that have the text among several: one for each position that it may have."""
        return (self._events.tags(**{f"{name}_{position}": text}) for position in range(self._most.get(name, 0)))

    def _first_of(
        self, question: Question, streams: Iterable[Any], keep: Callable[[Any], bool] = lambda row: True
    ) -> list[Any]:
        """What fits of several streams, of each only the first, or the latest, if there is a limit."""
        # Of what is found by time and place not all fits.
        limit = None if question.kind.startswith(("time", "window", "region", "near")) else question.limit
        rows = {}
        for stream in streams:
            for row in self._ordered(stream, question, limit, keep):
                rows[row.id] = row
        return self._fitting(question, rows.values())

    def _ordered(
        self, stream: Any, question: Question, limit: int | None, keep: Callable[[Any], bool]
    ) -> Iterator[Any]:
        """A stream's rows that are kept; with a limit in order of time, until there are enough.

        Those as old as the last one count, for DimOS does not order them further.
        """
        if limit is None:
            yield from filter(keep, stream)
            return
        found, last = 0, -inf
        for row in stream.order_by("ts", desc=question.kind == "type.latest"):
            if found >= limit and row.ts != last:
                return
            if keep(row):
                found, last = found + 1, row.ts
                yield row

    def _fitting(self, question: Question, rows: Iterable[Any]) -> list[Any]:
        return fitting(question, rows, _facts, self._kinds)

    def _begun(self, stream: Any, question: Question) -> Any:
        """The stream, as far as an interval that began then may answer."""
        begins = self._extents.begins(question)
        return stream if begins is None else stream.time_range(begins[0] / 1e6, begins[1] / 1e6)

    def _around(self, search: Search, question: Question) -> Iterator[Any]:
        for circle in self._extents.circles(search):
            yield self._begun(self._events.near(circle.centre, circle.radius), question)

    def _nearest(self, question: Question) -> list[Any]:
        """Regions in a circle that is widened until it holds enough."""
        x, y, metres = question.value["x"], question.value["y"], _FIRST_RADIUS
        while True:
            found = self._first_of(question, self._around(Search(x, y, metres, reaches=True), question))
            enough = sum(_distance(row, x, y) <= metres for row in found)
            if enough == question.limit or metres > _FARTHEST:
                return found
            metres *= 4

    def _with(self, question: Question, relation: str, texts: Sequence[str]) -> list[Any]:
        """By a digest of the set, by one of its members, by all of them, or by looking at every observation."""
        field, _, _ = question.kind.partition(".")
        wanted = set(texts)

        def keep(row: Any) -> bool:
            return related(relation, set(_several(field, row.data)), wanted)

        if relation == "equal":
            return self._first_of(question, [self._events.tags(**{field: _digest_of(sorted(wanted))})], keep)
        if relation == "subset" or not wanted:
            return self._first_of(question, [self._events.filter(keep)])
        asked = wanted if relation == "intersects" else {min(wanted)}
        return self._first_of(question, (stream for text in asked for stream in self._tagged(field, text)), keep)

    def _related(self, question: Question, relation: str) -> list[Any]:
        """Events that have these parts, or these wholes."""
        field, _, _ = question.kind.partition(".")
        own, other = ("whole", "part") if field == "parts" else ("part", "whole")
        wanted = set(question.value)

        def keep(row: Any) -> bool:
            if field == "parts":
                return related(relation, set(row.data["parts"]), wanted)
            return related(relation, {link.tags["whole"] for link in self._links.tags(part=row.data["uid"])}, wanted)

        if relation == "subset" or not wanted:
            return self._first_of(question, [self._events.filter(keep)])
        asked = wanted if relation == "intersects" else {min(wanted)}
        uids = {link.tags[own] for uid in asked for link in self._links.tags(**{other: uid})}
        return self._first_of(question, (self._events.tags(uid=uid) for uid in uids), keep)

    def _set_synchronous(self, value: str) -> None:
        for stream in (self._events, self._links):
            _connection(stream).execute(f"PRAGMA synchronous={value}")


def _store(file: Path) -> Any:
    """A store of DimOS, which is imported only now: it loads an extension, which Python's SQLite may refuse."""
    sys.modules["sqlite3"] = pysqlite3
    # Otherwise it writes logs into the user's home.
    os.environ["DIMOS_RUN_LOG_DIR"] = str(file.parent)
    from dimos.memory.store.sqlite import SqliteStore

    return SqliteStore(path=str(file))


def _connection(stream: Any) -> Any:
    return stream._source.metadata_store._conn


def _facts(row: Any) -> Facts:
    facts: Facts = row.data
    return facts


def _distance(row: Any, x: float, y: float) -> float:
    return float(shapely.distance(shapely.from_wkb(row.data["region"]), shapely.Point(x, y)))


def _several(field: str, data: Facts) -> Iterator[str]:
    return (token(name, value) if field == "features" else name for name, value in data["features"])


def _digest_of(texts: Iterable[str]) -> str:
    return _digest("\x1f".join(texts).encode())


def _digest(data: bytes) -> str:
    return blake2b(data, digest_size=16).hexdigest()


if __name__ == "__main__":
    serve(DimosSide)
