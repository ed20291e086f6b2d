"""Tests of the Arrow columns: types, nulls, batches, and what programs without extension types get."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID

import pytest

from elm import chunks
from elm.columns import batches_of, reader_of, schema, without_extensions
from elm.errors import MissingPackage
from elm.event import Event, Payload
from elm.geometry import Region
from elm.interval import Interval
from elm.query import Query
from elm.recollector import Recollector
from elm.storage.memory import MemoryStore
from elm.store import Arrival
from elm.taxonomy import EventType

BEGIN = datetime(2026, 1, 1, 10, 0, 0, 123456, tzinfo=UTC)
FULL = UUID("019b0000-0000-7000-8000-000000000001")
BARE = UUID("019b0000-0000-7000-8000-000000000002")
WHOLE = UUID("019b0000-0000-7000-8000-000000000003")


@pytest.fixture
def store() -> MemoryStore:
    store = MemoryStore()
    store.add_types([EventType(name="Act")])
    full = Event(
        uid=FULL,
        type="Act",
        interval=Interval(begin=BEGIN, end=BEGIN + timedelta(seconds=1)),
        region=Region.box(0, 0, 2, 1),
        subject=Region.box(5, 5, 6, 6, frame="lab"),
        features=[("n", 1), ("x", 1.5), ("s", 'a"b'), ("b", True), ("n", 2)],
        agent="r",
        payload=Payload(data=b"", media_type="text/plain"),
    )
    bare = Event(uid=BARE, type="Act", interval=Interval.since(BEGIN + timedelta(seconds=1)))
    learned = BEGIN + timedelta(hours=1)
    store.commit_all(
        [Arrival(event=one, recorded_at=learned) for one in (full, bare, Event(uid=WHOLE, type="Act", parts=[BARE]))]
    )
    return store


def test_every_column_keeps_its_values(store: MemoryStore) -> None:
    pa = pytest.importorskip("pyarrow")
    table = store.arrow(Query()).read_all()
    assert table.schema.equals(schema(), check_metadata=True)
    full, bare, whole = without_extensions(table).to_pylist()
    region = Region.box(0, 0, 2, 1)
    assert Region.from_wkb(full.pop("region"), frame="map") == region
    assert Region.from_wkb(full.pop("subject"), frame="lab") == Region.box(5, 5, 6, 6, frame="lab")
    assert json.loads(full.pop("features")) == [["n", 1], ["x", 1.5], ["s", 'a"b'], ["b", True], ["n", 2]]
    assert full == {
        "id": 1,
        "uid": str(FULL),
        "type": "Act",
        "begin": BEGIN,
        "end": BEGIN + timedelta(seconds=1),
        "region_frame": "map",
        "subject_frame": "lab",
        "agent": "r",
        "media_type": "text/plain",
        "payload": b"",
        "parts": [],
        "wholes": [],
        "recorded_at": BEGIN + timedelta(hours=1),
    }
    lacking = ("end", "region", "region_frame", "subject", "subject_frame", "agent", "media_type", "payload")
    assert [bare[name] for name in lacking] == [None] * 8
    assert (bare["features"], bare["wholes"]) == ("[]", [str(WHOLE)])
    assert whole["parts"] == [str(BARE)]
    assert table.schema.field("begin").type == pa.timestamp("us", tz="UTC")
    assert table.schema.field("parts").type == pa.list_(pa.binary(16))


def test_places_are_marked_as_geoarrow_and_uids_as_uuid() -> None:
    pa = pytest.importorskip("pyarrow")
    for name in ("region", "subject"):
        field = schema().field(name)
        assert field.type == pa.binary()
        assert field.metadata == {b"ARROW:extension:name": b"geoarrow.wkb", b"ARROW:extension:metadata": b"{}"}
    assert schema().field("uid").type == (pa.uuid() if hasattr(pa, "uuid") else pa.binary(16))


def test_without_extensions_nothing_is_marked(store: MemoryStore) -> None:
    pa = pytest.importorskip("pyarrow")
    plain = without_extensions(store.arrow(Query()).read_all())
    assert not any(field.metadata for field in plain.schema)
    assert plain.schema.field("uid").type == pa.string()
    assert plain.schema.field("wholes").type == pa.list_(pa.string())
    assert plain.schema.field("region").type == pa.binary()
    nothing = without_extensions(store.arrow(Query(limit=0)).read_all())
    assert nothing.schema == plain.schema
    assert nothing.num_rows == 0


def test_batches_are_made_as_they_are_asked_for(store: MemoryStore) -> None:
    pytest.importorskip("pyarrow")
    taken: list[int] = []

    def events() -> Any:
        for stored in store.find(Query()):
            taken.append(stored.id)
            yield stored

    batches = batches_of(events(), size=2)
    assert next(batches).num_rows == 2
    assert taken == [1, 2]
    assert next(batches).num_rows == 1
    assert next(batches, None) is None
    assert reader_of(batches_of(events())).read_next_batch().num_rows == 3


def test_large_payloads_fill_a_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(chunks, "CHUNK_BYTES", 1_000)
    store = MemoryStore()
    store.add_types([EventType(name="See")])
    seen = [Event(type="See", interval=Interval.since(BEGIN), payload=Payload(data=bytes(600))) for _ in range(5)]
    store.commit_all([Arrival(event=event) for event in seen])
    batches = list(store.arrow(Query()))
    assert [batch.num_rows for batch in batches] == [2, 2, 1]
    assert [value for batch in batches for value in batch.column("payload").to_pylist()] == [bytes(600)] * 5


def test_other_libraries_read_the_stream(store: MemoryStore) -> None:
    pa = pytest.importorskip("pyarrow")
    assert pa.RecordBatchReader.from_stream(store.arrow(Query())).read_all().column("id").to_pylist() == [1, 2, 3]


def test_a_geodataframe_has_the_regions_as_its_geometry(store: MemoryStore) -> None:
    pytest.importorskip("geopandas")
    frame = Recollector(store).recall().to_geopandas()
    assert list(frame["uid"]) == [str(FULL), str(BARE), str(WHOLE)]
    assert frame.geometry[0].equals(Region.box(0, 0, 2, 1).polygon)
    assert frame.geometry[1] is None
    assert frame["subject"][0].bounds == (5.0, 5.0, 6.0, 6.0)
    assert list(frame["id"]) == [1, 2, 3]


def test_without_pyarrow_the_remedy_is_named(store: MemoryStore, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingPackage, match=r"pip install 'elm-memory\[arrow\]'"):
        store.arrow(Query())
