"""Activation: how present a snapshot still is, by the time since it was last used (section 4.5.1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from armem_bridge.forgetting.refusals import require_number


class Activation(Protocol):
    """From 1 for what was used just now down towards 0, the longer ago the less.

    A time below 0, of a clock that was set back, counts as 0.
    """

    def __call__(self, seconds: float) -> float:
        """The activation so many seconds after the last use."""


@dataclass(frozen=True, slots=True)
class Exponential:
    """exp(-seconds / tau): after `tau` seconds 0.368 are left, after `tau` * ln 2 one half."""

    tau: float = 1.0

    def __post_init__(self) -> None:
        require_number(self.tau, what="the time constant tau of an activation, in seconds,", open_=True)

    def __call__(self, seconds: float) -> float:
        """The activation so many seconds after the last use."""
        return math.exp(-max(seconds, 0.0) / self.tau)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ebbinghaus:
    """Ebbinghaus's own curve of 1885, k / ((log10 t)^c + k), as Murre and Dros (2015) quote it.

    t is in minutes and counted from one minute before the last use, as he counted it: so it is 1 at the
    use itself, and the curve begins at 1. With his constants, k = 1.84 and c = 1.25, one half is left after
    about 41 minutes and a fifth after two months; `minute` says how many seconds are one of his minutes,
    for a robot whose days are shorter.
    """

    k: float = 1.84
    c: float = 1.25
    minute: float = 60.0

    def __post_init__(self) -> None:
        require_number(self.k, what="the constant k of Ebbinghaus's curve", open_=True)
        require_number(self.c, what="the constant c of Ebbinghaus's curve", open_=True)
        require_number(self.minute, what="the minute of Ebbinghaus's curve, in seconds,", open_=True)

    def __call__(self, seconds: float) -> float:
        """The activation so many seconds after the last use."""
        minutes = 1.0 + max(seconds, 0.0) / self.minute
        return self.k / (math.pow(math.log10(minutes), self.c) + self.k)
