"""Generated dataclasses: at run time and as text they are the same, and read what is only partially of their type."""

from __future__ import annotations

import enum
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.aron.class_names import class_names, field_names, identifier
from armem_bridge.aron.data import Data, Dict, Double, Float, Int, List, Long, String
from armem_bridge.aron.definitions import parse_definitions
from armem_bridge.aron.generation import generate
from armem_bridge.aron.realization import Level, realizes
from armem_bridge.aron.records import Record
from armem_bridge.aron.source_text import generate_source
from armem_bridge.errors import InvalidTypeObject, NotConvertible, NotRealized
from tests.armem.aron.listings import LISTINGS
from tests.armem.aron.strategies import TYPES, realizing

ODD = t.Object(
    name="odd names::class",
    members={
        "class": t.Int(),
        "a b": t.String(maybe=True),
        "1": t.List(accepted=t.Int()),
        "": t.Dict(accepted=t.Double()),
        "to_aron": t.Tuple(accepted=(t.Int(), t.String())),
        "list": t.List(accepted=t.IntEnum(name="Side", values={"import": 3, "name": 4, "__x__": 5, "mro": 6})),
        "field": t.Any(),
        "__private": t.Any(maybe=True),
        'x\'"""\n': t.Pair(first=t.Bool(), second=t.NDArray(element="pcl::PointXYZ")),
        "Side": t.Long(),
    },
)


def listings() -> dict[str, t.TypeObject]:
    known: dict[str, t.TypeObject] = {}
    for text in LISTINGS.values():
        known |= parse_definitions(text, known=known)
    return known


def module_of(text: str) -> ModuleType:
    """The module that a text is, as if it were imported from a file."""
    module = ModuleType("generated_for_a_test")
    sys.modules[module.__name__] = module
    exec(compile(text, "generated_for_a_test.py", "exec"), module.__dict__)  # noqa: S102 - our own text
    return module


@pytest.fixture(autouse=True)
def no_module_left() -> Iterator[None]:
    yield
    sys.modules.pop("generated_for_a_test", None)


def both(*type_objects: t.TypeObject) -> list[dict[str, type]]:
    """The classes as made at run time, and as defined by the text."""
    module = module_of(generate_source(*type_objects))
    return [generate(*type_objects), {name: getattr(module, name) for name in module.__all__}]


def test_the_class_of_listing_4_2() -> None:
    for classes in both(*parse_definitions(LISTINGS["4.1"]).values()):
        assert issubclass(classes["UserCommand"], Record)
        command_class: Any = classes["UserCommand"]
        command = command_class(cmd="bring me the cup")
        assert command_class().cmd == ""
        assert command.to_aron() == Dict({"cmd": String("bring me the cup")})
        assert command_class.from_aron(command.to_aron()) == command != command_class()
        assert command_class.type_object == t.Object(name="example::dto::UserCommand", members={"cmd": t.String()})


def test_all_listings_and_aliases_have_classes() -> None:
    made, written = both(*listings().values(), *ALIASES.values())
    assert made.keys() == written.keys()
    assert len(made) > 40
    for name, one in made.items():
        other = written[name]
        if issubclass(one, enum.IntEnum):
            assert issubclass(other, enum.IntEnum)
            assert one.__members__ == other.__members__
            continue
        assert issubclass(one, Record)
        assert issubclass(other, Record)
        assert is_dataclass(one)
        assert is_dataclass(other)
        assert one.type_object == other.type_object
        assert [(each.name, each.metadata) for each in fields(one)] == [(e.name, e.metadata) for e in fields(other)]
        assert one().to_aron() == other().to_aron()
        assert realizes(one().to_aron(), one.type_object).level is Level.FULL
        assert one.from_aron(one().to_aron()) == one()


def test_types_of_one_name_in_two_places_get_both_names() -> None:
    names = set(class_names([*listings().values(), ALIASES["KnownGrasp"], ALIASES["MemoryID"]]).values())
    assert {"example_dto_KnownGrasp", "KnownGrasp", "armem_dto_MemoryID", "MemoryID", "Object"} <= names


def test_values_may_be_set_and_arrays_begin_with_zeros() -> None:
    for classes in both(listings()["example::dto::Object"]):
        thing: Any = classes["Object"]()
        assert thing.position.global_pose.shape == (4, 4)
        assert not thing.position.global_pose.any()
        thing.position.global_pose = np.eye(4)
        thing.position.name = "table"
        assert realizes(thing.to_aron(), thing.type_object).level is Level.FULL
        assert classes["Object"]().position.name == "", "defaults are not shared"
        thing.name = 3
        with pytest.raises(NotConvertible, match=r"name: an? int is no String"):
            thing.to_aron()


