"""Files in and out: loads that refuse lines, exports that load again, and formats that other programs read."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Program, told
from tests.cli.samples import DRIVES, EVENTS, TYPES, drive, trip, uid
from tests.cli.terminals import on_terminal


def test_refused_lines_are_named_and_kept_as_they_stood(program: Program) -> None:
    program("types", "load", "-", stdin=told(TYPES))
    file = program.directory / "events.jsonl"
    stood = [
        json.dumps({"type": "Dance", "interval": ["2026-01-01T10:00:00Z", None]}).encode() + b"\r",
        b'{"type": "Drive", "interval": ["2026-01-01T10:00:00", null]}',
        b"no JSON \xff\xfe",
        json.dumps(trip(7, 8)).encode(),
    ]
    file.write_bytes(
        b"\n".join([b"\xef\xbb\xbf" + EVENTS[0].encode(), *stood[:2], b"", stood[2], EVENTS[1].encode(), stood[3]])
    )
    done = program("load", "events.jsonl")
    assert done.returncode == 1
    told_of = done.stderr.splitlines()
    assert [line.split(": ")[1] for line in told_of[:-1]] == ["line 2", "line 3", "line 5", "line 7"]
    assert "'Dance'" in told_of[0]
    assert "naive datetime" in told_of[1]
    assert "not JSON" in told_of[2]
    assert uid(8) in told_of[3]
    assert told_of[-1] == "2 events loaded; 4 of 6 lines refused, they are in events.jsonl.refused.jsonl"
    refused = program.directory / "events.jsonl.refused.jsonl"
    assert refused.read_bytes() == b"".join(line + b"\n" for line in stood)

    file.write_bytes(told(EVENTS[:2]))
    again = program("load", "events.jsonl")
    assert (again.returncode, again.stderr) == (0, "0 events loaded; 2 were there already\n")
    assert not refused.exists()


def test_the_file_for_refused_lines_can_be_chosen(program: Program) -> None:
    program.here("types", "add", "Drive")
    done = program.here("load", "-", "--refused", "bad.jsonl", stdin=told(["{}"]))
    assert done.returncode == 1
    assert (program.directory / "bad.jsonl").read_bytes() == b"{}\n"
    assert program.here("load", "-", "--refused", "no/such/folder", stdin=told(["{}"])).returncode == 1


def test_refused_lines_never_overwrite_what_is_loaded(program: Program) -> None:
    program.here("types", "add", "Drive")
    mended = program.directory / "stdin.refused.jsonl"
    mended.write_bytes(told(EVENTS[:2]))
    with mended.open("rb") as lines:
        loading = program.start("load", "-", stdin=lines.fileno(), stderr=subprocess.PIPE)
        _, remarks = loading.communicate(timeout=60)
    assert (loading.returncode, b"is the file to load" in remarks) == (2, True)
    assert program.here("load", mended, "--refused", mended).returncode == 2
    assert mended.read_bytes() == told(EVENTS[:2])
    assert program.here("load", mended).returncode == 0


def test_a_person_is_told_the_first_reasons_only(program: Program) -> None:
    program.here("types", "add", "Drive")
    (program.directory / "bad.jsonl").write_bytes(told(["{}"] * 50))
    code, remarks, answer = on_terminal(program, "load", "bad.jsonl", stream="stderr")
    assert (code, answer) == (1, "")
    assert remarks.count("'type'") == 20
    assert "and 30 more lines" in remarks
    assert program.here("load", "bad.jsonl").stderr.count("'type'") == 50


def test_progress_is_drawn_on_a_terminal_only(program: Program) -> None:
    program("types", "load", "-", stdin=told(TYPES))
    (program.directory / "events.jsonl").write_bytes(told(EVENTS))
    code, remarks, _ = on_terminal(program, "load", "events.jsonl", stream="stderr")
    assert code == 0
    assert "loading events.jsonl" in remarks
    assert "\x1b[" in remarks
    assert "\x1b" not in program("load", "events.jsonl").stderr


def without_ids(text: str) -> list[Any]:
    events = [json.loads(line) for line in text.removesuffix("\n").split("\n")]
    return [{name: value for name, value in event.items() if name != "id"} for event in events]


def test_an_export_loads_into_another_memory(filled: Program, program: Program) -> None:
    exported = filled("export")
    assert exported.stderr == f"{len(EVENTS)} events exported\n"
    types = filled("types", "tree").stdout
    assert program("types", "load", "-", stdin=types.encode()).returncode == 0
    loaded = program("load", "-", stdin=exported.stdout.encode())
    assert (loaded.returncode, loaded.stdout) == (0, "")
    assert loaded.stderr.startswith(f"{len(EVENTS)} events loaded; ")
    assert f"'id' passed over on {len(EVENTS)} lines" in loaded.stderr
    assert without_ids(program("export").stdout) == without_ids(exported.stdout)
    again = program("load", "-", stdin=exported.stdout.encode())
    assert again.stderr.startswith(f"0 events loaded; {len(EVENTS)} were there already")


def test_a_filtered_export_brings_all_parts_along(filled: Program) -> None:
    done = filled.here("export", "--cue", json.dumps({"op": "uid", "uids": [uid(1003)]}))
    assert [event["uid"] for event in without_ids(done.stdout)] == [uid(n) for n in (1, 2, 3, 1001, 1002, 1003)]
    assert done.stderr == "6 events exported, 5 of them parts of what matched\n"


def test_an_exported_file_is_there_only_when_it_is_whole(filled: Program) -> None:
    assert filled.here("export", "--to", "all.jsonl").stdout == ""
    assert (filled.directory / "all.jsonl").read_text(encoding="utf-8") == filled.here("export").stdout
    assert filled.here("export", "--is-a", "Unheard-of", "--to", "all.jsonl").returncode == 1
    assert (filled.directory / "all.jsonl").read_text(encoding="utf-8") == filled.here("export").stdout
    assert not list(filled.directory.glob("*.part"))
    assert filled.here("export", "--to", "/dev/null").returncode == 0
    assert Path("/dev/null").is_char_device()


def test_a_file_that_cannot_be_written_is_named_as_the_user_named_it(filled: Program) -> None:
    nowhere = filled.here("export", "--to", "nowhere/all.jsonl")
    assert nowhere.returncode == 2
    assert "--to" in nowhere.stderr
    assert "nowhere: make it first" in " ".join(nowhere.stderr.replace("│", "").split())
    assert not list(filled.directory.glob("**/*.part"))
    full = filled.here("export", "--to", "/dev/full")
    assert full.returncode == 1
    assert "/dev/full: No space left on device" in full.stderr


def test_geojson_exports_what_recall_writes(filled: Program) -> None:
    exported = json.loads(filled.here("export", "-o", "geojson").stdout)
    recalled = json.loads(filled.here("recall", "-o", "geojson").stdout)
    key = lambda feature: feature["id"]  # noqa: E731
    assert sorted(exported["features"], key=key) == sorted(recalled["features"], key=key)


def test_parquet_is_geoparquet(filled: Program) -> None:
    geopandas = pytest.importorskip("geopandas")
    assert filled.here("export", "-o", "parquet", "--type", "Drive", "--to", "drives.parquet").returncode == 0
    frame = geopandas.read_parquet(filled.directory / "drives.parquet")
    assert len(frame) == DRIVES
    assert frame.crs is None
    assert frame.geometry.name == "region"
    assert frame.region.iloc[6].bounds == (7.0, 0.0, 8.0, 1.0)
    assert frame.uid.iloc[6] == uid(7)
    assert json.loads(frame.features.iloc[6]) == drive(7)["features"]
    empty = filled.here("export", "-o", "parquet", "--agent", "nobody", "--to", "none.parquet")
    assert empty.returncode == 0
    assert len(geopandas.read_parquet(filled.directory / "none.parquet")) == 0


def test_wrong_types_add_nothing(program: Program) -> None:
    done = program.here("types", "load", "-", stdin=told(['{"type": "A"}', '{"typ": "B"}']))
    assert done.returncode == 1
    assert done.stderr.startswith("elm: line 2: ")
    assert program.here("types", "load", "-", stdin=told(['{"type": "A", "parents": ["Z"]}'])).returncode == 1
    assert program.here("types", "load", "-", stdin=told(TYPES)).returncode == 0
    assert program.here("types", "tree").stdout.count("\n") == len(TYPES)


def test_a_long_tree_of_types_is_cut(program: Program) -> None:
    types = [json.dumps({"type": f"T{number}", "parents": [] if number < 2 else ["T1"]}) for number in range(1, 131)]
    program.here("types", "load", "-", stdin=told(types))
    done = program.here("types", "tree", "-o", "table")
    assert len(done.stdout.splitlines()) == 100
    assert done.stderr == "first 100 of 130 types; --limit N for more\n"
    assert len(program.here("types", "tree", "-o", "table", "--limit", "130").stdout.splitlines()) == 130
    assert len(program.here("types", "tree").stdout.splitlines()) == 130
