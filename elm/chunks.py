"""Streams in chunks that fit in memory: of so many items, and of little more payload than so many bytes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import TypeVar

CHUNK_BYTES = 64 * 1024 * 1024
"""Bytes of payload after which a chunk takes no further item."""

_Item = TypeVar("_Item")


def chunks_of(items: Iterable[_Item], *, most: int, payload: Callable[[_Item], bytes | None]) -> Iterator[list[_Item]]:
    """The items in lists of at most `most`, each ended by the item with which its payloads reach `CHUNK_BYTES`."""
    rest = iter(items)
    while True:
        chunk: list[_Item] = []
        held = 0
        for item in islice(rest, most):
            chunk.append(item)
            data = payload(item)
            if data is not None:
                held += len(data)
                if held >= CHUNK_BYTES:
                    break
        if not chunk:
            return
        yield chunk
