"""`elm armem demo`: a minute in a kitchen, in an object memory and in elm behind it."""

from __future__ import annotations

from typing import Annotated

import typer

from elm.cli.memory_options import Dsn
from elm.cli.terminal import answers


def demo(
    *,
    # Not ELM_MEMORY: the demo's events have no place in the memory somebody works with.
    memory: Annotated[str, typer.Option("--memory", metavar="NAME", help="The memory to fill.")] = "kitchen",
    dsn: Dsn = None,
) -> None:
    """Fill an object memory, query it as in ArmarX, and ask elm what no such query can say."""
    from armem_bridge.demo import run

    run(memory=memory, dsn=dsn, console=answers(markup=True))
