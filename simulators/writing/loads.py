"""Loading a stream of events against a bare COPY of the finished rows into equal tables, batch by batch in turn."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import islice
from time import perf_counter
from typing import Any

import elm
from elm.errors import StoreFailure
from elm.writer import LOAD_BATCH
from simulators.bench.scratch import connect, scratch_memory
from simulators.bench.timing import seconds, steady_heap
from simulators.bench.twins import Twins
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate

_BATCHES = 3
"""Batches at least: too few events for as many whole ones make smaller ones."""

# Without schema the event table is the twin, which so far holds what was loaded before.
_NEW_EVENTS = "id > (SELECT coalesce(max(id), 0) FROM event) ORDER BY id"
_NEW_PARTS = "whole_id > (SELECT coalesce(max(id), 0) FROM event) ORDER BY whole_id, ordinal"


@dataclass(slots=True)
class Loads:
    """The times of the batches of one load, and of a COPY of the same rows, in seconds."""

    events: int
    batch: int
    load: list[float] = field(default_factory=list)
    copy: list[float] = field(default_factory=list)
    load_analyze: float = 0.0
    copy_analyze: float = 0.0

    def figures(self) -> dict[str, Any]:
        """Events per second of both sides, and their ratio, without and with ANALYZE at the end."""
        return {
            "events": self.events,
            "batch": self.batch,
            "events_per_second": self.events / sum(self.load),
            "copy_events_per_second": self.events / sum(self.copy),
            "load_vs_copy": sum(self.copy) / sum(self.load),
            "load_vs_copy_median_of_batches": statistics.median(
                copy / load for copy, load in zip(self.copy, self.load, strict=True)
            ),
            "load_vs_copy_with_analyze": (sum(self.copy) + self.copy_analyze) / (sum(self.load) + self.load_analyze),
            "analyze_seconds": self.load_analyze,
            "copy_analyze_seconds": self.copy_analyze,
        }


class _Turns:
    """Told that a batch was loaded: notes the time, has the same rows copied, and waits for the next batch."""

    def __init__(self, found: Loads, twins: Twins, advance: Callable[[int], None]) -> None:
        self._found = found
        self._twins = twins
        self._advance = advance
        self._begin = 0.0

    def begin(self) -> None:
        self._begin = perf_counter()

    def elapsed(self) -> float:
        return perf_counter() - self._begin

    def loaded(self, _: int) -> None:
        self._found.load.append(self.elapsed())
        rows = {
            "event": self._twins.finished("event", _NEW_EVENTS),
            "part": self._twins.finished("part", _NEW_PARTS),
        }
        self._found.copy.append(seconds(lambda: self._twins.copy(rows)))
        self._advance(self._found.batch)
        self.begin()


def measure(dsn: str, *, events: int, seed: int, advance: Callable[[int], None]) -> Loads:
    """One `load` into a new memory; what becomes of each batch is at once copied into the tables' empty twins.

    A batch is one transaction on both sides. The rows to copy are read back before the clock starts.
    """
    found = Loads(events=events, batch=min(LOAD_BATCH, -(-events // _BATCHES)))
    life = list(islice(simulate(seed), events))
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory, connect(dsn) as connection:
        memory.add_types(hierarchy.event_types())
        twins = Twins(connection, name, ["event", "part"])
        turns = _Turns(found, twins, advance)
        with steady_heap():
            turns.begin()
            report = memory.load(life, progress=turns.loaded, batch=found.batch)
            found.load_analyze = turns.elapsed()
            found.copy_analyze = seconds(twins.analyze)
        if not report.new == twins.count("event") == events:
            raise StoreFailure(f"of {events:,} events {report.new:,} were loaded and {twins.count('event'):,} copied")
    return found
