"""Results: the events that an emission stands for, with the same uids whenever it is found."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import msgspec

from elm.errors import InvalidValue
from elm.event import Event, StoredEvent, hashed_uid
from elm.extents import common_agent, in_uid_order, span
from elm.features import Feature, kind_of, value_text
from elm.geometry import derived_region
from elm.interval import Interval, from_micros, to_micros
from elm.recognizers.base import DEADLINE, DEPTH, OUTPUT, RECOGNIZER, VERSION, Emission, Fed, Recognizer

DEADLINE_STEP = "deadline"
"""The step of the part that says when a time was over."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What one emission commits, parts first, and the complex event as it is fed to other recognizers."""

    events: tuple[Event, ...]
    fed: Fed


def result_of(recognizer: Recognizer, definition: str, emission: Emission, *, moment: int, agent: str | None) -> Result:
    """The events of an emission that was certain at `moment`; `definition` is the recognizer's fingerprint."""
    if not isinstance(emission, Emission):
        raise InvalidValue(f"recognizer {recognizer.name!r} emits Emissions, not {emission!r:.80}")
    known = {each.name for each in recognizer.outputs}
    if emission.type not in known:
        raise InvalidValue(
            f"recognizer {recognizer.name!r} found an event of type {emission.type!r}, which is none of its outputs"
        )
    marks: list[Feature] = [
        (RECOGNIZER, recognizer.name),
        (VERSION, recognizer.version),
        (OUTPUT, emission.output),
        (DEPTH, depth_of(emission)),
    ]
    steps = [(step, part.uid) for step, part in emission.parts]
    parts = [part for _, part in emission.parts]
    events: list[Event] = []
    told: list[Any] = [
        recognizer.name,
        definition,
        emission.output,
        [kind_of(value) + value_text(value) for value in emission.key],
        [[step, str(uid)] for step, uid in steps],
    ]
    if emission.deadline is not None:
        # Of the deadline's own: it may differ between two results with the same other parts.
        told.append(to_micros(emission.deadline))
        instant = Event(
            type=DEADLINE.name,
            interval=Interval.at(emission.deadline),
            agent=agent,
            features=marks,
            uid=hashed_uid(msgspec.json.encode([*told, DEADLINE_STEP])),
        )
        events.append(instant)
        parts.append(_instant(instant, moment))
    whole = Event(
        type=emission.type,
        parts=[part.uid for part in parts],
        features=[*marks, *(each for each in emission.features if each not in marks)],
        uid=hashed_uid(msgspec.json.encode(told)),
    )
    events.append(whole)
    stored = StoredEvent.of_row((whole, parts, moment), _DERIVED)
    return Result(events=tuple(events), fed=Fed(event=stored, moment=moment, begin=to_micros(stored.interval.begin)))


def depth_of(emission: Emission) -> int:
    """How many layers of recognition make an emission: one more than the deepest of its parts."""
    if not isinstance(emission, Emission):
        return 1
    depths = [value for _, part in emission.parts for value in part.values(DEPTH) if isinstance(value, int)]
    return 1 + max(depths, default=0)


def _instant(event: Event, moment: int) -> StoredEvent:
    assert event.interval is not None  # noqa: S101 - a deadline has one
    return StoredEvent(
        id=0,
        uid=event.uid,
        type=event.type,
        interval=event.interval,
        recorded_at=from_micros(moment),
        features=event.features,
        agent=event.agent,
    )


# As a store will derive it, each when it is first looked at: a hull is dear, and few recognizers ask for one.
_DERIVED: Mapping[str, Callable[[Sequence[Any]], Any]] = MappingProxyType(
    {
        "id": lambda row: 0,
        "uid": lambda row: row[0].uid,
        "type": lambda row: row[0].type,
        "interval": lambda row: span(part.interval for part in row[1]),
        "region": lambda row: derived_region(part.region for part in in_uid_order(row[1])),
        "subject": lambda row: derived_region(part.subject for part in in_uid_order(row[1])),
        "features": lambda row: row[0].features,
        "agent": lambda row: common_agent(row[1]),
        "payload": lambda row: None,
        "parts": lambda row: row[0].parts,
        "wholes": lambda row: (),
        "recorded_at": lambda row: from_micros(row[2]),
    }
)


def moment_of(event: StoredEvent) -> int:
    """When an event that was not recognized here was certain: at its end."""
    end = event.interval.end
    if end is None:
        raise InvalidValue(f"event {event.uid} is still going on: it is fed when it has ended")
    return to_micros(end)
