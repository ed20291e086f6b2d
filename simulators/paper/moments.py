"""Mean, sample standard deviation and maximum of times that are not kept, over all and by the size of the memory."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field


@dataclass(slots=True, kw_only=True)
class Moments:
    """Of a series of values: its count, mean, sum of squared deviations from the mean, and maximum (Welford)."""

    count: int = 0
    mean: float = 0.0
    squares: float = 0.0
    max: float = 0.0

    def add(self, value: float) -> None:
        """Count one value in."""
        self.count += 1
        off = value - self.mean
        self.mean += off / self.count
        self.squares += off * (value - self.mean)
        self.max = value if self.count == 1 else max(self.max, value)

    def merge(self, other: Moments) -> None:
        """Count another series in, as if its values had been added one by one (Chan, Golub, LeVeque)."""
        if not other.count:
            return
        count, off = self.count + other.count, other.mean - self.mean
        self.max = other.max if not self.count else max(self.max, other.max)
        self.squares += other.squares + off * off * self.count * other.count / count
        self.mean += off * other.count / count
        self.count = count

    @property
    def sd(self) -> float | None:
        """The sample standard deviation (divided by n - 1); None of less than two values."""
        return math.sqrt(self.squares / (self.count - 1)) if self.count > 1 else None


@dataclass(slots=True)
class BySize:
    """The moments of a series apart for each size of the memory, rounded up to a multiple of `step`."""

    step: int
    bins: dict[int, Moments] = field(default_factory=dict)

    def add(self, events: int, value: float) -> None:
        """Count a value in that was measured while the memory had so many events."""
        size = -(-events // self.step) * self.step
        if size not in self.bins:
            self.bins[size] = Moments()
        self.bins[size].add(value)

    def merge(self, other: BySize) -> None:
        """Count another series in, size by size."""
        for size, found in other.bins.items():
            self.bins.setdefault(size, Moments()).merge(found)

    def total(self) -> Moments:
        """The moments over all sizes."""
        return self.between(0, max(self.bins, default=0))

    def between(self, above: int, up_to: int) -> Moments:
        """The moments over the sizes in (above, up_to]."""
        found = Moments()
        for size in sorted(self.bins):
            if above < size <= up_to:
                found.merge(self.bins[size])
        return found

    def growth(self, events: int) -> float | None:
        """Mean of the last tenth of a memory of `events` over that of its second; None where either has no values.

        The first tenth is left out: caches and plans are cold in it.
        """
        tenth = events // 10
        begin, end = self.between(tenth, 2 * tenth), self.between(events - tenth, events)
        return end.mean / begin.mean if begin.count and end.count and begin.mean else None

    def as_rows(self) -> list[list[float]]:
        """Size, count, mean, sum of squared deviations and maximum of each bin, to be written to a file."""
        return [[size, each.count, each.mean, each.squares, each.max] for size, each in sorted(self.bins.items())]

    @classmethod
    def of_rows(cls, step: int, rows: Iterable[Sequence[float]]) -> BySize:
        """What `as_rows` wrote."""
        return cls(
            step,
            {
                int(size): Moments(count=int(count), mean=mean, squares=squares, max=largest)
                for size, count, mean, squares, largest in rows
            },
        )
