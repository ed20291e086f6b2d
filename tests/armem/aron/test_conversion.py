"""Python, numpy and dataclasses to ARON and back, with the traps seen in ArmarX's own clients."""

from __future__ import annotations

import datetime as dt
import enum
import math
from collections import OrderedDict
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.sensing import image_depth, image_rgb
from armem_bridge.aron.arrays import PLAIN, STRUCTURED, channels, from_numpy, to_numpy
from armem_bridge.aron.conversion import to_aron, to_python
from armem_bridge.aron.data import DEPTH_LIMIT, Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.realization import Level, realizes
from armem_bridge.aron.records import from_aron
from armem_bridge.errors import ArmemError, InvalidData, NotConvertible, NotRealized
from tests.armem.aron.strategies import DATA, INT64, NAMES, TEXTS, TYPES, realizing

ZERO = np.int64(0)


class Side(enum.IntEnum):
    LEFT = 1
    RIGHT = 2


class Label(enum.Enum):
    GRASPABLE = "graspable"


@dataclass(frozen=True)
class Place:
    name: str
    pose: np.ndarray[Any, Any] = field(default_factory=lambda: np.eye(4, dtype=np.float32), compare=False)


@dataclass(frozen=True)
class Cup:
    place: Place
    side: Side = Side.LEFT
    weights: dict[str, float] = field(default_factory=dict)
    places: tuple[Place, ...] = ()
    pair: tuple[int, str] = (1, "x")
    note: str | None = "none yet"
    raw: Data | None = None
    count: np.int64 = ZERO
    class_: str = field(default="cup", metadata={"aron": "class"})
    anything: Any = None
    label: Label = Label.GRASPABLE
    numbers: list[int] = field(default_factory=list)
    secret: int = field(default=7, init=False)


@pytest.mark.parametrize(
    ("value", "data"),
    [
        (None, None),
        (True, Bool(True)),
        (np.True_, Bool(True)),
        (1, Int(1)),
        (Side.RIGHT, Int(2)),
        (2**31 - 1, Int(2**31 - 1)),
        (2**31, Long(2**31)),
        (-(2**31) - 1, Long(-(2**31) - 1)),
        (np.int8(-3), Int(-3)),
        (np.uint8(200), Int(200)),
        (np.int32(1), Int(1)),
        (np.int64(1), Long(1)),
        (np.uint32(2**32 - 1), Long(2**32 - 1)),
        (np.uint64(2**63 - 1), Long(2**63 - 1)),
        (np.longlong(5), None),
        (0.1, Double(0.1)),
        (np.float64(0.1), Double(0.1)),
        (np.float32(0.1), Float(0.1)),
        (np.float16(0.5), Float(0.5)),
        (math.inf, Double(math.inf)),
        ("x", String("x")),
        (np.str_("x"), String("x")),
        (Label.GRASPABLE, String("graspable")),
        ([1, "x", None], List([Int(1), String("x"), None])),
        ((1, 2), List([Int(1), Int(2)])),
        ({"a": {"b": 1.0}}, Dict({"a": Dict({"b": Double(1.0)})})),
        (OrderedDict(a=1), Dict({"a": Int(1)})),
        (MappingProxyType({"a": 1}), Dict({"a": Int(1)})),
        ({"raw": Float(0.5)}, Dict({"raw": Float(0.5)})),
        (np.array([[1.0, 2.0]], dtype=np.float32), NDArray((1, 2, 4), "float32", np.array([1, 2], "<f4").tobytes())),
        (
            np.arange(6, dtype=">i2").reshape(2, 3).T,
            NDArray((3, 2, 2), "int16", np.array([0, 3, 1, 4, 2, 5], "<i2").tobytes()),
        ),
        (np.array(3, dtype=np.uint8), NDArray((1,), "uint8", b"\x03")),
        (np.array([True]), NDArray((1, 1), "bool", b"\x01")),
        (np.empty((0, 3)), NDArray((0, 3, 8), "float64", b"")),
    ],
)
def test_what_becomes_of_python(value: Any, data: Data | None) -> None:
    found = to_aron(value)
    if isinstance(value, np.longlong):
        # Of 64 bits as np.int64 is, and on some machines the same class.
        assert found in (Int(5), Long(5))
    else:
        assert found == data
        assert type(found) is type(data)


