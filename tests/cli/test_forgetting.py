"""`elm forget`: what it asks, says and refuses, and how it ends."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import subprocess
import time

import pytest

from tests.cli.conftest import Program, told
from tests.cli.samples import DRIVES, EVENTS, TYPES, uid

SOME = json.dumps({"op": "uid", "uids": [uid(2), uid(3), uid(50)]})
GOING_ON = json.dumps({"op": "type", "relation": "exactly", "type": "Motion"})


@pytest.fixture
def memory(program: Program) -> Program:
    """`elm` with a memory of the samples that the test may forget from."""
    assert program.here("types", "load", "-", stdin=told(TYPES)).returncode == 0
    assert program.here("load", "-", stdin=told(EVENTS)).returncode == 0
    return program


def _tombstones(exported: str) -> list[str]:
    return [line for line in exported.split("\n") if "forgotten" in line]


def count(program: Program) -> int:
    return int(program.here("count").stdout)


def test_a_dry_run_says_what_would_go_and_changes_nothing(memory: Program) -> None:
    before = memory.here("export").stdout
    dry = memory.here("forget", "--cue", SOME, "--dry-run")
    assert dry.returncode == 0
    report = json.loads(dry.stdout)
    assert report.pop("bytes") > 0
    assert report == {
        "run": None,
        "events": 3,
        "tombstones": 2,
        "dissolved": 0,
        "still_open": 0,
        "held": 0,
        "types": {"Drive": 3},
    }
    assert "3 events would be forgotten" in dry.stderr
    assert memory.here("export").stdout == before

    done = json.loads(memory.here("forget", "--cue", SOME, "--yes").stdout)
    assert (done["events"], done["tombstones"], done["run"] is None) == (3, 2, False)
    assert count(memory) == len(EVENTS) - 3
    stats = json.loads(memory.here("stats").stdout)
    assert (stats["forgotten"], stats["tombstones"]) == (3, 2)


@pytest.mark.parametrize("stdin", [True, False], ids=["stdin", "file"])
def test_the_cue_comes_from_a_file_or_stdin(memory: Program, stdin: bool) -> None:
    (memory.directory / "cue.json").write_text(SOME, encoding="utf-8")
    given = "-" if stdin else "cue.json"
    done = memory.here("forget", "--cue", given, "--yes", stdin=SOME.encode() if stdin else b"")
    assert (done.returncode, count(memory)) == (0, len(EVENTS) - 3)


def test_what_is_not_forgotten_is_counted_and_ends_with_1(memory: Program) -> None:
    done = memory.here("forget", "--is-a", "Motion", "--yes", "-o", "table")
    assert done.returncode == 1
    assert done.stdout.split() == ["type", "events", "Drive", str(DRIVES)]
    assert "elm: 1 events are still going on: close them first" in done.stderr.splitlines()
    assert count(memory) == len(EVENTS) - DRIVES
    again = memory.here("forget", "--is-a", "Motion", "--yes")
    assert (again.returncode, json.loads(again.stdout)["events"]) == (1, 0)


TRIPS = """
from datetime import timedelta

from elm import cues
from elm.recognizers import Pattern, step

