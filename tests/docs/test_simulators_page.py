"""What docs/simulators.md shows runs as it stands there: the Python in one go, and the commands in a shell's place."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from elm.cli.program import app
from simulators import __main__ as simulators
from tests.pages import Page
from tests.servers import Server

PAGE = Page("docs/simulators.md")


def test_the_python_of_the_page_runs() -> None:
    found = PAGE.blocks("python")
    assert len(found) >= 5
    PAGE.run(found)


def test_the_commands_of_the_page_run(
    postgres_server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (block,) = PAGE.blocks("sh")
    simulate, *commands = map(shlex.split, block.splitlines())
    monkeypatch.chdir(tmp_path)
    assert simulate[:3] == ["python", "-m", "simulators"]
    assert simulators.main(simulate[3:]) == 0
    written = len((tmp_path / "life.jsonl").read_text(encoding="utf-8").splitlines())
    assert f"{written:,} events" in capsys.readouterr().out
    with postgres_server.database() as dsn:
        runner = CliRunner(env={"ELM_DSN": dsn, "ELM_MEMORY": None})
        for program, *arguments in commands:
            assert program == "elm"
            done = runner.invoke(app, arguments, prog_name="elm")
            assert done.exit_code == 0, done.output
    assert len(done.stdout.splitlines()) == 6
    assert not (tmp_path / "life.jsonl.refused.jsonl").exists()
