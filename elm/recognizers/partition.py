"""Partitions: which groups an event belongs to by the values of some of its features."""

from __future__ import annotations

from itertools import product

from elm.event import StoredEvent
from elm.features import FeatureValue, kind_of

Key = tuple[tuple[str, FeatureValue], ...]
"""The (kind, value) of each feature of a partition: 1 and 1.0 are one key; 1, True and "1" are three."""


def keys_of(event: StoredEvent, names: tuple[str, ...]) -> tuple[Key, ...]:
    """The groups of an event: one for each combination of its values, none where it lacks one of the features."""
    if not names:
        return _ALL
    if len(names) == 1:
        name = names[0]
        # Written out for the common case: this runs for every event of every partitioned pattern.
        found = [value for known, value in event.features if known == name]
        if len(found) == 1:
            return (((kind_of(found[0]), found[0]),),)
    values = [dict.fromkeys((kind_of(value), value) for value in event.values(name)) for name in names]
    return tuple(product(*values))


def values_of(key: Key) -> tuple[FeatureValue, ...]:
    """The values alone."""
    return tuple(value for _, value in key)


_ALL: tuple[Key, ...] = ((),)
