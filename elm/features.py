"""What, in detail: features as a set of (name, value) pairs, and when two values are the same one."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations_with_replacement
from typing import cast
from zlib import crc32

import numpy as np

from elm.errors import InvalidValue
from elm.text import check_name, check_text

FeatureValue = str | int | float | bool
Feature = tuple[str, FeatureValue]

TOKEN_BYTES = 200
"""Longest token kept whole; a longer one becomes a prefix and a SHA-256 (an index entry must hold it)."""
_PREFIX_CHARACTERS = 30
_INT64 = -(2**63), 2**63 - 1


def kind_of(value: FeatureValue) -> str:
    """The kind within which values compare: "b" for bools, "n" for numbers, "s" for strings.

    Python's `==` merges True, 1 and 1.0; here 1 and 1.0 are one number, True and "1" other values.
    """
    if isinstance(value, bool):
        return "b"
    return "s" if isinstance(value, str) else "n"


def identity(feature: Feature) -> tuple[str, str, FeatureValue]:
    """A key that two features share exactly when they are the same element of a feature set."""
    name, value = feature
    return name, kind_of(value), value


def check_value(name: str, value: object) -> FeatureValue:
    """`value` as str, int, float or bool (numpy scalars become Python's); anything else is refused."""
    kind = type(value)
    if kind is bool or (kind is float and math.isfinite(cast(float, value))):
        return cast(FeatureValue, value)
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, bool):
        return value
    if isinstance(value, str):
        return check_text(value, what=f"the value of feature {name!r}")
    if isinstance(value, int):
        if not _INT64[0] <= value <= _INT64[1]:
            raise InvalidValue(
                f"feature {name!r} is an integer beyond 64 bits ({value}): "
                f"give it as a float, or as text where every digit counts"
            )
        return int(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise InvalidValue(f"feature {name!r} is {value}: leave the feature out when it is unknown")
        return float(value)
    raise InvalidValue(
        f"feature {name!r} is a {type(value).__name__}: values are str, int, float or bool; "
        f"several values of one name are several features"
    )


def as_features(given: Mapping[str, object] | Iterable[tuple[str, object]]) -> tuple[Feature, ...]:
    """The features given as a mapping or as pairs, checked, in the order given, each once (it is a set)."""
    return tuple(by_canonical(given).values())


def by_canonical(given: Mapping[str, object] | Iterable[tuple[str, object]]) -> dict[str, Feature]:
    """The features given, checked, in the order given, each under its canonical text and so once."""
    pairs = given.items() if isinstance(given, Mapping) else given
    if isinstance(pairs, str | bytes) or not isinstance(pairs, Iterable):
        raise InvalidValue(f"features are a mapping or several pairs (name, value), not {given!r:.80}")
    found: dict[str, Feature] = {}
    for pair in pairs:
        if not isinstance(pair, tuple | list) or len(pair) != 2:
            raise InvalidValue(f"a feature is a pair (name, value), not {pair!r:.80}")
        name, raw = check_name(pair[0], what="a feature name"), pair[1]
        feature = (name, check_value(name, raw))
        found.setdefault(canonical(feature), feature)
    return found


def value_text(value: FeatureValue) -> str:
    """The canonical text of a value within its kind: equal values have one text, others another."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() else repr(value)
    return str(value)


def canonical(feature: Feature) -> str:
    """The feature as one unambiguous text: name, U+001F, kind, value."""
    name, value = feature
    return f"{name}\x1f{kind_of(value)}{value_text(value)}"


def fold(text: str) -> str:
    """`text` itself up to `TOKEN_BYTES` of UTF-8, else U+001F, its first characters, U+001F and its SHA-256.

    No name begins with U+001F, so that a folded text never equals one that was kept whole.
    """
    if len(text) * 4 <= TOKEN_BYTES:
        return text
    data = text.encode()
    if len(data) <= TOKEN_BYTES:
        return text
    return f"\x1f{text[:_PREFIX_CHARACTERS]}\x1f{hashlib.sha256(data).hexdigest()}"


def token(feature: Feature) -> str:
    """The folded canonical text under which a store indexes a feature."""
    return fold(canonical(feature))


def tokens(features: Iterable[Feature]) -> list[str]:
    """The tokens of a feature set, sorted by code point."""
    return sorted({token(feature) for feature in features})


def name_tokens(names: Iterable[str]) -> list[str]:
    """The folded names, each once, sorted by code point."""
    return sorted({fold(name) for name in names})


def ends(sorted_tokens: Sequence[str]) -> int:
    """A number of 64 bits that depends on the first and the last of some sorted tokens only.

    A set within another has both its ends in it: an index on this number finds the candidates for a
    `subset` by a few probes, where one on the tokens visits every event that shares any.
    """
    if not sorted_tokens:
        return _EMPTY
    return _EMPTY + (crc32(sorted_tokens[0].encode()) << 32 | crc32(sorted_tokens[-1].encode()))


def ends_within(sorted_tokens: Sequence[str]) -> list[int]:
    """The `ends` of every set that lies within the given one, the empty set's among them."""
    pairs = combinations_with_replacement(sorted_tokens, 2)
    return sorted({_EMPTY, *(ends(pair) for pair in pairs)})


_EMPTY = -(2**63)
