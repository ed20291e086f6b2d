"""How long calls take: one clock, a garbage collector that treats both sides alike, and the figures of a series."""

from __future__ import annotations

import gc
import statistics
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import perf_counter
from typing import TypeVar

import numpy as np

Side = TypeVar("Side")


def seconds(call: Callable[[], object]) -> float:
    """Wall-clock time of one call; what it returns is let go of after the clock was read."""
    begin = perf_counter()
    result = call()
    taken = perf_counter() - begin
    del result
    return taken


@contextmanager
def steady_heap() -> Iterator[None]:
    """The garbage collector stays on for both sides, as in users' programs, but passes over what is there already.

    Otherwise the material of a measurement, prepared beforehand, would be searched again and again
    at the cost of whichever side happens to be running.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def in_turn(sides: Sequence[Side], turn: int) -> list[Side]:
    """The sides in the order of this turn: each comes first equally often."""
    start = turn % len(sides)
    return [*sides[start:], *sides[:start]]


def mean_ratio(ours: Sequence[float], bare: Sequence[float]) -> float:
    """How many times the bare series' mean ours is."""
    return statistics.fmean(ours) / statistics.fmean(bare)


def median_ratio(ours: Sequence[float], bare: Sequence[float]) -> float:
    """How many times the bare series' median ours is."""
    return statistics.median(ours) / statistics.median(bare)


def in_milliseconds(series: Sequence[float]) -> dict[str, float]:
    """Count, mean, median, tails and maximum of a series of seconds, in milliseconds."""
    millis = np.asarray(series) * 1e3
    median, p95, p99 = np.percentile(millis, [50, 95, 99]).tolist()
    figures = {"mean": float(millis.mean()), "median": median, "p95": p95, "p99": p99, "max": float(millis.max())}
    return {"count": len(series), **{name: round(value, 4) for name, value in figures.items()}}
