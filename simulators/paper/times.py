"""What experimental runs measured: seconds of insertions and of queries of each class, by the size of the memory."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any

from simulators.paper.moments import BySize

ALL = "all"
"""The key of the series over all queries; the others are classes."""

ASKED = MappingProxyType(
    {
        "time": "seconds of the queries",
        "rows": "how many events they asked for",
        "fetch": "seconds of the bare fetches that followed some of them, of the first rows",
        "fetched": "seconds of those of these queries whose rows were all fetched",
        "fetch_whole": "seconds of the bare fetches of all rows",
    }
)
"""What is known of the queries of a class."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Longest:
    """The query that took longest, and how many events the memory had."""

    seconds: float = 0.0
    classes: tuple[str, ...] = ()
    rows: int = 0
    events: int = 0


@dataclass(slots=True)
class Times:
    """Of one run, or of several together."""

    step: int
    """Sizes of the memory in one data point."""
    insertion: BySize = field(init=False)
    bare: BySize = field(init=False)
    asked: dict[str, dict[str, BySize]] = field(default_factory=dict)
    """By class or `ALL`, then by the keys of `ASKED`."""
    longest: Longest = field(default_factory=Longest)

    def __post_init__(self) -> None:
        self.insertion, self.bare = BySize(self.step), BySize(self.step)

    def of(self, key: str) -> dict[str, BySize]:
        """The series of a class, or of `ALL`."""
        if key not in self.asked:
            self.asked[key] = {name: BySize(self.step) for name in ASKED}
        return self.asked[key]

    def merge(self, other: Times) -> None:
        """Count another run in."""
        self.insertion.merge(other.insertion)
        self.bare.merge(other.bare)
        for key, series in other.asked.items():
            for name, found in series.items():
                self.of(key)[name].merge(found)
        self.longest = max(self.longest, other.longest, key=lambda query: query.seconds)

    def as_json(self) -> dict[str, Any]:
        """All of it, to be written to a file."""
        return {
            "step": self.step,
            "insertion": self.insertion.as_rows(),
            "bare": self.bare.as_rows(),
            "asked": {
                key: {name: found.as_rows() for name, found in series.items()}
                for key, series in sorted(self.asked.items())
            },
            "longest": asdict(self.longest),
        }

    @classmethod
    def of_json(cls, written: dict[str, Any]) -> Times:
        """What `as_json` wrote."""
        step = written["step"]
        times = cls(step)
        times.insertion, times.bare = (BySize.of_rows(step, written[name]) for name in ("insertion", "bare"))
        times.asked = {
            key: {name: BySize.of_rows(step, found) for name, found in series.items()}
            for key, series in written["asked"].items()
        }
        longest = written["longest"]
        times.longest = Longest(**{**longest, "classes": tuple(longest["classes"])})
        return times
