"""Who answers a command: long-term memory, read through elm, or a memory server that runs, asked through Ice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol

import typer

from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.terminal import say

if TYPE_CHECKING:
    from armem_bridge.ice import MemoryClient
    from armem_bridge.working import Memory as ArmemMemory
    from armem_bridge.working import Query
    from elm.app import Memory

Server = Annotated[
    Path | None,
    typer.Option(
        "--server",
        metavar="FILE",
        dir_okay=False,
        help="Ask the server that runs with this configuration, through Ice. Default: long-term memory, without Ice.",
    ),
]


class Answering(Protocol):
    """What can be asked about memories."""

    def memories(self) -> Sequence[str]:
        """The names of all memories there are."""

    def query(self, memory: str, query: Query) -> ArmemMemory:
        """What the memory of that name has of what is asked for."""


@dataclass(frozen=True)
class LongTerm:
    """What was consolidated into an elm memory."""

    elm: Memory

    def memories(self) -> Sequence[str]:
        """The names of the memories that snapshots were consolidated of."""
        from armem_bridge.long_term.contents import memory_names

        return memory_names(self.elm)

    def query(self, memory: str, query: Query) -> ArmemMemory:
        """What was consolidated of the memory of that name and is asked for."""
        from armem_bridge.long_term.source import LongTermSource
        from armem_bridge.working.evaluation import evaluate

        return evaluate(query, LongTermSource(self.elm), memory)


@dataclass(frozen=True)
class Running:
    """Memory servers that run."""

    client: MemoryClient

    def memories(self) -> Sequence[str]:
        """The names of the memories that the name system knows."""
        return list(self.client.registered())

    def query(self, memory: str, query: Query) -> ArmemMemory:
        """What the running server answers. Raises `UnknownMemory` and what Ice has to say."""
        return self.client.memory(memory).query(query)


@contextmanager
def answering(where: MemoryOptions, server: Path | None) -> Iterator[Answering]:
    """Whoever is to be asked, until the block ends."""
    if server is None:
        with where.open() as memory:
            yield LongTerm(memory)
        return
    with connected(server) as client:
        yield Running(client)


@contextmanager
def connected(file: Path) -> Iterator[MemoryClient]:
    """A client of the server that runs with a configuration; the command ends where it cannot be reached."""
    from armem_bridge.config import read_config
    from armem_bridge.ice.installation import load_ice
    from armem_bridge.ice.refusals import Unreachable
    from armem_bridge.service import connect_client

    config = read_config(file)
    gone = load_ice().LocalException
    try:
        with connect_client(config) as client:
            yield client
    except (Unreachable, gone) as error:
        reason = str(error) if isinstance(error, Unreachable) else f"its server is gone ({type(error).__name__})"
        say(f"elm: the memories of {file} cannot be reached: {reason}")
        raise typer.Exit(ExitCode.UNREACHABLE) from None
