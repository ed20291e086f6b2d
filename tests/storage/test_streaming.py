"""What a stream of large payloads holds at a time: as much as its bounds say, however long it is."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from contextlib import closing

import pytest

from elm import chunks
from elm.event import Event, Payload, StoredEvent
from elm.query import Query
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import span
from tests.servers import MEMORY, Server

IMAGE = 20_000
"""Bytes of a payload."""
IMAGES = 500


@pytest.fixture(scope="module")
def seen(postgres_server: Server) -> Iterator[PostgresStore]:
    """A memory of many images."""
    with postgres_server.database() as dsn, closing(PostgresStore(dsn, MEMORY)) as store:
        store.add_types([EventType(name="See")])
        store.load(
            [
                Arrival(event=Event(type="See", interval=span(second, second), payload=Payload(data=bytes(IMAGE))))
                for second in range(IMAGES)
            ]
        )
        yield store


def held(stream: Iterator[StoredEvent]) -> float:
    """How many images there are in memory at most while the stream is read."""
    tracemalloc.start()
    try:
        for event in stream:
            assert event.payload is not None
            assert len(event.payload.data) == IMAGE
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    return peak / IMAGE


# While a chunk is filled the one before it is still there.


def test_a_stream_holds_a_few_images_at_a_time(seen: PostgresStore) -> None:
    for query in (Query(), Query(limit=IMAGES - 1)):
        assert held(seen.find(query)) < IMAGES / 2


def test_batches_of_images_are_smaller(seen: PostgresStore, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow")
    monkeypatch.setattr(chunks, "CHUNK_BYTES", 100 * IMAGE)
    batches = list(seen.arrow(Query()))
    assert [batch.num_rows for batch in batches] == [100] * 5
    assert [len(data) for batch in batches for data in batch.column("payload").to_pylist()] == [IMAGE] * IMAGES
