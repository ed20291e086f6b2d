"""eMEM: its store of observations at points in space and time, without the models that it can do without.

An event is an observation at its region's centroid and at its begin, in the layer of its type (what eMEM can be
asked for by name), from its agent as the source; all else is metadata. Its parts are the observations that it
summarizes, by eMEM's edges. eMEM finds by layer, time, place and edge; Python has the last word about polygons
and ends. It cannot be asked for metadata, so there is no way to find features or payloads but to read everything,
which is not done here. Kinds of types are asked for one layer after the other.

The R-tree is in memory and built anew when a store is opened. Edges are a second transaction: a power cut may
leave a complex event without its links. The vector index, which needs embeddings, stays empty.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import shapely
from emem.config import SpatioTemporalMemoryConfig
from emem.store import MemoryStore
from emem.types import Edge, EdgeType, ObservationNode

from simulators.opponents.protocol import KINDS, Question, Record, Workload, everything_but, serve
from simulators.opponents.sides.exact import fitting, related
from simulators.opponents.sides.points import NOWHERE, Extents, Search, search_of

_ALL = 1 << 40
"""A number of results that is none: eMEM wants to be given one."""
_PAGE = 256
"""Observations read at once where a scan is expected to find enough early."""
_METADATA = "metadata cannot be asked for"


class EmemSide:
    """A store in a file of SQLite, with its R-tree in memory."""

    name = "emem_side"
    title = "eMEM"
    why = (
        "A library in the user's own process: what its indexes of layer, time, place and edge find is there in a "
        "fraction of a server's round trip; but it keeps points and cannot search metadata, so that Python reads "
        "all that large circles and many sub-types bring, and features and payloads cannot be asked for."
    )
    durability: Mapping[str, str] = MappingProxyType(
        {
            "durable": "SQLite's WAL with synchronous=FULL, set on eMEM's private connection: it has no option for it",
            "relaxed": "SQLite's WAL with synchronous=NORMAL, as eMEM sets it: the last commits may be lost",
        }
    )
    abilities = everything_but(
        {kind: _METADATA for kind in KINDS if kind.startswith(("payload.", "features.", "feature_names."))},
        filtered=[
            kind
            for kind in KINDS
            if kind.startswith(("time.", "region.", "parts.", "wholes.", "near")) or kind in ("type.is_a", "window")
        ],
    )

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None:
        config = SpatioTemporalMemoryConfig(
            db_path=str(directory / "memory.db"),
            hnsw_path=str(directory / "memory.hnsw.bin"),
            embedding_dim=1,
            hnsw_max_elements=1,
        )
        self._store = MemoryStore(config)
        if mode == "durable":
            self._store._db.execute("PRAGMA synchronous=FULL")
        self._kinds = workload.closure
        self._below = workload.descendants
        self._extents = Extents()

    def version(self) -> str:
        """eMEM's."""
        return version("emem")

    def commit(self, record: Record) -> object:
        """An observation, and after it the edges to those it is made of."""
        self._store.add_observation(self._observation(record))
        return self._store.add_edges(_edges(record))

    def load(self, records: Sequence[Record]) -> object:
        """All observations in one transaction, all edges in another."""
        self._store.add_observations_batch([self._observation(record) for record in records])
        return self._store.add_edges([edge for record in records for edge in _edges(record)])

    def ask(self, question: Question) -> Sequence[ObservationNode]:
        """Observations, with all that is known of them in their metadata."""
        field, _, relation = question.kind.partition(".")
        match field:
            case "type":
                return self._of_types(question)
            case "time" | "window":
                return self._fitting(question, self._begun(self._extents.begins(question)))
            case "region" | "near":
                return self._fitting(question, self._around(search_of(question), self._extents.begins(question)))
            case "nearest":
                return self._nearest(question)
            case "parts":
                return self._wholes_of(question, relation)
            case "wholes":
                return self._parts_of(question, relation)
            case other:
                raise ValueError(f"eMEM cannot be asked for {other}")

    def uid_of(self, row: ObservationNode) -> str:
        """Its id."""
        uid: str = row.id
        return uid

    def close(self) -> None:
        """Close the files."""
        self._store.close()

    def _observation(self, record: Record) -> ObservationNode:
        return ObservationNode(
            id=record.uid,
            text=record.type,
            coordinates=np.array(self._extents.note(record) or NOWHERE),
            timestamp=record.begin / 1e6,
            layer_name=record.type,
            source_type=record.agent,
            metadata={
                "number": record.number,
                "type": record.type,
                "begin": record.begin,
                "end": record.end,
                "region": None if record.ring is None else shapely.Polygon(record.ring).wkb_hex,
                "features": record.features,
                "payload": b64encode(record.payload).decode(),
                "media_type": record.media_type,
                "parts": record.parts,
            },
        )

    def _fitting(self, question: Question, rows: Iterable[ObservationNode]) -> list[ObservationNode]:
        return fitting(question, rows, _facts, self._kinds)

    def _of_types(self, question: Question) -> list[ObservationNode]:
        """One layer after the other: the first or the latest of each, if there is a limit."""
        layers = self._below[question.value] if question.kind == "type.is_a" else [question.value]
        order = "newest" if question.kind == "type.latest" else "oldest"
        rows = [row for layer in layers for row in self._of_layer(layer, order, question.limit)]
        return self._fitting(question, rows)

    def _of_layer(self, layer: str, order: str, limit: int | None) -> list[ObservationNode]:
        """At least the limit's first, and those as old as the last of them: eMEM does not order them."""
        wanted = _ALL if limit is None else limit + 1
        while True:
            rows: list[ObservationNode] = self._store.temporal_query(layer=layer, order=order, n_results=wanted)
            if limit is None or len(rows) < wanted or rows[-1].timestamp != rows[limit - 1].timestamp:
                return rows
            wanted *= 2

    def _begun(self, begins: tuple[int, int] | None) -> list[ObservationNode]:
        rows: list[ObservationNode] = self._store.temporal_query(time_range=_seconds(begins), n_results=_ALL)
        return rows

    def _around(self, search: Search, begins: tuple[int, int] | None = None) -> list[ObservationNode]:
        return [
            row
            for circle in self._extents.circles(search)
            for row in self._store.spatial_query(
                np.array(circle.centre), circle.radius, time_range=_seconds(begins), n_results=_ALL
            )
        ]

    def _nearest(self, question: Question) -> list[ObservationNode]:
        """Those of the nearest centroids say how far one must look to have the nearest regions."""
        x, y = question.value["x"], question.value["y"]
        some = [
            row
            for point in self._extents.points(x, y)
            for row in self._store.spatial_nearest(np.array(point), question.limit)
        ]
        unique = list({row.id: row for row in some}.values())
        nearest = self._fitting(question, unique)
        regions = shapely.from_wkb([row.metadata["region"] for row in nearest])
        metres = float(shapely.distance(regions, shapely.Point(x, y)).max()) if nearest else 0.0
        return self._fitting(question, self._around(Search(x, y, metres, reaches=True)))

    def _wholes_of(self, question: Question, relation: str) -> list[ObservationNode]:
        """By the edges of parts; only what has no parts at all is found by reading everything in order."""
        parts = question.value
        if relation == "subset" or not parts:
            return self._scan(question, lambda row: related(relation, set(row.metadata["parts"]), set(parts)))
        asked = parts if relation == "intersects" else parts[:1]
        wholes = {edge.source_id for part in asked for edge in self._edges(target_id=part)}
        return self._fitting(question, map(self._store.get_observation, wholes))

    def _parts_of(self, question: Question, relation: str) -> list[ObservationNode]:
        """By the edges of wholes; only what has no wholes at all is found by reading everything in order."""
        wholes = question.value

        def fits(uid: str) -> bool:
            return related(relation, {edge.source_id for edge in self._edges(target_id=uid)}, set(wholes))

        if relation == "subset" or not wholes:
            return self._scan(question, lambda row: fits(row.id))
        asked = wholes if relation == "intersects" else wholes[:1]
        parts = {edge.target_id for whole in asked for edge in self._edges(source_id=whole)}
        return self._fitting(question, map(self._store.get_observation, filter(fits, parts)))

    def _scan(self, question: Question, keep: Callable[[ObservationNode], bool]) -> list[ObservationNode]:
        """Those that are kept, read in order of time, page by page until there are enough."""
        found: list[ObservationNode] = []
        since, wanted = -inf, _PAGE
        while True:
            page = self._store.temporal_query(time_range=(since, inf), order="oldest", n_results=wanted)
            is_last = len(page) < wanted
            # More of those that are as old as the last one may follow.
            found += [row for row in page if (is_last or row.timestamp < page[-1].timestamp) and keep(row)]
            if is_last or (question.limit is not None and len(found) >= question.limit):
                return fitting(question, found, _facts, self._kinds)
            wanted = wanted * 2 if page[-1].timestamp == since else _PAGE
            since = page[-1].timestamp

    def _edges(self, **ends: str) -> list[Edge]:
        # There are no others; asked for by their type too, SQLite would read all of the type.
        edges: list[Edge] = self._store.get_edges(**ends)
        return edges


def _edges(record: Record) -> list[Edge]:
    return [Edge(source_id=record.uid, target_id=part, edge_type=EdgeType.SUMMARIZES) for part in record.parts]


def _facts(row: ObservationNode) -> Mapping[str, Any]:
    metadata: Mapping[str, Any] = row.metadata
    return metadata


def _seconds(micros: tuple[int, int] | None) -> tuple[float, float] | None:
    return None if micros is None else (micros[0] / 1e6, micros[1] / 1e6)


if __name__ == "__main__":
    serve(EmemSide)
