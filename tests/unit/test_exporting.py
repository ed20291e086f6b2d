"""Exports: parts before wholes, and formats that their readers understand."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable
from datetime import timedelta
from typing import Any
from uuid import UUID

import pytest

from elm import cues
from elm.app import Memory
from elm.errors import MissingPackage
from elm.event import Event, Payload
from elm.exporting import CSV_COLUMNS, comma_separated, geojson, jsonl, with_parts, write_parquet
from elm.geometry import Region
from elm.storage.memory import MemoryStore
from elm.taxonomy import EventType
from tests.clock import span


def uid(number: int) -> UUID:
    return UUID(int=number)


@pytest.fixture
def memory() -> Memory:
    """Atoms 1 to 4 and a diamond above the first three: 7 of 5 and 6, both of which have 2; and a stranger 8."""
    memory = Memory(MemoryStore())
    memory.add_types([EventType(name="Atom"), EventType(name="Whole")])
    for number in (1, 2, 3, 4):
        memory.commit(
            Event(
                type="Atom",
                interval=span(10 - number, 20),
                region=Region.box(number, 0, number + 1, 1),
                features=[("n", number), ("n", str(number)), ("line\nbreak", 'a,"b"\r\n')],
                payload=Payload(data=b"\x00\xff", media_type="image/png") if number == 1 else None,
                uid=uid(number),
            )
        )
    for whole, parts in ((5, (1, 2)), (6, (2, 3)), (7, (6, 5))):
        memory.commit(Event(type="Whole", parts=map(uid, parts), uid=uid(whole)))
    memory.commit(Event(type="Atom", interval=span(0, None), agent="x", uid=uid(8)))
    return memory


def numbers(events: Iterable[Any]) -> list[int]:
    return [event.uid.int for event in events]


def test_everything_comes_in_id_order(memory: Memory) -> None:
    assert numbers(with_parts(memory.recall())) == [1, 2, 3, 4, 5, 6, 7, 8]


@pytest.mark.parametrize(
    ("matching", "exported"),
    [
        ((7,), [1, 2, 3, 5, 6, 7]),
        ((6,), [2, 3, 6]),
        ((5, 8), [1, 2, 5, 8]),
        ((4,), [4]),
        ((), []),
    ],
)
def test_all_that_matches_comes_with_its_parts(memory: Memory, matching: tuple[int, ...], exported: list[int]) -> None:
    assert numbers(with_parts(memory.recall(cues.uid(*map(uid, matching))))) == exported


def test_a_limit_chooses_before_the_parts_are_added(memory: Memory) -> None:
    assert numbers(with_parts(memory.recall(order="-begin", limit=1))) == [1]
    assert numbers(with_parts(memory.recall(cues.exactly("Whole"), order="-begin", limit=1))) == [1, 2, 5]


def test_more_parts_than_one_question_asks_for(memory: Memory) -> None:
    atoms = [Event(type="Atom", interval=span(n, n), uid=uid(10_000 + n)) for n in range(2_500)]
    memory.commit_all([*atoms, Event(type="Whole", parts=[atom.uid for atom in atoms], uid=uid(99_999))])
    exported = numbers(with_parts(memory.recall(cues.uid(uid(99_999)))))
    assert exported == [*(atom.uid.int for atom in atoms), 99_999]


def test_json_lines_load_back(memory: Memory) -> None:
    written = b"".join(jsonl(memory.recall(order="id"))).decode()
    read = [json.loads(line) for line in written.splitlines()]
    assert [event["id"] for event in read] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert read[0]["features"] == [["n", 1], ["n", "1"], ["line\nbreak", 'a,"b"\r\n']]


def test_geojson_of_nothing_is_an_empty_collection(memory: Memory) -> None:
    assert json.loads(b"".join(geojson([]))) == {"type": "FeatureCollection", "features": []}


def test_geojson_separates_features_and_keeps_what_has_no_place(memory: Memory) -> None:
    collection = json.loads(b"".join(geojson(memory.recall(order="id"))))
    features = collection["features"]
    assert [feature["geometry"] is None for feature in features] == [False] * 7 + [True]
    assert features[0]["properties"]["payload"] == {"media_type": "image/png", "bytes": 2}
    assert features[7]["properties"]["end"] is None
    assert {"begin", "end", "frame", "features", "parts", "wholes", "id"} <= set(features[0]["properties"])


def test_csv_has_its_header_even_of_nothing(memory: Memory) -> None:
    assert b"".join(comma_separated([])).decode() == ",".join(CSV_COLUMNS) + "\r\n"


def test_csv_survives_commas_quotes_and_line_breaks(memory: Memory) -> None:
    rows = list(csv.DictReader(io.StringIO(b"".join(comma_separated(memory.recall(order="id"))).decode(), newline="")))
    assert [int(row["id"]) for row in rows] == [1, 2, 3, 4, 5, 6, 7, 8]
    assert json.loads(rows[0]["features"])[2] == ["line\nbreak", 'a,"b"\r\n']
    assert (rows[0]["media_type"], rows[0]["payload_bytes"], rows[1]["payload_bytes"]) == ("image/png", "2", "")
    assert rows[6]["parts"].split() == [str(uid(6)), str(uid(5))]
    assert sorted(rows[1]["wholes"].split()) == [str(uid(5)), str(uid(6))]


def test_parquet_says_that_its_places_are_geometries(memory: Memory) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    sink, done = io.BytesIO(), list[int]()
    assert write_parquet(memory.recall(order="id"), sink, progress=done.append) == 8
    assert done == [8]
    table = parquet.read_table(io.BytesIO(sink.getvalue()))
    said = json.loads(table.schema.metadata[b"geo"])
    assert (said["version"], said["primary_column"], set(said["columns"])) == ("1.1.0", "region", {"region", "subject"})
    assert said["columns"]["region"] == {
        "encoding": "WKB",
        "geometry_types": ["Polygon"],
        "crs": None,
        "edges": "planar",
    }
    rows = table.to_pylist()
    assert [row["uid"] for row in rows] == [str(uid(number)) for number in range(1, 9)]
    assert rows[6]["parts"] == [str(uid(6)), str(uid(5))]
    assert rows[0]["end"] - rows[0]["begin"] == timedelta(seconds=11)
    assert Region.from_wkb(rows[3]["region"], frame=rows[3]["region_frame"]) == Region.box(4, 0, 5, 1)


def test_parquet_of_nothing_has_all_columns(memory: Memory) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    sink = io.BytesIO()
    assert write_parquet(memory.recall(cues.agent("nobody")), sink) == 0
    table = parquet.read_table(io.BytesIO(sink.getvalue()))
    assert table.num_rows == 0
    assert b"geo" in table.schema.metadata
    assert {"uid", "region", "subject", "parts"} <= set(table.column_names)


def test_parquet_without_pyarrow_says_what_to_install(memory: Memory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(MissingPackage, match=r"elm-memory\[arrow\]"):
        write_parquet(memory.recall(), io.BytesIO())
