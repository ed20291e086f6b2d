"""Data objects from and to what Python, numpy and dataclasses have for them.

Without a type object the narrowest kind that loses nothing is taken: a Python float becomes a Double and
never a Float, an int an Int or, beyond 32 bits, a Long. With one, its kinds are: there a Float may be
asked for, and a number that does not fit is refused rather than cut.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, fields, is_dataclass
from enum import Enum
from typing import Any, Final

import numpy as np

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import dtype_of, element_name, element_of, extents_of, from_numpy, plain_dtype, to_numpy
from armem_bridge.aron.data import (
    DEPTH_LIMIT,
    INT32,
    Bool,
    Data,
    Dict,
    Double,
    Float,
    Int,
    List,
    Long,
    NDArray,
    String,
)
from armem_bridge.aron.realization import Path, fits, name_of, parts_of, show_path
from armem_bridge.errors import InvalidData, NotConvertible


def to_aron(value: object, type_object: t.TypeObject | None = None) -> Data | None:
    """`value` as a data object: of `type_object`, if one is given, else of the narrowest fitting kind.

    | Python | without a type object |
    |---|---|
    | None, a data object | itself |
    | bool, np.bool_ | Bool |
    | int, IntEnum, numpy's integers | Int if it fits into 32 bits, else Long; np.int64 always Long |
    | float, np.float64 | Double |
    | np.float32, np.float16 | Float |
    | str, an enumeration of texts | String |
    | list, tuple | List |
    | mapping with names as keys, dataclass | Dict |
    | np.ndarray | NDArray |

    An object type takes the members that there are, and None for a maybe member that is missing; what it
    does not know is converted without it. Raises `NotConvertible` with the path of what has no ARON form
    (bytes, sets, dates ...) or not the one asked for, `InvalidData` for what does not fit into its kind.
    """
    return _guided(value, type_object, ()) if type_object is not None else _plain(value, ())


def to_python(data: Data | None, *, exact: bool = False) -> Any:
    """The data object as Python has it: str, bool, int, float, list, dict, np.ndarray, None.

    Arrays are read-only views of the same bytes. An NDArray that numpy cannot read, or would write back under
    another name, stays the NDArray that it is: nothing is lost on the way back to ARON. With `exact` that holds
    for numbers too: Long comes as np.int64, Float as np.float32. (Without, `to_aron` may choose another kind.)
    """
    match data:
        case None:
            return None
        case String() | Bool() | Int() | Double():
            return data.value
        case Long():
            return np.int64(data.value) if exact else data.value
        case Float():
            return np.float32(data.value) if exact else data.value
        case List():
            return [to_python(element, exact=exact) for element in data.elements]
        case Dict():
            return {name: to_python(element, exact=exact) for name, element in data.elements.items()}
        case NDArray():
            return to_numpy(data) if _comes_back(data) else data


def member_name(of: Field[Any]) -> str:
    """The name of a dataclass's field in ARON: its own, or the one its metadata give under `aron`."""
    return str(of.metadata.get("aron", of.name))


def members_of(value: Any) -> dict[str, Any]:
    """The fields of a dataclass by their names in ARON."""
    return {member_name(each): getattr(value, each.name) for each in fields(value)}


def _comes_back(array: NDArray) -> bool:
    """Whether numpy reads the array and would write it back alike; "float" and "float32" are alike."""
    if not array.shape:
        return False
    dtype = dtype_of(array.type, array.shape[-1])
    return dtype is not None and not (array.type == "16" and dtype.names is None)


def _plain(value: Any, path: Path) -> Data | None:
    make = _MAKERS.get(type(value))
    if make is not None:
        return make(value)
    if value is None or isinstance(value, Data):
        return value
    if len(path) > DEPTH_LIMIT:
        raise InvalidData(f"{_at(path)}lists and dicts nest deeper than {DEPTH_LIMIT} levels, or one holds itself")
    match value:
        case Mapping():
            return Dict({_name(name, path): _plain(element, (*path, name)) for name, element in value.items()})
        case list() | tuple():
            return List([_plain(element, (*path, index)) for index, element in enumerate(value)])
        case np.ndarray():
            return from_numpy(value)
        case str():
            return String(value)
        case int() | np.integer():
            return _integer(int(value))
        case float():
            return Double(value)
        case Enum():
            return _plain(value.value, path)
        case _ if is_dataclass(value) and not isinstance(value, type):
            return Dict({name: _plain(element, (*path, name)) for name, element in members_of(value).items()})
        case _:
            raise NotConvertible(f"{_at(path)}a {type(value).__name__} has no ARON form: {_remedy(value)}")


