"""ARON's type objects: what data objects of a type have in common, in five categories (section 4.3.1).

The names are those of the data objects, and of the types that have no data object of their own (IntEnum,
Object, Tuple, Pair, Any): import the module rather than the names.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Final

import msgspec
from msgspec.structs import force_setattr, replace

from armem_bridge.aron.data import EXTENTS_LIMIT, INT32
from armem_bridge.errors import InvalidTypeObject

DEPTH_LIMIT: Final = 200
"""How deep type objects may nest, inheritance included."""


class _Primitive(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", omit_defaults=True):
    maybe: bool = False
    """Whether null is a value of the type."""

    depth: ClassVar[int] = 0


class String(_Primitive, frozen=True, tag="string"):
    """Realized by String."""


class Bool(_Primitive, frozen=True, tag="bool"):
    """Realized by Bool."""


class Int(_Primitive, frozen=True, tag="int"):
    """Realized by Int."""


class Long(_Primitive, frozen=True, tag="long"):
    """Realized by Long."""


class Float(_Primitive, frozen=True, tag="float"):
    """Realized by Float."""


class Double(_Primitive, frozen=True, tag="double"):
    """Realized by Double."""


class NDArray(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="ndarray", omit_defaults=True):
    """Realized by NDArray of these extents and elements.

    `shape` are the extents without the bytes per element, None for any number there; without `shape` the
    array may have any. Extents of 1 at either end do not count: a vector of 3 is also one of 3 x 1. `element`
    names the element type ("uint8", "float32", "pcl::PointXYZRGBA" ...), empty for any; `aron.arrays` says
    which names mean the same. With `either_order` the first two extents may also stand in the other order, as
    those of images do: ArmarX describes them as width x height, and numpy has them as height x width.
    """

    shape: tuple[int | None, ...] | None = None
    element: str = ""
    maybe: bool = False
    either_order: bool = False

    depth: ClassVar[int] = 0

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            shape: Iterable[int | None] | None = ...,
            element: str = ...,
            maybe: bool = ...,
            either_order: bool = ...,
        ) -> None: ...

    @property
    def shapes(self) -> tuple[tuple[int | None, ...], ...]:
        """The shapes that it may have, the one that it is described by first; none where it may have any."""
        if self.shape is None:
            return ()
        return (self.shape, (*self.shape[1::-1], *self.shape[2:])) if self.either_order else (self.shape,)

    def __post_init__(self) -> None:
        if self.shape is not None:
            force_setattr(self, "shape", tuple(self.shape))
            if any(extent is not None and (type(extent) is not int or extent < 0) for extent in self.shape):
                raise InvalidTypeObject(f"the extents of an NDArray type are counts or None, not {self.shape!r:.80}")
            if len(self.shape) > EXTENTS_LIMIT:
                raise InvalidTypeObject(f"an NDArray has at most {EXTENTS_LIMIT} extents, not {len(self.shape)}")


class IntEnum(
    msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="intenum", omit_defaults=True, dict=True
):
    """Realized by Int of one of the values, which have names."""

    name: str
    values: dict[str, int]
    maybe: bool = False

    depth: ClassVar[int] = 0

    def __post_init__(self) -> None:
        force_setattr(self, "values", dict(self.values))
        if not self.values:
            raise InvalidTypeObject(f"the enumeration {self.name!r} has no values: give it one")
        for name, value in self.values.items():
            if type(value) is not int or not INT32[0] <= value <= INT32[1]:
                raise InvalidTypeObject(f"{name!r} of the enumeration {self.name!r} is no 32-bit integer: {value!r}")
        if len(set(self.values.values())) != len(self.values):
            raise InvalidTypeObject(f"the enumeration {self.name!r} gives one value two names: drop one")

    @cached_property
    def numbers(self) -> frozenset[int]:
        """The values without their names."""
        return frozenset(self.values.values())

    def __hash__(self) -> int:
        return hash((self.name, frozenset(self.values.items()), self.maybe))


class List(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="list", omit_defaults=True, dict=True):
    """Realized by List whose elements all realize `accepted`."""

    accepted: TypeObject
    maybe: bool = False

    depth: ClassVar[int] = 1

    def __post_init__(self) -> None:
        _nest(self, (self.accepted,))


class Dict(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="dict", omit_defaults=True, dict=True):
    """Realized by Dict whose elements all realize `accepted`, whatever their names."""

    accepted: TypeObject
    maybe: bool = False

    depth: ClassVar[int] = 1

    def __post_init__(self) -> None:
        _nest(self, (self.accepted,))


class Tuple(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="tuple", omit_defaults=True, dict=True):
    """Realized by List of as many elements, each of the type at its place."""

    accepted: tuple[TypeObject, ...]
    maybe: bool = False

    depth: ClassVar[int] = 1

    if TYPE_CHECKING:

        def __init__(self, *, accepted: Iterable[TypeObject], maybe: bool = ...) -> None: ...

    def __post_init__(self) -> None:
        force_setattr(self, "accepted", tuple(self.accepted))
        _nest(self, self.accepted)


class Pair(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="pair", omit_defaults=True, dict=True):
    """Realized by List of two elements."""

    first: TypeObject
    second: TypeObject
    maybe: bool = False

    depth: ClassVar[int] = 1

    def __post_init__(self) -> None:
        _nest(self, (self.first, self.second))


class Object(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind", tag="object", omit_defaults=True, dict=True):
    """Realized by Dict that has the members, those of what the object extends included.

    `members` are the object's own, `all_members` all of them, the inherited ones first. A name occurs once
    along the chain: what is inherited cannot be defined anew. The order of members does not count.
    """

    name: str
    members: dict[str, TypeObject] = {}
    extends: Object | None = None
    maybe: bool = False

    depth: ClassVar[int] = 1

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            name: str,
            members: Mapping[str, TypeObject] = ...,
            extends: Object | None = ...,
            maybe: bool = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        force_setattr(self, "members", dict(self.members))
        if not isinstance(self.name, str) or any(not isinstance(member, str) for member in self.members):
            raise InvalidTypeObject(f"the name of an object type and those of its members are text: {self.name!r:.80}")
        base = self.extends
        if base is not None:
            if not isinstance(base, Object):
                raise InvalidTypeObject(f"the object type {self.name!r} extends an object type, not {base!r:.80}")
            twice = self.members.keys() & base.all_members.keys()
            if twice:
                raise InvalidTypeObject(
                    f"the object type {self.name!r} defines {sorted(twice)} that it inherits from {base.name!r}: "
                    f"leave them out, or name them otherwise"
                )
        _nest(self, (*self.members.values(), *(() if base is None else (base,))))

    @cached_property
    def all_members(self) -> dict[str, TypeObject]:
        """The members by name, the inherited ones first."""
        return self.members if self.extends is None else {**self.extends.all_members, **self.members}

    def __hash__(self) -> int:
        return hash((self.name, frozenset(self.members.items()), self.extends, self.maybe))


class Any(_Primitive, frozen=True, tag="any"):
    """Realized by every data object; by null only when it is a maybe type."""


TypeObject = String | Bool | Int | Long | Float | Double | NDArray | IntEnum | List | Dict | Tuple | Pair | Object | Any
"""A type object. Where the type of something is not known the annotation is `TypeObject | None`."""

KINDS: Final[tuple[type[TypeObject], ...]] = (
    String, Bool, Int, Long, Float, Double, NDArray, IntEnum, List, Dict, Tuple, Pair, Object, Any
)  # fmt: skip
"""The classes of type objects."""

_KNOWN: frozenset[type] = frozenset(KINDS)


def as_maybe(type_object: TypeObject, *, maybe: bool = True) -> TypeObject:
    """The same type with null as a value of it, or without."""
    return type_object if type_object.maybe == maybe else replace(type_object, maybe=maybe)


def _nest(container: List | Dict | Tuple | Pair | Object, parts: Iterable[TypeObject]) -> None:
    """Check what a type is made of, and note how deep it nests."""
    deepest = 0
    for part in parts:
        if type(part) not in _KNOWN:
            raise InvalidTypeObject(f"a {type(container).__name__} type is made of type objects, not of {part!r:.80}")
        deepest = max(deepest, part.depth)
    if deepest >= DEPTH_LIMIT:
        raise InvalidTypeObject(f"type objects nest deeper than {DEPTH_LIMIT} levels: flatten the type")
    if deepest:
        # Beside the fields, for it is no part of the type; where nothing nests the class attribute says 1.
        container.__dict__["depth"] = deepest + 1
