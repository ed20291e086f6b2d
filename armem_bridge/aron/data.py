"""ARON's data objects: what one piece of knowledge is at a time, in nine kinds and null (section 4.3.2)."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, ClassVar, Final

import msgspec
from msgspec.structs import force_setattr

from armem_bridge.errors import InvalidData

DEPTH_LIMIT: Final = 200
"""How deep lists and dicts may nest; what is deeper is refused, before anything that recurses could break on it."""

EXTENTS_LIMIT: Final = 64
"""How many extents an array may have: as many as numpy's."""

INT32: Final = (-(2**31), 2**31 - 1)
INT64: Final = (-(2**63), 2**63 - 1)

_FLOAT32 = struct.Struct("<f")


class String(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="s"):
    """Text. No half of a surrogate pair, for no codec could write it."""

    value: str

    def __post_init__(self) -> None:
        if type(self.value) is not str or not self.value.isascii():
            force_setattr(self, "value", _text(self.value, what="a String"))


class Bool(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="b"):
    """True or false."""

    value: bool

    def __post_init__(self) -> None:
        if type(self.value) is not bool:
            raise InvalidData(f"a Bool holds True or False, not {self.value!r:.80}")


class Int(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="i"):
    """An integer of 32 bits."""

    value: int

    def __post_init__(self) -> None:
        if type(self.value) is not int:
            force_setattr(self, "value", _integer(self.value, what="an Int"))
        if not -0x80000000 <= self.value <= 0x7FFFFFFF:
            raise InvalidData(f"{self.value} does not fit into the 32 bits of an Int: make it a Long")


class Long(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="l"):
    """An integer of 64 bits."""

    value: int

    def __post_init__(self) -> None:
        if type(self.value) is not int:
            force_setattr(self, "value", _integer(self.value, what="a Long"))
        if not -0x8000000000000000 <= self.value <= 0x7FFFFFFFFFFFFFFF:
            raise InvalidData(f"{self.value} does not fit into the 64 bits of a Long: give it as a String")


class Float(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="f"):
    """A floating-point number of 32 bits.

    The value is rounded to 32 bits at birth, so that two that are equal here are equal on the wire too.
    NaN and the infinities are allowed; all NaN are one, equal to itself.
    """

    value: float

    def __post_init__(self) -> None:
        value = self.value
        if type(value) is not float:
            value = _number(value, what="a Float")
        try:
            rounded: float = _FLOAT32.unpack(_FLOAT32.pack(value))[0]
        except OverflowError as error:
            raise InvalidData(f"{value!r} is beyond the range of a Float: make it a Double") from error
        force_setattr(self, "value", rounded if rounded == rounded else math.nan)


class Double(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="d"):
    """A floating-point number of 64 bits. NaN and the infinities are allowed; all NaN are one, equal to itself."""

    value: float

    def __post_init__(self) -> None:
        value = self.value
        if type(value) is not float:
            force_setattr(self, "value", _number(value, what="a Double"))
        elif value != value and value is not math.nan:
            force_setattr(self, "value", math.nan)


class List(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="[", dict=True):
    """Data objects in an order; any may be null. Given as any iterable, kept as a tuple."""

    elements: tuple[Data | None, ...] = ()

    depth: ClassVar[int] = 1
    """How deep containers nest here, this one included; at most `DEPTH_LIMIT`."""

    if TYPE_CHECKING:

        def __init__(self, elements: Iterable[Data | None] = ...) -> None: ...

    def __post_init__(self) -> None:
        elements = self.elements
        if type(elements) is not tuple:
            if isinstance(elements, str | bytes | Mapping) or not isinstance(elements, Iterable):
                raise InvalidData(f"the elements of a List are several data objects, not {elements!r:.80}")
            elements = tuple(elements)
            force_setattr(self, "elements", elements)
        deepest = 0
        for index, element in enumerate(elements):
            kind = type(element)
            if kind in _LEAVES:
                continue
            if kind is Dict or kind is List:
                deepest = max(deepest, element.depth)  # type: ignore[union-attr]
            else:
                raise InvalidData(f"element {index} of a List is no data object: {element!r:.80}. See to_aron")
        if deepest:
            _nest(self, deepest)


class Dict(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="{", dict=True):
    """Data objects by names; any may be null. Copied at birth, in the order given, and never changed after.

    The order of the names is kept by the codecs; it counts neither for equality nor for the content hash.
    """

    elements: dict[str, Data | None] = {}

    depth: ClassVar[int] = 1
    """How deep containers nest here, this one included; at most `DEPTH_LIMIT`."""

    if TYPE_CHECKING:

        def __init__(self, elements: Mapping[str, Data | None] = ...) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.elements, Mapping):
            raise InvalidData(f"the elements of a Dict are data objects by names, not {self.elements!r:.80}")
        elements = dict(self.elements)
        deepest = 0
        plain = True
        for key, element in elements.items():
            if type(key) is not str or not key.isascii():
                plain = False
            kind = type(element)
            if kind in _LEAVES:
                continue
            if kind is Dict or kind is List:
                deepest = max(deepest, element.depth)  # type: ignore[union-attr]
            else:
                raise InvalidData(f"element {key!r:.80} of a Dict is no data object: {element!r:.80}. See to_aron")
        if not plain:
            elements = {_text(key, what="a key of a Dict"): element for key, element in elements.items()}
        force_setattr(self, "elements", elements)
        if deepest:
            _nest(self, deepest)

    def __hash__(self) -> int:
        return hash(frozenset(self.elements.items()))


