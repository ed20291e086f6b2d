"""The codecs lose nothing, know their version, and refuse what is damaged in words."""

from __future__ import annotations

import json
import math
import random
import timeit

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron import binary, textual
from armem_bridge.aron.data import DEPTH_LIMIT, Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.versions import MAJOR, MINOR, VersionCounts
from armem_bridge.errors import ArmemError, InvalidData, InvalidTypeObject, TooLarge, Undecodable, UnknownCodecVersion
from tests.armem.aron.strategies import DATA, TYPES

CUP = Dict({"name": String("cup"), "seen": Int(3), "weight": Double(0.25)})

DEEPEST: Data = List([])
for _ in range(DEPTH_LIMIT - 1):
    DEEPEST = List([DEEPEST])


def bits(data: Data | None) -> object:
    """What == does not see: the order of names and the signs of zeros."""
    match data:
        case Dict():
            return [(name, bits(element)) for name, element in data.elements.items()]
        case List():
            return [bits(element) for element in data.elements]
        case Float() | Double():
            return (type(data), data.value, math.copysign(1, data.value))
        case _:
            return data


@given(DATA | st.none())
def test_both_codecs_lose_nothing(data: Data | None) -> None:
    for codec in (binary, textual):
        decoded = codec.decode(codec.encode(data))
        assert decoded == data
        assert bits(decoded) == bits(data)
    assert textual.from_json(json.loads(json.dumps(textual.to_json(data)))) == data


@given(TYPES)
def test_type_objects_go_there_and_back(type_object: t.TypeObject) -> None:
    assert textual.decode_type(textual.encode_type(type_object)) == type_object
    assert textual.type_from_json(json.loads(json.dumps(textual.type_to_json(type_object)))) == type_object


def test_the_binary_form_is_the_one_described() -> None:
    array = NDArray((1, 1), "uint8", b"\x07")
    everything = Dict(
        {
            "s": String("x"),
            "b": Bool(True),
            "i": Int(1),
            "l": Long(2),
            "f": Float(0.5),
            "d": Double(0.1),
            "[": List([None]),
            "n": array,
        }
    )
    assert msgspec.msgpack.decode(binary.encode(everything)) == [
        "aron",
        MAJOR,
        MINOR,
        [
            "{",
            {
                "s": ["s", "x"],
                "b": ["b", True],
                "i": ["i", 1],
                "l": ["l", 2],
                "f": ["f", 0.5],
                "d": ["d", 0.1],
                "[": ["[", [None]],
                "n": ["n", [1, 1], "uint8", b"\x07"],
            },
        ],
    ]


def test_the_binary_form_never_changes() -> None:
    assert binary.encode(CUP).hex() == (
        "94a461726f6e010092a17b83a46e616d6592a173a3637570a47365656e92a16903a677656967687492a164cb3fd0000000000000"
    )


def test_the_json_form_is_the_one_described() -> None:
    data = Dict({"x": List([None, Float(math.nan), Double(-math.inf), Double(math.inf), Bool(False)])})
    assert textual.to_json(data) == {
        "dict": {
            "x": {"list": [None, {"float": "NaN"}, {"double": "-Infinity"}, {"double": "Infinity"}, {"bool": False}]}
        }
    }
    assert json.loads(textual.encode(NDArray((2, 1), "uint8", b"ab"))) == {
        "aron": "1.0",
        "data": {"ndarray": {"shape": [2, 1], "type": "uint8", "base64": "YWI="}},
    }


def test_integers_in_the_place_of_floats_are_read() -> None:
    assert textual.decode('{"aron": "1.0", "data": {"double": 1}}') == Double(1.0)
    assert textual.decode('{"aron": "1.0", "data": {"string": "NaN"}}') == String("NaN")


def test_the_deepest_goes_there_and_back() -> None:
    for codec in (binary, textual):
        assert codec.decode(codec.encode(DEEPEST)) == DEEPEST


def test_another_major_version_is_refused_another_minor_is_read() -> None:
    for minor in (0, 7):
        assert binary.decode(msgspec.msgpack.encode(["aron", MAJOR, minor, ["i", 1, "a field to come"]])) == Int(1)
        assert textual.decode(json.dumps({"aron": f"{MAJOR}.{minor}", "data": {"int": 1}, "more": 1})) == Int(1)
    for major in (0, MAJOR + 1):
        with pytest.raises(UnknownCodecVersion, match=f"version {major}.3 .* upgrade elm"):
            binary.decode(msgspec.msgpack.encode(["aron", major, 3, {"what": "ever"}]))
        with pytest.raises(UnknownCodecVersion, match=f"version {major}.3 .* upgrade elm"):
            textual.decode(json.dumps({"aron": f"{major}.3", "data": {"what": "ever"}}))


