"""`elm demo`: half an hour in the life of a real robot, remembered and asked about."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from elm.cli.memory_options import Dsn
from elm.cli.terminal import answers


def demo(
    *,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", dir_okay=False, help="Also draw what happened.")
    ] = None,
    # Not ELM_MEMORY: the demo's events have no place in the memory somebody works with.
    memory: Annotated[str, typer.Option("--memory", metavar="NAME", help="The memory to fill.")] = "mower",
    dsn: Dsn = None,
) -> None:
    """Fill a memory from a real mower's recording, and ask it what a person would ask."""
    from elm.app import connect
    from elm.demo import run

    with connect(dsn, memory) as opened:
        run(opened, picture=picture, console=answers(markup=True))
