"""The port of the log: the events of a memory in commit order, and the consumers that read it from where they were."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Protocol

from elm.errors import ConsumerBusy, InvalidValue, PositionLost, UnknownConsumer
from elm.event import StoredEvent
from elm.interval import as_utc
from elm.query import MOST_ID
from elm.store import Arrival, Committed, Store
from elm.text import check_short_name


class LogKind(StrEnum):
    """What an entry of the log tells."""

    COMMIT = "commit"
    """A new event that has ended."""
    OPEN = "open"
    """A new event that is still going on."""
    CLOSE = "close"
    """The end of an event that was going on, or of a whole whose last open part ended."""
    TICK = "tick"
    """Time went by: the agent's clock moves by as much log time as passed, at most to `deadline`."""
    PUNCTUATION = "punctuation"
    """A promise of the source: of this agent nothing that ended before `deadline` is to come."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LogEntry:
    """One entry: its position (1, 2, 3 ... without gaps), when it was written, and what it tells.

    `at` is by the clock of who wrote it: of several writers a later entry may have the earlier time.
    `event` is there for the kinds commit, open and close, as it stands when it is read, unless it was forgotten;
    `deadline` for ticks and punctuations.
    """

    position: int
    kind: LogKind
    at: datetime
    agent: str | None
    event: StoredEvent | None = None
    deadline: datetime | None = None

    @property
    def is_forgotten(self) -> bool:
        """Whether the event it told of was forgotten since: consumers count such entries and pass them over."""
        return self.event is None and self.kind in (LogKind.COMMIT, LogKind.OPEN, LogKind.CLOSE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tick:
    """An entry of a clock, to be written: a tick or a punctuation of one agent."""

    agent: str | None
    deadline: datetime
    kind: LogKind = LogKind.TICK

    def __post_init__(self) -> None:
        if self.kind not in (LogKind.TICK, LogKind.PUNCTUATION):
            raise InvalidValue(f"a clock moves by a tick or a punctuation, not by a {self.kind.value!r}")
        if self.agent is not None:
            object.__setattr__(self, "agent", check_short_name(self.agent, what="the agent of a tick"))
        object.__setattr__(self, "deadline", as_utc(self.deadline, what="the deadline of a tick"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a named reader of the log got: the last entry dealt with, and what it tells of itself, plain JSON."""

    name: str
    position: int
    report: Mapping[str, Any]
    updated_at: datetime


@dataclass(frozen=True, slots=True, kw_only=True)
class Consumer(Progress):
    """A named reader of the log, how far it got, and what it knew: `state`, after entry `checkpoint`.

    The checkpoint is not after the position. States may be large: who does not need them asks for the progress.
    """

    checkpoint: int
    state: bytes | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Advance:
    """How far a consumer goes: from `before` to `position`; with a `state` also its checkpoint moves to there."""

    name: str
    before: int
    position: int
    state: bytes | None = None
    report: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0 <= self.before <= self.position <= MOST_ID:
            raise InvalidValue(f"consumer {self.name!r} cannot advance from position {self.before} to {self.position}")


class Log(Protocol):
    """The log of one memory. Every call is a transaction of its own.

    Positions are dense and causal (parts before wholes), and the same for all consumers: what is committed
    enters the log when somebody asks for its head.
    """

    def head(self) -> int:
        """Bring everything committed so far into the log; the position of the last entry, 0 when there is none.

        Who may read the memory but not write to it brings in nothing: it gets the last entry that others brought in,
        and what was committed since is not in the log for it until one of them asks for the head.
        """

    def read(self, after: int, limit: int) -> list[LogEntry]:
        """Up to `limit` entries behind position `after`, of those that a call of `head` brought in, whoever made it."""

    def write(self, ticks: Sequence[Tick]) -> None:
        """Write entries of clocks."""

    def consumers(self) -> list[Consumer]:
        """All consumers, by name."""

    def progress(self) -> list[Progress]:
        """How far all consumers got, by name, without what they know."""

    def consumer(self, name: str) -> Consumer | None:
        """The consumer of this name."""

    def register(self, name: str, *, position: int = 0) -> Consumer:
        """The consumer of this name; a new one begins behind `position`."""

    def advance(self, advances: Sequence[Advance], results: Sequence[Arrival] = ()) -> list[Committed]:
        """Commit results, in the order given but parts first, and move consumers on, all in one transaction.

        A consumer that is not at the `before` of its advance refuses the whole call with `PositionLost`: another
        process has done the work.
        """

    def rewind(self, name: str, position: int) -> None:
        """Have a consumer begin again behind `position`, without state."""

    def remove(self, name: str) -> None:
        """Forget a consumer; an unknown one is no error."""

    def definitions(self) -> dict[str, str]:
        """Fingerprints of the definitions that have been at work here, by name and version."""

    def define(self, fingerprints: Mapping[str, str]) -> None:
        """Remember definitions; the first fingerprint of a name stays."""

    def wait(self, after: int, seconds: float) -> bool:
        """Wait until `head` is behind position `after`, at most `seconds`; whether it is."""

    def exclusive(self, name: str) -> AbstractContextManager[None]:
        """Be the only one to work under this name while the context is open; `ConsumerBusy` when another does."""


class LoggedStore(Store, Protocol):
    """A memory whose log can be read."""

    @property
    def log(self) -> Log:
        """What was committed, in order, and who reads it."""


# What both stores check and refuse


def check_position(value: int, *, what: str = "a position in the log") -> int:
    """`value`, when it can be a position or a number of entries."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST_ID:
        raise InvalidValue(f"{what} is a number from 0 to {MOST_ID}, not {value!r}")
    return value


def unknown_consumer(name: str) -> UnknownConsumer:
    """The error of a name that no consumer has."""
    return UnknownConsumer(f"the log has no consumer {name!r}: register it first, or correct the name")


def position_lost(advance: Advance, found: int) -> PositionLost:
    """The error of a consumer that is elsewhere than where its advance begins."""
    return PositionLost(
        f"consumer {advance.name!r} is at position {found}, not at {advance.before}: another process moved it, "
        f"and nothing of this call was kept. Read the consumer again and go on from there"
    )


def beyond_the_end(name: str, position: int, head: int) -> InvalidValue:
    """The error of a position that the log does not have yet."""
    return InvalidValue(
        f"consumer {name!r} cannot be at position {position}: the log ends at {head}. Ask for its head() first"
    )


def consumer_busy(name: str) -> ConsumerBusy:
    """The error of a name under which another works."""
    return ConsumerBusy(f"another already works on this memory as {name!r}: stop that one, or choose another name")
