"""`elm recognize` and `elm show --why`: recognizers from files and packages, running, stopped, failing, replayed."""

from __future__ import annotations

import csv
import io
import json
import os
import pty
import select
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Program, told
from tests.cli.samples import uid
from tests.clock import at

KITCHEN = """
from datetime import timedelta

from elm import cues
from elm.recognizers import Pattern, step

pairs = Pattern(
    name="pairs",
    version=1,
    type="Pair",
    elements=[step("first", cues.exactly("Look")), step("second", cues.exactly("Grasp"))],
    within=timedelta(seconds=60),
)
"""
BROKEN = """
import kitchen
from elm import cues


class Broken:
    name, version, across_agents, definition, outputs = "broken", 1, False, [], ()
    interest = cues.exactly("Grasp")

    def start(self, around):
        raise RuntimeError("out \\x1b[31m of order")

    resume = start


broken = Broken()
pairs = kitchen.pairs
"""
SLOW = """
import time
from kitchen import pairs


class Slow:
    name, version, across_agents, definition, outputs = "slow", 1, False, [], ()
    interest = pairs.interest

    def start(self, around):
        open("at-it", "w").close()
        time.sleep(600)

    resume = start


slow = Slow()
del pairs
"""
PATIENCE = 60.0


def event(number: int, kind: str, begin: float, **more: object) -> str:
    interval = [at(begin).isoformat(), at(begin + 1).isoformat()]
    return json.dumps({"uid": uid(number), "type": kind, "interval": interval, "agent": "one", **more})


EVENTS = (event(1, "Look", 0), event(2, "Grasp", 5), event(3, "Look", 10), event(4, "Grasp", 15), event(5, "Rest", 90))


@pytest.fixture
def beside(program: Program) -> Program:
    """`elm` beside a file with a recognizer."""
    (program.directory / "kitchen.py").write_text(KITCHEN)
    return program


@pytest.fixture
def kitchen(beside: Program) -> Program:
    """The same with a memory in which the recognizer finds two."""
    types = told([json.dumps({"type": name}) for name in ("Look", "Grasp", "Rest")])
    assert beside.here("types", "load", "-", stdin=types).returncode == 0
    assert beside.here("load", "-", stdin=told(EVENTS)).returncode == 0
    return beside


def lines(done: subprocess.CompletedProcess[str]) -> list[Any]:
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def found(program: Program) -> list[list[str]]:
    """The parts of what was found."""
    return [pair["parts"] for pair in lines(program.here("export", "--type", "Pair")) if pair["type"] == "Pair"]


PAIRS = [[uid(1), uid(2)], [uid(3), uid(4)]]


# Where recognizers come from


def test_a_file_and_a_module_have_the_same_recognizers_once(beside: Program) -> None:
    expected = {"recognizer": "pairs", "version": 1, "finds": ["Pair"], "across_agents": False}
    listed = lines(beside("recognize", "list", "--from", "kitchen", "--from", "kitchen.py"))
    assert listed == [{**expected, "from": "kitchen:pairs"}]
    listed = lines(beside.here("recognize", "list", "--from", beside.directory / "kitchen.py"))
    assert listed == [{**expected, "from": f"{beside.directory / 'kitchen.py'}:pairs"}]


@pytest.mark.parametrize("name", ["pairs", "Shelf.one", "LISTED", "STREAMED"])
def test_a_name_is_a_recognizer_or_some(beside: Program, name: str) -> None:
    more = "class Shelf:\n    one = pairs\nLISTED = [pairs]\nSTREAMED = (each for each in LISTED)\n"
    (beside.directory / "more.py").write_text(KITCHEN + more)
    listed = lines(beside.here("recognize", "list", "--from", f"more.py:{name}"))
    assert [(each["recognizer"], each["from"]) for each in listed] == [("pairs", f"more.py:{name}")]


