"""Tombstones: what they may say, and their lines in files that are exported and loaded."""

from __future__ import annotations

import json
from typing import Any
from uuid import UUID

import pytest

from elm import cues
from elm.app import Memory
from elm.errors import InvalidValue, UnknownEvent
from elm.event import Event
from elm.exchange import tombstone_from_json, tombstone_to_json
from elm.exporting import jsonl, with_parts
from elm.geometry import Region
from elm.loading import RefusedLine, load_lines
from elm.storage.memory import MemoryStore
from elm.taxonomy import EventType
from elm.tombstone import RunTombstone, Tombstone
from tests.clock import at, span

RUN = UUID(int=500)
HERE, ELSEWHERE = Region.box(0, 0, 4, 4), Region.box(0, 0, 1, 1, frame="odom")
GRAVE = Tombstone(uid=UUID(int=1), interval=span(0, 1), region=HERE, subject=ELSEWHERE, agent="a", run=RUN, id=7)
REST = RunTombstone(run=RUN, at=at(9), events=2, interval=span(0, 5), regions=(ELSEWHERE, HERE), subjects=(HERE,))


def uid(number: int) -> UUID:
    return UUID(int=number)


@pytest.fixture
def memory() -> Memory:
    """Wholes 5 of 1 and 2, and 6 of 5 and 3; 1 and 3 are forgotten, and 4, which was part of nothing."""
    memory = _empty()
    for number in (1, 2, 3, 4):
        memory.commit(Event(type="Atom", interval=span(number, 20), region=HERE, uid=uid(number)))
    for whole, parts in ((5, (1, 2)), (6, (5, 3))):
        memory.commit(Event(type="Whole", parts=map(uid, parts), uid=uid(whole)))
    assert memory.forget([uid(1), uid(3), uid(4)]).tombstones == 2
    return memory


def _empty() -> Memory:
    memory = Memory(MemoryStore())
    memory.add_types([EventType(name="Atom"), EventType(name="Whole")])
    return memory


def _load(memory: Memory, *lines: bytes) -> tuple[Any, list[RefusedLine]]:
    refused: list[RefusedLine] = []
    return load_lines(memory.writer, lines, refused=refused.append), refused


# What they may say


def test_a_tombstone_is_of_an_event_that_had_ended() -> None:
    with pytest.raises(InvalidValue, match="close it first"):
        Tombstone(uid=uid(1), interval=span(0, None), run=RUN)


def test_tombstones_are_compared_by_what_was_forgotten() -> None:
    fields: dict[str, Any] = {"uid": uid(1), "interval": span(0, 1), "region": HERE, "subject": ELSEWHERE}
    assert Tombstone(**fields, agent="a", run=uid(6)) == GRAVE
    assert Tombstone(**fields, agent="b", run=RUN) != GRAVE


@pytest.mark.parametrize(
    "wrong",
    [
        {"events": -1},
        {"events": True},
        {"events": 2**63},
        {"events": 1.5},
        {"events": 0},
        {"interval": None},
        {"interval": span(0, None)},
        {"regions": (HERE, HERE)},
        {"subjects": (HERE, ELSEWHERE, Region.box(5, 5, 6, 6))},
        {"at": at(9).replace(tzinfo=None)},
    ],
    ids=str,
)
def test_what_no_forgetting_can_have_left_is_refused(wrong: dict[str, Any]) -> None:
    fields: dict[str, Any] = {"run": RUN, "at": at(9), "events": 2, "interval": span(0, 5)}
    with pytest.raises(InvalidValue):
        RunTombstone(**{**fields, **wrong})


def test_the_hulls_of_a_forgetting_come_by_frame() -> None:
    assert [hull.frame for hull in REST.regions] == ["map", "odom"]


# Their lines


@pytest.mark.parametrize("tombstone", [GRAVE, REST], ids=["event", "run"])
def test_a_line_says_all_of_a_tombstone(tombstone: Tombstone | RunTombstone) -> None:
    assert tombstone_from_json(tombstone_to_json(tombstone)) == tombstone