@pytest.mark.parametrize(
    "encoded",
    [
        b"",
        b"\xc1",
        b"hello",
        binary.encode(CUP)[:-1],
        binary.encode(CUP) + b"\x00",
        msgspec.msgpack.encode(["nora", 1, 0, None]),
        msgspec.msgpack.encode(["aron", -1, 0, None]),
        msgspec.msgpack.encode(["aron", "1", 0, None]),
        msgspec.msgpack.encode(["aron", 1, 0]),
        msgspec.msgpack.encode({"aron": 1}),
        *(
            msgspec.msgpack.encode(["aron", 1, 0, data])
            for data in (
                3,
                ["i"],
                ["i", 2**31],
                ["i", True],
                ["i", 1.5],
                ["l", 2**63],
                ["f", 1e39],
                ["?", 1],
                ["s", b"x"],
                ["[", [3]],
                ["[", 3],
                ["{", {"a": 3}],
                ["{", {1: ["i", 1]}],
                ["n", [2, 1], "uint8", b"x"],
                ["n", [-1, -1], "uint8", b"x"],
                ["n", [1], "uint8", "x"],
                ["n", [1], 16, b"x"],
            )
        ),
        b"\x94\xa4aron\x01\x00\x92\xa1[\xdd\xff\xff\xff\xff\xc0",
        b"\x94\xa4aron\x01\x00\x92\xa1{\xdf\xff\xff\xff\xff\xc0",
        b"\x94\xa4aron\x01\x00\x92\xa1s\xdb\xff\xff\xff\xffx",
        b"\x94\xa4aron\x01\x00\x92\xa1s\xa1\xff",
        b"\x94\xa4aron\x01\x00\x92\xa1s\xa3\xed\xa0\x80",
        b"\x94\xa4aron\x01\x00" + b"\x92\xa1[\x91" * DEPTH_LIMIT + b"\x92\xa1[\x90",
        b"\x94\xa4aron\x01\x00" + b"\x92\xa1[\x91" * 100_000 + b"\xc0",
    ],
)
def test_what_is_no_binary_form_is_refused(encoded: bytes) -> None:
    with pytest.raises(Undecodable, match="ARON object in binary form") as refused:
        binary.decode(encoded)
    assert len(str(refused.value)) < 500


@pytest.mark.parametrize(
    "document",
    [
        "",
        "null",
        "[]",
        "{",
        '{"aron": "1.0"}',
        '{"aron": 1, "data": null}',
        '{"aron": "1", "data": null}',
        '{"aron": "1.x", "data": null}',
        '{"data": null}',
        b"\xff",
        *(
            '{"aron": "1.0", "data": ' + data + "}"
            for data in (
                "3",
                '"x"',
                "{}",
                '{"int": 1, "long": 1}',
                '{"integer": 1}',
                '{"int": "1"}',
                '{"int": true}',
                '{"int": 2147483648}',
                '{"int": 1e3}',
                '{"long": 9223372036854775808}',
                '{"float": "nan"}',
                '{"double": null}',
                '{"double": 1e400}',
                '{"bool": 1}',
                '{"string": "\\ud800"}',
                '{"list": {}}',
                '{"list": [1]}',
                '{"dict": []}',
                '{"ndarray": []}',
                '{"ndarray": {"shape": [1, 1], "type": "uint8"}}',
                '{"ndarray": {"shape": [1, 1], "type": "uint8", "base64": "!!!!"}}',
                '{"ndarray": {"shape": [2, 1], "type": "uint8", "base64": "eA=="}}',
                '{"ndarray": {"shape": [1, 1], "type": "uint8", "base64": "e!A=="}}',
                '{"ndarray": {"shape": "11", "type": "uint8", "base64": "eA=="}}',
                '{"ndarray": {"shape": [1, 1], "type": 16, "base64": "eA=="}}',
                '{"list": [' * (DEPTH_LIMIT + 1) + "]}" * (DEPTH_LIMIT + 1),
                "[" * 100_000,
            )
        ),
    ],
)
def test_what_is_no_json_form_is_refused(document: str | bytes) -> None:
    with pytest.raises(Undecodable, match="ARON object in JSON"):
        textual.decode(document)