@pytest.mark.parametrize(
    ("value", "error", "says"),
    [
        (b"abc", NotConvertible, "array of uint8"),
        (bytearray(b"abc"), NotConvertible, "array of uint8"),
        ({1, 2}, NotConvertible, "give a list"),
        (dt.datetime(2020, 1, 1, tzinfo=dt.UTC), NotConvertible, "a datetime has no ARON form"),
        (1j, NotConvertible, "complex"),
        (object(), NotConvertible, "object"),
        (Place, NotConvertible, "type"),
        (np.datetime64("2020"), NotConvertible, "datetime64"),
        (np.longdouble(1), NotConvertible, "longdouble|float128"),
        (2**63, InvalidData, "64 bits"),
        (np.uint64(2**64 - 1), InvalidData, "64 bits"),
        ("\ud800", InvalidData, "surrogate"),
        ({1: 2}, NotConvertible, "names .str. as keys"),
        ({"a": [{"b": b""}]}, NotConvertible, r"^a\[0\].b: a bytes"),
        (np.array(["x"]), NotConvertible, "no ARON form"),
        (np.array([None]), NotConvertible, "no ARON form"),
        (np.array(["2020"], dtype="datetime64[s]"), NotConvertible, "no ARON form"),
        (np.zeros(2, dtype=np.longdouble), NotConvertible, "no ARON form"),
        (np.zeros(2, dtype=[("x", "f4"), ("y", "f4")]), NotConvertible, "structured elements"),
    ],
)
def test_what_has_no_form_is_refused(value: object, error: type[ArmemError], says: str) -> None:
    with pytest.raises(error, match=says):
        to_aron(value)


def test_values_that_hold_themselves_are_refused() -> None:
    endless: list[Any] = []
    endless.append(endless)
    with pytest.raises(InvalidData, match="holds itself"):
        to_aron(endless)
    deep: Any = 1
    for _ in range(DEPTH_LIMIT):
        deep = {"a": deep}
    assert to_python(to_aron(deep)) == deep
    with pytest.raises(InvalidData, match="nest deeper"):
        to_aron([deep])


PLAIN_VALUES = st.recursive(
    st.one_of(st.none(), st.booleans(), INT64, st.floats(allow_nan=False), TEXTS),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(NAMES, inner, max_size=4),
    max_leaves=12,
)


@given(PLAIN_VALUES)
def test_python_goes_there_and_back(value: Any) -> None:
    back = to_python(to_aron(value))
    assert back == value
    assert repr(back) == repr(value), "1, 1.0 and True are told apart"


@given(DATA | st.none())
def test_aron_goes_there_and_back_when_exact(data: Data | None) -> None:
    back = to_aron(to_python(data, exact=True))
    assert _as_numpy_names(back) == _as_numpy_names(data)


def _as_numpy_names(data: Data | None) -> Data | None:
    """float is float32 and double float64: numpy has one name for each."""
    match data:
        case NDArray():
            return NDArray(data.shape, {"float": "float32", "double": "float64"}.get(data.type, data.type), data.data)
        case List():
            return List([_as_numpy_names(each) for each in data.elements])
        case Dict():
            return Dict({name: _as_numpy_names(each) for name, each in data.elements.items()})
        case _:
            return data


@pytest.mark.parametrize("name", sorted(PLAIN))
def test_arrays_of_all_plain_elements(name: str) -> None:
    array = np.arange(6).astype(name).reshape(2, 3)
    data = from_numpy(array)
    assert (data.shape, data.type) == ((2, 3, array.itemsize), name)
    assert np.array_equal(to_numpy(data), array)
    assert to_numpy(data).dtype == array.dtype
    assert not to_numpy(data).flags.writeable


