"""docs/cli.md: its examples run, in order, and print what it says; it speaks of every command and option."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from elm.cli.program import app
from tests.cli.conftest import Program
from tests.cli.page_examples import check, options
from tests.pages import Page

PAGE = Page("docs/cli.md")

pytestmark = pytest.mark.skipif(not PAGE.exists, reason="the documents are not beside the installed package")


def test_the_examples_print_what_the_page_says(home: Path, tmp_path: Path) -> None:
    elm = Program(directory=tmp_path, settings={"ELM_HOME": str(home)})
    assert check(elm, PAGE.all_blocks()) > 25


def _commands(group: Any, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


COMMANDS = dict(_commands(typer.main.get_command(app), ("elm",)))


def _sections() -> dict[str, str]:
    pieces = re.split(r"^#{2,3} (.*)$", PAGE.text, flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_section_shows_each_command_with_its_options(name: str) -> None:
    sections = _sections()
    common = ("What all commands have in common", "What to recall by", "Which recognizers")
    shared = "".join(sections[title] for title in common)
    assert f"$ {name}" in sections[name], f"{name} has no example"
    missing = {option for option in options(COMMANDS[name]) if option not in sections[name] + shared}
    assert not missing, f"{name} has options that its section does not mention"


def test_the_options_of_elm_itself_are_there() -> None:
    shared = _sections()["What all commands have in common"]
    assert {option for option in options(typer.main.get_command(app)) if option not in shared} == set()


def test_the_page_names_no_option_that_does_not_exist() -> None:
    known = {"--help"}.union(options(typer.main.get_command(app)), *map(options, COMMANDS.values()))
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", PAGE.text)) - known == set()
