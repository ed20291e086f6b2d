"""Clocks and watermarks: how far each agent's time has come, told by the entries of the log alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import timedelta
from typing import Any, Self

from elm.errors import InvalidValue
from elm.interval import to_micros
from elm.log import LogEntry, LogKind

AHEAD = 60_000_000
"""Microseconds by which an event may end after its entry was written before it counts as dated in the future."""
_MICROSECOND = timedelta(microseconds=1)
LONGEST = timedelta(days=36_500)
"""Longest lateness, and time until an agent is idle."""
NEVER = -(2**62)
"""The watermark of an agent of which nothing is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """How recognition waits: part of the definition, for results depend on it.

    Events may arrive `lateness` after later ones; agents without entries for `idle` of log time hold nobody up
    (recognizers across agents wait for the slowest that is not idle). In a memory that runs on simulated time
    no end is in the future, and time passes by events and punctuations alone.
    """

    lateness: timedelta = timedelta(seconds=1)
    idle: timedelta = timedelta(minutes=10)
    simulated: bool = False

    def __post_init__(self) -> None:
        for name in ("lateness", "idle"):
            given = getattr(self, name)
            if not isinstance(given, timedelta) or not timedelta(0) <= given <= LONGEST:
                raise InvalidValue(f"{name} is a timedelta from 0 to {LONGEST.days:,} days, not {given!r:.80}")
        if not isinstance(self.simulated, bool):
            raise InvalidValue(f"simulated is True or False, not {self.simulated!r:.80}")


@dataclass(slots=True, kw_only=True)
class Clock:
    """One agent's: the time it shows, what its last event left it at, and when that event's entry was written."""

    time: int
    base: int
    written: int

    def after(self, now: int) -> int:
        """What a tick written at `now` can move it to, at most."""
        return max(self.time, self.base + max(0, now - self.written))


@dataclass(slots=True)
class Clocks:
    """The clocks of all agents, as a fold over the log. Times are microseconds since 1970."""

    timing: Timing
    agents: dict[str | None, Clock] = field(default_factory=dict)
    log_time: int = NEVER
    shared: int = NEVER
    """The watermark across agents."""

    def watermark(self, agent: str | None) -> int:
        """Before this, nothing of the agent is to come."""
        clock = self.agents.get(agent)
        return NEVER if clock is None else clock.time - self.lateness

    @property
    def lateness(self) -> int:
        """The allowed lateness."""
        return self.timing.lateness // _MICROSECOND

    def tell(self, entry: LogEntry, end: int | None) -> None:
        """Take in an entry; `end` is that of an event that moves its agent's clock."""
        written = to_micros(entry.at)
        self.log_time = max(self.log_time, written)
        clock = self.agents.get(entry.agent)
        match entry.kind:
            case LogKind.TICK if self.timing.simulated:
                # Another consumer's, on the time of the wall.
                return
            case LogKind.TICK:
                assert entry.deadline is not None  # noqa: S101 - a tick has one
                if clock is not None:
                    clock.time = max(clock.time, min(clock.after(written), to_micros(entry.deadline)))
            case LogKind.PUNCTUATION:
                assert entry.deadline is not None  # noqa: S101 - a punctuation has one
                promised = to_micros(entry.deadline) + self.lateness
                if clock is None:
                    self.agents[entry.agent] = Clock(time=promised, base=promised, written=written)
                elif promised > clock.time:
                    clock.time = clock.base = promised
                    clock.written = written
            case LogKind.COMMIT | LogKind.CLOSE if end is not None:
                if not self.timing.simulated and end > written + AHEAD:
                    end = written
                if clock is None:
                    self.agents[entry.agent] = Clock(time=end, base=end, written=written)
                else:
                    clock.time = clock.base = max(clock.time, end)
                    clock.written = max(clock.written, written)
            case _:
                return

    def awake(self) -> set[str | None]:
        """The agents that are not idle; where all are, those heard of last."""
        latest = max((clock.written for clock in self.agents.values()), default=NEVER)
        since = min(self.log_time - self.timing.idle // _MICROSECOND, latest)
        return {agent for agent, clock in self.agents.items() if clock.written >= since}

    def idle_after(self, clock: Clock) -> int:
        """The log time after which an agent is idle if nothing comes of it."""
        return clock.written + self.timing.idle // _MICROSECOND

    def share(self) -> int:
        """The watermark across agents: the smallest of those that are not idle; it never goes back."""
        if awake := self.awake():
            self.shared = max(self.shared, min(self.agents[agent].time for agent in awake) - self.lateness)
        return self.shared

    def snapshot(self) -> Any:
        """The clocks as plain JSON."""
        agents = [[agent, clock.time, clock.base, clock.written] for agent, clock in self.agents.items()]
        return {"agents": agents, "log_time": self.log_time, "shared": self.shared}

    @classmethod
    def resumed(cls, timing: Timing, told: Any) -> Self:
        """The clocks of which a snapshot was taken."""
        agents = {agent: Clock(time=time, base=base, written=at) for agent, time, base, at in told["agents"]}
        return cls(timing, agents, told["log_time"], told["shared"])
