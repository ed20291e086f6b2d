"""`elm armem`: what its commands print, what ends how, and memories that are served to other processes through Ice."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from armem_bridge.cli import app
from armem_bridge.config import read_config
from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.refusals import IceMissing
from tests.cli.conftest import SOURCES, Program
from tests.servers import Server

SLICES = SOURCES / "tests" / "armem" / "ice" / "slices" / "gen4"
COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
MUG = "Object/Instance/ObjectLocalizer/mug"
CUP = "Object/Instance/ObjectLocalizer/blue-cup"
END = 1_767_261_659_000_000


@pytest.fixture(scope="module")
def demo_database(postgres_server: Server) -> Iterator[str]:
    """A database whose memory `kitchen` the demo filled."""
    with postgres_server.database() as dsn:
        done = CliRunner(env={"ELM_DSN": dsn}).invoke(app, ["demo"])
        assert done.exit_code == 0, done.output
        yield dsn


@pytest.fixture
def kitchen(demo_database: str, tmp_path: Path) -> Program:
    """`elm` on what the demo remembers; tests leave it as it is."""
    settings = {"ELM_DSN": demo_database, "ELM_HOME": str(tmp_path / "no-home"), "ELM_MEMORY": "kitchen"}
    return Program(directory=tmp_path, settings=settings)


@pytest.fixture
def ice() -> None:
    """Skips where there is no Ice for this Python."""
    try:
        load_ice()
        slice_directory()
    except IceMissing as error:
        pytest.skip(str(error))


# Commands on long-term memory


def lines(done: subprocess.CompletedProcess[str]) -> list[dict[str, Any]]:
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_elm_takes_the_command_in(kitchen: Program) -> None:
    assert "serve it, and look into what it consolidated" in kitchen("--help").stdout
    done = kitchen("armem", "ls", MUG.rpartition("/")[0])
    assert [row["id"] for row in lines(done)] == [CUP, MUG]


def test_help_imports_nothing_heavy() -> None:
    code = "import sys, armem_bridge.cli; print(*{name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=SOURCES)
    assert not {"numpy", "shapely", "sqlalchemy", "msgspec", "rich", "Ice"} & set(done.stdout.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_each_command(kitchen: Program, name: str) -> None:
    done = kitchen.here("armem", name, "--help")
    assert done.returncode == 0
    assert done.stdout.startswith("\n Usage: elm armem " + name) or f"armem {name}" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("ls",), 0),
        (("ls", CUP), 0),
        (("ls", f"{CUP}/{END}"), 0),
        (("get", "Object"), 0),
        (("profiles",), 0),
        (("watch", "--timeout", "0"), 0),
        (("ls", "--memory", "never-made"), 4),
        (("ls", "Nothing"), 4),
        (("ls", f"{CUP}/{END + 1}"), 4),
        (("get", "Nothing"), 4),
        (("get", f"{CUP}/{END}/1"), 4),
        (("get", "Object", "--memory", "never-made"), 4),
        (("forget", "--count", "9", "--dry-run", "Object"), 0),
        (("forget", "--count", "9", "--dry-run", "Nothing"), 4),
        (("forget", "--count", "9", "--dry-run", "--memory", "never-made"), 1),
        (("watch", "--memory", "never-made", "--timeout", "0"), 1),
        (("serve", "--config", "no-such.toml"), 1),
        (("ls", "--server", "no-such.toml"), 1),
        (("ls", "a//b"), 2),
        (("get",), 2),
        (("get", "Object", "--last", "0"), 2),
        (("get", "Object", "-o", "csv"), 2),
        (("forget",), 2),
        (("forget", "--count", "9"), 2),
        (("forget", "--count", "-1", "--dry-run"), 2),
        (("forget", "--count", "9", "--config", "x.toml", "--dry-run"), 2),
        (("watch", "--server", "x.toml", "--since", "3"), 2),
        (("serve",), 2),
        (("ls", "--dsn", "postgresql://robot:geheim@127.0.0.1:1/elm"), 3),
    ],
)
def test_exit_codes(kitchen: Program, arguments: tuple[str, ...], code: int) -> None:
    done = kitchen.here("armem", *arguments)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    assert "geheim" not in done.args
    if code in (1, 3):
        assert done.stderr.startswith("elm: ")
        assert len(done.stderr.splitlines()) == 1


def test_snapshots_as_lines(kitchen: Program) -> None:
    (latest,) = lines(kitchen.here("armem", "get", MUG))
    assert (latest["id"], latest["referenced"]) == (f"{MUG}/{END}", END)
    (instance,) = latest["instances"]
    assert instance["data"]["dict"]["creator"] == {"string": "ObjectLocalizer"}
    assert instance["data"]["dict"]["globalPose"]["ndarray"]["shape"] == [4, 4, 4]
    assert len(lines(kitchen.here("armem", "get", "Object", "--last", "3"))) == 6
    assert len(lines(kitchen.here("armem", "get", CUP, "--history", "--without-data"))) == 60
    (one,) = lines(kitchen.here("armem", "get", f"{CUP}/{END}/0"))
    assert len(one["instances"]) == 1


def test_snapshots_in_a_table(kitchen: Program) -> None:
    done = kitchen.here("armem", "ls", "-o", "table", CUP, "--limit", "2")
    assert done.stdout.splitlines()[1].split()[:3] == [f"{CUP}/1767261600000000", "2026-01-01", "10:00:00"]
    assert (len(done.stdout.splitlines()), done.stderr) == (3, "first 2 of 60; --limit N for more\n")
    done = kitchen.here("armem", "get", "-o", "table", MUG)
    assert "  className: mug" in done.stdout
    assert "framedPose: null" in done.stdout


def test_a_configuration_without_a_way_to_it_is_not_served(kitchen: Program) -> None:
    (kitchen.directory / "alone.toml").write_text('[[memories]]\nprofile = "AudioMemory"\n')
    done = kitchen.here("armem", "serve", "--config", "alone.toml")
    assert done.returncode == 1
    assert 'set mode = "standalone" or "join"' in done.stderr
    assert kitchen.here("armem", "serve", "--config", "alone.toml", "--check").returncode == 0
    (kitchen.directory / "known.toml").write_text(
        '[[memories]]\nprofile = "AudioMemory"\nprior_knowledge = ["no.json"]\n'
    )
    done = kitchen.here("armem", "serve", "--config", "known.toml", "--check")
    assert (done.returncode, "no.json cannot be read" in done.stderr) == (1, True)
    done = kitchen.here("armem", "forget", "--config", "alone.toml", "--dry-run")
    assert (done.returncode, "no mechanisms" in done.stderr) == (2, True)


def test_forgetting_takes_what_the_dry_run_said(program: Program) -> None:
    assert program.here("armem", "demo", "--memory", program.settings["ELM_MEMORY"]).returncode == 0
    told = lines(program.here("armem", "forget", "--count", "55", "--dry-run", "Object"))
    assert len(told) == 10
    assert len(lines(program.here("armem", "get", "Object", "--history", "--without-data"))) == 120
    assert lines(program.here("armem", "forget", "--count", "55", "--yes", "Object")) == told
    left = lines(program.here("armem", "get", "Object", "--history", "--without-data"))
    assert {row["id"] for row in left} & {row["id"] for row in told} == set()
    assert len(left) == 110
    assert lines(program.here("armem", "forget", "--count", "55", "--yes", "Object")) == []


def test_a_configuration_forgets_in_its_own_memory(program: Program) -> None:
    """Whatever memory the environment names: by these thresholds another robot's would be forgotten."""
    own, dsn = program.settings["ELM_MEMORY"], program.settings["ELM_DSN"]
    assert program.here("armem", "demo", "--memory", own).returncode == 0
    text = '[[memories]]\nprofile = "ObjectMemory"\n[forgetting.offline]\nretention = {count = 55}\n'
    (program.directory / "robot.toml").write_text(f'{text}[long_term]\nmemory = "{own}"\ndsn = "{dsn}"\n')
    asked = ("armem", "forget", "--config", "robot.toml", "--dry-run")

    elsewhere = program.having(ELM_MEMORY="another", ELM_DSN="postgresql://127.0.0.1:1/nowhere")
    assert len(lines(elsewhere.here(*asked))) == 15
    (program.directory / "robot.toml").write_text(f'{text}[long_term]\nmemory = "another"\n')
    assert program.here(*asked).returncode == 1
    assert len(lines(program.here(*asked, "--memory", own))) == 15
    (program.directory / "robot.toml").write_text(text)
    assert len(lines(program.here(*asked))) == 15


