"""What simulated features are called and which values they take: 50 names of texts, integers, floats and bools."""

from __future__ import annotations

from elm.features import Feature, FeatureValue

VALUES = 256
"""Entries in the table of a name; texts and bools repeat in it."""

TEXTS = (
    *("object", "room", "person", "colour", "material", "grasp", "gesture", "utterance", "category", "shape"),
    *("owner", "state", "goal", "outcome", "tool", "surface", "door", "sound"),
)
INTEGERS = (
    *("count", "attempt", "floor", "track", "marker", "joint", "retries", "battery", "channel", "priority"),
    *("frames", "points", "scan", "waypoint"),
)
FLOATS = (
    *("speed", "force", "confidence", "temperature", "distance", "angle", "height", "width", "weight", "loudness"),
    *("brightness", "voltage", "slope", "torque"),
)
BOOLS = ("held", "lit", "moving", "reachable")

_WORDS = (
    *("cup", "plate", "book", "door", "table", "kitchen", "corridor", "office", "lab", "red", "green", "blue"),
    *("wood", "steel", "glass", "open", "closed", "full", "empty", "Anna", "Ben", "Carla", "left", "right"),
)


def _value(name: str, number: int) -> FeatureValue:
    if name in TEXTS:
        return _WORDS[number % len(_WORDS)]
    if name in INTEGERS:
        return number
    if name in FLOATS:
        return round(0.37 * number + 0.01, 2)
    return number % 2 == 0


def table() -> list[list[Feature]]:
    """One row a name, with `VALUES` features of it, each equally likely."""
    names = (*TEXTS, *INTEGERS, *FLOATS, *BOOLS)
    return [[(name, _value(name, number)) for number in range(VALUES)] for name in names]
