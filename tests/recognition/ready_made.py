"""Feeding ready-made recognizers: plainly, and with the process written down and resumed at every step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import product
from typing import Any
from uuid import UUID

import msgspec
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from elm.cues.algebra import Cue
from elm.cues.match import match
from elm.cues.relations import Kin
from elm.event import StoredEvent
from elm.features import FeatureValue, as_features, kind_of
from elm.geometry import Region
from elm.interval import to_micros
from elm.recognizers.base import Emission, Fed, Process, Recognizer
from tests.clock import at, span

SECOND = 10**6
"""In microseconds."""
LATEST = to_micros(datetime.max.replace(tzinfo=UTC))
"""The last moment that there is."""
MANY = settings(max_examples=200)
"""A process costs little, so each is tried on many streams."""
TYPES = ("A", "B", "C")

Kinds = tuple[tuple[str, FeatureValue], ...]
"""Values with their kinds: Python holds 1 and True for the same."""


class Surroundings:
    """A memory in which no type is a kind of another and all parts are known."""

    def is_a(self, name: str, ancestor: str) -> bool:
        return name == ancestor

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        raise AssertionError("these tests do not ask for relatives")

    def matches(self, cue: Cue, event: StoredEvent) -> bool:
        return match(cue, event, self)

    def of_type(self, cue: Cue, type_name: str) -> bool | None:
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A result as a test compares it; the moment is when it became certain."""

    moment: int
    type: str
    output: str
    parts: tuple[tuple[str, int], ...]
    key: Kinds = ()
    features: frozenset[tuple[str, str, FeatureValue]] = frozenset()
    deadline: int | None = None


def fed(
    number: int,
    begin: float,
    end: float | None = None,
    *,
    type: str = "A",  # noqa: A002 - the field's name
    lag: float = 0,
    features: Iterable[tuple[str, FeatureValue]] = (),
    region: Region | None = None,
    subject: Region | None = None,
) -> Fed:
    """An event with a number for its uid, an instant without end; certain `lag` seconds after its end."""
    interval = span(begin, begin if end is None else end)
    event = StoredEvent(
        id=number,
        uid=UUID(int=number),
        type=type,
        interval=interval,
        region=region,
        subject=subject,
        features=as_features(features),
        recorded_at=at(0),
    )
    begun, ended = interval.micros
    return Fed(event=event, moment=ended + round(lag * SECOND), begin=begun)


def in_order(given: Iterable[Fed]) -> list[Fed]:
    """Events in the order in which they are fed."""
    return sorted(given, key=lambda each: (each.moment, each.event.interval.micros[1], each.begin, each.event.uid))


def found_by(recognizer: Recognizer, given: Iterable[Fed]) -> list[Found]:
    """All that a recognizer finds when time then passes: the same plainly and resumed, and nothing stays held."""
    events = in_order(each for each in given if Surroundings().matches(recognizer.interest, each.event))
    plainly = feed_all(recognizer, events, lambda process: process)
    assert feed_all(recognizer, events, lambda process: resumed(recognizer, process)) == plainly
    assert [each.moment for each in plainly] == sorted(each.moment for each in plainly)
    known = {event_type.name for event_type in recognizer.outputs}
    assert {each.type for each in plainly} <= known
    assert "elm.Deadline" in known or not any(each.deadline for each in plainly)
    return plainly


def feed_all(recognizer: Recognizer, events: Sequence[Fed], between: Callable[[Process], Process]) -> list[Found]:
    """Feed events as a manager does, replacing the process by what `between` makes of it before every call."""
    process = recognizer.start(Surroundings())
    found: list[Found] = []

    def expire(before: int | None) -> None:
        nonlocal process
        while (deadline := process.deadline()) is not None and (before is None or deadline < before):
            process = between(process)
            found.extend(told(emission, deadline) for emission in process.expire(deadline))
            following = process.deadline()
            assert following is None or following > deadline, "time passes"

    for each in events:
        expire(each.moment)
        process = between(process)
        found.extend(told(emission, each.moment) for emission in process.feed(each))
        following = process.deadline()
        assert following is None or following >= each.moment
    expire(None)
    # What nothing is told of need not be waited for, but is forgotten when time passes.
    assert list(process.expire(LATEST)) == []
    assert list(process.held()) == []
    assert process.counts()["partial"] == 0
    assert process.snapshot()["groups"] == []
    return found


