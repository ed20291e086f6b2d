"""What the sides are given: a simulated life, questions about it, and the answers that the meaning of cues gives."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any
from uuid import UUID

import numpy as np
import shapely

import elm
from elm.event import StoredEvent
from elm.interval import to_micros
from simulators.opponents.asking import recollection
from simulators.opponents.protocol import KINDS, Question, Record, Ring, Workload
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate

LARGE = 1_000
"""Answers with more rows are asked for with a limit."""
FIRST = 100
"""The limit: who would be told more than that?"""
LATEST = 10
NEAREST = 5
MINUTE = 60_000_000
"""In microseconds."""

_NEAR = 2.0
_AROUND = 10.0
_MARGIN = 1e-4
"""Metres that must lie between a distance and what it is compared with: engines differ in the last digits."""
_TRIES = 1_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """The workload, and for each of its questions the uids that answer it (sorted, where the order does not count)."""

    workload: Workload
    answers: Sequence[Sequence[str]]


def make(*, events: int, per_kind: int, seed: int) -> Task:
    """`events` events of the event simulator and `per_kind` questions of each of `KINDS`, all from the seed.

    The store in this process derives the extents of complex events, and judges every question by
    `elm.cues.match`.
    """
    types = hierarchy.event_types()
    named = [(each.name, tuple(each.parents)) for each in types]
    with elm.connect("memory://") as memory:
        memory.add_types(types)
        memory.load(islice(simulate(seed), events))
        known = list(memory.recall(order="id"))
        records = [_record(number, event) for number, event in enumerate(known)]
        workload = Workload(types=named, records=records, questions=[])
        questions: list[Question] = []
        answers: list[list[str]] = []
        drawing = _Drawing(known, workload, random.Random(seed))
        for kind in KINDS:
            for _ in range(per_kind):
                asked, uids = _with_limit(memory, drawing.question(len(questions), kind))
                questions.append(asked)
                answers.append(uids)
    return Task(workload=replace(workload, questions=questions), answers=answers)


def _with_limit(memory: elm.Memory, asked: Question) -> tuple[Question, list[str]]:
    uids = [event.uid.hex for event in recollection(memory, asked)]
    if asked.is_ordered:
        return asked, uids
    if len(uids) > LARGE:
        return replace(asked, limit=FIRST), uids[:FIRST]
    return asked, sorted(uids)


class _Drawing:
    """Draws questions: what they ask for is what some event has, or lies about where one was."""

    def __init__(self, events: Sequence[StoredEvent], workload: Workload, chance: random.Random) -> None:
        self._events = events
        self._records = workload.records
        self._kinds_of = workload.closure
        self._chance = chance
        self._polygons = np.array([None if event.region is None else event.region.polygon for event in events])

    def question(self, number: int, kind: str) -> Question:
        """A question of this kind."""
        field, _, _ = kind.partition(".")
        limits = {"type.latest": LATEST, "nearest": NEAREST}
        values: Mapping[str, Callable[[], Any]] = {
            "type.is_a": self._type_above,
            "near": lambda: self._place(_NEAR),
            "near.lately": self._place_and_time,
            "near.type": self._place_and_type,
            "type.latest": lambda: self._value("type"),
            "window": self._window,
            "nearest": self._spot,
        }
        value = values[kind]() if kind in values else self._value(field)
        return Question(number=number, kind=kind, value=value, limit=limits.get(kind))

    def _value(self, field: str) -> Any:
        """That field of an event that has it."""
        while True:
            number = self._chance.randrange(len(self._events))
            event, record = self._events[number], self._records[number]
            match field:
                case "type":
                    return record.type
                case "payload":
                    return record.payload.hex()
                case "time":
                    return {"begin": record.begin, "end": record.end}
                case "region" if record.ring is not None:
                    return [list(corner) for corner in record.ring]
                case "parts" if record.parts:
                    return list(record.parts)
                case "wholes" if event.wholes:
                    return [uid.hex for uid in event.wholes]
                case "features":
                    return [list(pair) for pair in record.features]
                case "feature_names":
                    return sorted({name for name, _ in record.features})
                case _:
                    continue

    def _type_above(self) -> str:
        """The type of an event or one of those above it, equally likely: most types are leaves with few events."""
        return self._chance.choice(self._kinds_of[self._value("type")])

    def _place(self, metres: float) -> dict[str, Any]:
        """A place where something was, from which no region is just so far away."""
        for _ in range(_TRIES):
            polygon = self._chance.choice(self._polygons)
            x, y = round(polygon.centroid.x, 2), round(polygon.centroid.y, 2)
            if not (np.abs(self._distances(x, y) - metres) < _MARGIN).any():
                return {"x": x, "y": y, "metres": metres}
        raise ValueError(
            f"of {_TRIES} places each is almost exactly {metres} m from some region: simulate fewer events"
        )

    def _place_and_time(self) -> dict[str, Any]:
        """A larger place, and the half hour around when something was there or elsewhere."""
        begin = self._chance.choice(self._records).begin
        return {**self._place(_AROUND), "begin": begin - 15 * MINUTE, "end": begin + 15 * MINUTE}

    def _place_and_type(self) -> dict[str, Any]:
        """A larger place, and a type with many sub-types."""
        return {**self._place(_AROUND), "type": f"type-{self._chance.randrange(hierarchy.ROOTS)}"}

    def _window(self) -> dict[str, int]:
        begin = self._chance.choice(self._records).begin
        return {"begin": begin, "end": begin + 10 * MINUTE}

    def _spot(self) -> dict[str, float]:
        """A place on the map to which the nearest regions have clear ranks, by distance or by number."""
        west, south, east, north = shapely.total_bounds(self._polygons).tolist()
        for _ in range(_TRIES):
            x, y = round(self._chance.uniform(west, east), 2), round(self._chance.uniform(south, north), 2)
            nearest = np.sort(self._distances(x, y))[: NEAREST + 1]
            gaps = np.diff(nearest[nearest > 0])
            if (nearest[nearest > 0] > _MARGIN).all() and (gaps > _MARGIN).all():
                return {"x": x, "y": y}
        raise ValueError(f"{_TRIES} places are all equally far from several regions: simulate fewer events")

    def _distances(self, x: float, y: float) -> Any:
        found = shapely.distance(self._polygons, shapely.Point(x, y))
        return found[~np.isnan(found)]


def _record(number: int, event: StoredEvent) -> Record:
    """A stored event in words that every side understands."""
    begin, end = event.interval.begin, event.interval.end
    if begin is None or end is None or event.payload is None or event.agent is None:
        raise ValueError(f"event {event.uid} is none of the event simulator's: it lacks an end, a payload or an agent")
    return Record(
        number=number,
        uid=event.uid.hex,
        type=event.type,
        begin=to_micros(begin),
        end=to_micros(end),
        ring=None if event.region is None else _ring(event.region.polygon),
        features=event.features,
        agent=event.agent,
        payload=event.payload.data,
        media_type=event.payload.media_type,
        parts=tuple(map(_hex, event.parts)),
    )


def _ring(polygon: Any) -> Ring:
    return tuple((x, y) for x, y in polygon.exterior.coords)


def _hex(uid: UUID) -> str:
    return uid.hex
