"""Tests of features: when two values are the same one, what is refused, and that tokens never collide."""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm.errors import InvalidValue
from elm.features import (
    TOKEN_BYTES,
    Feature,
    as_features,
    canonical,
    check_value,
    fold,
    identity,
    kind_of,
    name_tokens,
    token,
    tokens,
)

# When two values are the same one

SAME: list[tuple[Any, Any]] = [
    (1, 1.0),
    (0, -0.0),
    (0.0, -0.0),
    (-5, -5.0),
    (2**53, float(2**53)),
    (-(2**63), -(2.0**63)),
    (1e16, 10**16),
    (0.1, 0.1),
    (1e300, 1e300),
    (5e-324, 5e-324),
    ("cup", "cup"),
    ("", ""),
    (True, True),
    (np.int64(1), 1),
    (np.float64(0.5), 0.5),
    (np.bool_(True), True),
    (np.str_("cup"), "cup"),
]

DIFFERENT: list[tuple[Any, Any]] = [
    (1, True),
    (1, "1"),
    (True, "1"),
    (True, "true"),
    (True, "True"),
    (1.0, True),
    (1.0, "1.0"),
    (0, False),
    (0, ""),
    (False, ""),
    (False, "false"),
    (2**53, 2**53 + 1),
    (float(2**53), 2**53 + 1),
    (2**63 - 1, 2.0**63),
    (2**63 - 1, 2**63 - 2),
    (0.1, 0.1 + 2**-56),
    (0.1 + 0.2, 0.3),
    (1, 1 + 2**-52),
    (0, 5e-324),
    (1e300, 1.0000000000000002e300),
    (1e22, 1e23),
    (np.float32(0.1), 0.1),
    ("a", "A"),
    ("a", "a "),
    ("a", " a"),
    ("é", "e\u0301"),
    ("n1", 1),
    ("s", ""),
    ("a\nb", "a b"),
    ("x" * 5000 + "1", "x" * 5000 + "2"),
    ("1" + "x" * 5000, "2" + "x" * 5000),
    ("x" * 5000, "x" * 5001),
    ("é" * 5000, "é" * 4999 + "e"),
]


def _kept(value: Any) -> Feature:
    return as_features([("name", value)])[0]


@pytest.mark.parametrize(("one", "other"), SAME)
def test_the_same_value_is_one_feature_and_one_token(one: Any, other: Any) -> None:
    assert identity(_kept(one)) == identity(_kept(other))
    assert len(as_features([("name", one), ("name", other)])) == 1
    assert token(_kept(one)) == token(_kept(other))
    assert canonical(_kept(one)) == canonical(_kept(other))


@pytest.mark.parametrize(("one", "other"), DIFFERENT)
def test_another_value_is_another_feature_and_another_token(one: Any, other: Any) -> None:
    assert identity(_kept(one)) != identity(_kept(other))
    assert len(as_features([("name", one), ("name", other)])) == 2
    assert token(_kept(one)) != token(_kept(other))
    assert canonical(_kept(one)) != canonical(_kept(other))


@pytest.mark.parametrize(
    ("value", "kind"), [(True, "b"), (False, "b"), (1, "n"), (1.0, "n"), ("1", "s"), ("", "s"), ("True", "s")]
)
def test_kinds_are_bool_number_and_string(value: Any, kind: str) -> None:
    assert kind_of(value) == kind


@pytest.mark.parametrize(
    ("given_value", "expected"),
    [
        (np.int8(-3), -3),
        (np.uint64(2**63 - 1), 2**63 - 1),
        (np.float32(0.5), 0.5),
        (np.float64(-0.0), 0.0),
        (np.bool_(False), False),
        (np.str_("cup"), "cup"),
    ],
)
def test_numpy_scalars_become_plain_values(given_value: Any, expected: object) -> None:
    found = check_value("name", given_value)

    assert found == expected
    assert type(found) is type(expected)


class _Colour(str, enum.Enum):  # noqa: UP042 - the older kind of enumeration is what is tested
    RED = "red"


