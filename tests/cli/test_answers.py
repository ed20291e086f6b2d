"""What commands print: a table for a person, JSON Lines for a program, and the other formats when asked for."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest
import shapely

from tests.cli.conftest import Program
from tests.cli.samples import DRIVES, EVENTS, HOSTILE, square, uid
from tests.cli.terminals import on_terminal


def lines(text: str) -> list[Any]:
    # Not splitlines: it also cuts at characters that JSON may hold within a text.
    return [json.loads(line) for line in text.removesuffix("\n").split("\n")]


def test_a_pipe_gets_every_event_as_json_lines(filled: Program) -> None:
    done = filled("recall")
    assert (done.returncode, done.stderr) == (0, "")
    found = lines(done.stdout)
    assert len(found) == len(EVENTS)
    begins = [(event["interval"][0], event["id"]) for event in found]
    assert begins == sorted(begins)


def test_a_terminal_gets_a_table_of_100_and_is_told_how_many_there_are(filled: Program) -> None:
    code, table, remarks = on_terminal(filled, "recall", "--is-a", "Motion", stream="stdout")
    assert code == 0
    rows = [row for row in table.splitlines() if " 2026-01-01 10:" in row]
    assert len(rows) == 100
    assert remarks.startswith(f"first 100 of {DRIVES + 1}; --limit N for more, --after ")


def test_a_table_shows_control_characters_and_markup_as_text(filled: Program) -> None:
    done = filled.here("show", "1", "-o", "table")
    assert "\x1b" not in done.stdout
    assert "\u202e" not in done.stdout
    assert r"[/red] \x1b[31m \u2028 \u202e ü" in done.stdout


def test_limited_recalls_go_on_where_they_ended(filled: Program) -> None:
    whole = filled("recall", "--type", "Drive", "--order", "-begin").stdout.split("\n")[:-1]
    pages: list[str] = []
    cursor: list[str] = []
    while True:
        done = filled("recall", "--type", "Drive", "--order", "-begin", "--limit", "60", *cursor)
        pages += done.stdout.split("\n")[:-1]
        if "--after" not in done.stderr:
            break
        cursor = ["--after", done.stderr.split("--after ")[1].split()[0]]
    assert len(whole) == DRIVES
    assert pages == whole


def test_the_nearest_come_first_and_name_no_cursor(filled: Program) -> None:
    done = filled.here("recall", "--type", "Drive", "--nearest", "7.3,0.5", "--limit", "3")
    assert [json.loads(line)["uid"] for line in done.stdout.split("\n")[:-1]] == [uid(number) for number in (7, 6, 8)]
    assert done.stderr == "first 3; --limit N for more\n"
    table = filled.here("recall", "--is-a", "Motion", "--nearest", "7.5,0.5", "-o", "table", "--limit", "1")
    # The one that has no place is none of the nearest.
    assert table.stderr == f"first 1 of {DRIVES}; --limit N for more\n"


def test_csv_holds_what_json_lines_hold(filled: Program) -> None:
    rows = list(csv.DictReader(io.StringIO(filled.here("recall", "-o", "csv").stdout, newline="")))
    events = lines(filled.here("recall").stdout)
    assert [row["uid"] for row in rows] == [event["uid"] for event in events]
    row = next(row for row in rows if row["uid"] == uid(1))
    assert json.loads(row["features"]) == [["number", 1], ["note", HOSTILE]]
    assert shapely.from_wkt(row["region"]).equals(shapely.Polygon(square(1, 0)))
    assert (row["region_frame"], row["subject"], row["media_type"], row["payload_bytes"]) == (
        *("map", "", "text/plain"),
        "5",
    )
    trip = next(row for row in rows if row["uid"] == uid(1003))
    assert trip["parts"].split() == [uid(1001), uid(1002)]
    assert next(row for row in rows if row["uid"] == uid(1004))["end"] == ""


def test_geojson_is_one_feature_collection(filled: Program) -> None:
    collection = json.loads(filled.here("recall", "--until", "2026-01-01T10:00:02Z", "-o", "geojson").stdout)
    assert collection["type"] == "FeatureCollection"
    found = {feature["id"]: feature for feature in collection["features"]}
    assert set(found) == {uid(1), uid(2), uid(1001), uid(1002), uid(1003), uid(1004)}
    first = found[uid(1)]
    assert shapely.from_geojson(json.dumps(first["geometry"])).equals(shapely.Polygon(square(1, 0)))
    assert first["properties"]["frame"] == "map"
    assert first["properties"]["payload"] == {"media_type": "text/plain", "bytes": 5}
    assert found[uid(1004)]["geometry"] is None
    assert found[uid(1004)]["properties"]["end"] is None


@pytest.mark.parametrize(
    ("options", "count"),
    [
        ((), len(EVENTS)),
        (("--type", "Motion"), 1),
        (("--is-a", "Motion"), DRIVES + 1),
        (("--is-a", "Motion", "--is-a", "Drive"), DRIVES),
        (("--type", "Drive", "--agent", "two"), DRIVES // 2),
        (("--type", "Drive", "--since", "2026-01-01T10:02:30Z"), 6),
        (("--type", "Drive", "--until", "2026-01-01T11:00:03+01:00"), 3),
        (("--type", "Drive", "--since", "2026-01-01T10:00:07Z", "--until", "2026-01-01T10:00:08Z"), 7),
        (("--type", "Drive", "--near", "-5,0.5,7"), 2),
        (("--type", "Drive", "--near", "-5,0.5,7,cellar"), 0),
        (("--type", "Drive", "--near-subject", "-5,0.5,7"), 0),
        (("--feature", "number=7"), 1),
        (("--feature", 'number="7"'), 0),
        (("--feature", f"note={HOSTILE}", "--feature", "number=8"), 1),
        (("--cue", '{"op": "or", "args": []}'), 0),
        (("--cue", '{"op": "not", "arg": {"op": "type", "relation": "exactly", "type": "Drive"}}'), 4),
    ],
)
def test_options_say_what_a_cue_would(filled: Program, options: tuple[str, ...], count: int) -> None:
    assert filled.here("count", *options).stdout == f"{count}\n"


def test_a_cue_comes_from_a_file_or_stdin(filled: Program) -> None:
    cue = b'{"op": "agent", "agent": "one"}'
    (filled.directory / "cue.json").write_bytes(cue)
    assert (
        filled.here("count", "--cue", "cue.json").stdout
        == filled.here("count", "--cue", "-", stdin=cue).stdout
        == "75\n"
    )


def test_counts_by_key(filled: Program) -> None:
    groups = lines(filled.here("count", "--by", "agent").stdout)
    assert [(group["key"], group["count"]) for group in groups] == [("one", 75), ("two", 75), (None, 4)]
    assert groups[0]["seconds"] == 375.0
    assert groups[2]["last_end"] is None
    by_feature = lines(filled.here("count", "--by", "feature:number", "--until", "2026-01-01T10:00:02Z").stdout)
    assert [(group["key"], group["count"]) for group in by_feature] == [(1, 1), (2, 1), (None, 4)]
    assert lines(filled.here("count", "--by", "hour").stdout)[0]["key"] == "2026-01-01T10:00:00Z"
    assert lines(filled.here("count", "-o", "jsonl").stdout) == [{"count": len(EVENTS)}]


def test_show_finds_by_id_and_uid_and_says_what_is_not_there(filled: Program) -> None:
    done = filled.here("show", uid(1003), "1", "999999", "-o", "jsonl")
    shown = lines(done.stdout)
    assert [event["uid"] for event in shown] == [uid(1003), uid(1)]
    assert shown[1]["id"] == 1
    assert set(shown[1]["wholes"]) == {uid(1001)}
    assert done.returncode == 4
    assert "no event 999999" in done.stderr


def test_a_tree_draws_shared_parts_where_they_belong(filled: Program) -> None:
    drawing = filled.here("tree", uid(1003), "-o", "table").stdout
    events = lines(filled.here("tree", uid(1003)).stdout)
    ids = {event["uid"]: event["id"] for event in events}
    drawn = [line.lstrip("│├└─ ").split()[0] for line in drawing.splitlines()]
    assert drawn == [str(ids[uid(number)]) for number in (1003, 1001, 1, 2, 1002, 2, 3)]
    assert [event["uid"] for event in events] == [uid(number) for number in (1, 2, 3, 1001, 1002, 1003)]
    shallow = filled.here("tree", uid(1003), "--depth", "1", "-o", "table").stdout
    assert shallow.count("(2 parts not shown)") == 2
    assert len(shallow.splitlines()) == 3


def test_statistics(filled: Program) -> None:
    (known,) = lines(filled.here("stats").stdout)
    assert known["events"] == len(EVENTS)
    assert (known["complex_events"], known["open_events"], known["links"], known["types"]) == (3, 1, 6, 3)
    assert known["first_begin"] == "2026-01-01T10:00:00Z"
    assert known["bytes"] > 0


def test_explain_shows_statement_plan_and_what_each_condition_leaves(filled: Program) -> None:
    options = ("recall", "--is-a", "Motion", "--agent", "one", "--explain")
    (explained,) = lines(filled(*options).stdout)
    assert "SELECT" in explained["sql"]
    assert "actual time" in explained["plan"]
    assert [(rows["alone"], rows["left"]) for rows in explained["conditions"]] == [(DRIVES + 1, DRIVES + 1), (75, 75)]
    table = filled(*options, "-o", "table").stdout
    assert '{"op":"agent","agent":"one"}' in table
    assert "actual time" in table