def test_names_that_nobody_knows_are_kept_verbatim() -> None:
    for array in (
        NDArray((2, 3), "mystery", b"abcdef"),
        NDArray((2, 2), "float32", b"abcd"),
        NDArray((2, 3, 1), "16", b"abcdef"),
        NDArray((2, 16), "pcl::PointXYZRGBA", bytes(32)),
        NDArray((), "", b""),
    ):
        assert to_python(array) is array
        assert to_aron({"x": array}) == Dict({"x": array})
    with pytest.raises(NotConvertible, match="'mystery' and 3 bytes"):
        to_numpy(NDArray((2, 3), "mystery", b"abcdef"))


@pytest.mark.parametrize("name", sorted(STRUCTURED))
def test_points_and_pixels_keep_their_names(name: str) -> None:
    dtype = STRUCTURED[name]
    array = NDArray((2, 3, dtype.itemsize), name, bytes(range(6 * dtype.itemsize)))
    read = to_python(array)
    assert read.shape == (2, 3)
    assert read.dtype == dtype
    assert to_aron(read) == array


def test_points_have_the_fields_of_pcl() -> None:
    data = np.zeros(32, np.uint8)
    data[:12] = np.array([1, 2, 3], "<f4").view(np.uint8)
    data[16:20] = (4, 3, 2, 255)
    point = to_numpy(NDArray((1, 32), "pcl::PointXYZRGBA", data.tobytes()))[0]
    assert (point["x"], point["y"], point["z"], hex(point["rgba"])) == (1, 2, 3, "0xff020304")


def test_images_of_opencv_have_channels() -> None:
    image = NDArray((2, 1, 3), "16", bytes(range(6)))
    assert channels(image).tolist() == [[[0, 1, 2]], [[3, 4, 5]]]
    assert channels(NDArray((2, 1, 3, 1), "uint8", bytes(range(6)))).tolist() == [[[0, 1, 2]], [[3, 4, 5]]]
    assert channels(NDArray((0, 5, 3), "16", b"")).shape == (0, 5, 3)
    assert to_numpy(image)["b"].tolist() == [[2], [5]]


POSE = t.NDArray(shape=(4, 4), element="float32")


@pytest.mark.parametrize(
    ("value", "type_object", "data"),
    [
        (1, t.Int(), Int(1)),
        (1, t.Long(), Long(1)),
        (1, t.Float(), Float(1.0)),
        (1, t.Double(), Double(1.0)),
        (0.1, t.Float(), Float(0.1)),
        (np.float32(0.1), t.Double(), Double(0.10000000149011612)),
        (np.int64(5), t.Int(), Int(5)),
        (np.bool_(True), t.Bool(), Bool(True)),
        (None, t.Int(maybe=True), None),
        (None, t.Any(maybe=True), None),
        (3, t.Any(), Int(3)),
        (Side.LEFT, t.IntEnum(name="Side", values={"LEFT": 1}), Int(1)),
        ("LEFT", t.IntEnum(name="Side", values={"LEFT": 1}), Int(1)),
        ((1, 2), t.List(accepted=t.Long()), List([Long(1), Long(2)])),
        (np.array([1.5, 2]), t.List(accepted=t.Float()), List([Float(1.5), Float(2)])),
        ((1, "x"), t.Pair(first=t.Long(), second=t.String()), List([Long(1), String("x")])),
        ([1, 2.0], t.Tuple(accepted=(t.Int(), t.Float())), List([Int(1), Float(2)])),
        ({"a": 1}, t.Dict(accepted=t.Float()), Dict({"a": Float(1)})),
        ({"a": 1, "b": 2}, t.Object(name="", members={"a": t.Float()}), Dict({"a": Float(1), "b": Int(2)})),
        ({}, t.Object(name="", members={"a": t.Float(), "b": t.Int(maybe=True)}), Dict({"b": None})),
        (np.eye(4), POSE, from_numpy(np.eye(4, dtype=np.float32))),
        (np.eye(4).tolist(), POSE, from_numpy(np.eye(4, dtype=np.float32))),
        (np.eye(4, dtype=np.int64), POSE, from_numpy(np.eye(4, dtype=np.float32))),
        ([1, 2], t.NDArray(element="uint8"), NDArray((2, 1), "uint8", b"\x01\x02")),
        ([1, 2], t.NDArray(shape=(2,)), from_numpy(np.array([1, 2]))),
        ([0.1, math.nan, math.inf], t.NDArray(element="float"), from_numpy(np.array([0.1, math.nan, math.inf], "f4"))),
    ],
)
def test_a_type_object_says_which_kinds(value: Any, type_object: t.TypeObject, data: Data | None) -> None:
    found = to_aron(value, type_object)
    assert found == data
    assert type(found) is type(data)


