"""The content hash depends on nothing but the content, and never changes."""

from __future__ import annotations

import hashlib
import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.aron import binary, content_hash
from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.errors import InvalidData
from tests.armem.aron.strategies import DATA

TAGS = {String: "s", Bool: "b", Int: "i", Long: "l", Float: "f", Double: "d", List: "[", Dict: "{", NDArray: "n"}


def shuffled(data: Data | None, dice: random.Random) -> Data | None:
    """The same data with the names of its dicts in another order."""
    match data:
        case Dict():
            items = [(name, shuffled(element, dice)) for name, element in data.elements.items()]
            dice.shuffle(items)
            return Dict(dict(items))
        case List():
            return List([shuffled(element, dice) for element in data.elements])
        case _:
            return data


def canonical(value: object) -> bytes:
    """The canonical form, written down a second time from msgpack's specification."""
    match value:
        case None:
            return b"\xc0"
        case bool():
            return b"\xc3" if value else b"\xc2"
        case int():
            return _integer(value)
        case float():
            return b"\xcb" + struct.pack(">d", value)
        case str():
            return _sized(value.encode(), fixed=0xA0, limit=32, sizes=(0xD9, 0xDA, 0xDB))
        case bytes():
            return _sized(value, fixed=0, limit=0, sizes=(0xC4, 0xC5, 0xC6))
        case list() | tuple():
            return _head(len(value), 0x90, (0xDC, 0xDD)) + b"".join(map(canonical, value))
        case dict():
            items = sorted(value.items(), key=lambda item: item[0].encode())
            return _head(len(items), 0x80, (0xDE, 0xDF)) + b"".join(canonical(n) + canonical(v) for n, v in items)
        case List() | Dict():
            return canonical([TAGS[type(value)], value.elements])
        case NDArray():
            return canonical(["n", value.shape, value.type, value.data])
        case String() | Bool() | Int() | Long() | Float() | Double():
            return canonical([TAGS[type(value)], value.value])
        case _:
            raise AssertionError(value)


def _integer(value: int) -> bytes:
    if -32 <= value < 128:
        return struct.pack(">b", value) if value < 0 else bytes([value])
    forms = (
        ((0xCC, ">B"), (0xCD, ">H"), (0xCE, ">I"), (0xCF, ">Q"))
        if value > 0
        else ((0xD0, ">b"), (0xD1, ">h"), (0xD2, ">i"), (0xD3, ">q"))
    )
    for head, form in forms:
        try:
            return bytes([head]) + struct.pack(form, value)
        except struct.error:
            continue
    raise AssertionError(value)


def _sized(data: bytes, *, fixed: int, limit: int, sizes: tuple[int, int, int]) -> bytes:
    if len(data) < limit:
        return bytes([fixed | len(data)]) + data
    for head, form in zip(sizes, (">B", ">H", ">I"), strict=True):
        if len(data) < 256 ** struct.calcsize(form):
            return bytes([head]) + struct.pack(form, len(data)) + data
    raise AssertionError(len(data))


def _head(count: int, fixed: int, sizes: tuple[int, int]) -> bytes:
    if count < 16:
        return bytes([fixed | count])
    return bytes([sizes[0]]) + struct.pack(">H", count)


@given(DATA | st.none(), st.randoms(use_true_random=False))
def test_the_order_of_names_and_codecs_do_not_matter(data: Data | None, dice: random.Random) -> None:
    assert content_hash(shuffled(data, dice)) == content_hash(data)
    assert content_hash(binary.decode(binary.encode(data))) == content_hash(data)


@given(DATA | st.none())
def test_the_hash_is_the_one_described(data: Data | None) -> None:
    assert content_hash(data) == hashlib.sha256(canonical(data)).digest()


@given(DATA, DATA)
def test_other_content_has_another_hash(one: Data, other: Data) -> None:
    if one != other:
        assert content_hash(one) != content_hash(other)


def test_what_is_nearly_the_same_is_told_apart() -> None:
    different = [
        None,
        *(kind(1) for kind in (Int, Long, Float, Double)),
        Bool(True),
        String("1"),
        List([]),
        Dict({}),
        List([None]),
        List([List([])]),
        Dict({"": None}),
        Double(0.0),
        Double(-0.0),
        NDArray((), "", b""),
        NDArray((1, 1), "uint8", b"\x00"),
        NDArray((1, 1), "int8", b"\x00"),
        NDArray((1, 1, 1), "uint8", b"\x00"),
        NDArray((4,), "float", bytes(4)),
        NDArray((4,), "float32", bytes(4)),
    ]
    assert len({content_hash(data) for data in different}) == len(different)


def test_all_nan_hash_alike() -> None:
    other = struct.unpack("<d", b"\x01\x00\x00\x00\x00\x00\xf8\xff")[0]
    assert content_hash(Double(other)) == content_hash(Double(float("nan")))
    assert content_hash(Float(other)) == content_hash(Float(float("nan")))


def test_the_hash_never_changes() -> None:
    data = Dict({"b": List([Int(-1), Long(2**40), Float(0.1), Double(0.1), None]), "a": NDArray((2, 1), "16", b"ab")})
    assert content_hash(data).hex() == "f1ee5bb00ca73eec5ed6f565ac581813c9a27709d930486387e33d686ab8e8fa"


def test_only_data_objects_have_a_hash() -> None:
    with pytest.raises(InvalidData, match="to_aron"):
        content_hash({"a": 1})  # type: ignore[arg-type]