def resumed(recognizer: Recognizer, process: Process) -> Process:
    """The process resumed from what it wrote down."""
    held = {str(each.event.uid): each for each in process.held()}
    assert len(held) == len(process.held())
    written = msgspec.json.decode(msgspec.json.encode(process.snapshot()))
    again = recognizer.resume(Surroundings(), written, held)
    assert again.snapshot() == process.snapshot() == written
    assert again.counts() == process.counts()
    assert again.deadline() == process.deadline()
    return again


def told(emission: Emission, moment: int) -> Found:
    """An emission as a test compares it."""
    return Found(
        moment=moment,
        type=emission.type,
        output=emission.output,
        parts=tuple((step, part.uid.int) for step, part in emission.parts),
        key=kinds(emission.key),
        features=features(emission.features),
        deadline=None if emission.deadline is None else to_micros(emission.deadline),
    )


def kinds(values: Iterable[FeatureValue]) -> Kinds:
    """Values with their kinds."""
    return tuple((kind_of(value), value) for value in values)


def features(pairs: Iterable[tuple[str, FeatureValue]]) -> frozenset[tuple[str, str, FeatureValue]]:
    """Features as a set in which 1 and True differ."""
    return frozenset((name, kind_of(value), value) for name, value in pairs)


def groups_of(events: Sequence[Fed], names: Sequence[str]) -> dict[Kinds, list[Fed]]:
    """The events, in order, of every combination of values that some event has."""
    keys = {key for each in events for key in product(*(kinds(each.event.values(name)) for name in names))}
    return {
        key: [
            each
            for each in events
            if all(value in kinds(each.event.values(name)) for name, value in zip(names, key, strict=True))
        ]
        for key in keys
    }


def unordered(found: Iterable[Found]) -> list[str]:
    """Results in an order of their own, for comparing those that become certain at one moment."""
    return sorted(map(normal, found))


def normal(found: Found) -> str:
    """One text for results that are the same: 1.0 is written as 1."""
    key = [(kind, float(value) if kind == "n" else value) for kind, value in found.key]
    told_features = sorted((name, kind, repr(float(v) if kind == "n" else v)) for name, kind, v in found.features)
    return repr((found.moment, found.type, found.output, found.parts, key, told_features, found.deadline))


def moments_in(seconds: float) -> int:
    """The microseconds of the instant so many seconds after second 0 of the tests."""
    return to_micros(at(seconds))


REGIONS: Mapping[str, Region] = {
    "kitchen": Region.box(0, 0, 10, 10),
    "corner": Region.box(0, 0, 2, 2),
}
"""Places of the tests; one lies in the other."""
SPOTS: tuple[Region | None, ...] = (
    None,
    Region.box(0, 0, 1, 1),
    Region.box(1, 1, 3, 3),
    Region.box(4, 4, 6, 6),
    Region.box(9, 9, 11, 11),
    Region.box(20, 20, 21, 21),
    Region.box(0, 0, 1, 1, frame="odom"),
)
"""Where events of the tests are."""
VALUES: tuple[FeatureValue, ...] = (1, 1.0, True, "1", 2)


def streams(*, max_size: int = 12, last: int = 8, **given: SearchStrategy[Any]) -> SearchStrategy[list[Fed]]:
    """Random events in order, with many ties in time; a few are certain only after their end."""
    one = st.fixed_dictionaries(
        {
            "begin": st.integers(0, last),
            "length": st.sampled_from((0, 0, 0, 1, 2, 5)),
            "type": st.sampled_from(TYPES),
            "lag": st.sampled_from((0, 0, 0, 0, 1, 3)),
            "features": st.lists(st.tuples(st.sampled_from("kl"), st.sampled_from(VALUES)), max_size=3, unique_by=repr),
            "region": st.sampled_from(SPOTS),
            **given,
        }
    )
    return st.lists(one, max_size=max_size).map(lambda drawn: in_order(map(_event, drawn, range(1, len(drawn) + 1))))


def _event(drawn: Mapping[str, Any], number: int) -> Fed:
    fields = {name: drawn[name] for name in ("type", "lag", "features", "region")}
    return fed(number, drawn["begin"], drawn["begin"] + drawn["length"], **fields)