@pytest.mark.parametrize(
    ("value", "type_object", "error", "says"),
    [
        (None, t.Int(), NotConvertible, "allows no null"),
        (True, t.Int(), NotConvertible, "a bool is no Int"),
        (1.0, t.Int(), NotConvertible, "a float is no Int"),
        (2**31, t.Int(), InvalidData, "32 bits"),
        (1, t.Bool(), NotConvertible, "an? int is no Bool"),
        (1, t.String(), NotConvertible, "an? int is no String"),
        ("1", t.Float(), NotConvertible, "a str is no Float"),
        (1e300, t.Float(), InvalidData, "make it a Double"),
        ("UP", t.IntEnum(name="Side", values={"LEFT": 1}), NotConvertible, "no 'Side'"),
        ("abc", t.List(accepted=t.String()), NotConvertible, "a str is no List"),
        ([1, "x"], t.List(accepted=t.Int()), NotConvertible, r"^\[1\]: a str is no Int"),
        ([1], t.Pair(first=t.Int(), second=t.Int()), NotConvertible, "1 elements are not the 2"),
        ({"a": {"b": "x"}}, t.Dict(accepted=t.Dict(accepted=t.Int())), NotConvertible, "^a.b: a str"),
        ([], t.Object(name="Cup"), NotConvertible, "a list is no 'Cup'"),
        (np.eye(3), POSE, NotConvertible, "is no NDArray of"),
        ([[1, 2], [3]], POSE, NotConvertible, "rows differ"),
        (["x"], POSE, NotConvertible, "no ARON form"),
        ("x", POSE, NotConvertible, "a str is no NDArray"),
        ([300], t.NDArray(element="uint8"), NotConvertible, "fit into uint8"),
        ([1.5], t.NDArray(element="uint8"), NotConvertible, "fit into uint8"),
        ([-1], t.NDArray(element="uint8"), NotConvertible, "fit into uint8"),
        ([1e300], t.NDArray(element="float32"), NotConvertible, "fit into float32"),
        ([1.0], t.NDArray(element="pcl::PointXYZ"), NotConvertible, "no pcl::PointXYZ"),
    ],
)
def test_what_is_not_of_its_type_is_refused(
    value: Any, type_object: t.TypeObject, error: type[ArmemError], says: str
) -> None:
    with pytest.raises(error, match=says):
        to_aron(value, type_object)


@given(TYPES.flatmap(lambda type_object: st.tuples(st.just(type_object), realizing(type_object))))
def test_python_of_a_type_becomes_the_same_data_again(pair: tuple[t.TypeObject, Data | None]) -> None:
    type_object, data = pair
    back = to_aron(to_python(data, exact=True), type_object)
    assert _as_numpy_names(back) == _as_numpy_names(data)
    assert realizes(back, type_object)


def test_dataclasses_go_there_and_back() -> None:
    cup = Cup(
        Place("table"),
        side=Side.RIGHT,
        weights={"a": 0.5},
        places=(Place("shelf"),),
        pair=(3, "y"),
        note=None,
        raw=Float(1.5),
        count=np.int64(5),
        class_="mug",
        anything=[1, {"a": None}],
        numbers=[1, 2**40],
    )
    data = to_aron(cup)

    assert isinstance(data, Dict)
    assert data.elements["class"] == String("mug")
    assert data.elements["count"] == Long(5)
    assert from_aron(data, Cup) == cup
    assert np.array_equal(from_aron(data, Cup).place.pose, np.eye(4))
    assert type(from_aron(data, Cup).count) is np.int64


