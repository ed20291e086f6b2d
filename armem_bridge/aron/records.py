"""Dataclasses read from data objects by the annotations of their fields, partially realized data included."""

from __future__ import annotations

import types
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from datetime import datetime
from enum import Enum
from functools import lru_cache
from typing import Any, ClassVar, Protocol, Self, TypeVar, get_args, get_origin, runtime_checkable

import numpy as np

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import to_numpy
from armem_bridge.aron.conversion import member_name, to_aron, to_python
from armem_bridge.aron.data import KINDS, Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.links import date_time_from
from armem_bridge.aron.realization import Path, show_path
from armem_bridge.errors import ArmemError, InvalidTypeObject, NotConvertible, NotRealized

T = TypeVar("T")


@runtime_checkable
class Readable(Protocol):
    """A class that reads its values by itself."""

    def from_aron(self, data: Data | None) -> Any:
        """The value of a data object."""


_SCALARS: dict[Any, tuple[type[Data], ...]] = {
    bool: (Bool,),
    int: (Int, Long),
    float: (Float, Double),
    str: (String,),
    np.bool_: (Bool,),
    np.int32: (Int,),
    np.int64: (Int, Long),
    np.float32: (Float,),
    np.float64: (Float, Double),
}
"""Annotations of single values, and the kinds that are read into them."""


def from_aron(data: Data | None, cls: type[T]) -> T:
    """`data` as a value of the dataclass `cls`; fields that the data lack keep their defaults, others are passed over.

    Fields may be of bool, int, float, str, numpy's scalars, np.ndarray, lists, tuples, dicts by str,
    enumerations, dataclasses, data objects, datetime (of a DateTime), MemoryID or another class with `from_aron`,
    Any, and each of them or None. A field's name in the data is its own or `field(metadata={"aron": name})`.

    Raises `NotRealized` with the path where a member is of another kind, null where None is not allowed,
    or missing without a default; `NotConvertible` for an annotation that nothing can be read into.
    """
    if not is_dataclass(cls):
        raise NotConvertible(f"{cls!r} is no dataclass: use to_python for plain values")
    read: T = _read(data, cls, ())
    return read


class Record:
    """Base of dataclasses with a type object: what ArmarX generates from a type definition (listing 4.2)."""

    type_object: ClassVar[t.Object]

    def to_aron(self) -> Dict:
        """The data object, which realizes `type_object` fully."""
        data = to_aron(self, self.type_object)
        if not isinstance(data, Dict):
            raise InvalidTypeObject(f"the type object of {type(self).__name__} is no object type")
        return data

    @classmethod
    def from_aron(cls, data: Data | None) -> Self:
        """A value of this class; members that the data lack keep their defaults. Raises `NotRealized`."""
        return from_aron(data, cls)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self) or not isinstance(other, Record):
            return NotImplemented
        return self.to_aron() == other.to_aron()


@lru_cache(maxsize=1024)
def _annotations(cls: type) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _read(data: Data | None, annotation: Any, path: Path) -> Any:
    if annotation is Any or annotation is object:
        return to_python(data)
    if annotation in _SCALARS:
        value = _expect(data, _SCALARS[annotation], annotation, path)
        return annotation(value.value)
    origin, arguments = get_origin(annotation) or annotation, get_args(annotation)
    if origin is typing.Union or origin is types.UnionType:
        return _read_union(data, arguments, annotation, path)
    if origin is np.ndarray:
        return to_numpy(_expect(data, (NDArray,), annotation, path))
    if origin in KINDS:
        return _expect(data, (origin,), annotation, path)
    if origin in (list, Sequence):
        (inner,) = arguments or (Any,)
        elements = _expect(data, (List,), annotation, path).elements
        return [_read(element, inner, (*path, index)) for index, element in enumerate(elements)]
    if origin is tuple:
        return _read_tuple(_expect(data, (List,), annotation, path), arguments, path)
    if origin in (dict, Mapping):
        inner = arguments[1] if arguments else Any
        items = _expect(data, (Dict,), annotation, path).elements.items()
        return {name: _read(element, inner, (*path, name)) for name, element in items}
    if origin is datetime:
        return _named(date_time_from, data, path)
    if isinstance(origin, type) and issubclass(origin, Enum):
        return _read_enum(data, origin, path)
    if is_dataclass(origin) and isinstance(origin, type):
        return _read_dataclass(_expect(data, (Dict,), annotation, path), origin, path)
    if isinstance(origin, Readable):
        return _named(origin.from_aron, data, path)
    raise NotConvertible(f"{show_path(path)}: nothing can be read into {_shown(annotation)}: annotate it otherwise")


def _named(read: Callable[[Data | None], Any], data: Data | None, path: Path) -> Any:
    """What a class reads by itself; what it refuses is refused with its path."""
    try:
        return read(data)
    except ArmemError as error:
        raise NotRealized(f"{show_path(path)}: {error}") from error


def _read_dataclass(data: Dict, cls: type, path: Path) -> Any:
    annotations = _annotations(cls)
    values = {}
    for each in filter(lambda field: field.init, fields(cls)):
        name = member_name(each)
        if name in data.elements:
            values[each.name] = _read(data.elements[name], annotations[each.name], (*path, name))
        elif each.default is MISSING and each.default_factory is MISSING:
            raise NotRealized(f"{show_path((*path, name))} is missing, and {cls.__name__} has no default for it")
    return cls(**values)


def _read_union(data: Data | None, arguments: tuple[Any, ...], annotation: Any, path: Path) -> Any:
    if data is None and type(None) in arguments:
        return None
    if arguments and all(argument in KINDS or argument is type(None) for argument in arguments):
        return _expect(data, tuple(argument for argument in arguments if argument in KINDS), annotation, path)
    others = [argument for argument in arguments if argument is not type(None)]
    if len(others) != 1:
        raise NotConvertible(f"{show_path(path)}: of {_shown(annotation)} one cannot be chosen: take one type or None")
    return _read(data, others[0], path)


def _read_tuple(data: List, arguments: tuple[Any, ...], path: Path) -> tuple[Any, ...]:
    if not arguments or (len(arguments) == 2 and arguments[1] is Ellipsis):
        arguments = (arguments or (Any,))[:1] * len(data.elements)
    if len(data.elements) != len(arguments):
        raise NotRealized(f"{show_path(path)} has {len(data.elements)} elements, not {len(arguments)}")
    pairs = zip(data.elements, arguments, strict=True)
    return tuple(_read(element, argument, (*path, index)) for index, (element, argument) in enumerate(pairs))


def _read_enum(data: Data | None, enum: type[Enum], path: Path) -> Enum:
    value = _expect(data, (Int, String), enum, path).value
    try:
        return enum(value)
    except ValueError as error:
        raise NotRealized(f"{show_path(path)} is {value!r:.80}, no value of {enum.__name__}") from error


def _expect(data: Data | None, kinds: tuple[type[Data], ...], annotation: Any, path: Path) -> Any:
    if type(data) not in kinds:
        found = "null" if data is None else f"a {type(data).__name__}"
        raise NotRealized(f"{show_path(path)} is {found}, which cannot be read into {_shown(annotation)}")
    return data


def _shown(annotation: Any) -> str:
    return annotation.__name__ if isinstance(annotation, type) else str(annotation)
