"""The life of a robot that handles objects, to recognize complex events in: instants without end, from a seed."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from typing import NamedTuple
from uuid import UUID

from elm.event import Event, StoredEvent
from elm.interval import Interval, from_micros, to_micros
from elm.log import LogEntry, LogKind
from elm.recognizers import Fed
from elm.taxonomy import EventType

AGENT = "robot"
BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
PLACES = tuple(f"place-{number}" for number in range(8))

HANDLING = ("Approach", "Grasp", "Lift", "Carry", "Place", "Release", "Push", "Pull")
MISHAPS = ("Bump", "Slip", "Drop", "Fail")
OTHERS = ("Open", "Close", "Pour", "Wipe", "Look", "Point", "Speak", "Listen", "Dock", "Charge", "Undock", "Wait")
KINDS = (*HANDLING, *MISHAPS, *OTHERS)


class Done(NamedTuple):
    """One thing that the robot did, or that befell it, at an instant in microseconds since 1970."""

    kind: str
    object: str
    place: str
    force: int
    moment: int


def types() -> list[EventType]:
    """The kinds, two groups of them below a type of their own."""
    below = {**dict.fromkeys(HANDLING, ("Handling",)), **dict.fromkeys(MISHAPS, ("Mishap",))}
    named = [EventType(name=kind, parents=below.get(kind, ())) for kind in KINDS]
    return [EventType(name="Handling"), EventType(name="Mishap"), *named]


def live(
    seed: int, *, kinds: Sequence[str] = KINDS, objects: int = 20, pause: float = 1.0, replaced: int = 0
) -> Iterator[Done]:
    """What the robot does: kinds and objects equally likely, `pause` seconds between two on average.

    Moments strictly ascend. After every `replaced` things done (never, if 0) all objects are new ones.
    """
    chance = random.Random(seed)
    moment = to_micros(BEGIN)
    number = first = 0
    while True:
        if replaced and number and number % replaced == 0:
            first += objects
        moment += int(chance.expovariate(1 / pause) * 1e6) + 1
        yield Done(
            chance.choice(kinds),
            f"object-{first + chance.randrange(objects)}",
            chance.choice(PLACES),
            chance.randrange(30),
            moment,
        )
        number += 1


def event(done: Done) -> Event:
    """It as an event to be committed, with a new uid."""
    return Event(type=done.kind, interval=Interval.at(from_micros(done.moment)), features=_features(done), agent=AGENT)


def stored(done: Done, number: int) -> StoredEvent:
    """It as a memory would hold it."""
    instant = from_micros(done.moment)
    return StoredEvent(
        id=number,
        uid=UUID(int=number),
        type=done.kind,
        interval=Interval(begin=instant, end=instant),
        recorded_at=instant,
        features=tuple(_features(done).items()),
        agent=AGENT,
    )


def fed(done: Done, number: int) -> Fed:
    """It as a recognizer is given it."""
    return Fed(event=stored(done, number), moment=done.moment, begin=done.moment)


def entry(done: Done, position: int) -> LogEntry:
    """It as a log would tell of it."""
    known = stored(done, position)
    return LogEntry(position=position, kind=LogKind.COMMIT, at=known.recorded_at, agent=AGENT, event=known)


def _features(done: Done) -> dict[str, str | int]:
    return {"object": done.object, "place": done.place, "force": done.force}
