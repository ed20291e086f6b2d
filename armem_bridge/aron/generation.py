"""Dataclasses generated from type objects at run time (section 4.3.3, listing 4.2).

Each object type becomes a dataclass whose fields have defaults, each enumeration an IntEnum. A class has
`type_object`, `to_aron()` and `from_aron(data)`; data that realize the type partially are read too, and
the members that are missing keep their defaults. What the object extends becomes the base class.
`aron.source_text` writes the same classes as the text of a module.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import field, make_dataclass
from functools import partial
from typing import Any, Final

import numpy as np

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import plain_dtype
from armem_bridge.aron.class_names import Named, class_names, field_names, plain, value_names
from armem_bridge.aron.data import NDArray
from armem_bridge.aron.links import MICROSECONDS, unset_member
from armem_bridge.aron.realization import parts_of
from armem_bridge.aron.records import Record

PRIMITIVES: Final[dict[type, Any]] = {
    t.String: str,
    t.Bool: bool,
    t.Int: int,
    t.Long: int,
    t.Float: float,
    t.Double: float,
}
"""What the values of primitive types are in Python."""


def generate(*type_objects: t.TypeObject) -> dict[str, type]:
    """The classes of object types and enumerations, and of those inside them, by the classes' names.

    `class_names` says how they are named. Members whose names are no identifiers of Python, or are taken,
    get `_` for each sign or after the name; in the data they keep theirs. An array begins with zeros, an
    enumeration with its first value, a maybe type with None, Any with an empty dict; a DateTime and the instance
    of a MemoryID begin as not set (`aron.links`).

    Raises `InvalidTypeObject` when two different types would have one name.
    """
    made: dict[Named, Any] = {}
    for type_object, name in class_names(type_objects).items():
        match type_object:
            case t.IntEnum():
                names = value_names(type_object)
                made[type_object] = enum.IntEnum(name, {names[key]: value for key, value in type_object.values.items()})
            case t.Object():
                made[type_object] = _make(name, type_object, made)
    return {cls.__name__: cls for cls in made.values()}


def default_array(type_object: t.NDArray) -> Any:
    """The array that a field of this type begins with: zeros, with 0 for the extents that may be any."""
    dtype = plain_dtype(type_object.element)
    if dtype is None:
        return NDArray((), type_object.element, b"")
    return np.zeros([extent or 0 for extent in type_object.shape or (0,)], dtype)


def _make(name: str, type_object: t.Object, made: dict[Named, Any]) -> type:
    names = field_names(type_object)
    members = [
        (
            names[key],
            _annotation(member, made),
            field(default_factory=_begin(type_object, key, made), metadata={} if names[key] == key else {"aron": key}),
        )
        for key, member in type_object.members.items()
    ]
    base = Record if type_object.extends is None else made[plain(type_object.extends)]
    description = f"{type_object.name or name}, as its type object says."
    namespace = {"type_object": type_object, "__doc__": description, "__module__": __name__}
    return make_dataclass(name, members, bases=(base,), namespace=namespace, eq=False, kw_only=True)


def _annotation(type_object: t.TypeObject, made: dict[Named, Any]) -> Any:
    inner: Any
    match type_object:
        case t.Object() | t.IntEnum():
            inner = made[plain(type_object)]
        case t.List():
            inner = list.__class_getitem__(_annotation(type_object.accepted, made))
        case t.Dict():
            inner = dict.__class_getitem__((str, _annotation(type_object.accepted, made)))
        case t.Tuple() | t.Pair():
            inner = tuple.__class_getitem__(tuple(_annotation(part, made) for part in parts_of(type_object)))
        case t.NDArray():
            inner = NDArray if plain_dtype(type_object.element) is None else np.ndarray
        case t.Any():
            return Any
        case _:
            inner = PRIMITIVES[type(type_object)]
    return inner | None if type_object.maybe else inner


def _begin(owner: t.Object, key: str, made: dict[Named, Any]) -> Callable[[], Any]:
    """What a field begins with."""
    member = owner.members[key]
    unset = unset_member(owner, key)
    if unset is None:
        return _default(member, made)
    if isinstance(member, t.Object):
        return partial(made[member], **{MICROSECONDS: unset})
    return partial(int, unset)


def _default(type_object: t.TypeObject, made: dict[Named, Any]) -> Callable[[], Any]:
    made_by: Callable[[], Any]
    match type_object:
        case _ if type_object.maybe:
            made_by = _nothing
        case t.Object():
            made_by = made[type_object]
        case t.IntEnum():
            made_by = partial(made[type_object], next(iter(type_object.values.values())))
        case t.List():
            made_by = list
        case t.Dict() | t.Any():
            made_by = dict
        case t.Tuple() | t.Pair():
            made_by = partial(_all, [_default(part, made) for part in parts_of(type_object)])
        case t.NDArray():
            made_by = partial(default_array, type_object)
        case _:
            made_by = PRIMITIVES[type(type_object)]
    return made_by


def _nothing() -> None:
    return None


def _all(made_by: list[Callable[[], Any]]) -> tuple[Any, ...]:
    return tuple(make() for make in made_by)
