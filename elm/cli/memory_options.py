"""Which memory a command works on: the options --memory and --dsn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from elm.app import Memory

Dsn = Annotated[
    str | None,
    typer.Option(
        "--dsn",
        envvar="ELM_DSN",
        show_envvar=True,
        metavar="DSN",
        help="The PostgreSQL database, as postgresql://user@host/dbname. Default: elm's private cluster.",
    ),
]


@dataclass(frozen=True, kw_only=True)
class MemoryOptions:
    """The memory by name, and the database it lives in."""

    memory: Annotated[
        str,
        typer.Option(
            "--memory", envvar="ELM_MEMORY", show_envvar=True, metavar="NAME", help="The memory to work on, by name."
        ),
    ] = "elm"
    dsn: Dsn = None

    def open(self) -> Memory:
        """The memory, to be closed by `with`."""
        from elm.app import connect

        return connect(self.dsn, self.memory)
