"""The bridge's JSON form of ARON data and type objects: lossless, readable, with a version that readers check.

A data object is an object of one name, its kind, and its value; null is null:

    {"string": "cup"} {"bool": true} {"int": 3} {"long": 3} {"float": 0.5} {"double": 0.1}
    {"list": [...]} {"dict": {"name": ...}}
    {"ndarray": {"shape": [4, 4, 4], "type": "float32", "base64": "..."}}

NaN and the infinities, which JSON does not have, are the texts "NaN", "Infinity" and "-Infinity" in the place
of the number. A type object is an object with its "kind" and its fields, where fields that have their
default are left out. A document is {"aron": "1.0", "data": ...} or {"aron": "1.0", "type": ...}.
ArmarX has a JSON form of its own for the same objects: this is not it.
"""

from __future__ import annotations

import binascii
import math
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec

import armem_bridge.aron.data as d
import armem_bridge.aron.type_objects as t
from armem_bridge.aron.binary import SIZE_LIMIT, undecodable
from armem_bridge.aron.data import check_data
from armem_bridge.aron.versions import MAJOR, MINOR, check_version
from armem_bridge.errors import ArmemError, InvalidTypeObject, TooLarge, Undecodable

WHAT: Final = "an ARON object in JSON"

_VERSION: Final = f"{MAJOR}.{MINOR}"
_WORDS: Final = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}
_NAMES: Final[dict[type, str]] = {kind: kind.__name__.lower() for kind in d.KINDS}


def to_json(data: d.Data | None) -> Any:
    """The data object in Python's JSON values, without the version; numpy or bytes do not occur in it."""
    match data:
        case None:
            return None
        case d.Float() | d.Double():
            return {_NAMES[type(data)]: data.value if math.isfinite(data.value) else _word(data.value)}
        case d.String() | d.Bool() | d.Int() | d.Long():
            return {_NAMES[type(data)]: data.value}
        case d.List():
            return {"list": [to_json(element) for element in data.elements]}
        case d.Dict():
            return {"dict": {name: to_json(element) for name, element in data.elements.items()}}
        case d.NDArray():
            inner = {"shape": list(data.shape), "type": data.type, "base64": b64encode(data.data).decode("ascii")}
            return {"ndarray": inner}


def from_json(value: Any) -> d.Data | None:
    """The data object that `to_json` wrote. Raises `Undecodable` for anything else."""
    try:
        return _read(value, 0)
    except ArmemError as error:
        raise error if isinstance(error, Undecodable) else undecodable(error, what=WHAT) from error


def encode(data: d.Data | None, *, limit: int = SIZE_LIMIT) -> bytes:
    """The data object as a JSON document in UTF-8. Raises `TooLarge` when there are more than `limit` bytes."""
    check_data(data, what="what to encode")
    encoded = msgspec.json.encode({"aron": _VERSION, "data": to_json(data)})
    if len(encoded) > limit:
        raise TooLarge(
            f"{WHAT} has {len(encoded):,} bytes, over the limit of {limit:,}: raise the limit, or use the binary form"
        )
    return encoded


def decode(encoded: bytes | str, *, limit: int = SIZE_LIMIT) -> d.Data | None:
    """The data object that `encode` wrote, with the errors of `aron.binary.decode`."""
    return from_json(_document(encoded, "data", limit))


def type_to_json(type_object: t.TypeObject) -> Any:
    """The type object in Python's JSON values, without the version."""
    return msgspec.to_builtins(type_object)


def type_from_json(value: Any) -> t.TypeObject:
    """The type object that `type_to_json` wrote. Raises `Undecodable` for anything else."""
    try:
        read: t.TypeObject = msgspec.convert(value, t.TypeObject)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise undecodable(error, what="a type object in JSON") from error
    return read


