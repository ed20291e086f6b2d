"""Data objects from and to what Python, numpy and dataclasses have for them.

Without a type object the narrowest kind that loses nothing is taken: a Python float becomes a Double and
never a Float, an int an Int or, beyond 32 bits, a Long. With one, its kinds are: there a Float may be
asked for, and a number that does not fit is refused rather than cut.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, fields, is_dataclass
from datetime import datetime
from enum import Enum
from typing import Any, Final, Protocol, TypeVar, runtime_checkable

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
from armem_bridge.aron.links import date_time_of
from armem_bridge.aron.realization import Path, fits, name_of, parts_of, realizes, show_path
from armem_bridge.errors import InvalidData, NotConvertible
from armem_bridge.moments import InvalidMoment

_Value = TypeVar("_Value")
_Made = TypeVar("_Made")


@runtime_checkable
class Convertible(Protocol):
    """What says by itself which data object it is."""

    def to_aron(self) -> Data:
        """The data object."""


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
    | what has a method `to_aron` (MemoryID) | what that says |

    An object type takes the members that there are, and None for a maybe member that is missing; what it
    does not know is converted without it. Where it says DateTime, a datetime with its zone is one. Raises
    `NotConvertible` with the path of what has no ARON form (bytes, sets, dates ...) or not the one asked for,
    `InvalidData` with the path of what does not fit into its kind.
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
        try:
            return make(value)
        except InvalidData as error:
            raise _placed(error, path) from error
    if value is None or isinstance(value, Data):
        return value
    if len(path) > DEPTH_LIMIT:
        raise InvalidData(f"{_at(path)}lists and dicts nest deeper than {DEPTH_LIMIT} levels, or one holds itself")
    match value:
        case Mapping():
            named = {_name(name, path): _plain(element, (*path, name)) for name, element in value.items()}
            return _made(Dict, named, path)
        case list() | tuple():
            return _made(List, [_plain(element, (*path, index)) for index, element in enumerate(value)], path)
        case np.ndarray():
            return _made(from_numpy, value, path)
        case str():
            return _made(String, value, path)
        case int() | np.integer():
            return _made(_integer, int(value), path)
        case float():
            return Double(value)
        case Enum():
            return _plain(value.value, path)
        case _ if is_dataclass(value) and not isinstance(value, type):
            members = {name: _plain(element, (*path, name)) for name, element in members_of(value).items()}
            return _made(Dict, members, path)
        case Convertible() if not isinstance(value, type):
            return value.to_aron()
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
            return _made(String, value, path)
        case t.Bool() if isinstance(value, bool | np.bool_):
            return Bool(bool(value))
        case t.Int() if _is_integer(value):
            return _int(int(value), path)
        case t.IntEnum() if _is_integer(value) and int(value) in type_object.numbers:
            return Int(int(value))
        case t.IntEnum() if isinstance(value, str) and value in type_object.values:
            return Int(type_object.values[value])
        case t.IntEnum() if _is_integer(value) or isinstance(value, str):
            known = ", ".join(f"{name} ({number})" for name, number in type_object.values.items())
            raise NotConvertible(f"{_at(path)}{value!r:.80} is no {name_of(type_object)}: it has {known}")
        case t.Long() if _is_integer(value):
            return _made(Long, int(value), path)
        case t.Float() if _is_number(value):
            return _made(Float, _as_float(value), path)
        case t.Double() if _is_number(value):
            return _made(Double, _as_float(value), path)
        case t.NDArray() if isinstance(value, np.ndarray | np.generic | Sequence) and not isinstance(
            value, str | bytes
        ):
            return _array(value, type_object, path)
        case t.List() if _is_list(value):
            accepted = type_object.accepted
            elements = [_guided(each, accepted, (*path, index)) for index, each in enumerate(value)]
            return _made(List, elements, path)
        case t.Tuple() | t.Pair() if _is_list(value):
            parts = parts_of(type_object)
            if len(value) != len(parts):
                raise NotConvertible(f"{_at(path)}{len(value)} elements are not the {len(parts)} of its type")
            pairs = zip(value, parts, strict=True)
            elements = [_guided(each, part, (*path, index)) for index, (each, part) in enumerate(pairs)]
            return _made(List, elements, path)
        case t.Dict() if isinstance(value, Mapping):
            accepted = type_object.accepted
            named = {_name(key, path): _guided(each, accepted, (*path, key)) for key, each in value.items()}
            return _made(Dict, named, path)
        case t.Object() if isinstance(value, Mapping) or (is_dataclass(value) and not isinstance(value, type)):
            return _object(value, type_object, path)
        case t.Object() if isinstance(value, datetime):
            return _of_type(_made(date_time_of, value, path), value, type_object, path)
        case _ if isinstance(value, Convertible) and not isinstance(value, type):
            return _of_type(value.to_aron(), value, type_object, path)
        case _:
            raise _is_no(value, type_object, path)


def _of_type(data: Data, value: object, type_object: t.TypeObject, path: Path) -> Data:
    """The data that a value is by itself, where they have all that the type asks for."""
    found = realizes(data, type_object)
    if found.wrong or found.missing:
        raise _is_no(value, type_object, path)
    return data


def _is_no(value: object, type_object: t.TypeObject, path: Path) -> NotConvertible:
    return NotConvertible(f"{_at(path)}a {type(value).__name__} is no {name_of(type_object)}: {value!r:.80}")


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
    return _made(Dict, elements, path)


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
    made = _made(from_numpy, array, path)
    if type_object.element and element_of(made) != element_name(type_object.element):
        raise NotConvertible(f"{_at(path)}elements of type {array.dtype} are no {type_object.element}")
    if type_object.shapes and not any(fits(extents_of(made), shape) for shape in type_object.shapes):
        raise NotConvertible(f"{_at(path)}an array of {list(array.shape)} is no {name_of(type_object)}")
    return made


def _made(make: Callable[[_Value], _Made], value: _Value, path: Path) -> _Made:
    """What `make` makes of a value; what cannot be made is refused with its path."""
    try:
        return make(value)
    except (InvalidData, InvalidMoment, NotConvertible) as error:
        raise _placed(error, path) from error


def _placed(error: InvalidData | InvalidMoment | NotConvertible, path: Path) -> InvalidData | NotConvertible:
    kind = InvalidData if isinstance(error, InvalidData) else NotConvertible
    return kind(f"{_at(path)}{error}")


def _int(value: int, path: Path) -> Int:
    if not INT32[0] <= value <= INT32[1]:
        raise InvalidData(
            f"{_at(path)}{value} does not fit into 32 bits, and its type is Int: correct it, or have the type say Long"
        )
    return Int(value)


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
    if isinstance(value, datetime):
        return "give microseconds since 1970, or a type that says DateTime there"
    return "give text, numbers, lists, dicts, arrays or dataclasses"