def test_help_says_which_mechanisms_a_configuration_gives(program: Program) -> None:
    said = " ".join(program.here("armem", "forget", "--help").stdout.replace("│", " ").split())
    assert "Take the offline mechanisms of this configuration, and its memory" in said


@pytest.mark.parametrize(("answer", "code", "left"), [("y", 0, 110), ("n", 1, 120)])
def test_a_person_is_asked(program: Program, answer: str, code: int, left: int) -> None:
    assert program.here("armem", "demo", "--memory", program.settings["ELM_MEMORY"]).returncode == 0
    terminal, inside = pty.openpty()
    try:
        asking = ("armem", "forget", "--count", "55", "Object")
        process = program.start(*asking, stdin=inside, stdout=subprocess.DEVNULL, stderr=inside)
        os.close(inside)
        said = b""
        while b"for good?" not in said:
            ready, _, _ = select.select([terminal], [], [], 60)
            assert ready, said
            said += os.read(terminal, 65536)
        assert b"10 of 120 snapshots would be forgotten" in said
        os.write(terminal, f"{answer}\n".encode())
        assert process.wait(timeout=60) == code
    finally:
        os.close(terminal)
    assert len(lines(program.here("armem", "get", "Object", "--history", "--without-data"))) == left


def test_watching_follows_the_log_of_elm(program: Program) -> None:
    memory = program.settings["ELM_MEMORY"]
    assert program.here("migrate").returncode == 0
    with watching(program, CUP, "--limit", "60", "--without-data") as process:
        assert program.here("armem", "demo", "--memory", memory).returncode == 0
        printed, _ = process.communicate(timeout=60)
    assert process.returncode == 0
    assert [json.loads(line)["id"].rpartition("/")[0] for line in printed.splitlines()] == [CUP] * 60


