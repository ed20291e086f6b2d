"""Which type can stand for which: by hand, and by what data realize."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.sensing import image_rgb
from armem_bridge.aron.data import Data
from armem_bridge.aron.inheritance import faults, is_base_of
from armem_bridge.aron.realization import parts_of, realizes
from armem_bridge.errors import InvalidTypeObject
from tests.armem.aron.strategies import TYPES, realizing

wrong: Any = t
"""The same module without its annotations, for what they rule out."""

THING = t.Object(name="Thing", members={"name": t.String(), "weight": t.Float(maybe=True)})
CUP = t.Object(name="Cup", members={"handle": t.Bool()}, extends=THING)
NOT_SAID = t.Object(name="Cup", members={**THING.members, "handle": t.Bool()})
SIDES = t.IntEnum(name="Side", values={"L": 0, "R": 1})


@pytest.mark.parametrize(
    ("base", "extending", "is_base"),
    [
        (THING, THING, True),
        (THING, CUP, True),
        (CUP, THING, False),
        (THING, NOT_SAID, True),
        (CUP, NOT_SAID, True),
        (NOT_SAID, CUP, True),
        (THING, t.Object(name="Thing", members={"name": t.String()}), False),
        (THING, t.Object(name="Thing", members={"name": t.Int(), "weight": t.Float()}), False),
        (THING, t.Object(name="Thing", members={"name": t.String(), "weight": t.Float()}), True),
        (THING, t.Object(name="Thing", members={"name": t.String(maybe=True), "weight": t.Float()}), False),
        (t.Object(name=""), THING, True),
        (t.Int(), t.Int(), True),
        (t.Int(maybe=True), t.Int(), True),
        (t.Int(), t.Int(maybe=True), False),
        (t.Int(), t.Long(), False),
        (t.Long(), t.Int(), False),
        (t.Int(), SIDES, True),
        (SIDES, t.Int(), False),
        (SIDES, t.IntEnum(name="Other", values={"LEFT": 0}), True),
        (SIDES, t.IntEnum(name="Side", values={"L": 0, "R": 1, "M": 2}), False),
        (t.Any(), THING, True),
        (t.Any(), t.as_maybe(THING), False),
        (t.Any(maybe=True), t.as_maybe(THING), True),
        (THING, t.Any(), False),
        (t.List(accepted=THING), t.List(accepted=CUP), True),
        (t.List(accepted=CUP), t.List(accepted=THING), False),
        (t.Dict(accepted=t.Int()), t.Dict(accepted=t.Int()), True),
        (t.Dict(accepted=t.Int()), t.Dict(accepted=t.Float()), False),
        (t.Dict(accepted=t.String()), t.Object(name="", members={"name": t.String()}), False),
        (t.Object(name=""), t.Dict(accepted=t.Int()), False),
        (t.List(accepted=t.Int()), t.Tuple(accepted=(t.Int(),)), False),
        (t.Tuple(accepted=(t.Int(), THING)), t.Pair(first=t.Int(), second=CUP), True),
        (t.Pair(first=t.Int(), second=CUP), t.Tuple(accepted=(t.Int(), THING)), False),
        (t.Tuple(accepted=(t.Int(),)), t.Tuple(accepted=(t.Int(), t.Int())), False),
        (t.NDArray(), t.NDArray(shape=(4, 4), element="float32"), True),
        (t.NDArray(shape=(4, 4), element="float32"), t.NDArray(), False),
        (t.NDArray(shape=(None, None, 3)), t.NDArray(shape=(1920, 1080, 3), element="uint8"), True),
        (t.NDArray(shape=(1920, 1080, 3)), t.NDArray(shape=(None, None, 3)), False),
        (image_rgb(640, 480), t.NDArray(shape=(480, 640, 3), element="uint8"), True),
        (image_rgb(), image_rgb(640, 480), True),
        (image_rgb(640, 480), image_rgb(480, 640), True),
        (t.NDArray(shape=(640, 480, 3), element="uint8"), image_rgb(640, 480), False),
        (image_rgb(640, 480), t.NDArray(shape=(480, 480, 3), element="uint8"), False),
        (t.NDArray(element="float"), t.NDArray(element="float32"), True),
        (t.NDArray(element="float"), t.NDArray(element="double"), False),
        (t.NDArray(element="float"), t.NDArray(), False),
    ],
)
def test_the_truth_table(base: t.TypeObject, extending: t.TypeObject, is_base: bool) -> None:
    assert is_base_of(base, extending) is is_base
    assert bool(faults(base, extending)) is not is_base


def test_the_faults_are_named() -> None:
    other = t.Object(name="Other", members={"weight": t.Double(), "place": t.List(accepted=t.Int())})
    base = t.Object(name="Base", members={"weight": t.Float(), "name": t.String(), "place": t.List(accepted=t.Long())})
    assert faults(base, other) == (
        "weight is Double, not Float",
        "name is missing in 'Other'",
        "place[0] is Int, not Long",
    )


@given(TYPES, TYPES, st.data())
def test_what_realizes_a_type_realizes_its_bases(
    base: t.TypeObject, extending: t.TypeObject, data: st.DataObject
) -> None:
    assert is_base_of(base, base)
    if is_base_of(base, extending):
        made: Data | None = data.draw(realizing(extending))
        assert realizes(made, base), realizes(made, base).explain()


def loosened(draw: st.DrawFn, type_object: t.TypeObject) -> t.TypeObject:
    """A type that asks for less: null, any extents or elements, fewer members, anything."""
    maybe = type_object.maybe or draw(st.booleans())
    if draw(st.integers(0, 4)) == 0:
        return t.Any(maybe=maybe)
    match type_object:
        case t.Object():
            kept = {name: member for name, member in type_object.all_members.items() if draw(st.booleans())}
            members = {name: loosened(draw, member) for name, member in kept.items()}
            return t.Object(name="Loosened", members=members, maybe=maybe)
        case t.List():
            return t.List(accepted=loosened(draw, type_object.accepted), maybe=maybe)
        case t.Dict():
            return t.Dict(accepted=loosened(draw, type_object.accepted), maybe=maybe)
        case t.Tuple() | t.Pair():
            parts = [loosened(draw, part) for part in parts_of(type_object)]
            return t.Tuple(accepted=parts, maybe=maybe)
        case t.NDArray():
            shape = type_object.shape
            if shape is not None:
                shape = tuple(draw(st.sampled_from([None, extent])) for extent in shape)
            return t.NDArray(shape=draw(st.sampled_from([None, shape])), element="", maybe=maybe)
        case t.IntEnum():
            other = {"more": next(number for number in range(100) if number not in type_object.numbers)}
            values = {f"_{number}": number for number in type_object.numbers}
            return t.IntEnum(name="", values={**values, **other}, maybe=maybe)
        case _:
            return t.as_maybe(type_object, maybe=maybe)


@given(TYPES, st.data())
def test_a_type_that_asks_for_less_is_a_base(extending: t.TypeObject, data: st.DataObject) -> None:
    base = data.draw(st.composite(loosened)(extending))
    assert is_base_of(base, extending), faults(base, extending)
    made: Data | None = data.draw(realizing(extending))
    assert realizes(made, base), realizes(made, base).explain()


@given(TYPES, st.data())
def test_data_of_an_extended_object_realize_it(base: t.TypeObject, data: st.DataObject) -> None:
    if isinstance(base, t.Object):
        extending = t.Object(name="More", members={"a name that no type has": t.Int()}, extends=base)
        assert is_base_of(base, extending)
        assert not is_base_of(extending, base)
        assert realizes(data.draw(realizing(extending)), base).extra == (("a name that no type has",),)


def test_members_are_flattened_along_the_chain() -> None:
    mug = t.Object(name="Mug", members={"lid": t.Bool()}, extends=CUP)
    assert list(mug.all_members) == ["name", "weight", "handle", "lid"]
    assert mug.all_members["weight"] == t.Float(maybe=True)
    assert mug.depth == 4 - 1


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: wrong.Object(name="X", members={"name": t.Int()}, extends=THING), "defines .'name'. that it inherits"),
        (lambda: wrong.Object(name="X", extends=SIDES), "extends an object type"),
        (lambda: wrong.Object(name="X", members={"a": int}), "made of type objects"),
        (lambda: wrong.Object(name="X", members={1: t.Int()}), "are text"),
        (lambda: wrong.Object(name=3), "are text"),
        (lambda: wrong.List(accepted=None), "made of type objects"),
        (lambda: wrong.Tuple(accepted=[1]), "made of type objects"),
        (lambda: wrong.Pair(first=t.Int(), second="x"), "made of type objects"),
        (lambda: wrong.IntEnum(name="E", values={}), "no values"),
        (lambda: wrong.IntEnum(name="E", values={"a": 1, "b": 1}), "two names"),
        (lambda: wrong.IntEnum(name="E", values={"a": 2**31}), "32-bit"),
        (lambda: wrong.IntEnum(name="E", values={"a": True}), "32-bit"),
        (lambda: wrong.NDArray(shape=(-1,)), "counts or None"),
        (lambda: wrong.NDArray(shape=(True,)), "counts or None"),
        (lambda: wrong.NDArray(shape=(1,) * 65), "at most 64"),
    ],
)
def test_types_that_contradict_themselves_are_refused(make: object, says: str) -> None:
    assert callable(make)
    with pytest.raises(InvalidTypeObject, match=says):
        make()


def test_nesting_is_bounded() -> None:
    nested: t.TypeObject = t.Int()
    for _ in range(t.DEPTH_LIMIT):
        nested = t.List(accepted=nested)
    assert is_base_of(nested, nested)
    with pytest.raises(InvalidTypeObject, match="nest deeper than 200"):
        t.Object(name="X", members={"a": nested})
