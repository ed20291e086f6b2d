"""How many times as long a call takes in a larger memory: series of times by the size of their memory, compared."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence

from elm.errors import InvalidValue

INSERT_SIZES = (10_000, 1_000_000)
"""Events in the two memories between which commits are compared."""
RECALL_SIZES = (100_000, 1_000_000)
"""Events in the two memories between which recalls are compared."""

INSERT_GOAL, RECALL_GOAL = 1.2, 1.5
"""How many times as long a commit or a recall may take in the larger of the two."""

Series = Mapping[int, Sequence[float]]
"""Seconds of single calls, by the number of events in the memory."""


def sizes_up_to(largest: int, *, smallest: int) -> list[int]:
    """The sizes of the memories: powers of ten from `smallest` to `largest`."""
    found = [smallest]
    while found[-1] < largest:
        found.append(found[-1] * 10)
    if found[-1] != largest or len(found) < 2:
        raise InvalidValue(f"the largest memory has {smallest * 10:,} events or a power of ten more, not {largest:,}")
    return found


def compared(sizes: Sequence[int], wanted: tuple[int, int]) -> tuple[int, int]:
    """The two sizes wanted where both were measured; otherwise the first and last, or for recalls the last two."""
    if set(wanted) <= set(sizes):
        return wanted
    return (sizes[0], sizes[-1]) if wanted == INSERT_SIZES else (sizes[-2], sizes[-1])


def pair(between: Sequence[int]) -> str:
    """The two sizes in words."""
    return " and ".join(f"{size:,}" for size in between)


def of_medians(series: Series, between: tuple[int, int]) -> float:
    """The median in the larger memory over that in the smaller."""
    return _ratio(series, between, statistics.median)


def of_means(series: Series, between: tuple[int, int]) -> float:
    """The mean in the larger memory over that in the smaller."""
    return _ratio(series, between, statistics.fmean)


def _ratio(series: Series, between: tuple[int, int], figure: Callable[[Sequence[float]], float]) -> float:
    smaller, larger = between
    return figure(series[larger]) / figure(series[smaller])