def test_a_file_may_be_named_like_any_module_and_import_what_lies_beside_it(beside: Program) -> None:
    (beside.directory / "json.py").write_text("from kitchen import pairs\n")
    (listed,) = lines(beside("recognize", "list", "--from", "json.py"))
    assert listed["recognizer"] == "pairs"


@pytest.mark.parametrize(
    ("text", "source", "reason"),
    [
        ("nowhere.py", None, "there is no file 'nowhere.py'"),
        ("nowhere", None, "there is no module 'nowhere'"),
        ("no.where", None, "there is no module 'no'"),
        ("bad.py", "x = 1\ny = x / 0\n", "bad.py, line 2): ZeroDivisionError: division by zero"),
        ("bad.py", "x = (\n", "bad.py, line 1): SyntaxError"),
        ("bad.py", "import nowhere\n", "bad.py, line 1): ModuleNotFoundError: No module named 'nowhere'"),
        ("bad.py", "raise SystemExit(0)\n", "bad.py, line 1): SystemExit"),
        ("bad.py", "ALL = []\n", "bad.py has no recognizers of its own"),
        ("bad.py:ALL", "ALL = []\n", "bad.py:ALL is neither a recognizer nor some of them"),
        ("bad.py:ALL", "ALL = 'all'\n", "bad.py:ALL is neither a recognizer nor some of them"),
        ("bad.py:ALL", "from elm.recognizers import Pattern\nALL = Pattern\n", "neither a recognizer"),
        ("bad.py:nobody", KITCHEN, "bad.py has no 'nobody'; the recognizers it has: pairs"),
        ("bad.py:", KITCHEN, "MODULE or MODULE:NAME"),
        ("bad.py", KITCHEN.replace("version=1", "version=0"), "the version of recognizer 'pairs'"),
        ("bad.py", BROKEN.replace('"broken"', "5"), "bad.py:broken"),
        ("bad.py", BROKEN.replace("1, False, []", "1, False, object()"), "bad.py:broken"),
        ("bad.py", KITCHEN + 'twice = Pattern(**{**vars_of(pairs), "version": 2})\n', "NameError"),
        ("bad.py", KITCHEN.replace("60", "61"), "two recognizers are named 'pairs', one of kitchen.py:pairs"),
    ],
)
def test_what_is_wrong_with_a_source_is_said_in_one_line(
    beside: Program, text: str, source: str | None, reason: str
) -> None:
    if source is not None:
        (beside.directory / "bad.py").write_text(source)
    done = beside.here("recognize", "run", "--from", "kitchen.py", "--from", text, "--once")
    assert done.returncode == 1
    assert done.stderr.startswith("elm: ")
    assert len(done.stderr.splitlines()) == 1
    assert reason in done.stderr
    assert done.stdout == ""


def test_recognizers_can_be_selected(beside: Program) -> None:
    (beside.directory / "broken.py").write_text(BROKEN)
    sources = ("--from", "broken.py")
    assert {each["recognizer"] for each in lines(beside.here("recognize", "list", *sources))} == {"broken", "pairs"}
    (listed,) = lines(beside.here("recognize", "list", *sources, "--only", "pairs"))
    assert listed["recognizer"] == "pairs"
    done = beside.here("recognize", "list", *sources, "--only", "pear")
    assert (done.returncode, done.stderr) == (
        1,
        "elm: there is no recognizer 'pear' to select with --only: found broken, pairs\n",
    )


