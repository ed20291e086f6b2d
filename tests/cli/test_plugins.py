"""Commands that other packages add: there when they are asked for, harmless when they are broken."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Program

MODULE = """
import sys
print("imported", file=sys.stderr)
import typer
app = typer.Typer(help="Commands of a bridge.", add_completion=False)

@app.command()
def ping(times: int = 1) -> None:
    print("pong " * times)
"""
ENTRY_POINTS = """[elm.cli]
bridge = bridge_of_a_test:app
broken = no_such_module:app
odd = os:path
recall = bridge_of_a_test:app
"""


@pytest.fixture
def extended(program: Program, tmp_path: Path) -> Program:
    """`elm` beside an installed package with commands of its own."""
    site = tmp_path / "site"
    information = site / "bridge_of_a_test-1.0.dist-info"
    information.mkdir(parents=True)
    (site / "bridge_of_a_test.py").write_text(MODULE)
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: bridge-of-a-test\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(ENTRY_POINTS)
    return program.having(PYTHONPATH=f"{program.environment['PYTHONPATH']}:{site}")


def test_a_command_of_another_package(extended: Program) -> None:
    done = extended("bridge", "ping", "--times", "2")
    assert (done.returncode, done.stdout, done.stderr) == (0, "pong pong \n", "imported\n")


def test_own_commands_do_not_import_it_and_come_first(extended: Program) -> None:
    done = extended("recall", "--dsn", "memory://")
    assert (done.returncode, done.stderr) == (4, "nothing matched\n")


def test_help_lists_it_and_says_what_is_broken(extended: Program) -> None:
    done = extended("--help")
    assert done.returncode == 0
    assert "Commands of a bridge." in done.stdout
    assert "'broken' cannot be loaded" in done.stdout


@pytest.mark.parametrize(("name", "reason"), [("broken", "ModuleNotFoundError"), ("odd", "not a typer.Typer")])
def test_a_broken_one_says_so_when_called(extended: Program, name: str, reason: str) -> None:
    done = extended(name, "anything", "--at", "all")
    assert done.returncode == 1
    assert done.stderr.startswith(f"elm: the command {name!r} cannot be loaded: ")
    assert reason in done.stderr
    assert len(done.stderr.splitlines()) == 1
