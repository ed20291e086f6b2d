"""The mechanisms of forgetting and their thresholds, as values that can be combined (section 4.5.1, table 5.1)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, TypeVar

from armem_bridge.forgetting.activation import Activation
from armem_bridge.forgetting.distances import DISTANCES, Distance
from armem_bridge.forgetting.encoders import Encoder
from armem_bridge.forgetting.refusals import InvalidMechanism, require_count, require_number


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeDecay:
    """Keeps what is active enough: `minimum` <= activation of the time since the last use. From 0 to 1."""

    activation: Activation
    minimum: float

    def __post_init__(self) -> None:
        if not callable(self.activation):
            raise InvalidMechanism(f"the activation of a time decay is an Activation, not {self.activation!r:.80}")
        require_number(
            self.minimum,
            what="the least activation that is kept (a_min; no activation is above 1, so more would forget all)",
            most=1.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Frequency:
    """Keeps at most one snapshot of an entity in `wait` seconds: `wait` <= time between it and the nearest one kept.

    Times are reference times: when something is consolidated does not matter, for much may be at once.
    """

    wait: float

    def __post_init__(self) -> None:
        require_number(self.wait, what="the wait between two snapshots that are kept (delta_wait), in seconds,")


@dataclass(frozen=True, slots=True, kw_only=True)
class Similarity:
    """Keeps what is new: `minimum` <= its distance from the last `count` kept before its reference time (d_min and n).

    What has no numbers, or cannot be compared with one of them, is infinitely far, and kept.
    """

    distance: str
    minimum: float
    count: int = 1

    def __post_init__(self) -> None:
        _require_distance(self.distance)
        require_number(self.minimum, what="the least distance that is kept (d_min)")
        require_count(self.count, what="the number of snapshots that one is compared with (n)")

    @property
    def measure(self) -> Distance:
        """The distance itself."""
        return DISTANCES[self.distance]


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentSimilarity:
    """Offline only: keeps what is `minimum` or more from the *nearest* of the last `count` kept ones (Algorithm 3).

    All kept ones are looked at where `count` is None. With an encoder, which learns anew from the snapshots
    of each entity, the distance is that of their codes; without, that of their numbers.
    """

    distance: str
    minimum: float
    count: int | None = None
    encoder: Encoder | None = None

    def __post_init__(self) -> None:
        _require_distance(self.distance)
        require_number(self.minimum, what="the least distance of codes that is kept (d_min)")
        if self.count is not None:
            require_count(self.count, what="the number of snapshots that one is compared with (n)")

    @property
    def measure(self) -> Distance:
        """The distance itself."""
        return DISTANCES[self.distance]


@dataclass(frozen=True, slots=True, kw_only=True)
class Retention:
    """Offline only: a budget for each entity, and one for all together; what has none is not bounded.

    Of each entity `count` snapshots, `size` bytes and an `age` of as many seconds since the reference time
    are kept at most; of all entities together `total_count` snapshots and `total_size` bytes. The oldest
    reference times go first.
    """

    count: int | None = None
    size: int | None = None
    age: float | None = None
    total_count: int | None = None
    total_size: int | None = None

    def __post_init__(self) -> None:
        for name in ("count", "size", "total_count", "total_size"):
            value = getattr(self, name)
            if value is not None:
                require_count(value, what=f"the {name} of a retention budget", least=0)
        if self.age is not None:
            require_number(self.age, what="the age of a retention budget, in seconds,")


Online = TimeDecay | Frequency | Similarity
"""What may forget between working memory and long-term memory (Algorithm 1)."""

Offline = TimeDecay | Frequency | LatentSimilarity | Retention
"""What may forget in long-term memory, in the order in which it does."""

NAMES: Final[Mapping[type, str]] = MappingProxyType(
    {
        TimeDecay: "time decay",
        Frequency: "frequency",
        Similarity: "similarity",
        LatentSimilarity: "latent similarity",
        Retention: "retention",
    }
)
"""The mechanisms in the order in which they are applied, and their names in reports."""

_ORDER = list(NAMES)
_M = TypeVar("_M", bound=TimeDecay | Frequency | Similarity | LatentSimilarity | Retention)


def combined(mechanisms: Iterable[_M], *, allowed: tuple[type, ...], where: str) -> tuple[_M, ...]:
    """The mechanisms in their order, at most one of each kind, whichever order they are given in."""
    given = list(mechanisms)
    for mechanism in given:
        if not isinstance(mechanism, allowed):
            names = ", ".join(NAMES[kind] for kind in allowed)
            raise InvalidMechanism(f"{where} forgetting knows {names}, not {mechanism!r:.120}")
    kinds = [type(mechanism) for mechanism in given]
    for kind in kinds:
        if kinds.count(kind) > 1:
            raise InvalidMechanism(
                f"{where} forgetting is given {NAMES[kind]} {kinds.count(kind)} times: once is enough"
            )
    return tuple(sorted(given, key=lambda mechanism: _ORDER.index(type(mechanism))))


def _require_distance(name: object) -> None:
    if name not in DISTANCES:
        raise InvalidMechanism(f"the distance is one of {', '.join(DISTANCES)}, not {name!r:.80}")
