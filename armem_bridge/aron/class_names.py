"""Which classes there are to generate from type objects, in which order, and how they and their fields are named."""

from __future__ import annotations

import keyword
import unicodedata
from collections.abc import Iterable
from typing import Final

from msgspec.structs import replace

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.realization import parts_of
from armem_bridge.aron.records import Record
from armem_bridge.errors import InvalidTypeObject

MODULE: Final = frozenset(
    [
        "Any",
        "ClassVar",
        "NDArray",
        "Record",
        "bool",
        "dataclass",
        "default_array",
        "dict",
        "enum",
        "field",
        "float",
        "int",
        "list",
        "np",
        "str",
        "t",
        "tuple",
    ]
)
"""Names that a module of such classes uses itself."""

FIELDS: Final = frozenset({*dir(Record), "type_object", "dataclass", "field"})
"""Names that a field cannot have, for the class uses them."""

VALUES: Final = frozenset({"mro", "name", "value"})
"""Names that a value of an enumeration cannot have."""

Named = t.Object | t.IntEnum


def class_names(type_objects: Iterable[t.TypeObject]) -> dict[Named, str]:
    """The object types and enumerations in and inside `type_objects` with their classes' names, inner ones first.

    A class has the last part of its type's name (`Cup` of `example::dto::Cup`); where two types have that
    in common, the whole names joined by `_`; types without a name that of their whole and member.

    Raises `InvalidTypeObject` when two different types would have one name.
    """
    paths: dict[Named, str] = {}
    for type_object in type_objects:
        if not isinstance(type_object, t.KINDS):
            raise InvalidTypeObject(f"classes are generated from type objects, not from {type_object!r:.80}")
        _collect(type_object, "Anonymous", paths)
    sharing: dict[str, set[str]] = {}
    for path in paths.values():
        sharing.setdefault(_last(path), set()).add(path)
    names = {
        type_object: identifier(_last(path) if len(sharing[_last(path)]) == 1 else path.replace("::", "_"), MODULE)
        for type_object, path in paths.items()
    }
    by_name: dict[str, Named] = {}
    for type_object, name in names.items():
        if name in by_name:
            raise InvalidTypeObject(f"two different types would both become the class {name!r}: rename one")
        by_name[name] = type_object
    return names


def field_names(type_object: t.Object) -> dict[str, str]:
    """The members of an object type, inherited ones included, with the names of their fields."""
    return _distinct(type_object.all_members, type_object.name, FIELDS)


def value_names(type_object: t.IntEnum) -> dict[str, str]:
    """The values of an enumeration with their names in Python, which begin with `v` where others begin with `_`."""
    names = _distinct(type_object.values, type_object.name, VALUES)
    # An enumeration takes `_name_` for its own and `_Class__name` for no value.
    return {key: f"v{name}" if name.startswith("_") else name for key, name in names.items()}


def identifier(name: str, taken: frozenset[str] = frozenset()) -> str:
    """The name, changed as little as Python needs: `_` for signs, and after names that are taken."""
    name = unicodedata.normalize("NFKC", name)
    name = "".join(sign if f"_{sign}".isidentifier() else "_" for sign in name)
    if not name.strip("_"):
        name = f"unnamed_{len(name)}"
    elif name.startswith("_"):
        # Python means something by `__name` inside a class, and enum by `_name_`.
        name = "_" + name.strip("_")
    elif not name.isidentifier():
        name = f"_{name}"
    return f"{name}_" if keyword.iskeyword(name) or name in taken else name


def plain(type_object: Named) -> Named:
    """The type under which a class is made: null is no value of a class."""
    return replace(type_object, maybe=False) if type_object.maybe else type_object


def _distinct(keys: Iterable[str], what: str, taken: frozenset[str]) -> dict[str, str]:
    names = {key: identifier(key, taken) for key in keys}
    if len(set(names.values())) != len(names):
        raise InvalidTypeObject(
            f"two names of {what!r} would become one in Python: rename one of {sorted(names)!r:.200}"
        )
    return names


def _collect(type_object: t.TypeObject, path: str, paths: dict[Named, str]) -> None:
    match type_object:
        case t.Object() if plain(type_object) not in paths:
            own = type_object.name or path
            if type_object.extends is not None:
                _collect(type_object.extends, f"{own}Base", paths)
            for key, member in type_object.members.items():
                _collect(member, f"{own}{key[:1].upper()}{key[1:]}", paths)
            paths[plain(type_object)] = own
        case t.IntEnum():
            paths.setdefault(plain(type_object), type_object.name or path)
        case t.List() | t.Dict():
            _collect(type_object.accepted, path, paths)
        case t.Tuple() | t.Pair():
            for index, part in enumerate(parts_of(type_object)):
                _collect(part, f"{path}{index}", paths)
        case _:
            return


def _last(name: str) -> str:
    return name.rpartition("::")[2]
