"""The console examples of a page: run one after the other, they print what the page says."""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Iterable, Iterator
from doctest import ELLIPSIS, OutputChecker
from typing import Any

from tests.cli.conftest import Program

_EXIT = re.compile(r"^\[exit code (\d+)\]$")


def check(elm: Program, blocks: Iterable[tuple[str, str, str]]) -> int:
    """Write the blocks that are files, run the console's, and compare; how many commands there were."""
    commands = 0
    for kind, name, text in blocks:
        if name:
            (elm.directory / name).write_text(text, encoding="utf-8")
        for command, expected, code in _examples(text) if kind == "console" else ():
            printed, ended = _run(elm, command)
            assert OutputChecker().check_output(expected, printed, ELLIPSIS), f"$ {command}\n{printed}"
            assert ended == code, f"$ {command}\n{printed}"
            commands += 1
    return commands


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


def options(command: Any) -> set[str]:
    """The options of a command, by the long name where there is one: `--output` is introduced with its short form."""
    return {max(parameter.opts, key=len) for parameter in command.params if parameter.param_type_name == "option"}
