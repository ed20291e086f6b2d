"""`like` in this process: no pattern takes long, however often its pieces fit."""

from __future__ import annotations

import time

import pytest

from elm import cues
from elm.app import Memory
from elm.event import Event
from elm.storage.memory import MemoryStore
from tests.clock import span


@pytest.mark.parametrize(
    ("pattern", "text", "fits"),
    [
        ("%a%a%a%a%a%b", "a" * 120, False),
        ("%a_" * 30 + "%b", "a" * 5_000, False),
        ("%" * 5_000 + "b", "a" * 5_000, False),
        ("%" + "a" * 2_000 + "_b%", "a" * 5_000, False),
        ("%" + "_a" * 1_000 + "b%", "a" * 5_000, False),
        ("%a_" * 30 + "%", "a" * 5_000, True),
        ("%" + "_" * 5_000, "a" * 5_000, True),
    ],
    ids=range(7),
)
def test_no_pattern_is_slow(pattern: str, text: str, fits: bool) -> None:
    memory = Memory(MemoryStore())
    memory.add_type("Event")
    memory.commit(Event(type="Event", interval=span(0, 1), features={"v": text}))

    began = time.process_time()
    assert memory.recall(cues.feature("v", "like", pattern)).exists() is fits
    assert time.process_time() - began < 1