class NDArray(msgspec.Struct, frozen=True, array_like=True, tag_field="kind", tag="n"):
    """A multidimensional array as the wire has it: extents, name of the element type, bytes in C order.

    The last entry of `shape` is the number of bytes of one element, the others are the extents; their
    product is the number of bytes. An empty `shape` is that of no array yet, without bytes. `type` is kept
    verbatim, known or not ("float", "float32", "16", "pcl::PointXYZRGBA" ...): `aron.arrays` reads it.
    """

    shape: tuple[int, ...]
    type: str
    data: bytes

    if TYPE_CHECKING:

        def __init__(self, shape: Iterable[int], type: str, data: bytes | bytearray | memoryview) -> None: ...  # noqa: A002

    def __post_init__(self) -> None:
        shape = self.shape
        if type(shape) is not tuple:
            if isinstance(shape, str | bytes) or not isinstance(shape, Iterable):
                raise InvalidData(f"the shape of an NDArray is several integers, not {shape!r:.80}")
            shape = tuple(shape)
            force_setattr(self, "shape", shape)
        if any(type(extent) is not int for extent in shape):
            shape = tuple(_integer(extent, what="an extent of an NDArray") for extent in shape)
            force_setattr(self, "shape", shape)
        if type(self.type) is not str or not self.type.isascii():
            force_setattr(self, "type", _text(self.type, what="the element type of an NDArray"))
        if type(self.data) is not bytes:
            if not isinstance(self.data, bytearray | memoryview):
                raise InvalidData(f"the data of an NDArray are bytes, not {self.data!r:.80}: see to_aron")
            force_setattr(self, "data", bytes(self.data))
        if len(shape) > EXTENTS_LIMIT + 1:
            raise InvalidData(f"an NDArray has at most {EXTENTS_LIMIT} extents, not {len(shape) - 1}")
        if any(not 0 <= extent <= 0x7FFFFFFF for extent in shape) or (shape and shape[-1] == 0):
            raise InvalidData(
                f"the shape {list(shape)} of an NDArray has an extent below 0 or beyond 32 bits, "
                f"or ends with no bytes per element"
            )
        if len(self.data) != (math.prod(shape) if shape else 0):
            raise InvalidData(
                f"an NDArray of shape {list(shape)} has {math.prod(shape) if shape else 0:,} bytes, "
                f"not {len(self.data):,}: the last entry of the shape is the number of bytes per element"
            )

    def __repr__(self) -> str:
        return f"NDArray(shape={list(self.shape)}, type={self.type!r}, {len(self.data):,} bytes)"


Data = String | Bool | Int | Long | Float | Double | List | Dict | NDArray
"""A data object. Where one may be missing the annotation is `Data | None`: None is ARON's null."""

KINDS: Final[tuple[type[Data], ...]] = (String, Bool, Int, Long, Float, Double, List, Dict, NDArray)
"""The classes of data objects."""

_KNOWN: frozenset[type] = frozenset({*KINDS, type(None)})
_LEAVES: frozenset[type] = _KNOWN - {List, Dict}


def check_data(value: object, *, what: str) -> Data | None:
    """`value`, when it is a data object or null."""
    if type(value) in _KNOWN:
        return value  # type: ignore[return-value]
    raise InvalidData(f"{what} is no ARON data object but a {type(value).__name__}: convert it with to_aron")


def _nest(container: List | Dict, deepest: int) -> None:
    if deepest >= DEPTH_LIMIT:
        raise InvalidData(f"lists and dicts nest deeper than {DEPTH_LIMIT} levels: flatten the data")
    # Beside the fields, for it is no part of the content; where nothing nests the class attribute says 1.
    container.__dict__["depth"] = deepest + 1


def _text(value: object, *, what: str) -> str:
    """`value` as plain str, when it is text that UTF-8 can write."""
    if not isinstance(value, str):
        raise InvalidData(f"{what} is text, not a {type(value).__name__}: {value!r:.80}")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise InvalidData(f"{what} contains half of a surrogate pair, which is no character: {value!r:.80}") from error
    # Of an enumeration the text it is, not the name it shows.
    return value if type(value) is str else str.__str__(value)


def _integer(value: object, *, what: str) -> int:
    if isinstance(value, int) and not isinstance(value, bool):
        return int(value)
    raise InvalidData(f"{what} holds an integer, not a {type(value).__name__}: {value!r:.80}")


def _number(value: object, *, what: str) -> float:
    if isinstance(value, float | int) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError as error:
            raise InvalidData(f"{what} cannot hold an integer beyond its range: give it as a String") from error
        return number if number == number else math.nan
    raise InvalidData(f"{what} holds a number, not a {type(value).__name__}: {value!r:.80}")