@pytest.fixture
def installed(beside: Program, tmp_path: Path) -> Program:
    """The same beside an installed package that offers the recognizer, and one whose offer is broken."""
    site = tmp_path / "site"
    for package, value in (("robots", "robots_of_a_test"), ("ruins", "ruins_of_a_test:none")):
        information = site / f"{package}-1.0.dist-info"
        information.mkdir(parents=True)
        (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
        (information / "entry_points.txt").write_text(f"[elm.recognizers]\n{package} = {value}\n")
    (site / "robots_of_a_test.py").write_text(KITCHEN.replace('"pairs"', '"packaged"'))
    (site / "ruins_of_a_test.py").write_text("none = None\n")
    return beside.having(PYTHONPATH=f"{beside.environment['PYTHONPATH']}:{site}")


def test_packages_offer_recognizers(installed: Program) -> None:
    done = installed("recognize", "list")
    assert done.returncode == 1
    assert done.stderr.startswith("elm: the entry point 'ruins' of ruins offers no recognizers: ")
    (installed.directory / "site" / "ruins_of_a_test.py").write_text("from robots_of_a_test import pairs as none")
    (listed,) = lines(installed("recognize", "list"))
    assert (listed["recognizer"], listed["from"]) == ("packaged", "robots_of_a_test:pairs")


def test_packages_are_not_asked_for_what_is_there_already(installed: Program) -> None:
    (listed,) = lines(installed("recognize", "list", "--from", "kitchen.py", "--only", "pairs"))
    assert listed["from"] == "kitchen.py:pairs"


def test_without_recognizers_there_is_nothing_to_run(beside: Program) -> None:
    listed = beside.here("recognize", "list")
    assert (listed.returncode, listed.stdout) == (0, "")
    assert listed.stderr.startswith("no recognizers: ")
    done = beside.here("recognize", "run")
    assert done.returncode == 1
    assert done.stderr.startswith("elm: there are no recognizers: ")


# Running


def test_once_finds_what_is_there_and_nothing_twice(kitchen: Program) -> None:
    run = ("recognize", "run", "--from", "kitchen.py", "--once")
    done = kitchen(*run)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "position 7 of 7, 2 complex events so far\n")
    assert kitchen.here(*run).stderr == done.stderr
    assert found(kitchen) == PAIRS


def test_what_came_too_late_is_said(kitchen: Program) -> None:
    run = ("recognize", "run", "--from", "kitchen.py", "--once")
    assert kitchen.here(*run).returncode == 0
    set_back = [event(6, "Look", 20), event(7, "Grasp", 25)]
    assert kitchen.here("load", "-", stdin=told(set_back)).returncode == 0
    done = kitchen.here(*run)
    assert done.returncode == 0
    warned, closing = done.stderr.splitlines()
    assert warned.startswith("elm: recognition 'recognition': events come too late and are not fed: 2 to 'pairs'; ")
    assert closing == "position 9 of 9, 2 complex events so far, too late: 2 for pairs"


def test_how_it_is_doing_in_all_formats(kitchen: Program) -> None:
    nobody = kitchen.here("recognize", "status", "-o", "table")
    assert (nobody.returncode, nobody.stdout, nobody.stderr) == (0, "", "no recognizers have worked here\n")
    assert kitchen.here("recognize", "run", "--from", "kitchen.py", "--once", "--consumer", "arm").returncode == 0
    (known,) = lines(kitchen.here("recognize", "status"))
    expected = {"consumer": "arm", "recognizer": "pairs", "version": 1, "position": 7, "lag": 0, "fed": 4, "found": 2}
    expected |= {
        "partial": 0,
        "late": 0,
        "dropped": 0,
        "split": 0,
        "passed_over": 0,
        "cut": 0,
        "failures": 0,
        "error": None,
    }
    assert {name: known[name] for name in expected} == expected
    assert known["events_per_second"] > 0
    assert 0 < known["slowest"] < 10
    assert known["is_failing"] is False
    assert kitchen.here("load", "-", stdin=told([event(6, "Look", 100), event(7, "Look", 50)])).returncode == 0
    (behind,) = lines(kitchen.here("recognize", "status", "--consumer", "arm"))
    assert behind == {**known, "lag": 2}
    (row,) = csv.DictReader(io.StringIO(kitchen.here("recognize", "status", "-o", "csv").stdout, newline=""))
    assert row == {name: csv_text(value) for name, value in behind.items()}
    table = kitchen.here("recognize", "status", "-o", "table").stdout.splitlines()
    assert table[0].split()[:9] == [
        *("consumer", "recognizer", "version", "position", "lag", "fed", "found"),
        "partial",
        "late",
    ]
    assert table[1].split()[:9] == ["arm", "pairs", "1", "7", "2", "4", "2", "0", "0"]
    assert kitchen.here("recognize", "status", "--consumer", "leg").stdout == ""
    assert kitchen.here("recognize", "run", "--from", "kitchen.py", "--once", "--consumer", "arm").returncode == 0
    (known,) = lines(kitchen.here("recognize", "status"))
    assert (known["position"], known["late"]) == (9, 1)


