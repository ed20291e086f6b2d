"""How features and polygons are spelt for stores that have no type for them; nothing but Python's own library."""

from __future__ import annotations

import json
from collections.abc import Sequence
from struct import pack

from simulators.opponents.protocol import FeatureValue


def canonical(value: FeatureValue) -> FeatureValue:
    """A value so that equal numbers are spelt alike, 1 like 1.0; True is no number."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def token(name: str, value: FeatureValue) -> str:
    """A feature as one text, equal where name and value are equal."""
    return json.dumps([name, canonical(value)])


def polygon(ring: Sequence[Sequence[float]]) -> bytes:
    """A polygon with this exterior ring as well-known binary, little-endian."""
    return pack(f"<BIII{2 * len(ring)}d", 1, 3, 1, len(ring), *(number for corner in ring for number in corner))
