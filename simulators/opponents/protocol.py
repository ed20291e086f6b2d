"""What the sides of the comparison share: the workload's file, the adapter's form, and how a side's process is asked.

This runs in environments without elm: the standard library is all that it may import.
"""

from __future__ import annotations

import gc
import json
import os
import sys
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from time import perf_counter
from types import MappingProxyType
from typing import Any, Protocol, TextIO

MODES = ("durable", "relaxed")
"""durable: a commit that returned survives a power cut. relaxed: the last ones may be lost, the store stays whole."""

NATIVE = "native"
"""Ability: the tool answers the kind alone."""
FILTERED = "filtered"
"""Ability: the tool prunes, and the adapter's own Python finishes with the exact test, as a user would have to."""

SET_FIELDS = ("time", "region", "parts", "wholes", "features", "feature_names")
SET_RELATIONS = ("equal", "subset", "superset", "intersects")
CLASSES = (
    "type.exactly",
    "type.is_a",
    "payload.equal",
    *(f"{field}.{relation}" for field in SET_FIELDS for relation in SET_RELATIONS),
)
"""The 27 classes of one-component cues; the event's value is on the left of the relation."""

EVERYDAY = ("near", "near.lately", "near.type", "type.latest", "window", "nearest")
"""What a robot asks all day; ordered are `type.latest` (latest first) and `nearest` (nearest first)."""

KINDS = (*CLASSES, *EVERYDAY)

Ring = tuple[tuple[float, float], ...]
FeatureValue = str | int | float | bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One event, extents of complex ones included as elm derives them (nothing here is open-ended)."""

    number: int
    """Position in the workload, from 0: the order of commits."""
    uid: str
    """32 hexadecimal digits."""
    type: str
    begin: int
    """Microseconds since 1970, UTC; the interval is closed at both ends."""
    end: int
    ring: Ring | None
    """Closed exterior ring in metres of the map, no holes; None: nowhere known."""
    features: tuple[tuple[str, FeatureValue], ...]
    agent: str
    payload: bytes
    media_type: str | None
    parts: tuple[str, ...]
    """Uids of earlier records, in order."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """One thing to ask.

    The values, by kind:

    - `type.exactly`, `type.is_a`: the type's name; `payload.equal`: the bytes in hexadecimal digits
    - `time.*`, `window`: `{"begin": µs, "end": µs}`, closed; `window` asks for what intersects it
    - `region.*`: the closed ring `[[x, y], ...]` of a polygon; subset is ST_CoveredBy, superset ST_Covers,
      equal ST_Equals, intersects ST_Intersects
    - `parts.*`, `wholes.*`: a list of uids, as a set, never empty; those of an event may be
    - `features.*`: a list of `[name, value]`, `feature_names.*`: a list of names: as sets, never empty
    - `near`: `{"x", "y", "metres"}`: the region is at most so far from the point (ST_DWithin);
      `near.lately` has also `"begin"`, `"end"`, which the interval intersects; `near.type` also `"type"`, is_a
    - `type.latest`: the type's name, exactly; the limit's latest by (begin, number), latest first
    - `nearest`: `{"x", "y"}`: the limit's nearest regions by (distance of the polygon, number), nearest first

    For all other kinds a limit asks for the first by (begin, number); no limit asks for all, in any order.
    """

    number: int
    kind: str
    value: Any
    limit: int | None = None

    @property
    def is_ordered(self) -> bool:
        """Whether the order of the answer counts."""
        return self.limit is not None


@dataclass(frozen=True)
class Workload:
    """What all sides are given: the type hierarchy, parents first, the events and the questions."""

    types: Sequence[tuple[str, tuple[str, ...]]]
    records: Sequence[Record]
    questions: Sequence[Question]

    @cached_property
    def parents(self) -> Mapping[str, tuple[str, ...]]:
        """The direct parents of each type."""
        return dict(self.types)

    @cached_property
    def closure(self) -> Mapping[str, tuple[str, ...]]:
        """For each type itself and all that it is a kind of, in order of names."""
        found: dict[str, tuple[str, ...]] = {}
        for name, parents in self.types:
            found[name] = tuple(sorted({name}.union(*(found[parent] for parent in parents))))
        return found

    @cached_property
    def descendants(self) -> Mapping[str, tuple[str, ...]]:
        """For each type itself and all that are of its kind, in the order of `types`."""
        found: dict[str, list[str]] = {name: [] for name, _ in self.types}
        for name, _ in self.types:
            for ancestor in self.closure[name]:
                found[ancestor].append(name)
        return {name: tuple(below) for name, below in found.items()}

    def write(self, file: Path) -> None:
        """Write the workload as JSON lines."""
        with file.open("w", encoding="utf-8") as lines:
            for name, parents in self.types:
                _write(lines, {"type": [name, list(parents)]})
            for record in self.records:
                fields = {name: getattr(record, name) for name in Record.__slots__}
                _write(lines, {"event": fields | {"payload": b64encode(record.payload).decode()}})
            for asked in self.questions:
                _write(lines, {"question": [asked.number, asked.kind, asked.value, asked.limit]})

    @classmethod
    def read(cls, file: Path) -> Workload:
        """Read a file that `write` wrote."""
        types, records, questions = [], [], []
        with file.open(encoding="utf-8") as lines:
            for line in lines:
                match json.loads(line):
                    case {"type": [name, parents]}:
                        types.append((name, tuple(parents)))
                    case {"event": fields}:
                        records.append(_record(fields))
                    case {"question": [number, kind, value, limit]}:
                        questions.append(Question(number=number, kind=kind, value=value, limit=limit))
                    case other:
                        raise ValueError(f"{file} has a line that is no part of a workload: {other!r:.80}")
        return cls(types=types, records=records, questions=questions)


class Adapter(Protocol):
    """A store as a competent user would set it up for these events and questions.

    When made, it is an empty store in an empty directory, or in the database of `dsn`, which is its own
    and dropped afterwards; it already has the types of the workload, and its indexes.
    """

    name: str
    """That of its module and of its environment."""
    title: str
    """As the tables call it."""
    why: str
    """What it is, and where it wins or loses because of that: one or two sentences for the report."""
    durability: Mapping[str, str]
    """For each mode that it can be run in, how; a mode that it lacks is missing. Known of the class."""
    abilities: Mapping[str, str]
    """For each of `KINDS` `NATIVE`, `FILTERED`, or in a few words why it cannot."""

    def __init__(self, workload: Workload, directory: Path, mode: str, dsn: str | None) -> None: ...

    def version(self) -> str:
        """The versions of what is measured."""

    def commit(self, record: Record) -> object:
        """Store one event and see to it that it stays, as the mode says."""

    def load(self, records: Sequence[Record]) -> object:
        """Store many events in the tool's best way."""

    def ask(self, question: Question) -> Sequence[Any]:
        """The rows that answer a question, in the form that the tool's users get, fetched with all they hold."""

    def uid_of(self, row: Any) -> str:
        """The uid of a row of an answer, in 32 hexadecimal digits; not measured."""

    def close(self) -> None:
        """Let go of the store."""