def _guided(value: Any, type_object: t.TypeObject, path: Path) -> Data | None:
    if value is None:
        if not type_object.maybe:
            raise NotConvertible(f"{_at(path)}None stands where {name_of(type_object)} allows no null")
        return None
    if isinstance(value, Data):
        return value
    match type_object:
        case t.Any():
            return _plain(value, path)
        case t.String() if isinstance(value, str):
            return String(value)
        case t.Bool() if isinstance(value, bool | np.bool_):
            return Bool(bool(value))
        case t.Int() | t.IntEnum() if _is_integer(value):
            return Int(int(value))
        case t.IntEnum() if isinstance(value, str) and value in type_object.values:
            return Int(type_object.values[value])
        case t.Long() if _is_integer(value):
            return Long(int(value))
        case t.Float() if _is_number(value):
            return Float(_as_float(value))
        case t.Double() if _is_number(value):
            return Double(_as_float(value))
        case t.NDArray() if isinstance(value, np.ndarray | np.generic | Sequence) and not isinstance(
            value, str | bytes
        ):
            return _array(value, type_object, path)
        case t.List() if _is_list(value):
            return List([_guided(each, type_object.accepted, (*path, index)) for index, each in enumerate(value)])
        case t.Tuple() | t.Pair() if _is_list(value):
            parts = parts_of(type_object)
            if len(value) != len(parts):
                raise NotConvertible(f"{_at(path)}{len(value)} elements are not the {len(parts)} of its type")
            pairs = zip(value, parts, strict=True)
            return List([_guided(each, part, (*path, index)) for index, (each, part) in enumerate(pairs)])
        case t.Dict() if isinstance(value, Mapping):
            accepted = type_object.accepted
            return Dict({_name(key, path): _guided(each, accepted, (*path, key)) for key, each in value.items()})
        case t.Object() if isinstance(value, Mapping) or (is_dataclass(value) and not isinstance(value, type)):
            return _object(value, type_object, path)
        case _:
            raise NotConvertible(f"{_at(path)}a {type(value).__name__} is no {name_of(type_object)}: {value!r:.80}")


def _object(value: Any, type_object: t.Object, path: Path) -> Dict:
    given = value if isinstance(value, Mapping) else members_of(value)
    members = type_object.all_members
    elements: dict[str, Data | None] = {}
    for name, member in members.items():
        if name in given:
            elements[name] = _guided(given[name], member, (*path, name))
        elif member.maybe:
            elements[name] = None
    for name, element in given.items():
        if name not in members:
            elements[_name(name, path)] = _plain(element, (*path, name))
    return Dict(elements)


def _array(value: Any, type_object: t.NDArray, path: Path) -> NDArray:
    """An array of the elements and extents asked for; numbers are converted where that loses nothing but digits."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise NotConvertible(f"{_at(path)}{value!r:.80} is no array: its rows differ in length") from error
    wanted = plain_dtype(type_object.element)
    if wanted is not None and array.dtype != wanted and array.dtype.kind in "biuf":
        with np.errstate(over="ignore", invalid="ignore"):
            converted = array.astype(wanted)
            same = np.isfinite(converted) == np.isfinite(array) if wanted.kind in "fc" else converted == array
        if not np.all(same):
            raise NotConvertible(f"{_at(path)}not all elements of type {array.dtype} fit into {type_object.element}")
        array = converted
    made = from_numpy(array)
    if type_object.element and element_of(made) != element_name(type_object.element):
        raise NotConvertible(f"{_at(path)}elements of type {array.dtype} are no {type_object.element}")
    if type_object.shapes and not any(fits(extents_of(made), shape) for shape in type_object.shapes):
        raise NotConvertible(f"{_at(path)}an array of {list(array.shape)} is no {name_of(type_object)}")
    return made


def _integer(value: int) -> Int | Long:
    return Int(value) if INT32[0] <= value <= INT32[1] else Long(value)


_MAKERS: Final[dict[type, Callable[[Any], Data]]] = {
    str: String,
    bool: Bool,
    int: _integer,
    float: Double,
    np.bool_: lambda value: Bool(bool(value)),
    np.float64: lambda value: Double(float(value)),
    np.float32: lambda value: Float(float(value)),
    np.float16: lambda value: Float(float(value)),
    np.int64: lambda value: Long(int(value)),
    **{kind: lambda value: _integer(int(value)) for kind in (np.int8, np.int16, np.int32)},
    **{kind: lambda value: _integer(int(value)) for kind in (np.uint8, np.uint16, np.uint32, np.uint64)},
}
"""What is made of values of exactly these classes; bool comes before int for it is looked up by its own class."""


def _is_integer(value: object) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple | np.ndarray)


def _as_float(value: Any) -> float | int:
    return int(value) if isinstance(value, int) else float(value)


def _name(name: object, path: Path) -> str:
    if not isinstance(name, str):
        raise NotConvertible(f"{_at(path)}a dict has names (str) as keys, not {name!r:.80}: name them, or take a list")
    return name


def _at(path: Path) -> str:
    return f"{show_path(path)}: " if path else ""


def _remedy(value: object) -> str:
    if isinstance(value, bytes | bytearray | memoryview):
        return "give an array of uint8 (np.frombuffer(value, np.uint8))"
    if isinstance(value, set | frozenset):
        return "give a list"
    return "give text, numbers, lists, dicts, arrays or dataclasses"
