"""What each tag of a type definition means: one element to one type object."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import BY_PLAIN_NAME, plain_name
from armem_bridge.aron.aliases.geometry import matrix, vector
from armem_bridge.aron.aliases.sensing import image_depth, image_rgb, point_cloud
from armem_bridge.aron.markup import Element

PRIMITIVES: Final[dict[str, t.TypeObject]] = {
    "string": t.String(),
    "bool": t.Bool(),
    "int": t.Int(),
    "int32": t.Int(),
    "long": t.Long(),
    "int64": t.Long(),
    "time": t.Long(),
    "float": t.Float(),
    "float32": t.Float(),
    "double": t.Double(),
    "float64": t.Double(),
    "any": t.Any(),
    "anyobject": t.Any(),
}
"""Tags without attributes of their own; `time` is a Long of microseconds."""

MAYBE: Final = ("maybe", "optional", "rawptr", "sharedptr", "uniqueptr")
"""Attributes that make a maybe type: null is a value wherever C++ has an optional or a pointer."""

_YES = {"true", "1", "yes"}
_NO = {"false", "0", "no", "none"}

_IMAGES: Final = {"rgb24": image_rgb, "depth32": image_depth}


class TagReader:
    """Reads the elements of one definition; `find` gives the types that it names, in a namespace."""

    def __init__(self, find: Callable[[str, str], t.TypeObject | None], namespace: str) -> None:
        self._find = find
        self._namespace = namespace

    def define(self, element: Element, name: str) -> t.TypeObject:
        """The object type or enumeration that the element defines under a full name."""
        if plain_name(element.tag) == "intenum":
            return self._define_enum(element, name)
        attributes_of(element, "name", "namespace", "extends")
        return self._define_object(element, name)

    def read(self, element: Element) -> t.TypeObject:
        """The type that an element names, where a type is used."""
        tag = plain_name(element.tag)
        type_object = self._container(element, tag) or self._array(element, tag) or self._named(element, tag)
        return t.as_maybe(type_object) if _is_maybe(element) else type_object

    def _container(self, element: Element, tag: str) -> t.TypeObject | None:
        match tag:
            case "object" if element.children:
                return self._define_object(element, full_name(element))
            case "object" | "intenum":
                attributes_of(element, "name", "namespace", *MAYBE)
                return self._refer(element, full_name(element))
            case "list":
                return t.List(accepted=self._parts(element, 1)[0])
            case "dict" | "dictionary":
                return t.Dict(accepted=self._parts(element, 1)[0])
            case "pair":
                first, second = self._parts(element, 2)
                return t.Pair(first=first, second=second)
            case "tuple":
                return t.Tuple(accepted=self._parts(element, None))
            case _:
                return None

    def _array(self, element: Element, tag: str) -> t.TypeObject | None:
        if element.children and tag in ("ndarray", "matrix", "eigenmatrix", "quaternion", "image", "pointcloud"):
            element.children[0].refuse(f"<{element.tag}> holds no other elements")
        match tag:
            case "ndarray":
                attributes_of(element, "dimensions", "ndim", "type", *MAYBE)
                dimensions = _count(element, "ndim", _count(element, "dimensions", None))
                shape = None if dimensions is None else (None,) * min(dimensions, 65)
                return t.NDArray(shape=shape, element=attribute(element, "type", ""))
            case "matrix" | "eigenmatrix":
                attributes_of(element, "rows", "cols", "type", *MAYBE)
                rows, columns = _count(element, "rows", 4), _count(element, "cols", 4)
                return matrix(rows, columns, attribute(element, "type", "float32"))
            case "quaternion":
                attributes_of(element, "type", *MAYBE)
                return vector(4, attribute(element, "type", "float32"))
            case "image":
                attributes_of(element, "width", "height", "type", "pixeltype", *MAYBE)
                pixel = attribute(element, "type", attribute(element, "pixeltype", "rgb24")).lower()
                if pixel not in _IMAGES:
                    element.refuse(f"images have pixels of type {' or '.join(_IMAGES)}, not {pixel!r:.60}")
                return _IMAGES[pixel](_count(element, "width", None), _count(element, "height", None))
            case "pointcloud":
                attributes_of(element, "type", "voxeltype", *MAYBE)
                voxel = attribute(element, "type", attribute(element, "voxeltype", ""))
                if not voxel:
                    element.refuse("a point cloud says of which points it is: type='PointXYZRGBA'")
                return point_cloud(voxel.removeprefix("pcl::"))
            case _:
                return None

    def _named(self, element: Element, tag: str) -> t.TypeObject:
        """A primitive, a type by its own name as the tag, or an alias."""
        attributes_of(element, *MAYBE)
        if element.children:
            element.children[0].refuse(f"<{element.tag}> holds no other elements")
        if tag in PRIMITIVES:
            return PRIMITIVES[tag]
        return self._find(element.tag, self._namespace) or BY_PLAIN_NAME.get(tag) or self._refer(element, element.tag)

    def _parts(self, element: Element, count: int | None) -> tuple[t.TypeObject, ...]:
        attributes_of(element, *MAYBE)
        if not element.children or count not in (None, len(element.children)):
            wanted = "at least one type" if count is None else f"{count} type{'s' if count > 1 else ''}"
            element.refuse(f"<{element.tag}> holds {wanted}, not {len(element.children)}")
        return tuple(self.read(child) for child in element.children)

    def _refer(self, element: Element, name: str) -> t.TypeObject:
        found = self._find(name, self._namespace)
        if found is None:
            element.refuse(f"the type {name!r:.100} is not known: define it, or include the file that does")
        return found

    def _define_object(self, element: Element, name: str) -> t.Object:
        attributes_of(element, "name", "namespace", "extends", *MAYBE)
        members: dict[str, t.TypeObject] = {}
        for child in element.children:
            if plain_name(child.tag) != "objectchild":
                child.refuse(f"<{child.tag}> is not known: an object holds <objectchild key='...'>")
            attributes_of(child, "key")
            key = attribute(child, "key")
            if key in members:
                child.refuse(f"{name!r} has the member {key!r} twice: rename one")
            if len(child.children) != 1:
                child.refuse(f"the member {key!r} has one type, not {len(child.children)}")
            members[key] = self.read(child.children[0])
        base = attribute(element, "extends", "")
        extends = self._refer(element, base) if base else None
        if extends is not None and not isinstance(extends, t.Object):
            element.refuse(f"{name!r} extends {base!r}, which is no object type")
        return t.Object(name=name, members=members, extends=extends)

    def _define_enum(self, element: Element, name: str) -> t.IntEnum:
        attributes_of(element, "name", "namespace")
        values: dict[str, int] = {}
        for child in element.children:
            if plain_name(child.tag) != "enumvalue":
                child.refuse(f"<{child.tag}> is not known: an enumeration holds <enumvalue key='...' value='...'>")
            attributes_of(child, "key", "value")
            key = attribute(child, "key")
            if key in values:
                child.refuse(f"{name!r} has the value {key!r} twice: rename one")
            values[key] = _integer(child, "value")
        return t.IntEnum(name=name, values=values)


def attributes_of(element: Element, *known: str) -> None:
    """Refuse attributes that are not among the known ones; documentation is passed over."""
    for name in element.attributes:
        plain = plain_name(name)
        if plain not in known and not plain.startswith("doc"):
            there_are = f"there are {', '.join(known)}" if known else "there are none here"
            element.refuse(f"the attribute {name!r} of <{element.tag}> is not known: {there_are}")


def attribute(element: Element, name: str, default: str | None = None) -> str:
    """The value of an attribute, which must be there unless there is a default."""
    for written, value in element.attributes.items():
        if plain_name(written) == name:
            return value.strip()
    if default is None:
        element.refuse(f"<{element.tag}> has no {name!r}: add it")
    return default


def full_name(element: Element) -> str:
    """The name of an object or enumeration with its namespace, without leading colons."""
    name = attribute(element, "name")
    namespace = attribute(element, "namespace", "").strip(":")
    return f"{namespace}::{name.removeprefix('::')}" if namespace else name.removeprefix("::")


def _is_maybe(element: Element) -> bool:
    found = False
    for name in MAYBE:
        value = plain_name(attribute(element, name, "false"))
        if value in _YES or (name == "maybe" and value in MAYBE):
            found = True
        elif value not in _NO:
            element.refuse(f"{name}={value!r:.60} is neither true nor false")
    return found


def _integer(element: Element, name: str) -> int:
    text = attribute(element, name)
    try:
        return int(text[:20], 0)
    except ValueError:
        element.refuse(f"{name}={text!r:.60} is no integer")


def _count(element: Element, name: str, default: int | None) -> int | None:
    """A number of rows, pixels ...; -1 and `dynamic` stand for any."""
    text = attribute(element, name, "")
    if not text:
        return default
    if text.lower() in ("-1", "dynamic"):
        return None
    count = _integer(element, name)
    if not 0 <= count < 2**31:
        element.refuse(f"{name}={text!r:.60} is no count")
    return count
