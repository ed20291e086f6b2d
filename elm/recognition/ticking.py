"""Ticks: when the log must tell that time went by, for something to become certain though nothing comes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from elm.interval import from_micros
from elm.log import Tick
from elm.recognition.bench import Bench
from elm.recognition.clocks import Clocks


def due_ticks(
    clocks: Clocks, waits_for: Callable[[str | None], list[int]], across: Sequence[int], now: int
) -> tuple[list[Tick], int | None]:
    """The ticks that would make something certain if written `now`, and when the next one would be due.

    `waits_for` tells the moments that somebody waits for of an agent, `across` has those waited for across agents;
    times are microseconds since 1970.
    """
    found: list[Tick] = []
    later: list[int] = []
    if clocks.timing.simulated:
        return found, None
    lateness, awake = clocks.lateness, clocks.awake()
    for agent, clock in clocks.agents.items():
        waiting = [*waits_for(agent), *(across if agent in awake else ())]
        waits = sorted(moment + lateness + 1 for moment in waiting if moment + lateness >= clock.time)
        reach = clock.after(now)
        due = [moment for moment in waits if moment <= reach]
        if due:
            found.append(Tick(agent=agent, deadline=from_micros(due[-1])))
        if len(due) < len(waits):
            later.append(now + waits[len(due)] - reach)
        if across and len(awake) > 1 and agent in awake:
            # It holds others up until it is idle, which the log must tell: by a tick that moves no clock.
            if (until_idle := clocks.idle_after(clock)) >= now:
                later.append(until_idle + 1)
            elif not due:
                found.append(Tick(agent=agent, deadline=from_micros(clock.time)))
    return found, min(later, default=None)


def deadlines(benches: Iterable[Bench]) -> list[int]:
    """The next deadline of each bench that has one."""
    return [deadline for each in benches if (deadline := each.next_deadline()) is not None]
