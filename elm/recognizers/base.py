"""What a recognizer is: a pure definition that makes processes, which are fed events and emit what they find."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol, runtime_checkable

import msgspec

from elm.cues.algebra import Cue
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.features import Feature, FeatureValue, as_features
from elm.interval import as_utc
from elm.taxonomy import EventType
from elm.text import check_name, check_short_name

DEADLINE = EventType(name="elm.Deadline")
"""Type of the instants at which a time was over: they bound results that are certain because nothing came."""
RECOGNIZER, VERSION, OUTPUT, DEPTH = "elm.recognizer", "elm.version", "elm.output", "elm.depth"
"""Features that every recognized event carries."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fed:
    """An event as a process is given it.

    `moment` is when it was certain, in microseconds since 1970 (its end, or later for recognized ones); `begin`
    its begin in the same unit.
    """

    event: StoredEvent
    moment: int
    begin: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Emission:
    """A complex event that was found: its parts by the steps that took them, in the order in which they matched.

    `output` tells a recognizer's kinds of results apart and `key` its groups. With a `deadline` the instant at
    which it became certain is committed too and made the last part.
    """

    type: str
    parts: tuple[tuple[str, StoredEvent], ...]
    output: str = "match"
    key: tuple[FeatureValue, ...] = ()
    features: tuple[Feature, ...] = ()
    deadline: datetime | None = None

    def __post_init__(self) -> None:
        if not self.parts:
            raise InvalidValue("a recognized event has parts: those that it was recognized from")
        for step, part in self.parts:
            check_name(step, what="the step of a part")
            if not isinstance(part, StoredEvent):
                raise InvalidValue(f"the parts of a recognized event are events that were fed, not {part!r:.80}")
        if len({part.uid for _, part in self.parts}) != len(self.parts):
            raise InvalidValue("a recognized event has a part twice")
        object.__setattr__(self, "features", as_features(self.features))
        if self.deadline is not None:
            object.__setattr__(self, "deadline", as_utc(self.deadline, what="the deadline of a recognized event"))


class Process(Protocol):
    """A recognizer at work on one agent, or on all: its state, which is bounded and can be written down.

    Times are microseconds since 1970.
    """

    def feed(self, fed: Fed) -> Sequence[Emission]:
        """Take in an event; those that matched because of it. Moments never decrease."""

    def deadline(self) -> int | None:
        """The moment after which `expire` has something to tell, if nothing is fed before.

        What is only to be forgotten may wait for the next event.
        """

    def expire(self, moment: int) -> Sequence[Emission]:
        """Time has passed beyond `moment` without a further event; what matched, or timed out, because of it."""

    def snapshot(self) -> Any:
        """The state as plain JSON, its events as uids (texts)."""

    def held(self) -> Sequence[Fed]:
        """The events that the snapshot names."""

    def counts(self) -> Mapping[str, int]:
        """What a status shows: unfinished matches ("partial") and what was dropped ("dropped")."""


@runtime_checkable
class Recognizer(Protocol):
    """A definition of complex events (the paper's ComplexEventRecogniser, Def 13): immutable, without state."""

    @property
    def name(self) -> str:
        """Its name among all recognizers of a memory."""

    @property
    def version(self) -> int:
        """Grows with every change of the definition; results of older versions stay."""

    @property
    def across_agents(self) -> bool:
        """Whether one process sees the events of all agents; else there is one for each agent."""

    @property
    def interest(self) -> Cue:
        """Events that do not match are not fed."""

    @property
    def outputs(self) -> tuple[EventType, ...]:
        """The types of its results, so that the memory has them."""

    @property
    def definition(self) -> Any:
        """All that its results depend on, as plain JSON: its hash is the fingerprint."""

    def start(self, around: Judge) -> Process:
        """A process that has seen nothing yet."""

    def resume(self, around: Judge, snapshot: Any, held: Mapping[str, Fed]) -> Process:
        """The process of which `snapshot` was taken; `held` are the events it names, by uid."""


class Judge(Protocol):
    """Decides cues about events, by their types and components alone."""

    def matches(self, cue: Cue, event: StoredEvent) -> bool:
        """Whether an event matches."""

    def of_type(self, cue: Cue, type_name: str) -> bool | None:
        """Whether every event of this type matches (True), none does (False), or it depends (None)."""


def fingerprint(recognizer: Recognizer) -> str:
    """A hash of all that a recognizer's results depend on."""
    told = [recognizer.name, recognizer.version, recognizer.across_agents, recognizer.definition]
    return hashlib.sha256(msgspec.json.encode(told, order="sorted")).hexdigest()


MOST_COUNT = 1_000_000
"""Greatest bound that a definition may set itself."""


def check_count(count: int, *, what: str, least: int = 1) -> None:
    """Refuse what is no number from `least` on, or one beyond every bound."""
    if isinstance(count, bool) or not isinstance(count, int) or not least <= count <= MOST_COUNT:
        raise InvalidValue(f"{what} is a number from {least:,} to {MOST_COUNT:,}, not {count!r:.80}")


def check_feature(name: str, *, what: str) -> str:
    """The name of a feature that a definition gives its results: none that every recognized event carries."""
    if check_name(name, what=what) in (RECOGNIZER, VERSION, OUTPUT, DEPTH):
        raise InvalidValue(f"{what} cannot be {name!r}, which every recognized event carries: give it another name")
    return name


def check_identity(name: str, version: int) -> None:
    """Refuse a name or a version that cannot tell recognizers apart."""
    check_short_name(name, what="the name of a recognizer")
    if isinstance(version, bool) or not isinstance(version, int) or not 1 <= version < 2**31:
        raise InvalidValue(f"the version of recognizer {name!r} is a number from 1 on, not {version!r}")