def csv_text(value: object) -> str:
    match value:
        case None:
            return ""
        case bool():
            return str(value).lower()
        case _:
            return str(value)


def test_lateness_is_what_events_may_be_late(kitchen: Program) -> None:
    run = ("recognize", "run", "--from", "kitchen.py", "--once")
    assert kitchen.here("load", "-", stdin=told([event(6, "Grasp", 20), event(7, "Rest", 300)])).returncode == 0
    assert kitchen.here(*run, "--consumer", "strict").returncode == 0
    assert kitchen.here(*run, "--consumer", "patient", "--lateness", "100", "--simulated").returncode == 0
    late = {each["consumer"]: each["late"] for each in lines(kitchen.here("recognize", "status"))}
    assert late == {"strict": 1, "patient": 0}


@pytest.mark.parametrize("options", [("--lateness", "-1"), ("--idle", "nan"), ("--lateness", "1e300"), ("--idle", "x")])
def test_senseless_timing_is_wrong_usage(kitchen: Program, options: tuple[str, ...]) -> None:
    assert kitchen.here("recognize", "run", "--from", "kitchen.py", "--once", *options).returncode == 2


def test_a_changed_definition_needs_a_new_version(kitchen: Program) -> None:
    run = ("recognize", "run", "--once", "--from")
    assert kitchen.here(*run, "kitchen.py").returncode == 0
    (kitchen.directory / "changed.py").write_text(KITCHEN.replace("60", "61"))
    done = kitchen.here(*run, "changed.py")
    assert done.returncode == 1
    assert done.stderr.startswith("elm: recognizer 'pairs' of version 1 was defined otherwise")
    assert len(done.stderr.splitlines()) == 1
    (kitchen.directory / "newer.py").write_text(KITCHEN.replace("60", "61").replace("version=1", "version=2"))
    assert kitchen.here(*run, "newer.py").returncode == 0
    assert found(kitchen) == [*PAIRS, *PAIRS]


def test_a_recognizer_that_fails_is_told_of_and_holds_nobody_up(kitchen: Program) -> None:
    (kitchen.directory / "broken.py").write_text(BROKEN)
    done = kitchen.here("recognize", "run", "--from", "broken.py", "--once")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert r"broken: RuntimeError: out \x1b[31m of order" in done.stderr.splitlines()[0]
    assert done.stderr.endswith("2 complex events so far, failing: broken\n")
    known = {each["recognizer"]: each for each in lines(kitchen.here("recognize", "status"))}
    assert [(known[name]["is_failing"], known[name]["failures"]) for name in ("broken", "pairs")] == [
        (True, 1),
        (False, 0),
    ]
    table = kitchen.here("recognize", "status", "-o", "table").stdout
    assert r"broken failed 1 times, the last time with: broken: RuntimeError: out \x1b[31m of order" in table
    assert found(kitchen) == PAIRS


# Stopped by signals


