"""Data objects are valid from birth: what they hold, what they refuse, and what the refusal says."""

from __future__ import annotations

import enum
import math
import pickle
from typing import Any

import numpy as np
import pytest

import armem_bridge.aron.data as data_module
from armem_bridge.aron.data import DEPTH_LIMIT, Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.errors import ArmemError, InvalidData
from elm.errors import ElmError

wrong: Any = data_module
"""The same module without its annotations, for what they rule out."""


class Side(enum.IntEnum):
    LEFT = 1


class Colour(enum.StrEnum):
    RED = "red"


@pytest.mark.parametrize(
    ("given", "value"),
    [
        (Int(2**31 - 1), 2**31 - 1),
        (Int(-(2**31)), -(2**31)),
        (Int(Side.LEFT), 1),
        (Long(2**63 - 1), 2**63 - 1),
        (Long(-(2**63)), -(2**63)),
        (Float(0.1), 0.10000000149011612),
        (Float(3), 3.0),
        (Float(2.0**-160), 0.0),
        (Float(math.inf), math.inf),
        (Float(3.4028235e38), 3.4028234663852886e38),
        (Double(0.1), 0.1),
        (Double(3), 3.0),
        (Double(np.float64(0.1)), 0.1),
        (String(Colour.RED), "red"),
        (String("\x00 ü 🤖"), "\x00 ü 🤖"),
        (Bool(True), True),
    ],
)
def test_values_are_held_as_plain_python(given: Any, value: object) -> None:
    assert given.value == value
    assert type(given.value) is type(value)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: wrong.Int(2**31), "make it a Long"),
        (lambda: wrong.Int(-(2**31) - 1), "32 bits"),
        (lambda: wrong.Int(True), "not a bool"),
        (lambda: wrong.Int(1.0), "not a float"),
        (lambda: wrong.Int("1"), "not a str"),
        (lambda: wrong.Long(2**63), "64 bits"),
        (lambda: wrong.Long(-(2**63) - 1), "64 bits"),
        (lambda: wrong.Long(True), "not a bool"),
        (lambda: wrong.Bool(1), "True or False"),
        (lambda: wrong.Bool(np.True_), "True or False"),
        (lambda: wrong.Float(1e39), "make it a Double"),
        (lambda: wrong.Float(10**400), "beyond its range"),
        (lambda: wrong.Float("1"), "not a str"),
        (lambda: wrong.Float(True), "not a bool"),
        (lambda: wrong.Double(10**400), "beyond its range"),
        (lambda: wrong.Double(None), "not a NoneType"),
        (lambda: wrong.String("\ud800"), "surrogate"),
        (lambda: wrong.String(b"x"), "not a bytes"),
        (lambda: wrong.List("abc"), "several data objects"),
        (lambda: wrong.List(3), "several data objects"),
        (lambda: wrong.List([1]), "element 0"),
        (lambda: wrong.List([Int(1), "x"]), "element 1 .* to_aron"),
        (lambda: wrong.List({"a": Int(1)}), "several data objects"),
        (lambda: wrong.Dict([("a", Int(1))]), "by names"),
        (lambda: wrong.Dict({"a": 1}), "'a' .* to_aron"),
        (lambda: wrong.Dict({1: Int(1)}), "key of a Dict is text"),
        (lambda: wrong.Dict({"\udfff": Int(1)}), "surrogate"),
    ],
)
def test_what_cannot_be_is_refused(make: Any, says: str) -> None:
    with pytest.raises(InvalidData, match=says) as refused:
        make()
    assert isinstance(refused.value, ArmemError | ElmError)