def test_partially_realized_data_are_read() -> None:
    cup = t.Object(
        name="Cup",
        members={"handles": t.Int(), "weight": t.Float(maybe=True)},
        extends=t.Object(name="Thing", members={"name": t.String()}),
    )
    for classes in both(cup):
        cup_class: Any = classes["Cup"]
        assert issubclass(cup_class, classes["Thing"])
        assert cup_class.from_aron(Dict({"name": String("mug"), "colour": String("red")})) == cup_class(name="mug")
        assert cup_class.from_aron(Dict({"weight": Float(0.5)})) == cup_class(weight=0.5)
        assert cup_class(weight=0.1).to_aron() == Dict({"name": String(""), "handles": Int(0), "weight": Float(0.1)})
        assert cup_class() != classes["Thing"]()
        for data, says in (
            (Dict({"handles": String("two")}), "handles is a String, which cannot be read into int"),
            (Dict({"handles": None}), "handles is null"),
            (Dict({"weight": Int(1)}), "weight is a Int"),
            (List([]), "is a List"),
            (None, "is null"),
        ):
            with pytest.raises(NotRealized, match=says):
                cup_class.from_aron(data)


def test_odd_names() -> None:
    for classes in both(ODD):
        odd: Any = classes["class_"]
        one = odd(class_=3, a_b=None, list=[classes["Side"](4)], Side=2**40, _private={"x": 1})
        data = one.to_aron()
        assert list(data.elements) == list(ODD.members)
        assert data.elements["class"] == Int(3)
        assert data.elements["list"] == List([Int(4)])
        assert data.elements["Side"] == Long(2**40)
        assert realizes(data, ODD).level is Level.FULL
        assert odd.from_aron(data) == one
        assert odd.from_aron(data).list[0] is classes["Side"](4)
        assert one.to_aron_ == (0, "")


@pytest.mark.parametrize(
    ("name", "becomes"),
    [
        ("cup", "cup"),
        ("class", "class_"),
        ("a b-c", "a_b_c"),
        ("1", "_1"),
        ("", "unnamed_0"),
        ("_", "unnamed_1"),
        ("__", "unnamed_2"),
        ("__x__", "_x"),
        ("größe", "größe"),
        ("ﬁ", "fi"),
        ("²", "_2"),
        ("🤖", "unnamed_1"),
        ("x²", "x2"),
        ("None", "None_"),
    ],
)
def test_identifiers(name: str, becomes: str) -> None:
    assert identifier(name) == becomes
    assert becomes.isidentifier()


@given(st.text(max_size=8))
def test_every_name_becomes_an_identifier(name: str) -> None:
    assert identifier(name).isidentifier()


@pytest.mark.parametrize(
    ("type_objects", "says"),
    [
        ([t.Object(name="A", members={"a b": t.Int(), "a_b": t.Int()})], "two names of 'A'"),
        ([t.IntEnum(name="E", values={"a b": 1, "a_b": 2})], "two names of 'E'"),
        ([t.Object(name="A"), t.Object(name="A", members={"x": t.Int()})], "would both become the class 'A'"),
        ([t.Object(name="x::A"), t.Object(name="x::A", members={"x": t.Int()})], "would both become the class 'A'"),
        ([int], "from type objects"),
    ],
)
def test_names_that_would_fall_together_are_refused(type_objects: list[Any], says: str) -> None:
    for make in (generate, generate_source):
        with pytest.raises(InvalidTypeObject, match=says):
            make(*type_objects)


def test_values_of_all_names_become_values() -> None:
    names = ["a", "0", "0:", "_x_", "__z", "_Side__y", "_Side__", "name", "mro", "real", "_order_", "class", ""]
    side = t.IntEnum(name="Side", values={name: value for value, name in enumerate(names)})
    for classes in both(side):
        made: Any = classes["Side"]
        assert sorted(made) == list(range(len(names)))
        assert made["v_0_"] is made(2)


def test_inherited_members_keep_their_names() -> None:
    base = t.Object(name="Base", members={"a b": t.Int()})
    with pytest.raises(InvalidTypeObject, match="two names"):
        field_names(t.Object(name="More", members={"a_b": t.Int()}, extends=base))


def test_types_without_names_are_named_by_their_place() -> None:
    inner = t.List(accepted=t.Object(name="", members={"x": t.Double()}))
    for classes in both(t.Object(name="Outer", members={"points": inner})):
        outer: Any = classes["Outer"]
        assert set(classes) == {"Outer", "OuterPoints"}
        read = outer.from_aron(Dict({"points": List([Dict({"x": Double(0.5)})])}))
        assert read.points[0].x == 0.5


@given(TYPES, st.data())
def test_any_data_of_any_object_type_go_through_its_class(type_object: t.TypeObject, data: st.DataObject) -> None:
    type_object = t.Object(name="Whole", members={"part": type_object})
    try:
        made, written = both(type_object)
    except InvalidTypeObject:
        # Random names may fall together; the tests above say when.
        return
    given_data: Data = data.draw(realizing(type_object))
    for classes in (made, written):
        whole: Any = classes["Whole"]
        back = whole.from_aron(given_data).to_aron()
        assert realizes(back, type_object).level is Level.FULL
        assert whole.from_aron(back) == whole.from_aron(given_data)


def test_the_text_is_a_module_to_keep(tmp_path: Path) -> None:
    path = tmp_path / "types_of_mine.py"
    path.write_text(generate_source(*listings().values()))
    text = path.read_text()
    assert text.startswith('"""Dataclasses of ARON type definitions')
    assert "class UserCommand(Record):" in text
    assert generate_source(*listings().values()) == text
