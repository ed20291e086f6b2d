"""docs/formats.md is true of ArmarX snapshots: the example is what the bridge writes, the tables are complete."""

from __future__ import annotations

import base64
import hashlib
from typing import Any
from uuid import UUID

import msgspec

from armem_bridge.aron.binary import encode
from armem_bridge.aron.content import content_hash
from armem_bridge.long_term import mapping
from armem_bridge.long_term.payload import MEDIA_TYPE
from elm.exchange import parse_json
from elm.store import Arrival
from tests.docs.test_formats import PAGE, SNAPSHOTS, rows

SECTION = "ArmarX snapshots"
(LINE,) = SNAPSHOTS


def made() -> dict[str, Any]:
    """What the Python on the page defines."""
    return PAGE.run(PAGE.blocks("python", SECTION))


def test_the_example_is_what_the_bridge_writes() -> None:
    scope = made()
    arrival: Arrival = scope["arrival"]

    assert scope["line"] == LINE
    assert arrival.recorded_at is not None
    assert arrival.recorded_at.timestamp() == 1767261600.002


def test_the_tables_list_what_there_is() -> None:
    listed = {row[0] for row in rows(SECTION)}
    shown = parse_json(LINE, what="the example")

    assert {name for name, _ in shown["features"]} == {name for name in listed if name.startswith("armem.")}
    assert listed >= shown.keys() - {"features", "parts"}
    names = {value for name, value in vars(mapping).items() if name.isupper() and isinstance(value, str)}
    assert {name for name in names if name.startswith("armem.")} == {name for name, _ in shown["features"]}


def test_the_uid_is_made_as_described() -> None:
    snapshot = made()["snapshot"]
    (instance,) = snapshot.instances
    known = instance.metadata
    instances = [[content_hash(instance.data), known.confidence, known.sent, known.referenced]]
    form = ["armem-snapshot-1", *snapshot.id.names, snapshot.id.timestamp, instances]
    digest = bytearray(hashlib.sha256(msgspec.msgpack.encode(form)).digest()[:16])
    digest[6] = digest[6] & 0x0F | 0x80
    digest[8] = digest[8] & 0x3F | 0x80

    assert parse_json(LINE, what="the example")["uid"] == str(UUID(bytes=bytes(digest)))


def test_the_payload_is_as_described() -> None:
    payload = parse_json(LINE, what="the example")["payload"]
    snapshot = made()["snapshot"]

    assert payload["media_type"] == MEDIA_TYPE
    assert MEDIA_TYPE in PAGE.sections[SECTION]
    written = msgspec.msgpack.decode(base64.b64decode(payload["base64"]))
    assert written == ["armem", 1, [[0.9, 1767261600001500, None, encode(snapshot.instances[0].data)]]]
