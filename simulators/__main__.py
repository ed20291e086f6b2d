"""The command line of the simulators: `python -m simulators COMMAND ...`, one measurement a command."""

from __future__ import annotations

import sys
from importlib import import_module
from types import MappingProxyType

COMMANDS = MappingProxyType(
    {
        "insert": "time of one commit against a bare insert, and of a load against a bare COPY",
        "recall": "time of each class of cues against the best statement written by hand",
        "recognize": "rates, latency and memory of recognition against BoboCEP, a load and a bare commit",
        "types": "time of loading a large type hierarchy against a bare COPY of its tables",
    }
)
"""The commands, each a module of this package with a function `main(argv)`, and what they measure."""


def usage() -> str:
    """How the simulators are called."""
    lines = [f"  {name:<9} {purpose}" for name, purpose in COMMANDS.items()]
    return "\n".join(["usage: python -m simulators COMMAND [--json FILE] ...", "", "commands:", *lines])


def main(argv: list[str]) -> int:
    """Run the command that `argv` names; a command's module is imported only when it is asked for."""
    match argv:
        case ["-h" | "--help"]:
            print(usage())
            return 0
        case [name, *rest] if name in COMMANDS:
            code: int = import_module(f"simulators.{name}").main(rest)
            return code
        case _:
            print(usage(), file=sys.stderr)
            return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