class _Shape(enum.StrEnum):
    ROUND = "round"


class _Level(enum.IntEnum):
    HIGH = 3


class _Metres(float):
    """A float of a class of its own."""


@pytest.mark.parametrize(
    ("given_value", "expected"),
    [
        (_Colour.RED, "red"),
        (_Shape.ROUND, "round"),
        (_Level.HIGH, 3),
        (_Metres(1.5), 1.5),
    ],
)
def test_values_of_derived_classes_become_the_plain_value_they_equal(given_value: Any, expected: object) -> None:
    found = check_value("name", given_value)

    assert found == expected
    assert type(found) is type(expected)


@pytest.mark.parametrize("name", [_Colour.RED, _Shape.ROUND, np.str_("name")])
def test_a_name_of_a_derived_class_has_the_token_of_the_plain_name(name: Any) -> None:
    (kept,) = as_features([(name, 1)])

    assert token(kept) == token((str.__str__(name), 1))
    assert name_tokens([kept[0]]) == name_tokens([str.__str__(name)])


# What is refused


@pytest.mark.parametrize(
    "value",
    [
        math.nan,
        math.inf,
        -math.inf,
        np.float64("nan"),
        np.float32("inf"),
        2**63,
        -(2**63) - 1,
        10**400,
        np.uint64(2**64 - 1),
        None,
        b"bytes",
        np.bytes_(b"bytes"),
        [],
        [1],
        (1,),
        {},
        {1},
        1 + 2j,
        Decimal(1),
        Fraction(1, 2),
        np.datetime64("2026-01-01T00:00:00"),
        np.longdouble("1e400"),
        np.array([1]),
        object(),
        "a\x00b",
        "\ud800",
        "\udfff tail",
        "x" * 300 + "\udc80",
    ],
)
def test_values_that_cannot_be_kept_are_refused_naming_the_feature(value: object) -> None:
    with pytest.raises(InvalidValue, match="force"):
        as_features([("force", value)])


@pytest.mark.parametrize(
    "value", [2**63 - 1, -(2**63), 2.0**63, 1e308, -1e308, "\x1f", "a\x1fb", "'; DROP TABLE", "\\"]
)
def test_values_at_the_limits_are_kept(value: Any) -> None:
    assert as_features([("force", value)]) == (("force", value),)


@pytest.mark.parametrize("name", ["", "a\x00b", "a\x1fb", "\x1f", "\ud800", "a\udcff", None, 5, b"name", ("a",), True])
def test_names_that_cannot_be_kept_are_refused(name: Any) -> None:
    with pytest.raises(InvalidValue, match="feature name"):
        as_features([(name, 1)])


@pytest.mark.parametrize("pair", ["a", "abc", (), ("a",), ("a", 1, 2), 5, None, [["a", 1]]])
def test_what_is_no_pair_is_refused(pair: Any) -> None:
    with pytest.raises(InvalidValue, match="pair"):
        as_features([pair])


@pytest.mark.parametrize("pair", ["ab", {"name": "a", "value": 1}, {"a", "b"}])
def test_what_only_happens_to_have_two_elements_is_no_pair(pair: Any) -> None:
    with pytest.raises(InvalidValue, match="pair"):
        as_features([pair])


@pytest.mark.parametrize("features", [None, 5, True])
def test_features_that_are_not_several_are_refused(features: Any) -> None:
    with pytest.raises(InvalidValue, match="feature"):
        as_features(features)


# Features as a set


def test_features_keep_their_order_and_the_first_of_equal_ones() -> None:
    given_features: list[tuple[str, object]] = [("b", 2), ("a", 1), ("b", 1), ("a", 1.0), ("a", True), ("b", 2)]

    found = as_features(given_features)
    assert found == (("b", 2), ("a", 1), ("b", 1), ("a", True))
    assert [type(value) for _, value in found] == [int, int, int, bool]


def test_a_mapping_gives_its_items() -> None:
    assert as_features({"object": "cup", "force": 3.2}) == (("object", "cup"), ("force", 3.2))
    assert as_features({}) == ()
    assert as_features(iter([("a", 1)])) == (("a", 1),)


