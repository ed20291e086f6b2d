"""How parts of a memory are named on the command line: by the text of their ID."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.terminal import visible

if TYPE_CHECKING:
    from armem_bridge.memory_id import MemoryID

_HELP = "MEMORY/CORE/PROVIDER/ENTITY/MICROSECONDS/INSTANCE, as far down as wanted; / in a name is %2F, and % is %25."
Wanted = Annotated[str, typer.Argument(metavar="MEMORY-ID", help=_HELP)]
WantedOrAll = Annotated[str, typer.Argument(metavar="MEMORY-ID", help=f"{_HELP} Without it: everything.")]


def memory_id(text: str) -> MemoryID:
    """The ID that a text names; anything else is wrong usage."""
    from armem_bridge.memory_id import InvalidMemoryID, MemoryID

    try:
        return MemoryID.parse(text)
    except InvalidMemoryID as error:
        raise typer.BadParameter(visible(str(error)), param_hint="MEMORY-ID") from error