def can(ability: str) -> bool:
    """Whether an ability is one, and not the reason why there is none."""
    return ability in (NATIVE, FILTERED)


def everything_but(reasons: Mapping[str, str], filtered: Sequence[str] = ()) -> Mapping[str, str]:
    """Abilities: the `filtered` kinds, reasons for the others named, and native for all the rest."""
    known = {**dict.fromkeys(KINDS, NATIVE), **dict.fromkeys(filtered, FILTERED), **reasons}
    if unknown := sorted(known.keys() - set(KINDS)):
        raise ValueError(f"no kinds of questions: {', '.join(unknown)}")
    return MappingProxyType(known)


def serve(factory: type[Adapter]) -> None:
    """The process of a side: `WORKLOAD_FILE DIRECTORY MODE [DSN]`, then one line of JSON out for each one in.

    The first line, unasked, says `{"ready": true}`, or `{"lacks": MODE}`, and that is all. Orders:
    `{"do": "about"}`; `{"do": "commit", "from": a, "to": b}`: seconds of each commit;
    `{"do": "load", "from": a, "to": b}`: seconds of all; `{"do": "ask", "question": n, "repeat": r}`: seconds
    of each time, and the uids, sorted where the order does not count; `{"do": "size"}`: bytes of the
    directory; `{"do": "end"}`. The clock sees the adapter's calls and nothing else.
    """
    # Whatever a library prints must not be taken for an answer.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)
    file, directory, mode, *rest = sys.argv[1:]
    if mode not in factory.durability:
        _write(answers, {"lacks": mode})
        return
    workload = Workload.read(Path(file))
    adapter = factory(workload, Path(directory), mode, rest[0] if rest else None)
    gc.collect()
    gc.freeze()
    _write(answers, {"ready": True})
    try:
        for line in sys.stdin:
            order = json.loads(line)
            if order["do"] == "end":
                break
            _write(answers, _obeyed(adapter, workload, Path(directory), order))
    finally:
        adapter.close()
    _write(answers, {})


def _obeyed(adapter: Adapter, workload: Workload, directory: Path, order: Mapping[str, Any]) -> dict[str, Any]:
    match order:
        case {"do": "about"}:
            words = {"name": adapter.name, "title": adapter.title, "why": adapter.why, "version": adapter.version()}
            return {**words, "durability": dict(adapter.durability), "abilities": dict(adapter.abilities)}
        case {"do": "commit", "from": first, "to": stop}:
            return {"seconds": [_seconds(adapter.commit, record) for record in workload.records[first:stop]]}
        case {"do": "load", "from": first, "to": stop}:
            return {"seconds": _seconds(adapter.load, workload.records[first:stop])}
        case {"do": "ask", "question": number, "repeat": repeat}:
            return _answer(adapter, workload.questions[number], repeat)
        case {"do": "size"}:
            return {"bytes": sum(path.stat().st_size for path in directory.rglob("*") if path.is_file())}
        case other:
            raise ValueError(f"a side was asked for what it does not know: {other}")


def _answer(adapter: Adapter, question: Question, repeat: int) -> dict[str, Any]:
    ability = adapter.abilities[question.kind]
    if not can(ability):
        return {"cannot": ability}
    times = []
    rows: Sequence[Any] = ()
    for _ in range(repeat):
        # The answer before is let go of outside of the clock.
        rows = ()
        begin = perf_counter()
        rows = adapter.ask(question)
        times.append(perf_counter() - begin)
    uids = [adapter.uid_of(row) for row in rows]
    return {"seconds": times, "uids": uids if question.is_ordered else sorted(uids)}


def _seconds(call: Callable[[Any], object], argument: object) -> float:
    begin = perf_counter()
    result = call(argument)
    taken = perf_counter() - begin
    del result
    return taken


def _record(fields: Mapping[str, Any]) -> Record:
    ring = fields["ring"]
    converted = {
        "ring": None if ring is None else tuple((x, y) for x, y in ring),
        "features": tuple((name, value) for name, value in fields["features"]),
        "parts": tuple(fields["parts"]),
        "payload": b64decode(fields["payload"]),
    }
    return Record(**{**fields, **converted})


def _write(lines: TextIO, value: Mapping[str, Any]) -> None:
    lines.write(json.dumps(value, ensure_ascii=False) + "\n")
