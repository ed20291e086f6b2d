"""What forgetting refuses: mechanisms and encoders that cannot be what they are given as."""

from __future__ import annotations

import math

from armem_bridge.errors import ArmemError


class InvalidMechanism(ArmemError, ValueError):
    """A mechanism of forgetting, or a combination of some, cannot work as it is given. Correct what is named."""


class InvalidEncoder(ArmemError, ValueError):
    """An encoder, or what it is given to encode, has numbers that cannot be. Correct what is named."""


def require_number(
    value: object, *, what: str, least: float = 0.0, most: float = math.inf, open_: bool = False
) -> None:
    """Raise `InvalidMechanism` unless `value` is a number from `least` to `most`; with `open_` above `least`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value) or math.isinf(value):
        raise InvalidMechanism(f"{what} is a finite number, not {value!r:.80}")
    if value < least or value > most or (open_ and value == least):
        above = "above" if open_ else "at least"
        below = "" if math.isinf(most) else f" and at most {most:g}"
        raise InvalidMechanism(f"{what} is {above} {least:g}{below}, not {value!r:.80}")


def require_count(value: object, *, what: str, least: int = 1) -> None:
    """Raise `InvalidMechanism` unless `value` is an integer from `least` on."""
    if type(value) is not int or value < least:
        raise InvalidMechanism(f"{what} is an integer from {least} on, not {value!r:.80}")