@pytest.mark.parametrize(
    ("shape", "element", "data"),
    [
        ((2, 3, 4), "float32", bytes(24)),
        ((4,), "float32", bytes(4)),
        ((0, 3, 4), "float32", b""),
        ((), "", b""),
        ([2, 1], "uint8", bytearray(b"ab")),
        ((2, 1), "anything at all", memoryview(b"ab")),
    ],
)
def test_arrays_whose_bytes_fit(shape: Any, element: str, data: Any) -> None:
    array = NDArray(shape, element, data)
    assert (array.shape, array.type, array.data) == (tuple(shape), element, bytes(data))


@pytest.mark.parametrize(
    ("shape", "element", "data", "says"),
    [
        ((2, 3, 4), "float32", bytes(6), "24 bytes, not 6"),
        ((2, 3), "float32", bytes(24), "bytes per element"),
        ((), "float32", b"x", "0 bytes, not 1"),
        ((-2, -2, 1), "uint8", bytes(4), "below 0"),
        ((0,), "uint8", b"", "no bytes per element"),
        ((2, 0), "uint8", b"", "no bytes per element"),
        ((2**31, 0, 1), "uint8", b"", "32 bits"),
        ((1,) * 66, "uint8", b"x", "at most 64 extents"),
        ((1.0, 1), "uint8", b"x", "extent"),
        ((np.int64(1), 1), "uint8", b"x", "extent"),
        ("11", "uint8", b"x", "several integers"),
        (3, "uint8", b"x", "several integers"),
        ((1, 1), 16, b"x", "element type"),
        ((1, 1), "\ud800", b"x", "surrogate"),
        ((1, 1), "uint8", "x", "bytes"),
        ((1, 1), "uint8", [1], "bytes"),
    ],
)
def test_arrays_whose_bytes_do_not(shape: Any, element: Any, data: Any, says: str) -> None:
    with pytest.raises(InvalidData, match=says):
        NDArray(shape, element, data)


def test_all_nan_are_one() -> None:
    other = -np.frombuffer(b"\x01\x00\x00\x00\x00\x00\xf8\x7f")[0]
    for kind in (Float, Double):
        assert kind(math.nan) == kind(float(other)) != kind(0.0)
        assert math.copysign(1, kind(float(other)).value) == math.copysign(1, math.nan)


def test_kinds_are_never_equal() -> None:
    one = [Int(1), Long(1), Float(1.0), Double(1.0), Bool(True), String("1"), List([Int(1)]), Dict({"1": Int(1)})]
    assert all((a == b) == (a is b) for a in one for b in one)


def test_dicts_are_copied_and_their_order_does_not_count() -> None:
    given: dict[str, Data | None] = {"b": Int(1), "a": None}
    data = Dict(given)
    given["c"] = Int(2)

    assert data == Dict({"a": None, "b": Int(1)})
    assert list(data.elements) == ["b", "a"]
    assert hash(data) == hash(Dict({"a": None, "b": Int(1)}))
    assert Dict() == Dict({})
    assert Dict().elements is not Dict().elements


def test_data_objects_are_frozen() -> None:
    for data in (Int(1), List([]), Dict({}), NDArray((), "", b"")):
        with pytest.raises(AttributeError):
            data.value = 3  # type: ignore[union-attr, misc]


def test_nesting_is_bounded() -> None:
    nested: List | Dict = List([])
    for level in range(DEPTH_LIMIT - 1):
        nested = List([Int(1), nested]) if level % 2 else Dict({"a": nested, "b": None})

    assert nested.depth == DEPTH_LIMIT
    assert pickle.loads(pickle.dumps(nested)).depth == DEPTH_LIMIT  # noqa: S301 - our own bytes
    with pytest.raises(InvalidData, match="nest deeper than 200"):
        List([nested])
    with pytest.raises(InvalidData, match="nest deeper than 200"):
        Dict({"a": Int(1), "b": nested})


def test_large_arrays_are_shown_by_their_size() -> None:
    assert (
        repr(NDArray((100, 100, 1), "uint8", bytes(10000)))
        == "NDArray(shape=[100, 100, 1], type='uint8', 10,000 bytes)"
    )