def encode_type(type_object: t.TypeObject) -> bytes:
    """The type object as a JSON document in UTF-8; there is no other form of type objects."""
    if not isinstance(type_object, t.KINDS):
        raise InvalidTypeObject(f"what to encode is no type object but a {type(type_object).__name__}")
    return msgspec.json.encode({"aron": _VERSION, "type": type_object})


def decode_type(encoded: bytes | str, *, limit: int = SIZE_LIMIT) -> t.TypeObject:
    """The type object that `encode_type` wrote, with the errors of `decode`."""
    return type_from_json(_document(encoded, "type", limit))


def _document(encoded: bytes | str, part: str, limit: int) -> Any:
    """The part of a document that holds the object, after a look at its version."""
    if len(encoded) > limit:
        raise TooLarge(f"{WHAT} has {len(encoded):,} bytes, over the limit of {limit:,}: raise the limit to read it")
    try:
        document = msgspec.json.decode(encoded)
    except (msgspec.MsgspecError, UnicodeError, RecursionError) as error:
        raise undecodable(error, what=WHAT) from error
    if not isinstance(document, dict) or not isinstance(document.get("aron"), str) or part not in document:
        raise Undecodable(f'{WHAT} is {{"aron": "{_VERSION}", "{part}": ...}}, not {document!r:.80}')
    major, _, minor = document["aron"].partition(".")
    if not (major.isdecimal() and minor.isdecimal() and len(major) + len(minor) < 20):
        raise Undecodable(f"{WHAT} names no version but {document['aron']!r:.40}: it is damaged")
    check_version(int(major), int(minor), what=WHAT)
    return document[part]


def _word(value: float) -> str:
    return next(word for word, number in _WORDS.items() if number == value or (value != value and word == "NaN"))


def _read(value: Any, depth: int) -> d.Data | None:
    if value is None:
        return None
    if not isinstance(value, Mapping) or len(value) != 1:
        raise Undecodable(f"{WHAT} is null or an object of one name, its kind, not {value!r:.80}")
    if depth > d.DEPTH_LIMIT:
        raise Undecodable(f"{WHAT} nests deeper than {d.DEPTH_LIMIT} levels: it cannot have been written by elm")
    ((kind, inner),) = value.items()
    if kind == "list":
        return d.List([_read(element, depth + 1) for element in _expect(inner, list, kind)])
    if kind == "dict":
        return d.Dict({name: _read(element, depth + 1) for name, element in _expect(inner, dict, kind).items()})
    read = _LEAVES.get(kind)
    if read is None:
        raise Undecodable(
            f"{WHAT} names a kind that there is not: {kind!r:.80}. There are {', '.join(_NAMES.values())}"
        )
    return read(inner)


def _expect(value: Any, form: type, kind: str) -> Any:
    if not isinstance(value, form):
        raise Undecodable(f"{WHAT}: what a {kind} holds is a JSON {form.__name__}, not {value!r:.80}")
    return value


def _read_number(value: Any) -> Any:
    return _WORDS.get(value, value) if isinstance(value, str) else value


def _read_array(value: Any) -> d.NDArray:
    inner = _expect(value, dict, "ndarray")
    if inner.keys() != {"shape", "type", "base64"} or not isinstance(inner["base64"], str):
        raise Undecodable(f"{WHAT}: an ndarray has the names shape, type and base64, not {sorted(inner)!r:.80}")
    try:
        data = b64decode(inner["base64"], validate=True)
    except (binascii.Error, ValueError) as error:
        raise Undecodable(f"{WHAT}: the base64 of an ndarray cannot be read ({error})") from error
    return d.NDArray(_expect(inner["shape"], list, "shape"), inner["type"], data)


_LEAVES: Final[dict[str, Callable[[Any], d.Data]]] = {
    "string": d.String,
    "bool": d.Bool,
    "int": d.Int,
    "long": d.Long,
    "float": lambda value: d.Float(_read_number(value)),
    "double": lambda value: d.Double(_read_number(value)),
    "ndarray": _read_array,
}
