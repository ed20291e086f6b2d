"""When data realize a type: truth tables written by hand, with pairs that tell neighbouring rules apart."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.sensing import image_depth, image_rgb
from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.introspection import infer
from armem_bridge.aron.realization import Level, fits, realizes, show_path
from armem_bridge.errors import NotRealized
from tests.armem.aron.strategies import DATA, TYPES, realizing

FULL, PARTIAL, NO = Level.FULL, Level.PARTIAL, Level.NO

X_Y = t.Object(name="T1", members={"x": t.Int(), "y": t.Float()})
X_Y_Z = t.Object(name="T3", members={"z": t.String(maybe=True)}, extends=X_Y)
SIDE = t.IntEnum(name="Side", values={"LEFT": 0, "RIGHT": 1})
POSE = t.NDArray(shape=(4, 4), element="float32")
IMAGE = t.NDArray(shape=(None, None, 3), element="uint8")
INTS = t.List(accepted=t.Int())
MAYBE_INTS = t.List(accepted=t.Int(maybe=True))
TUPLE = t.Tuple(accepted=(t.Int(), t.String()))
PAIR = t.Pair(first=t.Int(), second=t.String())

ONE: dict[str, Data | None] = {"x": Int(0), "y": Float(1.0)}


def array(*shape: int, element: str) -> NDArray:
    size = 1
    for extent in shape:
        size *= extent
    return NDArray(shape, element, bytes(size))


@pytest.mark.parametrize(
    ("data", "type_object", "level"),
    [
        # The examples of section 4.3.2: D1 to D4.
        (Dict(ONE), X_Y, FULL),
        (Dict({**ONE, "s": String("abc")}), X_Y, PARTIAL),
        (Dict({"x": String("abc")}), X_Y, NO),
        (None, t.String(maybe=True), FULL),
        (None, X_Y, NO),
        # Kinds are never converted.
        (Int(1), t.Int(), FULL),
        (Int(1), t.Long(), NO),
        (Long(1), t.Int(), NO),
        (Long(1), t.Long(), FULL),
        (Float(1.0), t.Float(), FULL),
        (Float(1.0), t.Double(), NO),
        (Double(1.0), t.Double(), FULL),
        (Double(1.0), t.Float(), NO),
        (Int(1), t.Double(), NO),
        (Bool(True), t.Bool(), FULL),
        (Bool(True), t.Int(), NO),
        (Int(1), t.Bool(), NO),
        (String("1"), t.String(), FULL),
        (String("1"), t.Int(), NO),
        (Int(1), t.String(), NO),
        # Null.
        *((None, kind(), NO) for kind in (t.String, t.Bool, t.Int, t.Long, t.Float, t.Double, t.NDArray, t.Any)),
        *((None, kind(maybe=True), FULL) for kind in (t.Bool, t.Int, t.Long, t.Float, t.Double, t.NDArray, t.Any)),
        (None, t.as_maybe(X_Y), FULL),
        (None, t.as_maybe(SIDE), FULL),
        (None, t.as_maybe(INTS), FULL),
        (None, t.as_maybe(TUPLE), FULL),
        (None, INTS, NO),
        (List([None]), INTS, NO),
        (List([None]), MAYBE_INTS, FULL),
        (None, MAYBE_INTS, NO),
        (Dict({"a": None}), t.Dict(accepted=t.Int()), NO),
        (Dict({"a": None}), t.Dict(accepted=t.Int(maybe=True)), FULL),
        (Dict({"x": None, "y": Float(1.0)}), X_Y, NO),
        # Members: missing, extra, both, inherited, nested.
        (Dict({"x": Int(0)}), X_Y, PARTIAL),
        (Dict({}), X_Y, PARTIAL),
        (Dict({"s": Int(0)}), X_Y, PARTIAL),
        (Dict({"s": None, **ONE}), X_Y, PARTIAL),
        (Dict({}), t.Object(name="Empty"), FULL),
        (Dict({**ONE, "z": String("")}), X_Y_Z, FULL),
        (Dict({**ONE, "z": None}), X_Y_Z, FULL),
        (Dict(ONE), X_Y_Z, PARTIAL),
        (Dict({"z": None}), X_Y_Z, PARTIAL),
        (Dict({"x": Long(0), "y": Float(1.0), "z": None}), X_Y_Z, NO),
        (Dict({**ONE, "z": None}), X_Y, PARTIAL),
        (List([Dict(ONE), Dict({"x": Int(1)})]), t.List(accepted=X_Y), PARTIAL),
        (List([Dict(ONE), Dict({"x": Bool(True)})]), t.List(accepted=X_Y), NO),
        (List([Dict(ONE), Dict(ONE)]), t.List(accepted=X_Y), FULL),
        # Containers.
        (List([]), INTS, FULL),
        (List([Int(1), Int(2)]), INTS, FULL),
        (List([Int(1), Long(2)]), INTS, NO),
        (Dict({}), INTS, NO),
        (List([]), X_Y, NO),
        (List([]), t.Dict(accepted=t.Int()), NO),
        (Dict({}), t.Dict(accepted=t.Int()), FULL),
        (Dict({"a": Int(1), "b c": Int(2)}), t.Dict(accepted=t.Int()), FULL),
        (Dict({"a": Int(1), "b": Float(2)}), t.Dict(accepted=t.Int()), NO),
        (List([Int(1), String("")]), TUPLE, FULL),
        (List([String(""), Int(1)]), TUPLE, NO),
        (List([Int(1)]), TUPLE, NO),
        (List([Int(1), String(""), Int(1)]), TUPLE, NO),
        (List([]), t.Tuple(accepted=()), FULL),
        (List([Int(1), String("")]), PAIR, FULL),
        (List([String(""), Int(1)]), PAIR, NO),
        (List([Int(1)]), PAIR, NO),
        (Dict({"0": Int(1), "1": String("")}), PAIR, NO),
        # Enumerations.
        (Int(0), SIDE, FULL),
        (Int(1), SIDE, FULL),
        (Int(2), SIDE, NO),
        (Long(0), SIDE, NO),
        (String("LEFT"), SIDE, NO),
        # Any.
        *((data, t.Any(), FULL) for data in (Int(1), Dict(ONE), List([None]), array(1, 1, element="?"))),
        # Arrays: elements and their synonyms.
        (array(4, 4, 4, element="float32"), POSE, FULL),
        (array(4, 4, 4, element="float"), POSE, FULL),
        (array(4, 4, 4, element="float32"), t.NDArray(shape=(4, 4), element="float"), FULL),
        (array(4, 4, 8, element="float64"), POSE, NO),
        (array(4, 4, 8, element="double"), POSE, NO),
        (array(4, 4, 8, element="double"), t.NDArray(shape=(4, 4), element="float64"), FULL),
        (array(4, 4, 4, element="int32"), POSE, NO),
        (array(4, 4, 4, element="mystery"), t.NDArray(shape=(4, 4)), FULL),
        (array(4, 4, 4, element="mystery"), t.NDArray(element="mystery"), FULL),
        (array(4, 4, 4, element="mystery"), t.NDArray(element="Mystery"), NO),
        (Int(1), POSE, NO),
        (List([Float(1.0)]), POSE, NO),
        # Arrays: extents.
        (array(4, 3, 4, element="float32"), POSE, NO),
        (array(16, 4, element="float32"), POSE, NO),
        (array(4, 4, 2, 4, element="float32"), POSE, NO),
        (array(4, 4, 1, 4, element="float32"), POSE, FULL),
        (array(1, 4, 4, 4, element="float32"), POSE, FULL),
        (array(4, 1, 4, 4, element="float32"), POSE, NO),
        (array(3, 4, element="float32"), t.NDArray(shape=(3,), element="float32"), FULL),
        (array(3, 1, 4, element="float32"), t.NDArray(shape=(3,), element="float32"), FULL),
        (array(1, 3, 4, element="float32"), t.NDArray(shape=(3, 1), element="float32"), FULL),
        (array(1, 4, element="float32"), t.NDArray(shape=(3,), element="float32"), NO),
        (array(4, element="float32"), t.NDArray(shape=()), FULL),
        (array(2, 4, element="float32"), t.NDArray(shape=()), NO),
        (NDArray((), "float32", b""), t.NDArray(), FULL),
        # Images, as ArmarX and as OpenCV have them.
        # Width and height in either order: ArmarX says width x height, numpy has height x width.
        (array(640, 480, 3, 1, element="uint8"), image_rgb(640, 480), FULL),
        (array(480, 640, 3, 1, element="uint8"), image_rgb(640, 480), FULL),
        (array(480, 640, 3, element="16"), image_rgb(640, 480), FULL),
        (array(3, 640, 480, 1, element="uint8"), image_rgb(640, 480), NO),
        (array(480, 480, 3, 1, element="uint8"), image_rgb(640, 480), NO),
        (array(480, 640, 4, element="float32"), image_depth(640, 480), FULL),
        (array(480, 640, 1, 4, element="float32"), image_depth(640, 480), FULL),
        (array(640, 640, 4, element="float32"), image_depth(640, 480), NO),
        (array(480, 640, 4, element="float32"), t.NDArray(shape=(640, 480)), NO),
        (array(640, 480, 3, 1, element="uint8"), IMAGE, FULL),
        (array(480, 640, 3, element="16"), IMAGE, FULL),
        (array(480, 640, 3, 1, element="16"), IMAGE, FULL),
        (array(640, 480, 4, 1, element="uint8"), IMAGE, NO),
        (array(640, 480, 1, element="uint8"), IMAGE, NO),
        (array(640, 480, 1, 4, element="float32"), t.NDArray(shape=(640, 480, 1), element="float32"), FULL),
        (array(640, 480, 4, element="float32"), t.NDArray(shape=(640, 480, 1), element="float32"), FULL),
        (array(480, 640, 4, element="float32"), t.NDArray(shape=(640, 480, 1), element="float32"), NO),
    ],
)
def test_the_truth_table(data: Data | None, type_object: t.TypeObject, level: Level) -> None:
    found = realizes(data, type_object)

    assert found.level is level, found.explain()
    assert bool(found) is (level is not NO)
    assert bool(found.explain()) is (level is not FULL)


def test_the_paths_are_named() -> None:
    inner = t.Object(name="Inner", members={"a": t.Int(), "b": t.Int(), "d": t.String()})
    outer = t.Object(name="Outer", members={"list": t.List(accepted=inner), "n": t.Int()})
    data = Dict({"list": List([Dict({"a": Int(1), "b": Long(1), "c d": Int(1)})]), "n": None, "more": Int(1)})

    found = realizes(data, outer)

    assert found.level is NO
    assert found.extra == (("list", 0, "c d"), ("more",))
    assert found.missing == (("list", 0, "d"),)
    assert [path for path, _ in found.wrong] == [("list", 0, "b"), ("n",)]
    assert found.explain() == (
        "wrong: list[0].b is a Long, and its type Int, n is null, and Int allows none; "
        "missing: list[0].d; extra: list[0]['c d'], more"
    )
    with pytest.raises(NotRealized, match=r"instance 3 is not of its type: wrong: list\[0\].b"):
        found.require("instance 3")
    realizes(Dict({"n": Int(1)}), outer).require("what is partial is no error")


def test_many_paths_are_counted() -> None:
    data = List([String("x")] * 100)
    assert realizes(data, INTS).explain().endswith("[4] is a String, and its type Int and 95 more")
    assert show_path(()) == "(all)"


@given(TYPES.flatmap(lambda type_object: st.tuples(st.just(type_object), realizing(type_object))))
def test_data_made_for_a_type_realize_it(pair: tuple[t.TypeObject, Data | None]) -> None:
    type_object, data = pair
    found = realizes(data, type_object)
    assert found.level is FULL, found.explain()


@given(TYPES.flatmap(lambda type_object: st.tuples(st.just(type_object), realizing(type_object))))
def test_leaving_out_and_adding_members_is_partial(pair: tuple[t.TypeObject, Data | None]) -> None:
    type_object, data = pair
    if isinstance(type_object, t.Object) and isinstance(data, Dict):
        more = Dict({**data.elements, "a name that no type has": None})
        assert realizes(more, type_object).extra == (("a name that no type has",),)
        for name in data.elements:
            fewer = Dict({key: element for key, element in data.elements.items() if key != name})
            assert realizes(fewer, type_object).missing == ((name,),)


@given(DATA | st.none())
def test_introspection_finds_a_type_that_the_data_realize(data: Data | None) -> None:
    found = realizes(data, infer(data))
    assert found.level is FULL, found.explain()


@pytest.mark.parametrize(
    ("data", "inferred"),
    [
        (None, t.Any(maybe=True)),
        (Int(1), t.Int()),
        (Float(1.0), t.Float()),
        (List([]), t.List(accepted=t.Any(maybe=True))),
        (List([None]), t.List(accepted=t.Any(maybe=True))),
        (List([Int(1), Int(2)]), INTS),
        (List([Int(1), None, Int(2)]), MAYBE_INTS),
        (List([Int(1), Long(2)]), t.List(accepted=t.Any())),
        (List([Int(1), Long(2), None]), t.List(accepted=t.Any(maybe=True))),
        (List([List([Int(1)]), List([None])]), t.List(accepted=t.List(accepted=t.Any(maybe=True)))),
        (Dict(ONE), t.Object(name="", members=X_Y.members)),
        (
            List([Dict(ONE), Dict({"y": Float(0), "x": Int(1)})]),
            t.List(accepted=t.Object(name="", members=X_Y.members)),
        ),
        (List([Dict(ONE), Dict({"x": Int(1)})]), t.List(accepted=t.Any())),
        (
            List([Dict({"a": Int(1)}), Dict({"a": String("x")})]),
            t.List(accepted=t.Object(name="", members={"a": t.Any()})),
        ),
        (array(2, 2, 4, element="float"), t.NDArray(shape=(2, 2), element="float32")),
        (
            List([array(2, 2, 4, element="float"), array(2, 3, 4, element="float32")]),
            t.List(accepted=t.NDArray(shape=(2, None), element="float32")),
        ),
        (List([array(2, 1, element="a"), array(2, 2, 1, element="b")]), t.List(accepted=t.NDArray())),
        (array(2, 2, 3, element="16"), t.NDArray(shape=(2, 2, 3), element="uint8")),
        (array(2, 3, 1, element="16"), t.NDArray(shape=(2, 3), element="uint8")),
    ],
)
def test_introspection(data: Data | None, inferred: t.TypeObject) -> None:
    assert infer(data) == inferred


def test_introspection_gives_the_outermost_object_a_name() -> None:
    found = infer(Dict({"inner": Dict({})}), name="Outer")
    assert found == t.Object(name="Outer", members={"inner": t.Object(name="")})


@given(st.lists(st.integers(0, 3), max_size=4), st.lists(st.none() | st.integers(0, 3), max_size=4))
def test_ones_at_the_ends_do_not_count(extents: list[int], pattern: list[int | None]) -> None:
    expected = fits(tuple(extents), tuple(pattern))
    assert fits((1, *extents), tuple(pattern)) is expected
    assert fits((*extents, 1), tuple(pattern)) is expected
    assert fits(tuple(extents), (1, *pattern)) is expected
    assert fits(tuple(extents), (*pattern, 1)) is expected
    assert fits(tuple(extents), tuple(extents))
