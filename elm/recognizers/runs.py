"""Runs: one way each to take events, how it is written down and read back, and queues of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from heapq import heapify, heappop, heappush
from typing import Any

from elm.event import StoredEvent
from elm.recognizers.base import Fed
from elm.recognizers.partition import Key

SPARE = 1_000
"""Entries of a queue that need not count, beside as many as there are runs."""

Taken = tuple["Taken | None", int, Fed, int]
"""What a run took, last first: what it took before, the step, the event, and the event's place in the partition."""


NOTHING: frozenset[int] = frozenset()


class Run:
    """One way to take events: where it stands, what it took, and what has been closed to it since."""

    __slots__ = (
        "alive",
        "begin",
        "closed",
        "count",
        "deadline",
        "ends_silently",
        "key",
        "last",
        "passed",
        "serial",
        "start",
        "taken",
        "timer",
    )

    def __init__(self, serial: int, key: Key, start: int, taken: Taken, count: int, begin: int, last: int) -> None:
        self.serial = serial
        self.key = key
        self.start = start
        self.taken = taken
        self.count = count
        self.begin = begin
        self.last = last
        self.closed: frozenset[int] = NOTHING
        """Negations, and the absence, that an event met since the last one taken."""
        self.passed = False
        """Whether an event was passed over since the last one taken."""
        self.deadline: int | None = None
        self.ends_silently = False
        self.timer = 0
        """The number under which its deadline is queued, if it is."""
        self.alive = True

    def rank(self) -> tuple[list[int], list[int], Key]:
        """What comes first of two that become certain at once: the places of its events, then its steps."""
        trail = self.trail()
        return [each[3] for each in trail], [each[1] for each in trail], self.key

    def trail(self) -> list[Taken]:
        """What was taken, first first."""
        found: list[Taken] = []
        each: Taken | None = self.taken
        while each is not None:
            found.append(each)
            each = each[0]
        found.reverse()
        return found


def told(run: Run) -> Any:
    """A run as plain JSON."""
    return {
        "serial": run.serial,
        "key": [list(pair) for pair in run.key],
        "start": run.start,
        "taken": [[step, str(fed.event.uid), place] for _, step, fed, place in run.trail()],
        "closed": sorted(run.closed),
        "passed": run.passed,
    }


def run_of(told: Any, held: Mapping[str, Fed]) -> Run:
    """The run that `told` was told of."""
    taken: Taken | None = None
    count = 0
    for step, uid, place in told["taken"]:
        count = count + 1 if taken is not None and taken[1] == step else 1
        taken = (taken, step, held[uid], place)
    assert taken is not None  # noqa: S101 - a run begins by taking an event
    feds = [held[uid] for _, uid, _ in told["taken"]]
    key = tuple((kind, value) for kind, value in told["key"])
    begin = min(fed.begin for fed in feds)
    run = Run(told["serial"], key, told["start"], taken, count, begin, feds[-1].moment)
    run.closed = frozenset(told["closed"])
    run.passed = told["passed"]
    return run


def taken_by(step: int, taken: Taken | None) -> list[StoredEvent]:
    """The events that one step took, in order."""
    found = []
    while taken is not None:
        if taken[1] == step:
            found.append(taken[2].event)
        taken = taken[0]
    found.reverse()
    return found


class Queue:
    """Runs by two numbers, least first; those that `counts` no longer says yes to are let go of in time."""

    __slots__ = ("_counts", "_entries")

    def __init__(self, counts: Callable[[int, Run], bool]) -> None:
        self._counts = counts
        self._entries: list[tuple[int, int, Run]] = []

    def __len__(self) -> int:
        return len(self._entries)

    def push(self, first: int, second: int, run: Run) -> None:
        """Put a run in; `second` is like that of no other entry."""
        heappush(self._entries, (first, second, run))

    def may_begin_before(self, number: int) -> bool:
        """Whether some first number may be smaller: a quick look, before `first` tells."""
        return bool(self._entries) and self._entries[0][0] < number

    def first(self) -> int | None:
        """The first number of the first run that counts."""
        entries, counts = self._entries, self._counts
        while entries and not counts(entries[0][1], entries[0][2]):
            heappop(entries)
        return entries[0][0] if entries else None

    def pop(self) -> Run:
        """Take out the first entry, which counts when `first` has just been asked."""
        return heappop(self._entries)[2]

    def tidy(self, held: int) -> None:
        """Keep few entries that do not count beside those of the runs held."""
        if len(self._entries) > 2 * held + SPARE:
            self._entries = [each for each in self._entries if self._counts(each[1], each[2])]
            heapify(self._entries)
