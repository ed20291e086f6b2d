"""Recognizers of every kind and random streams of events, for the tests of recognition as a whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from random import Random
from typing import Any
from uuid import UUID

from elm import cues
from elm.event import Event
from elm.interval import Interval
from elm.log import LoggedStore
from elm.query import Query
from elm.recognizers import Emission, Fed, Pattern, Recognizer, absent, same, step, sum_of, without
from elm.recognizers.base import RECOGNIZER
from elm.taxonomy import EventType
from tests.clock import at

SECOND = timedelta(seconds=1)
TYPES = [EventType(name="A"), EventType(name="B"), EventType(name="C"), EventType(name="A1", parents=("A",))]
AGENTS = ("r1", "r2", None)


class Stateless:
    """The part of a process that has nothing to keep and waits for nothing."""

    def deadline(self) -> int | None:
        return None

    def expire(self, moment: int) -> Sequence[Emission]:
        return ()

    def snapshot(self) -> Any:
        return None

    def held(self) -> Sequence[Fed]:
        return ()

    def counts(self) -> Mapping[str, int]:
        return {}


def recognizers() -> list[Recognizer]:
    """Some that feed each other, one across agents, one that waits for absence, one that times out."""
    return [
        Pattern(
            name="pair",
            version=1,
            type="Pair",
            elements=[step("a", cues.is_a("A")), step("b", cues.is_a("B"), same("object", "a"))],
            within=6 * SECOND,
            timed_out="HalfPair",
        ),
        Pattern(
            name="pairs",
            version=1,
            type="Pairs",
            elements=[step("pair", cues.is_a("Pair")).times(2, 3), absent(cues.is_a("Pair"), 3 * SECOND)],
            within=20 * SECOND,
        ),
        Pattern(
            name="run",
            version=1,
            type="Run",
            elements=[step("a", cues.is_a("A")).one_or_more(), without(cues.is_a("B")), step("c", cues.is_a("C"))],
            within=8 * SECOND,
            partition=["object"],
            measures={"sum": sum_of("x")},
            after_match="next_start",
        ),
        Pattern(
            name="met",
            version=1,
            type="Met",
            elements=[step("one", cues.is_a("C")), step("two", cues.is_a("C") | cues.is_a("Run")).skip_till_any()],
            within=4 * SECOND,
            across_agents=True,
            after_match="all",
        ),
    ]


def stream(chance: Random, count: int) -> list[Event]:
    """Events in order of their ends, many at equal times; their uids follow from `chance`."""
    events = []
    for _ in range(count):
        end = chance.randrange(count // 2 + 1)
        begin = end - chance.choice([0, 0, 1, 3])
        features: list[tuple[str, str | int | float | bool]] = [("x", chance.choice([0.1, 0.2, 1e16, 3]))]
        objects: list[str | int | float | bool] = [1, 1.0, True, "1", "cup"]
        features += [("object", value) for value in chance.sample(objects, chance.choice([0, 1, 2]))]
        events.append(
            Event(
                type=chance.choice(["A", "A", "A1", "B", "B", "C"]),
                interval=Interval(begin=at(begin), end=at(end)),
                features=features,
                agent=chance.choice(AGENTS),
                uid=UUID(int=chance.getrandbits(128)),
            )
        )
    return sorted(events, key=_end)


def shuffled(chance: Random, events: list[Event], lateness: timedelta) -> list[Event]:
    """The events in an order in which they may arrive: none later than allowed."""
    keyed = [(_end(event) + chance.random() * lateness, chance.random(), event) for event in events]
    return [event for *_, event in sorted(keyed, key=lambda each: each[:2])]


def results(store: LoggedStore) -> set[tuple[UUID, str, tuple[UUID, ...], str]]:
    """Uid, type, parts and extent of every recognized event."""
    return {
        (event.uid, event.type, event.parts, str(event.interval))
        for event in store.find(Query(cue=cues.feature_names("superset", [RECOGNIZER])))
    }


def _end(event: Event) -> datetime:
    assert event.interval is not None
    assert event.interval.end is not None
    return event.interval.end
