"""The text of a Python module with the dataclasses of type objects, for people who want files."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import plain_dtype
from armem_bridge.aron.class_names import Named, class_names, field_names, plain, value_names
from armem_bridge.aron.generation import PRIMITIVES
from armem_bridge.aron.links import MICROSECONDS, unset_member
from armem_bridge.aron.realization import parts_of

_HEAD: Final = '''"""Dataclasses of ARON type definitions, written by elm."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.data import NDArray
from armem_bridge.aron.generation import default_array
from armem_bridge.aron.records import Record

__all__ = {names!r}
'''


def generate_source(*type_objects: t.TypeObject) -> str:
    """The text of a module that defines the classes which `generation.generate` makes at run time.

    It imports elm's bridge and numpy and runs as it stands; formatting it is left to the formatter of
    whoever keeps it. Nothing of a type object becomes code but by its `repr` or as a checked identifier.

    Raises `InvalidTypeObject` when two different types would have one name.
    """
    names = class_names(type_objects)
    classes = []
    for type_object, name in names.items():
        match type_object:
            case t.IntEnum():
                classes.append(_enumeration(name, type_object))
            case t.Object():
                classes.append(_dataclass(name, type_object, names))
    return "\n\n".join([_HEAD.format(names=sorted(names.values())), *classes])


def _enumeration(name: str, type_object: t.IntEnum) -> str:
    values = value_names(type_object)
    lines = [f"    {values[key]} = {value}" for key, value in type_object.values.items()]
    return "\n".join([f"class {name}(enum.IntEnum):", f"    {type_object.name or name!r}", "", *lines, ""])


def _dataclass(name: str, type_object: t.Object, names: dict[Named, str]) -> str:
    base = "Record" if type_object.extends is None else names[plain(type_object.extends)]
    fields = field_names(type_object)
    lines = ["@dataclass(kw_only=True, eq=False)", f"class {name}({base}):"]
    lines += [f"    {f'{type_object.name or name}, as its type object says.'!r}", ""]
    for key, member in type_object.members.items():
        # A lambda looks names up in the module, where no field hides them.
        metadata = "" if fields[key] == key else f", metadata={ {'aron': key}!r}"
        lines.append(
            f"    {fields[key]}: {_annotation(member, names)} = "
            f"field(default_factory=lambda: {_begin(type_object, key, names)}{metadata})"
        )
    members = ", ".join(f"{key!r}: {_expression(member, names)}" for key, member in type_object.members.items())
    extends = f", extends={base}.type_object" if type_object.extends is not None else ""
    lines.append(
        f"    type_object: ClassVar[t.Object] = t.Object(name={type_object.name!r}, members={{{members}}}{extends})"
    )
    return "\n".join([*lines, ""])


def _annotation(type_object: t.TypeObject, names: dict[Named, str]) -> str:
    match type_object:
        case t.Object() | t.IntEnum():
            inner = names[plain(type_object)]
        case t.List():
            inner = f"list[{_annotation(type_object.accepted, names)}]"
        case t.Dict():
            inner = f"dict[str, {_annotation(type_object.accepted, names)}]"
        case t.Tuple() | t.Pair():
            parts = ", ".join(_annotation(part, names) for part in parts_of(type_object))
            inner = f"tuple[{parts or '()'}]"
        case t.NDArray():
            inner = "NDArray" if plain_dtype(type_object.element) is None else "np.ndarray"
        case t.Any():
            return "Any"
        case _:
            inner = PRIMITIVES[type(type_object)].__name__
    return f"{inner} | None" if type_object.maybe else inner


def _begin(owner: t.Object, key: str, names: dict[Named, str]) -> str:
    member = owner.members[key]
    unset = unset_member(owner, key)
    if unset is None:
        return _default(member, names)
    return f"{names[member]}({MICROSECONDS}={unset})" if isinstance(member, t.Object) else repr(unset)


def _default(type_object: t.TypeObject, names: dict[Named, str]) -> str:
    match type_object:
        case _ if type_object.maybe:
            return "None"
        case t.Object():
            return f"{names[type_object]}()"
        case t.IntEnum():
            return f"{names[type_object]}({next(iter(type_object.values.values()))})"
        case t.List():
            return "[]"
        case t.Dict() | t.Any():
            return "{}"
        case t.Tuple() | t.Pair():
            return f"({''.join(f'{_default(part, names)}, ' for part in parts_of(type_object))})"
        case t.NDArray():
            return f"default_array({_expression(type_object, names)})"
        case _:
            return repr(PRIMITIVES[type(type_object)]())


def _expression(type_object: t.TypeObject, names: dict[Named, str]) -> str:
    """The type object as Python makes it; that of an object type is an attribute of its class."""
    maybe = ", maybe=True" if type_object.maybe else ""
    match type_object:
        case t.Object():
            whole = f"{names[plain(type_object)]}.type_object"
            return f"t.as_maybe({whole})" if type_object.maybe else whole
        case t.IntEnum():
            return f"t.IntEnum(name={type_object.name!r}, values={type_object.values!r}{maybe})"
        case t.List() | t.Dict():
            return f"t.{type(type_object).__name__}(accepted={_expression(type_object.accepted, names)}{maybe})"
        case t.Tuple():
            parts = "".join(f"{_expression(part, names)}, " for part in type_object.accepted)
            return f"t.Tuple(accepted=({parts}){maybe})"
        case t.Pair():
            first, second = (_expression(part, names) for part in parts_of(type_object))
            return f"t.Pair(first={first}, second={second}{maybe})"
        case t.NDArray():
            order = ", either_order=True" if type_object.either_order else ""
            return f"t.NDArray(shape={type_object.shape!r}, element={type_object.element!r}{order}{maybe})"
        case _:
            return f"t.{type(type_object).__name__}({maybe.removeprefix(', ')})"