class Running:
    """`elm recognize run` in a process of its own, once it works."""

    def __init__(self, program: Program, *options: str) -> None:
        self.process = program.start("recognize", "run", *options, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert self.process.stderr is not None
        # It says how far it is as soon as it works.
        self.said = os.read(self.process.stderr.fileno(), 65536).decode()

    def ends(self) -> tuple[int, str]:
        """Its exit code, and all that it said."""
        answer, remarks = self.process.communicate(timeout=PATIENCE)
        assert answer == b""
        return self.process.returncode, self.said + remarks.decode()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_finds_what_comes_until_it_is_stopped(kitchen: Program, number: signal.Signals) -> None:
    running = Running(kitchen, "--from", "kitchen.py")
    assert "recognizing in memory" in running.said
    more = [event(6, "Look", 100), event(7, "Grasp", 105), event(8, "Rest", 200)]
    assert kitchen.here("load", "-", stdin=told(more)).returncode == 0
    expected = [*PAIRS, [uid(6), uid(7)]]
    deadline = time.monotonic() + PATIENCE
    while found(kitchen) != expected:
        assert time.monotonic() < deadline
        assert running.process.poll() is None
        time.sleep(0.05)
    running.process.send_signal(number)
    code, said = running.ends()
    assert code == 0
    assert "Traceback" not in said
    assert said.endswith("3 complex events so far\n")
    assert "stopped: position " in said


def test_a_terminal_is_shown_how_far_it_is(kitchen: Program) -> None:
    terminal, inside = pty.openpty()
    process = kitchen.start("recognize", "run", "--from", "kitchen.py", stderr=inside)
    os.close(inside)
    shown = b""
    deadline = time.monotonic() + PATIENCE
    while b"2 complex events so far" not in shown:
        ready, _, _ = select.select([terminal], [], [], max(0.0, deadline - time.monotonic()))
        assert ready, shown
        shown += os.read(terminal, 65536)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=PATIENCE) == 0
    os.close(terminal)
    assert b"recognizing in memory" in shown


def test_two_runs_of_one_name_exclude_each_other(kitchen: Program) -> None:
    running = Running(kitchen, "--from", "kitchen.py")
    try:
        for options in ((), ("--once",)):
            second = kitchen("recognize", "run", "--from", "kitchen.py", *options)
            assert second.returncode == 1
            assert second.stderr == (
                "elm: another already works on this memory as 'recognition': stop that one, or choose another name\n"
            )
        assert kitchen("recognize", "run", "--from", "kitchen.py", "--once", "--consumer", "other").returncode == 0
    finally:
        running.process.send_signal(signal.SIGTERM)
        code, _ = running.ends()
    assert code == 0


def test_a_second_signal_ends_it_at_once(kitchen: Program) -> None:
    (kitchen.directory / "slow.py").write_text(SLOW)
    running = Running(kitchen, "--from", "slow.py")
    assert (kitchen.directory / "at-it").exists()
    running.process.send_signal(signal.SIGINT)
    with pytest.raises(subprocess.TimeoutExpired):
        running.process.wait(timeout=2.0)
    running.process.send_signal(signal.SIGTERM)
    code, said = running.ends()
    assert code == -signal.SIGTERM
    assert said.endswith("ending after the batch at hand; once more ends it at once\n")


def test_who_runs_without_a_server_is_told(kitchen: Program) -> None:
    done = kitchen("recognize", "run", "--from", "kitchen.py", "--dsn", "postgresql://robot@127.0.0.1:1/elm")
    assert done.returncode == 3
    assert len(done.stderr.splitlines()) == 1


def test_a_run_makes_the_memory_that_it_watches(beside: Program) -> None:
    types = told([json.dumps({"type": name}) for name in ("Look", "Grasp")])
    running = Running(beside, "--from", "kitchen.py")
    assert beside.here("types", "load", "-", stdin=types).returncode == 0
    running.process.send_signal(signal.SIGTERM)
    code, said = running.ends()
    assert code == 0, said
    assert {each["type"] for each in lines(beside.here("types", "tree"))} == {"Pair", "Look", "Grasp"}


# Replaying


def test_a_replay_finds_what_a_run_finds(kitchen: Program) -> None:
    replay = ("recognize", "replay", "--from", "kitchen.py")
    (dry,) = lines(kitchen.here(*replay, "--dry-run"))
    assert dry == {"entries": 5, "found": 2, "new": 2, "missing": 0, "late": 0}
    assert found(kitchen) == []
    assert lines(kitchen.here(*replay)) == [dry]
    assert found(kitchen) == PAIRS
    assert kitchen.here("recognize", "run", "--from", "kitchen.py", "--once").returncode == 0
    assert found(kitchen) == PAIRS
    again = kitchen.here(*replay, "-o", "table").stdout.splitlines()
    assert [line.split() for line in again] == [
        ["entries", "found", "new", "missing", "late"],
        ["7", "2", "0", "0", "0"],
    ]


