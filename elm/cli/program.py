"""All commands of `elm`, put together."""

from __future__ import annotations

from typing import Annotated

import typer

from elm.cli.cluster_commands import down, status, up
from elm.cli.counting import count, stats
from elm.cli.demonstration import demo
from elm.cli.exporting import export
from elm.cli.forgetting import forget
from elm.cli.loading import load
from elm.cli.maintenance import doctor, migrate
from elm.cli.recalling import recall
from elm.cli.recognizing import recognize
from elm.cli.root_group import RootGroup
from elm.cli.showing import show, tree
from elm.cli.type_commands import types

app = typer.Typer(
    name="elm",
    cls=RootGroup,
    no_args_is_help=True,
    # What goes wrong is told in one line: traces show what people keep in memories.
    pretty_exceptions_enable=False,
)

_PANELS = {
    "Memory": (load, recall, count, show, tree, stats, export, forget, demo),
    "Database": (up, down, status, migrate, doctor),
}
for _panel, _commands in _PANELS.items():
    for _command in _commands:
        app.command(rich_help_panel=_panel)(_command)
app.add_typer(types, name="types", rich_help_panel="Memory")
app.add_typer(recognize, name="recognize", rich_help_panel="Memory")


def _version(asked: bool) -> None:
    if asked:
        from elm.cli.diagnosis import elm_version

        typer.echo(f"elm {elm_version()}")
        raise typer.Exit


@app.callback()
def elm(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", envvar="ELM_DEBUG", help="Show the trace of an error before its message.")
    ] = False,
) -> None:
    """The episodic memory for robots: what happened, where, when, as seen by whom."""
