"""docs/cli.md: its examples run, in order, and print what it says; it speaks of every command and option."""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Iterator
from doctest import ELLIPSIS, OutputChecker
from pathlib import Path
from typing import Any

import pytest
import typer

from elm.cli.program import app
from tests.cli.conftest import SOURCES, Program

PAGE = SOURCES / "docs" / "cli.md"
_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_EXIT = re.compile(r"^\[exit code (\d+)\]$")

pytestmark = pytest.mark.skipif(not PAGE.exists(), reason="the documents are not beside the installed package")


def test_the_examples_print_what_the_page_says(home: Path, tmp_path: Path) -> None:
    elm = Program(directory=tmp_path, settings={"ELM_HOME": str(home)})
    commands = 0
    for kind, name, text in _BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        if name:
            (tmp_path / name).write_text(text, encoding="utf-8")
        for command, expected, code in _examples(text) if kind == "console" else ():
            printed, ended = _run(elm, command)
            assert OutputChecker().check_output(expected, printed, ELLIPSIS), f"$ {command}\n{printed}"
            assert ended == code, f"$ {command}\n{printed}"
            commands += 1
    assert commands > 25


def _run(elm: Program, command: str) -> tuple[str, int]:
    """What a command prints, on stdout and stderr in turn, and how it ends; pipes and other programs need a shell."""
    program, *arguments = shlex.split(command)
    if program == "elm" and "|" not in command.partition("'")[0]:
        done = elm.here(*arguments)
        return _stripped(done.args), done.returncode
    function = f'elm() {{ {shlex.join(elm.command)} "$@"; }}'
    shell = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {function}; {command}"],
        cwd=elm.directory,
        env=elm.environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=120,
        check=False,
    )
    return _stripped(shell.stdout.decode()), shell.returncode


def _examples(text: str) -> Iterator[tuple[str, str, int]]:
    for example in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, *lines = example.splitlines()
        code = 0
        if lines and (ended := _EXIT.match(lines[-1])):
            code = int(ended[1])
            lines.pop()
        yield command, _stripped("\n".join(lines)), code


def _stripped(text: str) -> str:
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def _commands(group: Any, path: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


def _options(command: Any) -> set[str]:
    # The long name where there is one: `--output` is introduced with its short form.
    return {max(parameter.opts, key=len) for parameter in command.params if parameter.param_type_name == "option"}


COMMANDS = dict(_commands(typer.main.get_command(app), ("elm",)))


def _sections() -> dict[str, str]:
    pieces = re.split(r"^#{2,3} (.*)$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(zip(pieces[1::2], pieces[2::2], strict=True))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_section_shows_each_command_with_its_options(name: str) -> None:
    sections = _sections()
    common = ("What all commands have in common", "What to recall by", "Which recognizers")
    shared = "".join(sections[title] for title in common)
    assert f"$ {name}" in sections[name], f"{name} has no example"
    missing = {option for option in _options(COMMANDS[name]) if option not in sections[name] + shared}
    assert not missing, f"{name} has options that its section does not mention"


def test_the_options_of_elm_itself_are_there() -> None:
    shared = _sections()["What all commands have in common"]
    assert {option for option in _options(typer.main.get_command(app)) if option not in shared} == set()


def test_the_page_names_no_option_that_does_not_exist() -> None:
    known = {"--help"}.union(_options(typer.main.get_command(app)), *map(_options, COMMANDS.values()))
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", PAGE.read_text(encoding="utf-8"))) - known == set()
