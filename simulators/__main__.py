"""The command line of the simulators: `python -m simulators COMMAND ...`, one measurement a command."""

from __future__ import annotations

import sys
from importlib import import_module
from types import MappingProxyType

COMMANDS = MappingProxyType(
    {
        "insert": (
            "simulators.writing.insert",
            "time of a commit and of a load against a bare insert and a bare COPY",
        ),
        "types": (
            "simulators.writing.wordnet",
            "time of loading a large type hierarchy against a bare COPY",
        ),
        "recall": ("simulators.recalling.recall", "time of each class of cues against the best statement by hand"),
        "recognize": ("simulators.recognizing.recognize", "rates, latency and memory of recognition"),
        "opponents": ("simulators.opponents.opponents", "the same events and questions in other stores, side by side"),
        "paper": ("simulators.paper.experiments", "the experiments of the paper's section VI, run again"),
        "report": ("simulators.report.command", "the figures of all measurements as one document with plots"),
        "scale": ("simulators.scaling.scale", "growth of commits and recalls with the memory, up to 10^7 events"),
        "armem": (
            "simulators.armem.evaluation",
            "ArmarX-style memory: commits, queries, Ice, ages of data, forgetting",
        ),
        "household": ("simulators.worlds.household.command", "days in the life of a household, written to files"),
    }
)
"""The commands: the module of each, with a function `main(argv)`, and what it does."""


def usage() -> str:
    """How the simulators are called."""
    lines = [f"  {name:<9} {purpose}" for name, (_, purpose) in COMMANDS.items()]
    return "\n".join(["usage: python -m simulators COMMAND [--json FILE] ...", "", "commands:", *lines])


def main(argv: list[str]) -> int:
    """Run the command that `argv` names; a command's module is imported only when it is asked for."""
    match argv:
        case ["-h" | "--help"]:
            print(usage())
            return 0
        case [name, *rest] if name in COMMANDS:
            module, _ = COMMANDS[name]
            code: int = import_module(module).main(rest)
            return code
        case _:
            print(usage(), file=sys.stderr)
            return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
