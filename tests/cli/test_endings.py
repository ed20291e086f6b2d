"""How commands end: exit codes, one line for an error, and quietly when somebody has heard enough."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.conftest import Program

NOBODY_THERE = "postgresql://robot:geheim@127.0.0.1:1/elm"


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("count",), 0),
        (("export",), 0),
        (("count", "--agent", "nobody"), 0),
        (("export", "--agent", "nobody"), 0),
        (("--version",), 0),
        (("recall", "--help"), 0),
        (("recall", "--is-a", "Unheard-of"), 1),
        (("tree", "999999"), 1),
        (("types", "tree", "Unheard-of"), 1),
        (("count", "--memory", "never-made"), 1),
        (("rekall",), 2),
        (("recall", "--colour", "red"), 2),
        (("recall", "--limit", "0"), 2),
        (("recall", "--order", "size"), 2),
        (("recall", "--after", "yesterday"), 2),
        (("recall", "--since", "2026-01-01T10:00:00"), 2),
        (("recall", "--since", "2026-01-02T10:00:00Z", "--until", "2026-01-01T10:00:00Z"), 2),
        (("recall", "--near", "1,2"), 2),
        (("recall", "--near", "nan,0,1"), 2),
        (("recall", "--feature", "cup"), 2),
        (("recall", "--cue", "no-such-file"), 2),
        (("recall", "--cue", '{"op": "tipe"}'), 2),
        (("recall", "--cue", '{"op": '), 2),
        (("recall", "-o", "parquet"), 2),
        (("recall", "--near-subject", "1,2"), 2),
        (("recall", "--nearest", "1"), 2),
        (("recall", "--nearest", "1,x"), 2),
        (("recall", "--nearest", "1,2", "--order", "begin"), 2),
        (("recall", "--nearest", "1,2", "--after", "1767261600000000.1"), 2),
        (("recall", "--nearest", "1,2,unheard-of"), 4),
        (("recall", "--nearest", "1,2"), 0),
        (("count", "--by", "colour"), 2),
        (("count", "--by", "feature:"), 2),
        (("show", "cup"), 2),
        (("load", "no-such-file"), 2),
        (("types", "load"), 2),
        (("recall", "--agent", "nobody"), 4),
        (("show", "999999"), 4),
        (("show", "00000000-0000-4000-8000-00000000ffff"), 4),
    ],
)
def test_exit_codes(filled: Program, arguments: tuple[str, ...], code: int) -> None:
    done = filled.here(*arguments)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    if code == 1:
        assert done.stderr.startswith("elm: ")
        assert len(done.stderr.splitlines()) == 1


def test_a_choice_that_there_is_not_is_refused_in_words_of_the_command_line(program: Program) -> None:
    done = program.here("recall", "--order", "end")
    assert done.returncode == 2
    told = " ".join(done.stderr.replace("│", " ").split())
    assert "Invalid value for '--order': 'end' is not one of 'begin', '-begin'." in told


def test_an_unreachable_database_is_code_3_and_keeps_its_password(filled: Program) -> None:
    done = filled("recall", "--dsn", NOBODY_THERE)
    assert done.returncode == 3
    assert done.stderr.startswith("elm: ")
    assert len(done.stderr.splitlines()) == 1
    assert "geheim" not in done.stderr + done.stdout


def test_debug_shows_the_trace_before_the_message(filled: Program) -> None:
    done = filled("--debug", "recall", "--is-a", "Unheard-of")
    assert done.returncode == 1
    assert done.stderr.startswith("Traceback")
    assert done.stderr.splitlines()[-1].startswith("elm: ")
    assert filled.having(ELM_DEBUG="1")("tree", "999999").stderr.startswith("Traceback")


def test_a_reader_that_goes_away_ends_a_recall_quietly(filled: Program) -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        for form in ("jsonl", "csv", "geojson", "table"):
            process = filled.start("recall", "-o", form, stdout=write, stderr=subprocess.PIPE)
            _, remarks = process.communicate(timeout=60)
            assert (process.returncode, remarks) == (141, b""), form
    finally:
        os.close(write)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_an_error(filled: Program) -> None:
    with open("/dev/full", "wb") as full:
        process = filled.start("recall", stdout=full.fileno(), stderr=subprocess.PIPE)
        _, remarks = process.communicate(timeout=60)
    assert (process.returncode, remarks.decode()) == (1, "elm: No space left on device\n")


def test_control_c_ends_a_load_without_a_trace(program: Program) -> None:
    assert program.here("types", "add", "Drive").returncode == 0
    process = program.start("load", "-", stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    refused = program.directory / "stdin.refused.jsonl"
    part = program.directory / "stdin.refused.jsonl.part"
    deadline = time.monotonic() + 60
    # The file for refused lines is made just before the first line is waited for.
    while not part.exists():
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    answer, remarks = process.communicate(timeout=60)
    assert (process.returncode, answer) == (130, b"")
    assert remarks.decode().splitlines() == [
        "stopped: lines behind those that were read are not loaded",
        "0 events loaded",
    ]
    assert not refused.exists()
    assert not part.exists()


def test_control_c_keeps_what_a_slow_source_has_told(program: Program) -> None:
    assert program.here("types", "add", "Drive").returncode == 0
    process = program.start("load", "-", stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdin is not None
    line = b'{"type": "Drive", "interval": ["2026-01-01T10:00:00Z", null]}\n'
    process.stdin.write(line + line)
    process.stdin.flush()
    deadline = time.monotonic() + 60
    # They are there while more may come.
    while program.here("count").stdout != "2\n":
        assert time.monotonic() < deadline
        assert process.poll() is None
        time.sleep(0.1)
    process.stdin.write(line)
    process.stdin.flush()
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, remarks = process.communicate(timeout=60)
    assert process.returncode == 130
    assert remarks.decode().splitlines()[-1] == "3 events loaded"
    assert program.here("count").stdout == "3\n"


def test_what_the_driver_says_of_a_connection_that_is_dropped_is_not_shown() -> None:
    script = (
        "import logging, sys\n"
        "from elm.cli import main\n"
        "sys.argv = ['elm', '--version']\n"
        "try:\n"
        "    main()\n"
        "except SystemExit:\n"
        "    logging.getLogger('psycopg').warning('error ignored in rollback')\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.startswith("elm ")
    assert done.stderr == ""


def test_doctor_works_when_things_are_broken_and_keeps_secrets(program: Program, tmp_path: Path) -> None:
    broken = program.having(ELM_DSN=NOBODY_THERE, PGPASSWORD="geheim", ELM_HOME="/proc/nowhere")
    done = broken("doctor")
    assert done.returncode == 0
    assert "geheim" not in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    found = dict(line.split(": ", 1) for line in done.stdout.splitlines())
    assert found["ELM_DSN"] == "user=robot password=*** dbname=elm host=127.0.0.1 port=1"
    assert found["PGPASSWORD"] == "set (not shown)"
    assert found["Python"].startswith("CPython 3.")
    assert {"elm", "system", "GEOS", "libpq", "ELM_HOME"} <= set(found)
    assert found["connection"].startswith("FAILED: no database at 127.0.0.1")


def test_doctor_tells_of_a_memory_that_is_well(filled: Program) -> None:
    done = filled("doctor")
    assert (done.returncode, done.stderr) == (0, "")
    for word in ("PostgreSQL", "postgis", filled.settings["ELM_MEMORY"], "not running"):
        assert word in done.stdout


def test_up_and_down_say_what_they_did(home: Path, tmp_path: Path) -> None:
    elm = Program(directory=tmp_path, settings={"ELM_HOME": str(home)})
    assert "was not running" in elm("down").stderr
    up = elm.having(ELM_DSN=NOBODY_THERE)("up")
    assert (up.returncode, up.stdout) == (0, "")
    assert "is running" in up.stderr
    assert "ELM_DSN is set" in up.stderr
    assert "running as process" in elm("doctor").stdout
    assert elm("status").returncode == 0
    assert "is stopped" in elm("down").stderr
    stopped = elm("status")
    assert stopped.returncode == 3
    assert '"running":false' in stopped.stdout