# Tokens

EVIL = [
    "",
    "a",
    "b",
    "\x1f",
    "n1",
    "s",
    "sa",
    "\x1fs",
    "\x1fn1",
    "1",
    "a\x1fsb",
    "\x1fb",
    "x" * 197,
    "x" * 198,
    "x" * 199,
]
NAMES = st.one_of(
    st.sampled_from(["a", "as", "a1", "ab", "x" * 197, "x" * 198, "x" * 300]), st.text(min_size=1)
).filter(lambda text: not set(text) & {"\x00", "\x1f"} and text.isprintable())
VALUES = st.one_of(
    st.sampled_from([*EVIL, True, False, 0, 1, 1.0, -0.0, 0.5, 2**53, 2**53 + 1, float(2**53), 1e300]),
    st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]), max_size=300),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False, allow_infinity=False),
    st.booleans(),
)
FEATURES = st.tuples(NAMES, VALUES)


def _same(one: Feature, other: Feature) -> bool:
    """Written from the definition: same name, and numbers equal by value, else same kind and value."""
    (name, value), (other_name, other_value) = one, other
    kinds = (
        (isinstance(value, bool), isinstance(value, str)),
        (isinstance(other_value, bool), isinstance(other_value, str)),
    )
    return name == other_name and kinds[0] == kinds[1] and value == other_value


@given(st.lists(FEATURES, max_size=8))
def test_distinct_features_have_distinct_tokens_and_equal_ones_the_same(drawn: list[Feature]) -> None:
    for one in drawn:
        for other in drawn:
            assert (token(one) == token(other)) == _same(one, other)
            assert (identity(one) == identity(other)) == _same(one, other)


@given(st.lists(FEATURES, max_size=8))
def test_a_set_has_as_many_tokens_as_members_sorted_by_code_point(drawn: list[Feature]) -> None:
    found = tokens(drawn)

    assert found == sorted(found)
    assert len(found) == len(set(found)) == len(as_features(drawn))
    assert tokens(reversed(drawn)) == found


@given(FEATURES)
def test_a_token_fits_into_an_index_entry(feature: Feature) -> None:
    assert len(token(feature).encode()) <= TOKEN_BYTES
    assert "\x00" not in token(feature)


def test_a_token_is_kept_whole_up_to_200_bytes_and_folded_beyond() -> None:
    at_limit, beyond = "x" * 200, "x" * 201

    assert TOKEN_BYTES == 200
    assert fold(at_limit) == at_limit
    assert fold(beyond) != beyond
    assert fold("é" * 100) == "é" * 100
    assert fold("é" * 101) != "é" * 101
    assert len(fold("😀" * 1000).encode()) <= TOKEN_BYTES


def test_no_text_kept_whole_equals_a_folded_one() -> None:
    """Whoever knows the folding cannot choose a feature whose whole token is another's folded one."""
    long_value = "x" * 5000
    folded = token(("name", long_value))
    marks = folded.split("\x1f")

    def crafted() -> Iterable[Feature]:
        for cut in range(1, len(folded)):
            name, value = folded[:cut], folded[cut:]
            if "\x1f" not in name and name:
                yield name, value
        for part in marks:
            if part:
                yield part, long_value[:20]
                yield part, folded
                yield "name", folded

    assert all(token(feature) != folded for feature in crafted())
    with pytest.raises(InvalidValue):
        as_features([(folded, 1)])


def test_name_tokens_are_each_once_sorted_and_distinct() -> None:
    long_names = ["n" * 300 + "1", "n" * 300 + "2"]

    assert name_tokens(["b", "a", "b", "A"]) == ["A", "a", "b"]
    assert len(set(name_tokens(long_names))) == 2
    assert name_tokens([]) == []


@given(st.lists(NAMES, max_size=8))
def test_there_are_as_many_name_tokens_as_names(names: list[str]) -> None:
    assert len(name_tokens(names)) == len(set(names))
