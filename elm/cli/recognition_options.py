"""Options of recognition: which recognizers, under which name they work, and how long they wait."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from elm.cli.recognizer_sources import Sourced
    from elm.recognition import Timing
    from elm.recognizers import Recognizer

_SECONDS = "SECONDS"


@dataclass(frozen=True, kw_only=True)
class RecognizerOptions:
    """Recognizers of modules, of installed packages, or some of both."""

    sources: Annotated[
        list[str] | None,
        typer.Option(
            "--from",
            metavar="MODULE[:NAME]",
            help="A Python module or file, and in it a recognizer or some; default: all it has; may be repeated.",
        ),
    ] = None
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="NAME", help="The recognizer of this name; may be repeated. Default: all."),
    ] = None

    def find(self) -> list[Sourced]:
        """The recognizers that these options select, and where they are from."""
        from elm.cli.recognizer_sources import sourced

        return sourced(self.sources or (), self.only or ())

    def load(self) -> list[Recognizer]:
        """The recognizers that these options select, of which there must be some."""
        from elm.errors import InvalidValue

        found = [each.recognizer for each in self.find()]
        if not found:
            raise InvalidValue("there are no recognizers: name a module that has some with --from MODULE[:NAME]")
        return found


@dataclass(frozen=True, kw_only=True)
class TimingOptions:
    """How recognition waits."""

    lateness: Annotated[
        float,
        typer.Option("--lateness", min=0, metavar=_SECONDS, help="How long after later ones events may arrive."),
    ] = 1.0
    idle: Annotated[
        float,
        typer.Option(
            "--idle", min=0, metavar=_SECONDS, help="After so long without entries nobody waits for an agent any more."
        ),
    ] = 600.0
    simulated: Annotated[
        bool, typer.Option("--simulated", help="Time passes by events alone, and none is in the future.")
    ] = False

    def read(self) -> Timing:
        """The timing that these options say together; one that cannot be is wrong usage."""
        from datetime import timedelta

        from elm.recognition import Timing

        try:
            lateness, idle = (timedelta(seconds=seconds) for seconds in (self.lateness, self.idle))
            return Timing(lateness=lateness, idle=idle, simulated=self.simulated)
        except (ValueError, OverflowError) as error:
            raise typer.BadParameter(str(error), param_hint="--lateness / --idle") from error


Consumer = Annotated[
    str, typer.Option("--consumer", metavar="NAME", help="The name under which the recognizers work here.")
]
CONSUMER = "recognition"