def test_dataclasses_read_what_is_there() -> None:
    data = Dict({"place": Dict({"name": String("table"), "more": Int(1)}), "unknown": Int(1)})
    assert from_aron(data, Cup) == Cup(Place("table"))


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (None, r"\(all\) is null"),
        (List([]), "is a List, which cannot be read into Cup"),
        (Dict({}), "place is missing, and Cup has no default"),
        (Dict({"place": Dict({})}), "place.name is missing"),
        (Dict({"place": Dict({"name": Int(1)})}), "place.name is a Int, which cannot be read into str"),
        (Dict({"place": Dict({"name": None})}), "place.name is null"),
        (Dict({"place": Dict({"name": String("")}), "side": Int(9)}), "side is 9, no value of Side"),
        (Dict({"place": Dict({"name": String("")}), "pair": List([Int(1)])}), "pair has 1 elements, not 2"),
        (Dict({"place": Dict({"name": String("")}), "weights": Dict({"a": Int(1)})}), "weights.a is a Int"),
        (Dict({"place": Dict({"name": String("")}), "numbers": List([None])}), r"numbers\[0\] is null"),
    ],
)
def test_dataclasses_refuse_what_is_of_another_kind(data: Data | None, says: str) -> None:
    with pytest.raises(NotRealized, match=says):
        from_aron(data, Cup)


@dataclass
class Odd:
    x: int | str = 1
    y: complex = 1j


def test_annotations_that_say_nothing_are_refused() -> None:
    with pytest.raises(NotConvertible, match="one cannot be chosen"):
        from_aron(Dict({"x": Int(1)}), Odd)
    with pytest.raises(NotConvertible, match="nothing can be read into complex"):
        from_aron(Dict({"y": Int(1)}), Odd)
    with pytest.raises(NotConvertible, match="no dataclass"):
        from_aron(Int(1), int)


def test_images_of_numpy_are_of_the_type_that_armarx_gives() -> None:
    wanted = t.Object(name="Seen", members={"image": image_rgb(4, 2), "depth": image_depth(4, 2)})
    seen = to_aron({"image": np.zeros((2, 4, 3), np.uint8), "depth": np.zeros((2, 4), np.float32)}, wanted)
    assert realizes(seen, wanted).level is Level.FULL
    with pytest.raises(NotConvertible, match=r"\[2, 5, 3\] is no NDArray of \[4, 2, 3\] in either order uint8"):
        to_aron({"image": np.zeros((2, 5, 3), np.uint8)}, wanted)


@pytest.mark.parametrize(
    ("value", "wanted", "words"),
    [
        ({"x": {"y": 2**63}}, None, r"x\.y: 9223372036854775808 does not fit"),
        ({"a": np.array(["x"])}, None, r"a: numpy's elements of type <U1"),
        ({"a": ["x", "\ud800"]}, None, r"a\[1\]: "),
        ({"a": {"\ud800": 1}}, None, r"a: "),
        ([2**70], t.List(accepted=t.Long()), r"\[0\]: 1180591620717411303424 does not fit"),
        (
            {"cls": 2**31},
            t.Object(name="Seen", members={"cls": t.Int()}),
            r"cls: 2147483648 does not fit into 32 bits, and its type is Int: correct it, or have the type say Long",
        ),
        ({"a": [10**400]}, t.Dict(accepted=t.List(accepted=t.Double())), r"a\[0\]: "),
        ({"a": np.array(["x"])}, t.Dict(accepted=t.NDArray()), r"a: numpy's elements"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_path_once(
    value: object, wanted: t.TypeObject | None, words: str
) -> None:
    with pytest.raises(ArmemError, match=f"^{words}") as refused:
        to_aron(value, wanted)
    path = words.partition(": ")[0].replace("\\", "")
    assert str(refused.value).count(f"{path}: ") == 1


SIDES = t.IntEnum(name="Sides", values={"LEFT": 1, "RIGHT": 2})


def test_a_value_that_an_enumeration_does_not_have_is_refused() -> None:
    assert to_aron([1, Side.RIGHT, "LEFT"], t.List(accepted=SIDES)) == List([Int(1), Int(2), Int(1)])
    for wrong in (7, 2**31, np.int32(3), "MIDDLE"):
        with pytest.raises(NotConvertible, match=r"side: .* is no 'Sides': it has LEFT \(1\), RIGHT \(2\)"):
            to_aron({"side": wrong}, t.Object(name="Hand", members={"side": SIDES}))