def test_a_complete_replay_differs_by_what_came_late(kitchen: Program) -> None:
    assert kitchen.here("recognize", "run", "--from", "kitchen.py", "--once").returncode == 0
    late = [event(6, "Look", 30), event(7, "Grasp", 32)]
    assert kitchen.here("load", "-", stdin=told(late)).returncode == 0
    replay = ("recognize", "replay", "--from", "kitchen.py", "--diff", "--complete")
    difference = kitchen.here(*replay, "--dry-run")
    assert difference.stderr == "9 entries, 3 found, 1 new, 0 missing, 0 late\n"
    (only,) = lines(difference)
    assert only["only"] == "replay"
    assert lines(kitchen.here(*replay)) == [only]
    assert found(kitchen) == [*PAIRS, [uid(6), uid(7)]]
    assert only["uid"] == lines(kitchen.here("recall", "--type", "Pair", "--order", "-begin"))[0]["uid"]
    assert lines(kitchen.here(*replay)) == []
    without = kitchen.here("recognize", "replay", "--from", "kitchen.py", "--diff", "--since", "2", "-o", "csv")
    missing = [row["uid"] for row in csv.DictReader(io.StringIO(without.stdout, newline="")) if row["only"] == "live"]
    pairs = lines(kitchen.here("recall", "--type", "Pair"))
    assert set(missing) == {pairs[0]["uid"], pairs[2]["uid"]}


# Why


def test_why_names_the_recognizer_and_the_parts_as_they_matched(kitchen: Program) -> None:
    assert kitchen.here("recognize", "run", "--from", "kitchen.py", "--once").returncode == 0
    first, second = lines(kitchen.here("recall", "--type", "Pair"))
    told_of, other = lines(kitchen.here("show", second["uid"], uid(1), "--why"))
    assert told_of["uid"] == second["uid"]
    assert (told_of["recognizer"], told_of["version"], told_of["output"]) == ("pairs", 1, "match")
    assert [(part["uid"], part["type"]) for part in told_of["parts"]] == [(uid(3), "Look"), (uid(4), "Grasp")]
    assert (other["uid"], other["recognizer"], other["parts"]) == (uid(1), None, [])
    shown = [line.split() for line in kitchen.here("show", first["id"], "--why", "-o", "table").stdout.splitlines()]
    assert ["recognizer", "pairs"] in shown
    assert ["output", "match"] in shown
    assert [line[:2] for line in shown[-2:]] == [["1", "Look"], ["2", "Grasp"]]
    plain = kitchen.here("show", "1", "--why", "-o", "table")
    assert plain.returncode == 0
    assert "nobody recognized this event" in plain.stdout
    assert kitchen.here("show", "1", "999999", "--why").returncode == 4


def test_why_a_deadline_is_there(kitchen: Program) -> None:
    absence = KITCHEN.replace(
        'step("second", cues.exactly("Grasp"))', 'absent(cues.exactly("Rest"), timedelta(seconds=60))'
    )
    (kitchen.directory / "absence.py").write_text(absence.replace("Pattern, step", "Pattern, absent, step"))
    assert kitchen.here("recognize", "run", "--from", "absence.py", "--once").returncode == 0
    whole = lines(kitchen.here("recall", "--type", "Pair"))[0]
    (deadline,) = lines(kitchen.here("recall", "--type", "elm.Deadline", "--limit", "1"))
    shown = kitchen.here("show", deadline["id"], "--why", "-o", "table").stdout
    assert "pairs" in shown
    assert whole["uid"] in shown
    (why,) = lines(kitchen.here("show", whole["id"], "--why"))
    assert [part["type"] for part in why["parts"]] == ["Look", "elm.Deadline"]
