"""Measures: features of a result, computed from the events that it was recognized from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import assert_never

from elm.cues.relations import named
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.features import FeatureValue, kind_of
from elm.recognizers.base import check_feature
from elm.text import check_name


class Aggregate(StrEnum):
    """What is computed: how many events, how many a second, or something of a feature's values."""

    COUNT = "count"
    RATE = "rate"
    MEAN = "mean"
    SUM = "sum"
    LEAST = "least"
    GREATEST = "greatest"
    FIRST = "first"
    LAST = "last"


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """An aggregate over the events that one step took (None: all of them).

    `rate` is per second of the events' span; `mean`, `sum`, `least` and `greatest` are of the numbers among the
    feature's values, `first` and `last` any value. Where there is nothing to compute from, or more than a feature
    can hold, the feature is left out.
    Sums are exact before they are rounded (math.fsum), so that they do not depend on the order of arrival.
    """

    aggregate: Aggregate
    feature: str | None = None
    step: str | None = None

    def __post_init__(self) -> None:
        aggregate = named(self.aggregate, Aggregate, what="a measure")
        object.__setattr__(self, "aggregate", aggregate)
        counts = aggregate in (Aggregate.COUNT, Aggregate.RATE)
        if counts == (self.feature is not None):
            needs = "counts events, not a feature's values" if counts else "needs the name of a feature"
            raise InvalidValue(f"the measure {aggregate.value!r} {needs}")
        for name in (self.feature, self.step):
            if name is not None:
                check_name(name, what="a name in a measure")

    def of(self, events: Sequence[StoredEvent]) -> FeatureValue | None:
        """What is measured of these events; None where the feature is left out."""
        if self.feature is None:
            return len(events) if self.aggregate is Aggregate.COUNT else _rate(events)
        values = [value for event in events for value in event.values(self.feature)]
        numbers = [value for value in values if kind_of(value) == "n" and not isinstance(value, str)]
        match self.aggregate:
            case Aggregate.COUNT | Aggregate.RATE:
                raise AssertionError("a count has no feature")
            case Aggregate.FIRST:
                return values[0] if values else None
            case Aggregate.LAST:
                return values[-1] if values else None
            case Aggregate.MEAN:
                return None if (total := _sum(numbers)) is None else total / len(numbers)
            case Aggregate.SUM:
                return _sum(numbers)
            case Aggregate.LEAST:
                return min(numbers, default=None)
            case Aggregate.GREATEST:
                return max(numbers, default=None)
            case _:
                assert_never(self.aggregate)


def checked_measures(given: Mapping[str, Measure], steps: Iterable[str], *, what: str) -> dict[str, Measure]:
    """Measures by the names of their features, when each can be taken of a recognizer with these steps."""
    if not isinstance(given, Mapping):
        raise InvalidValue(f'the measures of {what} have names, as in {{"drops": count()}}, not {given!r:.80}')
    known = tuple(steps)
    for name, measure in given.items():
        check_feature(name, what=f"the name of a measure of {what}")
        if not isinstance(measure, Measure):
            raise InvalidValue(f"{what} measures by count(), mean(...) and the like, not by {measure!r:.80}")
        if measure.step is not None and measure.step not in known:
            raise InvalidValue(f"{what} measures step {measure.step!r}; its steps are {', '.join(map(repr, known))}")
    return dict(given)


def count(step: str | None = None) -> Measure:
    """How many events."""
    return Measure(aggregate=Aggregate.COUNT, step=step)


def rate(step: str | None = None) -> Measure:
    """How many events a second of their span."""
    return Measure(aggregate=Aggregate.RATE, step=step)


def mean(feature: str, step: str | None = None) -> Measure:
    """The mean of a feature's numbers."""
    return Measure(aggregate=Aggregate.MEAN, feature=feature, step=step)


def sum_of(feature: str, step: str | None = None) -> Measure:
    """The sum of a feature's numbers."""
    return Measure(aggregate=Aggregate.SUM, feature=feature, step=step)


def least(feature: str, step: str | None = None) -> Measure:
    """The least of a feature's numbers."""
    return Measure(aggregate=Aggregate.LEAST, feature=feature, step=step)


def greatest(feature: str, step: str | None = None) -> Measure:
    """The greatest of a feature's numbers."""
    return Measure(aggregate=Aggregate.GREATEST, feature=feature, step=step)


def first(feature: str, step: str | None = None) -> Measure:
    """The first value of a feature."""
    return Measure(aggregate=Aggregate.FIRST, feature=feature, step=step)


def last(feature: str, step: str | None = None) -> Measure:
    """The last value of a feature."""
    return Measure(aggregate=Aggregate.LAST, feature=feature, step=step)


def _sum(numbers: Sequence[float]) -> float | None:
    try:
        return math.fsum(numbers) if numbers else None
    except OverflowError:
        # No feature can hold it.
        return None


def _rate(events: Sequence[StoredEvent]) -> float | None:
    ends = [event.interval.end for event in events if event.interval.end is not None]
    if not ends:
        return None
    span = (max(ends) - min(event.interval.begin for event in events)).total_seconds()
    return len(events) / span if span else None
