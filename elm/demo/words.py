"""How the demo says events in words: what the robot was doing, where, when, and several of them in few lines."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from itertools import groupby

from elm.event import StoredEvent

SHOWN = 7
"""Events listed in an answer; of further ones only the number is told."""


def clock(moment: datetime) -> str:
    """The time of the unnamed day."""
    return f"{moment:%H:%M:%S}"


def lasted(span: timedelta | None) -> str:
    """A duration: seconds up to two minutes, then minutes."""
    seconds = 0.0 if span is None else span.total_seconds()
    return f"{seconds:.1f} s" if seconds < 120 else f"{seconds / 60:.1f} min"


def duration(event: StoredEvent) -> timedelta:
    """How long the event lasted; nothing while it is still going on."""
    return event.interval.duration or timedelta()


def number(event: StoredEvent, name: str) -> float:
    """The event's feature `name` as a number, 0 without one."""
    value = event.value(name)
    return float(value) if isinstance(value, int | float) else 0.0


def run_of(event: StoredEvent) -> str:
    """The run an event belongs to: the frame of its region."""
    return "an unknown place" if event.region is None else event.region.frame


def named(event: StoredEvent) -> str:
    """The event by what it is: "row 7 of plaza1", "visit of beacon 5 of plaza1"."""
    if event.type == "BeaconContact":
        return f"contact with beacon {event.value('beacon')} of {run_of(event)}"
    if event.type in ("BeaconVisit", "BeaconPassage"):
        return f"{event.type.removeprefix('Beacon').lower()} of {event.value('place')}"
    ordinal = event.value("number")
    kind = event.type.lower()
    return f"{kind if ordinal is None else f'{kind} {ordinal}'} of {run_of(event)}"


def doing(event: StoredEvent) -> str:
    """What the robot did, how far and for how long."""
    match event.type:
        case "Drive":
            what = f"driving {number(event, 'distance'):.1f} m at {number(event, 'speed'):.1f} m/s"
        case "Turn":
            turn = number(event, "turn")
            what = f"turning {abs(turn):.0f}° {'left' if turn > 0 else 'right'}"
        case "Stand":
            what = "standing"
        case _:
            what = named(event)
    return f"{what} for {lasted(event.interval.duration)}"


def at(event: StoredEvent) -> str:
    """When the event began and what the robot did."""
    return f"{clock(event.interval.begin)} {doing(event)}"


def listed(events: Iterable[StoredEvent], say: Callable[[StoredEvent], str] = at) -> list[str]:
    """One line for each of the first events, and the number of those left out."""
    found = list(events)
    more = [f"... and {len(found) - SHOWN} more"] if len(found) > SHOWN else []
    return [say(event) for event in found[:SHOWN]] + more


def numbers(episodes: Iterable[StoredEvent]) -> list[str]:
    """Numbered episodes of one type, run by run: "rows 3, 6 and 9 of plaza2"."""
    lines = []
    for run, found in groupby(episodes, key=run_of):
        some = list(found)
        ordinals = [str(event.value("number")) for event in some]
        said = ordinals[0] if len(ordinals) == 1 else f"{', '.join(ordinals[:-1])} and {ordinals[-1]}"
        lines.append(f"{some[0].type.lower()}{'s' if len(some) > 1 else ''} {said} of {run}")
    return lines or ["none"]