def test_values_that_nest_without_end_are_refused() -> None:
    endless: dict[str, object] = {}
    endless["list"] = [endless]
    with pytest.raises(Undecodable, match="nests deeper than 200"):
        textual.from_json(endless)


@pytest.mark.parametrize(
    "document",
    [
        '{"aron": "1.0", "data": null}',
        '{"aron": "1.0", "type": null}',
        '{"aron": "1.0", "type": {"kind": "integer"}}',
        '{"aron": "1.0", "type": {"kind": "list"}}',
        '{"aron": "1.0", "type": {"kind": "intenum", "name": "E", "values": {}}}',
        '{"aron": "1.0", "type": {"kind": "ndarray", "shape": [-1]}}',
        '{"aron": "1.0", "type": ' + '{"kind": "list", "accepted": ' * 201 + '{"kind": "int"}' + "}" * 202,
        '{"aron": "1.0", "type": ' + '{"kind": "list", "accepted": ' * 5000 + '{"kind": "int"}' + "}" * 5001,
    ],
)
def test_what_is_no_type_in_json_is_refused(document: str) -> None:
    with pytest.raises(Undecodable):
        textual.decode_type(document)


def test_damaged_bytes_are_refused_or_are_other_data() -> None:
    encoded = bytearray(
        binary.encode(Dict({"a": CUP, "b": List([NDArray((2, 2, 1), "uint8", b"abcd"), None, Float(0.5)])}))
    )
    dice = random.Random(20)
    refused = 0
    for _ in range(3000):
        damaged = encoded.copy()
        for _ in range(dice.randint(1, 3)):
            damaged[dice.randrange(len(damaged))] = dice.randrange(256)
        try:
            binary.decode(bytes(damaged))
        except ArmemError:
            refused += 1
    assert refused > 1000


def test_sizes_are_bounded() -> None:
    image = NDArray((100, 100, 1), "uint8", bytes(10_000))
    for codec in (binary, textual):
        encoded = codec.encode(image)
        assert (
            codec.decode(encoded, limit=len(encoded)) == codec.decode(codec.encode(image, limit=len(encoded))) == image
        )
        with pytest.raises(TooLarge, match="over the limit of 10,000"):
            codec.encode(image, limit=10_000)
        with pytest.raises(TooLarge, match="over the limit of 10,000"):
            codec.decode(encoded, limit=10_000)


def test_only_aron_is_encoded() -> None:
    for codec in (binary, textual):
        with pytest.raises(InvalidData, match="to_aron"):
            codec.encode({"a": 1})
    with pytest.raises(InvalidTypeObject, match="no type object"):
        textual.encode_type(Int(1))  # type: ignore[arg-type]


def test_any_buffer_is_decoded() -> None:
    encoded = binary.encode(CUP)
    assert binary.decode(bytearray(encoded)) == binary.decode(memoryview(encoded)) == CUP
    assert textual.decode(textual.encode(CUP).decode()) == CUP


def test_a_large_array_is_not_copied_about() -> None:
    image = Dict({"image": NDArray((128, 128, 3, 1), "uint8", bytes(49_152)), "time": Long(1)})
    encoded = binary.encode(image)

    def fastest(call: object, number: int) -> float:
        assert callable(call)
        return min(timeit.repeat(call, number=number, repeat=5)) / number

    # Generous, for busy machines: base64 or a copy by elements would take a hundred times as long.
    assert fastest(lambda: binary.encode(image), 200) < 200e-6
    assert fastest(lambda: binary.decode(encoded), 200) < 200e-6


def test_versions_from_the_wire_are_counted() -> None:
    counts = VersionCounts()
    for version in ("2.0.0", "", "beta 0.2.3", "2.0.0", "", "2.0.0"):
        counts.add(version)
    assert counts.report() == {"2.0.0": 3, "": 2, "beta 0.2.3": 1}
    assert list(counts.report()) == ["2.0.0", "", "beta 0.2.3"]


def test_a_flood_of_versions_is_added_up() -> None:
    counts = VersionCounts()
    for number in range(1000):
        counts.add(f"{number:04}" * 1000)
    assert len(counts.report()) == VersionCounts.DISTINCT + 1
    assert counts.report()[VersionCounts.OTHERS] == 1000 - VersionCounts.DISTINCT
    assert sum(counts.report().values()) == 1000