both = Pattern(
    name="both",
    version=1,
    type="Both",
    elements=[step("first", cues.exactly("Drive")), step("second", cues.exactly("Trip"))],
    within=timedelta(seconds=20),
)
"""


def test_what_recognizers_hold_is_not_forgotten_and_a_replay_ends_before_what_was(memory: Program) -> None:
    (memory.directory / "trips.py").write_text(TRIPS, encoding="utf-8")
    assert memory.here("recognize", "run", "--from", "trips.py", "--once").returncode == 0
    done = memory.here("forget", "--type", "Drive", "--yes")
    held = json.loads(done.stdout)["held"]
    assert done.returncode == 1
    assert 0 < held < DRIVES
    assert f"elm: {held} events are held by recognizers" in done.stderr
    replayed = memory.here("recognize", "replay", "--from", "trips.py", "--dry-run", "-o", "jsonl")
    assert replayed.returncode == 1
    assert "elm: the replay ended before position " in replayed.stderr


def test_nothing_that_matches_is_all_well(memory: Program) -> None:
    done = memory.here("forget", "--agent", "nobody", "--yes", "-o", "table")
    assert (done.returncode, done.stdout) == (0, "")
    assert done.stderr == "0 events forgotten, 0 bytes\n"


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("--yes",), 2, "which events"),
        (("--dry-run",), 2, "which events"),
        (("--agent", "one"), 2, "--dry-run"),
        (("--cue", "no-such-file", "--yes"), 2, "no-such-file"),
        (("--cue", '{"op": "tipe"}', "--yes"), 2, "tipe"),
        (("--is-a", "Unheard-of", "--yes"), 1, "Unheard-of"),
        (("--agent", "one", "--yes", "--memory", "never-made"), 1, "never-made"),
    ],
)
def test_what_is_refused(memory: Program, arguments: tuple[str, ...], code: int, said: str) -> None:
    done = memory.here("forget", *arguments)
    assert (done.returncode, done.stdout) == (code, "")
    assert said in done.stderr
    assert count(memory) == len(EVENTS)


def test_an_export_carries_tombstones_and_loads_again(memory: Program) -> None:
    memory.here("forget", "--cue", SOME, "--yes")
    exported = memory.here("export")
    assert exported.stderr == f"{len(EVENTS) - 3} events exported, and 3 tombstones\n"
    some = memory.here("export", "--cue", json.dumps({"op": "uid", "uids": [uid(1002)]}))
    assert some.stderr == "1 events exported, and 2 tombstones\n"
    copy = memory.having(ELM_MEMORY=f"{memory.settings['ELM_MEMORY']}_copy")
    copy.here("types", "load", "-", stdin=told(TYPES))
    loaded = copy.here("load", "-", stdin=exported.stdout.encode())
    assert loaded.returncode == 0
    assert loaded.stderr.startswith(f"{len(EVENTS) - 3} events loaded; 3 tombstones kept; ")
    assert _tombstones(copy.here("export").stdout) == _tombstones(exported.stdout)
    assert len(_tombstones(exported.stdout)) == 3
    refused = copy.here("load", "-", stdin=told(EVENTS))
    assert refused.returncode == 1
    assert f"event {uid(2)} was forgotten and still counts as a part" in refused.stderr


def test_a_tree_shows_what_was_forgotten(memory: Program) -> None:
    memory.here("forget", "--cue", SOME, "--yes")
    drawn = memory.here("tree", uid(1003), "-o", "table").stdout
    assert re.findall(r"([0-9a-f-]{36})  forgotten", drawn) == [uid(2), uid(2), uid(3)]
    told_of = memory.here("tree", uid(1003), "-o", "jsonl").stdout
    lines = [json.loads(line) for line in told_of.removesuffix("\n").split("\n")]
    assert [line["forgotten"]["uid"] for line in lines[:2]] == [uid(2), uid(3)]
    assert [line["uid"] for line in lines[2:]] == [uid(n) for n in (1, 1001, 1002, 1003)]
    assert "forgotten" not in memory.here("tree", uid(1003), "--depth", 1).stdout


@pytest.mark.parametrize(("answer", "code"), [("y", 0), ("n", 1)])
def test_a_person_is_asked(memory: Program, answer: str, code: int) -> None:
    terminal, inside = pty.openpty()
    try:
        process = memory.start("forget", "--cue", SOME, stdin=inside, stdout=subprocess.DEVNULL, stderr=inside)
        os.close(inside)
        said = b""
        deadline = time.monotonic() + 60
        while b"for good?" not in said:
            ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
            assert ready, said
            said += os.read(terminal, 65536)
        assert b"3 events would be forgotten" in said
        os.write(terminal, f"{answer}\n".encode())
        assert process.wait(timeout=60) == code
    finally:
        os.close(terminal)
    assert count(memory) == len(EVENTS) - (3 if answer == "y" else 0)
