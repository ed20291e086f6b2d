"""`elm armem`: memory servers on the command line, as commands that elm takes in through its entry-point group."""

from __future__ import annotations

import typer

from armem_bridge.cli.demonstration import demo
from armem_bridge.cli.forgetting import forget
from armem_bridge.cli.getting import get
from armem_bridge.cli.listing import ls
from armem_bridge.cli.profile_table import profiles
from armem_bridge.cli.serving import serve
from armem_bridge.cli.watching import watch

app = typer.Typer(
    name="armem",
    help="ArmarX-style memory: serve it, and look into what it consolidated.",
    no_args_is_help=True,
    add_completion=False,
)

for _command in (serve, ls, get, watch, forget, profiles, demo):
    app.command()(_command)
