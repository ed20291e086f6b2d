"""The group of all commands: turns errors into one line and an exit code, and takes in commands of other packages."""

from __future__ import annotations

import os
import sys
import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from elm.cli.exits import ExitCode, exit_code, message
from elm.cli.terminal import say

PLUGINS = "elm.cli"
"""The entry-point group in which another package names a `typer.Typer` of its own: NAME = "module:app"."""


class RootGroup(TyperGroup):
    """All commands of elm, and those that other packages add as entry points, loaded when they are asked for."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command; whatever goes wrong ends in one line on stderr."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
        except KeyboardInterrupt:
            raise typer.Exit(ExitCode.INTERRUPTED) from None
        except BrokenPipeError:
            # The reader went away, as `head` does: nobody is left to be told, nor at the flush when Python ends.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(ExitCode.BROKEN_PIPE) from None
        except Exception as error:
            if isinstance(error, typer.BadParameter):
                # What reads the options for typer says so of every value.
                error.message = error.message.removeprefix("Value error, ")
            # Typer's own (wrong usage, an exit that is asked for) know how to end.
            if hasattr(error, "exit_code") or isinstance(error, typer.Abort):
                raise
            if ctx.params.get("debug"):
                traceback.print_exc()
            say(f"elm: {message(error)}")
            raise typer.Exit(exit_code(error)) from None
        return result

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of elm's own commands, then of those that other packages add."""
        own = super().list_commands(ctx)
        return [*own, *sorted({point.name for point in _plugins()} - {*own})]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of this name; elm's own come first."""
        if own := super().get_command(ctx, cmd_name):
            return own
        for point in _plugins():
            if point.name == cmd_name:
                return _loaded(point)
        return None


def _plugins() -> Any:
    from importlib.metadata import entry_points

    return entry_points(group=PLUGINS)


def _loaded(point: Any) -> Any:
    """The commands of another package; when it cannot be imported, one command that says so."""
    try:
        app = point.load()
        if not isinstance(app, typer.Typer):
            raise TypeError(f"{point.value} is a {type(app).__name__}, not a typer.Typer")
    except Exception as error:
        return _refusing(point.name, f"the command {point.name!r} cannot be loaded: {type(error).__name__}: {error}")
    # Within a group of its own it becomes a group even if it has a single command.
    holder = typer.Typer(add_completion=False)
    holder.add_typer(app, name=point.name)
    group: Any = typer.main.get_command(holder)
    return group.commands[point.name]


def _refusing(name: str, reason: str) -> Any:
    app = typer.Typer(add_completion=False)

    @app.command(name, help=reason, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
    def refuse() -> None:
        say(f"elm: {reason}")
        raise typer.Exit(ExitCode.ERROR)

    return typer.main.get_command(app)