@contextmanager
def watching(program: Program, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process that watches already."""
    process = program.start("armem", "watch", *arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        assert process.stderr is not None
        assert process.stderr.readline().startswith(b"watching ")
        yield process
    finally:
        process.kill()
        process.communicate()


# Through Ice

SERVED = """
[[memories]]
profile = "ObjectMemory"
history = 3
delay_warning = 1e8

[[memories]]
profile = "RobotStateMemory"
history = 3
delay_warning = 1e8

[long_term]
memory = "{memory}"
patience = 60.0
robot_state = {{segment = "RobotState/State", pose = "globalPose"}}

[ice]
mode = "standalone"
slices = ["{slices}"]
port = {port}
"""

COMMITTING = """
import sys
from armem_bridge.config import read_config
from armem_bridge.demo import kitchen
from armem_bridge.service import connect_client
from armem_bridge.working import Commit

with connect_client(read_config("served.toml")) as client:
    memories = [client.wait(name, 20) for name in ("RobotState", "Object")]
    for commit in kitchen.commits():
        robot, *seen = commit.updates
        for memory, updates in zip(memories, ([robot], seen), strict=True):
            assert memory.commit(Commit(updates=updates)).success
"""


@contextmanager
def serving(program: Program) -> Iterator[subprocess.Popen[bytes]]:
    """A server of `served.toml` in a process of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    text = SERVED.format(memory=program.settings["ELM_MEMORY"], slices=SLICES, port=port)
    (program.directory / "served.toml").write_text(text)
    assert read_config(program.directory / "served.toml").ice.port == port
    process = program.start("armem", "serve", "--config", "served.toml", stderr=subprocess.PIPE)
    assert process.stderr is not None
    try:
        assert process.stderr.readline().startswith(b"serving Object, RobotState at IceGrid/Locator")
        yield process
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


@pytest.mark.usefixtures("ice")
def test_memories_are_served_to_other_processes(program: Program) -> None:
    with serving(program) as server:
        with watching(program, "--server", "served.toml", "--limit", "2", MUG) as watcher:
            command = [sys.executable, "-c", COMMITTING]
            subprocess.run(command, cwd=program.directory, env=program.environment, check=True, timeout=60)
            printed, _ = watcher.communicate(timeout=60)
        assert [json.loads(line)["id"].rpartition("/")[0] for line in printed.splitlines()] == [MUG, MUG]

        nobody = program("armem", "watch", "--server", "served.toml", "Nope", "--timeout", "0")
        assert nobody.returncode == 1
        assert "no memory server is registered as 'Nope' (there are: Object, RobotState)" in nobody.stderr

        asked = lines(program("armem", "ls", "--server", "served.toml", MUG))
        assert [row["referenced"] for row in asked] == [END - 2_000_000, END - 1_000_000, END]
        (state,) = lines(program("armem", "get", "--server", "served.toml", "RobotState"))
        assert state["referenced"] == END

        server.send_signal(signal.SIGTERM)
        assert server.wait(30) == 0
        assert server.stderr is not None
        said = server.stderr.read().decode()
    # The poses that snapshots wait for never came: it is the stop that flushes them.
    assert said.splitlines()[0].startswith("stopping"), said
    assert "180 updates, 0 refused" in said
    assert "180 consolidated, 0 waiting" in said
    assert len(lines(program.here("armem", "get", "Object", "--history", "--without-data"))) == 120
    gone = program("armem", "ls", "--server", "served.toml")
    assert (gone.returncode, "cannot be reached" in gone.stderr) == (3, True)
