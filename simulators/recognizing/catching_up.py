"""Catching up with a freshly loaded log against loading it: memories filled and recognized in, one after the other."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from datetime import timedelta
from itertools import islice
from time import perf_counter
from typing import Any

import elm
from elm import cues
from elm.errors import StoreFailure
from elm.event import Event
from elm.recognition import Timing
from elm.recognizers import Pattern, count, step
from elm.writer import LOAD_BATCH
from simulators.bench.scratch import scratch_memory
from simulators.bench.timing import seconds, steady_heap
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate

TIMING = Timing(lateness=timedelta(minutes=2), simulated=True)
"""No simulated event lasts longer, so none is late."""


def pattern() -> Pattern:
    """Two steps of types near the roots: about one result to fifteen events."""
    return Pattern(
        name="pairs",
        version=1,
        type="Pair",
        elements=[
            step("first", cues.is_a("type-3") | cues.is_a("type-4")),
            step("second", cues.is_a("type-7")),
        ],
        within=timedelta(minutes=5),
        measures={"events": count()},
    )


def measure(dsn: str, *, events: int, rounds: int, seed: int, advance: Callable[[int], None]) -> dict[str, Any]:
    """Events per second of both, medians over rounds, each in a memory of its own."""
    life = list(islice(simulate(seed), events))
    loads, catches, results = [], [], 0
    with steady_heap():
        for _ in range(rounds):
            loaded, caught, results = _round(dsn, life)
            loads.append(loaded)
            catches.append(caught)
            advance(1)
    load, catch = statistics.median(loads), statistics.median(catches)
    return {
        "events": events,
        "rounds": rounds,
        "results": results,
        "events_per_result": events / results,
        "load_events_per_second": events / load,
        "events_per_second": events / catch,
        "db_vs_load": load / catch,
        "db_vs_load_of_rounds": [ours / theirs for ours, theirs in zip(loads, catches, strict=True)],
    }


def _round(dsn: str, life: list[Event]) -> tuple[float, float, int]:
    """Seconds to load, without the ANALYZE at its end, seconds to catch up, and how many results were committed."""
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory:
        memory.add_types(hierarchy.event_types())
        batches: list[float] = []
        begin = perf_counter()
        memory.load(life, progress=lambda _: batches.append(perf_counter() - begin), batch=min(LOAD_BATCH, len(life)))
        manager = memory.recognition([pattern()], timing=TIMING)
        caught = seconds(manager.catch_up)
        (status,) = manager.status()
        results = memory.recall(cues.exactly("Pair")).count()
        if status.late or status.lag or not results == status.found > 0:
            raise StoreFailure(f"{results:,} results were committed, and the status is {status}")
    return batches[-1], caught, results
