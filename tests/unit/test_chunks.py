"""Tests of the chunks of a stream: bounded by number and by bytes, and no item taken before its turn."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from elm import chunks
from elm.chunks import chunks_of


def sizes(payloads: list[bytes | None], *, most: int) -> list[int]:
    return [len(chunk) for chunk in chunks_of(payloads, most=most, payload=lambda data: data)]


def test_a_chunk_has_so_many_items() -> None:
    assert sizes([None] * 7, most=3) == [3, 3, 1]
    assert sizes([b""] * 6, most=3) == [3, 3]
    assert sizes([], most=3) == []


def test_a_chunk_ends_with_the_item_that_fills_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "CHUNK_BYTES", 10)
    assert sizes([b"1234", None, b"1234", b"12", b"123456789", None], most=5) == [4, 2]
    assert sizes([b"12345678901", b"1234567890", b"1", None], most=5) == [1, 1, 2]
    assert sizes([b"1", b"1", b"1"], most=2) == [2, 1]


def test_no_item_is_taken_before_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "CHUNK_BYTES", 2)
    taken: list[bytes] = []

    def images() -> Iterator[bytes]:
        for image in (b"aa", b"bb", b"cc"):
            taken.append(image)
            yield image

    stream = chunks_of(images(), most=100, payload=lambda data: data)
    assert next(stream) == taken == [b"aa"]
    assert next(stream) == [b"bb"]
    assert taken == [b"aa", b"bb"]
