"""docs/armem.md about `elm armem`: its examples run, in order, and it speaks of every command, option and key."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import typer

from armem_bridge.cli import app
from armem_bridge.config import Mode, tables
from tests.cli.conftest import Program
from tests.cli.page_examples import check, options
from tests.pages import Page
from tests.servers import Server

PAGE = Page("docs/armem.md")
HEADING = "Running a server"
SECTION = PAGE.sections[HEADING] if PAGE.exists else ""
COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]

pytestmark = pytest.mark.skipif(not PAGE.exists, reason="the documents are not beside the installed package")


def test_the_examples_print_what_the_page_says(postgres_server: Server, tmp_path: Path) -> None:
    with postgres_server.database() as dsn:
        elm = Program(directory=tmp_path, settings={"ELM_DSN": dsn, "ELM_HOME": str(tmp_path / "no-home")})
        assert check(elm, PAGE.all_blocks(HEADING)) >= 11


def test_the_python_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for kind, name, text in PAGE.all_blocks(HEADING):
        if name:
            # Here the memories are for this program alone, and so is what they are consolidated into.
            alone = text.partition("[ice]")[0].replace('memory = "kitchen"', 'memory = "kitchen"\ndsn = "memory://"')
            Path(name).write_text(alone if kind == "toml" else text, encoding="utf-8")
        elif kind == "python":
            PAGE.run([text])


@pytest.mark.parametrize("name", COMMANDS)
def test_the_page_shows_each_command_with_its_options(name: str) -> None:
    text = SECTION
    assert f"$ elm armem {name}" in text
    shared = {"--output", "--memory", "--dsn"}
    assert {option for option in options(COMMANDS[name]) - shared if option not in text} == set()


def test_the_page_names_every_key_of_the_file_and_no_others() -> None:
    every = {
        key: kind
        for kind in vars(tables).values()
        if isinstance(kind, type) and issubclass(kind, tables.Table)
        for key in kind.__struct_fields__
    }
    listed = "".join(line for line in SECTION.splitlines() if line.startswith("| "))
    named = set(re.findall(r"`(\w+)`|(?<=[`{ ,])(\w+) = ", listed))
    shown = {word for pair in named for word in pair if word}
    holding = {"memories", "core_segments", "long_term", "forgetting", "online", "offline", "ice"}
    assert every.keys() - holding - shown == set()
    assert shown - every.keys() == {
        "Object",
        "ObjectMemory",
        "mse",
        "mae",
        "cosine",
        "map",
        "elm",
        "tcp",
        "false",
        "true",
    }


@pytest.mark.parametrize("row", re.findall(r"`(\{[a-z_]+ = [^`]*\})`", SECTION))
def test_the_tables_of_the_page_are_toml(row: str) -> None:
    assert tomllib.loads(f"x = {row}")["x"]


def test_defaults_of_the_page_are_those_of_the_tables() -> None:
    text = SECTION
    memory, ice = tables.MemoryTable(), tables.IceTable(mode=Mode.JOIN)
    assert (memory.delay_warning, memory.update_bytes) == (1.0, 256 * 1024**2)
    assert f"default `{ice.host}` and {ice.port}" in text
    assert f"default `{ice.endpoint}`" in text
    assert f"default `{tables.LongTermTable().memory}`" in text
    assert f"default `{tables.LongTermTable().frame}`" in text
