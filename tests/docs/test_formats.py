"""docs/formats.md is true: every example is read and written back, and every relation has one."""

from __future__ import annotations

import re
from typing import Any

import pytest

from elm.cues.codec import cue_from_json, cue_to_json
from elm.cues.relations import Comparison, SetRelation, TypeRelation
from elm.exchange import (
    event_from_json,
    event_to_json,
    is_tombstone,
    parse_json,
    tombstone_from_json,
    tombstone_to_json,
    type_from_json,
    type_to_json,
)
from elm.geometry import SpatialRelation
from elm.interval import AllenRelation, parse_time
from elm.query import Cursor
from tests.pages import Page

PAGE = Page("docs/formats.md")


def examples(section: str, language: str = "json") -> list[str]:
    """The lines of all code blocks of a section."""
    return [line for block in PAGE.blocks(language, section) for line in block.splitlines()]


def rows(section: str) -> list[list[str]]:
    """The rows of a section's table, without its head."""
    lines = [line for line in PAGE.sections[section].splitlines() if line.startswith("|")][2:]
    return [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]


def kinds(value: Any) -> Any:
    """A JSON value in which 1, 1.0 and true are told apart where a feature may hold them."""
    return [[name, type(item), item] for name, item in value]


EXAMPLES = ("Types", "Events", "Results", "Tombstones", "Cues", "ArmarX snapshots")
TYPES, EVENTS, RESULTS, TOMBSTONES, CUES, SNAPSHOTS = map(examples, EXAMPLES)


def test_no_example_is_passed_over() -> None:
    assert PAGE.blocks("json") == PAGE.blocks("json", *EXAMPLES)
    assert all((TYPES, EVENTS, RESULTS, TOMBSTONES, CUES, SNAPSHOTS))


@pytest.mark.parametrize("line", TYPES)
def test_types_go_there_and_back(line: str) -> None:
    given = parse_json(line, what="the example")

    assert type_to_json(type_from_json(given)) == given


@pytest.mark.parametrize("line", [*EVENTS, *RESULTS, *SNAPSHOTS])
def test_events_go_there_and_back(line: str) -> None:
    given = parse_json(line, what="the example")
    event = event_from_json(given).event
    written = event_to_json(event)

    assert event_from_json(written).event == event
    for key in given.keys() & written.keys() - {"interval", "features"}:
        assert written[key] == given[key], key
    assert kinds(written["features"]) == kinds(given.get("features", []))
    if "interval" in given:
        assert [end and parse_time(end, what="an end") for end in written["interval"]] == [
            end and parse_time(end, what="an end") for end in given["interval"]
        ]
    assert all(value in (None, []) for key, value in written.items() if key not in given)


@pytest.mark.parametrize("line", RESULTS)
def test_results_are_events_that_say_more(line: str) -> None:
    given = parse_json(line, what="the example")
    read = event_from_json(given)

    assert read.ignored == ("id", "wholes")
    assert read.recorded_at == parse_time(given["recorded_at"], what="recorded_at")
    assert given.keys() == event_to_json(read.event).keys() | {"id", "recorded_at", "wholes"}


@pytest.mark.parametrize("line", TOMBSTONES)
def test_tombstones_go_there_and_back(line: str) -> None:
    given = parse_json(line, what="the example")

    assert is_tombstone(given)
    assert tombstone_to_json(tombstone_from_json(given)) == given


def test_every_key_of_a_tombstone_is_described_and_shown() -> None:
    shown = [parse_json(line, what="the example")["forgotten"] for line in TOMBSTONES]
    described = {name for row in rows("Tombstones") for name in re.findall(r"\w+", row[0]) if name != "key"}

    assert described == {key for each in shown for key in each}
    assert {"uid" in each for each in shown} == {True, False}


@pytest.mark.parametrize("line", CUES)
def test_cues_go_there_and_back(line: str) -> None:
    given = parse_json(line, what="the example")
    cue = cue_from_json(given)

    assert cue_to_json(cue) == given
    assert cue_from_json(cue_to_json(cue)) == cue


def test_every_key_of_an_event_is_described_and_shown() -> None:
    described = [row[0] for row in rows("Events")]
    full = parse_json(EVENTS[0], what="the example")

    assert sorted(described) == sorted(full)
    assert sorted([*described, *(row[0] for row in rows("Results"))]) == sorted(parse_json(RESULTS[0], what="a result"))


@pytest.mark.parametrize(
    ("ops", "key", "names"),
    [
        ({"and", "or", "not"}, "op", {"and", "or", "not"}),
        ({"type"}, "relation", {*TypeRelation}),
        ({"time", "recorded_at"}, "op", {"time", "recorded_at"}),
        ({"time"}, "relation", {*SetRelation, *AllenRelation}),
        ({"region", "subject"}, "op", {"region", "subject"}),
        ({"region"}, "relation", {*SpatialRelation}),
        ({"features"}, "relation", {*SetRelation}),
        ({"feature_names"}, "relation", {*SetRelation}),
        ({"feature"}, "compare", {*Comparison}),
        ({"duration"}, "compare", {*Comparison} - {Comparison.LIKE}),
        ({"payload", "agent", "uid"}, "op", {"payload", "agent", "uid"}),
        ({"parts", "wholes"}, "op", {"parts", "wholes"}),
        ({"parts"}, "relation", {*SetRelation}),
        ({"parts", "wholes"}, "transitive", {True, False}),
    ],
)
def test_every_op_and_relation_has_an_example(ops: set[str], key: str, names: set[Any]) -> None:
    shown = [cue for line in CUES if (cue := parse_json(line, what="the example"))["op"] in ops]

    assert {cue[key] for cue in shown} == names


def test_the_cursor_is_one() -> None:
    (line,) = examples("Cursors", "text")

    assert str(Cursor.parse(line)) == line
    assert Cursor.parse(line).begin == parse_time("2026-01-01T10:00:02Z", what="a begin")


def test_the_arrow_columns_are_those_of_the_schema() -> None:
    pytest.importorskip("pyarrow", reason="the columns are pyarrow's")
    from elm.columns import schema

    names = {"extension<arrow.uuid>": "uuid", "list<item: fixed_size_binary[16]>": "list<fixed_size_binary[16]>"}
    found = [(field.name, names.get(str(field.type), str(field.type)), field.nullable) for field in schema()]
    assert [(row[0], row[1], row[2] == "yes") for row in rows("Arrow")] == found


def test_the_exit_codes_are_those_of_the_command_line() -> None:
    from elm.cli.exits import ExitCode

    assert [int(row[0]) for row in rows("Exit codes")] == sorted(ExitCode)