@pytest.mark.parametrize(
    "change",
    [
        {"colour": "red"},
        {"run": None},
        {"run": "yesterday"},
        {"interval": None},
        {"interval": ["2026-01-01T10:00:00Z", None]},
        {"interval": ["2026-01-01T10:00:00", "2026-01-01T10:00:01Z"]},
        {"uid": "one"},
        {"agent": 7},
        {"region": {"frame": "map"}},
        {"uid": None},
    ],
    ids=str,
)
def test_lines_that_are_no_tombstones_are_refused(memory: Memory, change: dict[str, Any]) -> None:
    told = {**tombstone_to_json(GRAVE)["forgotten"], **change}
    report, refused = _load(memory, json.dumps({"forgotten": told}).encode())
    assert (report.tombstones, report.refused, len(refused)) == (0, 1, 1)


@pytest.mark.parametrize("line", ['{"forgotten": 7}', '{"forgotten": {}, "type": "Atom"}', '{"forgotten": null}'])
def test_a_line_with_the_key_is_nothing_but_a_tombstone(memory: Memory, line: str) -> None:
    report, (refused,) = _load(memory, line.encode())
    assert (report.read, report.refused) == (1, 1)
    assert "tombstone" in refused.reason


# Exported and loaded


def test_an_export_of_everything_loads_into_an_empty_memory(memory: Memory) -> None:
    lines = list(jsonl(with_parts(memory.recall())))
    assert ["forgotten" in json.loads(line) for line in lines] == [True, True, True, False, False, False]
    copy = _empty()
    report, refused = _load(copy, *lines)

    assert refused == []
    assert (report.read, report.new, report.tombstones, report.existing) == (6, 3, 3, 0)
    assert list(copy.store.tombstones()) == list(memory.store.tombstones())
    assert list(copy.store.run_tombstones()) == list(memory.store.run_tombstones())
    assert [event.parts for event in copy.recall(cues.exactly("Whole"))] == [(uid(1), uid(2)), (uid(5), uid(3))]
    assert [list(jsonl(with_parts(each.recall()))) != [] for each in (memory, copy)] == [True, True]
    again, refused = _load(copy, *lines)
    assert (again.new, again.tombstones, again.existing, refused) == (0, 0, 6, [])


def test_an_export_of_some_brings_the_tombstones_of_their_parts(memory: Memory) -> None:
    exported = list(with_parts(memory.recall(cues.uid(uid(5)))))
    assert [each.uid for each in exported if not isinstance(each, RunTombstone)] == [uid(1), uid(2), uid(5)]
    copy = _empty()
    report, refused = _load(copy, *jsonl(exported))
    assert (report.new, report.tombstones, refused) == (2, 1, [])


def test_wholes_of_a_long_load_find_the_tombstones_before_them() -> None:
    graves = [Tombstone(uid=uid(number), interval=span(0, 1), run=RUN) for number in range(1, 2_502)]
    wholes = [
        {"uid": str(uid(5_000 + n)), "type": "Whole", "parts": [str(uid(n)), str(uid(n + 1))]} for n in (1, 2_500)
    ]
    copy = _empty()
    report, refused = _load(copy, *jsonl(graves), *(json.dumps(whole).encode() for whole in wholes))
    assert (report.new, report.tombstones, refused) == (2, 2_501, [])
    assert [event.interval for event in copy.recall()] == [span(0, 1)] * 2


def test_an_event_that_is_there_is_not_forgotten_by_loading(memory: Memory) -> None:
    full = _empty()
    event = Event(type="Atom", interval=span(5, 6), uid=uid(1))
    full.commit(event)
    report, refused = _load(full, *jsonl(memory.store.tombstones([uid(1)])))
    assert (report.tombstones, report.existing, refused) == (0, 1, [])
    assert full.get(uid(1)).interval == span(5, 6)


def test_a_tombstone_that_says_something_else_is_refused(memory: Memory) -> None:
    other = Tombstone(uid=uid(1), interval=span(0, 1), run=RUN)
    report, (refused,) = _load(memory, *jsonl([other, GRAVE]), b"{}")[0], _load(memory, *jsonl([other]))[1]
    assert report.refused == 3
    assert "other extents" in refused.reason


def test_a_forgotten_event_is_not_there(memory: Memory) -> None:
    with pytest.raises(UnknownEvent):
        memory.get(uid(1))
    assert {event.uid for event in memory.recall()} == {uid(2), uid(5), uid(6)}
