"""What to recall by: a cue in JSON, and short options for the usual conditions, all of which must hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

from elm.cli.sources import opened
from elm.cli.terminal import visible

if TYPE_CHECKING:
    from elm.cues.algebra import Cue
    from elm.features import FeatureValue
    from elm.geometry import Region
    from elm.query import Nearest

_POINT = 1e-3
"""Radius in metres of the small polygon that stands for a point."""


@dataclass(frozen=True, kw_only=True)
class CueOptions:
    """Conditions on events; without any, every event matches."""

    cue: Annotated[
        str | None,
        typer.Option("--cue", metavar="FILE|-|JSON", help="A cue in JSON: a file, - for stdin, or the object itself."),
    ] = None
    exactly: Annotated[
        str | None, typer.Option("--type", metavar="TYPE", help="Events of this type, not of its sub-types.")
    ] = None
    is_a: Annotated[
        list[str] | None,
        typer.Option("--is-a", metavar="TYPE", help="Events of this type or of its sub-types; may be repeated."),
    ] = None
    since: Annotated[
        str | None, typer.Option("--since", metavar="TIME", help="Events that ended at TIME or later, or go on.")
    ] = None
    until: Annotated[
        str | None, typer.Option("--until", metavar="TIME", help="Events that began at TIME or earlier.")
    ] = None
    near: Annotated[
        str | None,
        typer.Option(
            "--near",
            metavar="X,Y,METRES[,FRAME]",
            help="Events whose observer was at most METRES from the point X,Y of FRAME (default: map).",
        ),
    ] = None
    near_subject: Annotated[
        str | None,
        typer.Option(
            "--near-subject",
            metavar="X,Y,METRES[,FRAME]",
            help="Events whose subject was at most METRES from the point X,Y of FRAME (default: map).",
        ),
    ] = None
    agent: Annotated[
        str | None, typer.Option("--agent", metavar="AGENT", help="Events from this agent's perspective.")
    ] = None
    feature: Annotated[
        list[str] | None,
        typer.Option(
            "--feature",
            metavar="NAME=VALUE",
            help="Events with this feature; VALUE is a number, true, false or text; may be repeated.",
        ),
    ] = None

    def read(self) -> Cue:
        """The cue that these options say together; one that says nothing sensible is wrong usage."""
        from elm import cues

        wanted: list[tuple[str, Callable[[Any], Cue], Any]] = [
            ("--cue", _cue, self.cue),
            ("--type", cues.exactly, self.exactly),
            *(("--is-a", cues.is_a, name) for name in self.is_a or ()),
            ("--since / --until", _between, (self.since, self.until) if self.since or self.until else None),
            ("--near", lambda given: cues.within(*_distance_and_point(given)), self.near),
            ("--near-subject", lambda given: cues.subject_within(*_distance_and_point(given)), self.near_subject),
            ("--agent", cues.agent, self.agent),
            *(("--feature", _feature, pair) for pair in self.feature or ()),
        ]
        return cues.all_of(*(_condition(option, read, given) for option, read, given in wanted if given is not None))


def _condition(option: str, read: Callable[[Any], Cue], given: Any) -> Cue:
    from elm.errors import InvalidValue

    try:
        return read(given)
    except InvalidValue as error:
        raise typer.BadParameter(visible(str(error)), param_hint=option) from error


def _cue(given: str) -> Cue:
    from elm.cues.codec import cue_from_json
    from elm.exchange import parse_json

    if given.lstrip().startswith("{"):
        # Bytes of the command line that are no UTF-8 are then refused as such.
        return cue_from_json(parse_json(given.encode(errors="surrogateescape"), what="the cue"))
    with opened(given, hint="--cue") as file:
        return cue_from_json(parse_json(file.read(), what=f"the cue in {given}"))


def _between(times: tuple[str | None, str | None]) -> Cue:
    from elm import cues
    from elm.interval import parse_time

    since, until = times
    return cues.time(
        "intersects",
        None if since is None else parse_time(since, what="the time of --since"),
        None if until is None else parse_time(until, what="the time of --until"),
    )


def _distance_and_point(given: str) -> tuple[float, Region]:
    (x, y, metres), frame = _numbers(given, "X,Y,METRES", like="3.5,-2,10")
    return metres, _point(x, y, frame)


def nearest_to(given: str) -> Nearest:
    """The order that --nearest X,Y[,FRAME] asks for."""
    from elm.errors import InvalidValue
    from elm.query import Nearest

    try:
        (x, y), frame = _numbers(given, "X,Y", like="3.5,-2")
        return Nearest(to=_point(x, y, frame))
    except InvalidValue as error:
        raise typer.BadParameter(visible(str(error)), param_hint="--nearest") from error


def _numbers(given: str, names: str, *, like: str) -> tuple[list[float], str]:
    """The numbers that a text names, and the frame that may stand behind them."""
    from elm.errors import InvalidValue
    from elm.geometry import DEFAULT_FRAME

    wanted = names.count(",") + 1
    texts, frame = given.split(",", wanted), DEFAULT_FRAME
    if len(texts) > wanted:
        frame = texts.pop()
    try:
        numbers = [*map(float, texts)]
    except ValueError:
        numbers = []
    if len(numbers) != wanted:
        raise InvalidValue(f"a place is {names} or {names},FRAME, like {like}: not {given!r}")
    return numbers, frame


def _point(x: float, y: float, frame: str) -> Region:
    from elm.geometry import Region

    return Region.around(x, y, _POINT, frame=frame)


def _feature(given: str) -> Cue:
    from elm import cues
    from elm.errors import InvalidValue

    name, equals, text = given.partition("=")
    if not equals:
        raise InvalidValue(f"a feature is NAME=VALUE, like object=cup: not {given!r}")
    return cues.feature(name, "=", feature_value(text))


def feature_value(text: str) -> FeatureValue:
    """The value that a text on the command line means: a number or truth value that JSON knows, else text."""
    from elm.errors import InvalidValue
    from elm.exchange import parse_json

    try:
        value = parse_json(text.encode(errors="surrogateescape"), what="a value")
    except InvalidValue:
        return text
    return value if isinstance(value, str | int | float) else text
