"""Whether a data object realizes a type object: fully, partially, or not at all (section 4.3.2)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum

import armem_bridge.aron.data as d
import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import element_name, element_of, extents_of
from armem_bridge.errors import NotRealized

Path = tuple[str | int, ...]
"""The way to a part of a data object: names of dict elements, indices of list elements."""

SHOWN = 5
"""So many paths an error message names before it only counts."""


class Level(StrEnum):
    """How well a data object realizes a type object."""

    FULL = "full"
    """Every part is of its type, and there are exactly the members that the type has."""

    PARTIAL = "partial"
    """Every part that the type knows is of its type, but members are missing, or there are others."""

    NO = "no"
    """Some part is of another type, or null where the type allows none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Realization:
    """The answer of `realizes`: how well, and the paths where it does not. True unless the level is NO."""

    extra: tuple[Path, ...] = ()
    """Members that the type does not have."""

    missing: tuple[Path, ...] = ()
    """Members that the data do not have."""

    wrong: tuple[tuple[Path, str], ...] = ()
    """What is of another type, and why."""

    level: Level = field(init=False)

    def __post_init__(self) -> None:
        partial = Level.PARTIAL if self.extra or self.missing else Level.FULL
        object.__setattr__(self, "level", Level.NO if self.wrong else partial)

    def __bool__(self) -> bool:
        return self.level is not Level.NO

    def explain(self) -> str:
        """What is wrong, missing or extra, in one line; empty when nothing is."""
        parts = [
            _listed("wrong", [f"{show_path(path)} {why}" for path, why in self.wrong]),
            _listed("missing", map(show_path, self.missing)),
            _listed("extra", map(show_path, self.extra)),
        ]
        return "; ".join(filter(None, parts))

    def require(self, what: str) -> None:
        """Raise `NotRealized` when the level is NO; `what` names the data in its message."""
        if self.wrong:
            raise NotRealized(f"{what} is not of its type: {self.explain()}")


FULLY = Realization()

_PRIMITIVE: dict[type, type] = {
    t.String: d.String,
    t.Bool: d.Bool,
    t.Int: d.Int,
    t.Long: d.Long,
    t.Float: d.Float,
    t.Double: d.Double,
}


def realizes(data: d.Data | None, type_object: t.TypeObject) -> Realization:
    """How well `data` realizes `type_object`.

    - A member that only the data have is `extra`, one that only the type has is `missing`, even when it
      is a maybe type: a writer that knows the type writes null. Both leave the realization partial.
    - Null realizes maybe types only, whatever they are otherwise.
    - Kinds are never converted: an Int realizes neither Long nor Double.
    - Tuples and pairs are lists on the wire; another number of elements is wrong, not missing.
    - The values of an IntEnum are Ints; a value that it does not have is wrong.
    - Any is realized by all data fully.
    """
    extra: list[Path] = []
    missing: list[Path] = []
    wrong: list[tuple[Path, str]] = []
    _walk(data, type_object, (), extra, missing, wrong)
    if not (extra or missing or wrong):
        return FULLY
    return Realization(extra=tuple(extra), missing=tuple(missing), wrong=tuple(wrong))


def show_path(path: Path) -> str:
    """A path as text: `position.name`, `grasps[3]`, `["a name with signs"]`; `(all)` for the whole."""
    text = ""
    for step in path:
        if isinstance(step, int):
            text += f"[{step}]"
        elif step.isidentifier():
            text += f".{step}" if text else step
        else:
            text += f"[{step!r:.80}]"
    return text or "(all)"


def _walk(
    data: d.Data | None,
    type_object: t.TypeObject,
    path: Path,
    extra: list[Path],
    missing: list[Path],
    wrong: list[tuple[Path, str]],
) -> None:
    if data is None:
        if not type_object.maybe:
            wrong.append((path, f"is null, and {name_of(type_object)} allows none"))
        return
    if _PRIMITIVE.get(type(type_object)) is type(data):
        return
    match type_object, data:
        case t.Any(), _:
            return
        case t.Object(), d.Dict():
            elements = data.elements
            members = type_object.all_members
            for name, member in members.items():
                if name in elements:
                    _walk(elements[name], member, (*path, name), extra, missing, wrong)
                else:
                    missing.append((*path, name))
            if len(elements) > len(members) or elements.keys() - members.keys():
                extra.extend((*path, name) for name in elements if name not in members)
        case t.Dict(), d.Dict():
            for name, element in data.elements.items():
                _walk(element, type_object.accepted, (*path, name), extra, missing, wrong)
        case t.List(), d.List():
            for index, element in enumerate(data.elements):
                _walk(element, type_object.accepted, (*path, index), extra, missing, wrong)
        case ((t.Tuple() | t.Pair()), d.List()):
            accepted = parts_of(type_object)
            if len(data.elements) != len(accepted):
                wrong.append((path, f"has {len(data.elements)} elements, not the {len(accepted)} of its type"))
            for index, (element, part) in enumerate(zip(data.elements, accepted, strict=False)):
                _walk(element, part, (*path, index), extra, missing, wrong)
        case t.NDArray(), d.NDArray():
            _walk_array(data, type_object, path, wrong)
        case t.IntEnum(), d.Int():
            if data.value not in type_object.numbers:
                wrong.append((path, f"is {data.value}, no value of {type_object.name!r}"))
        case _:
            wrong.append((path, f"is a {type(data).__name__}, and its type {name_of(type_object)}"))


def _walk_array(data: d.NDArray, type_object: t.NDArray, path: Path, wrong: list[tuple[Path, str]]) -> None:
    extents = extents_of(data)
    if type_object.shapes and not any(fits(extents, shape) for shape in type_object.shapes):
        wrong.append((path, f"is an NDArray of {list(extents)}, and its type {name_of(type_object)}"))
    elif type_object.element and element_of(data) != element_name(type_object.element):
        wrong.append((path, f"has elements of type {data.type!r}, not {type_object.element!r}"))


def parts_of(type_object: t.Tuple | t.Pair) -> tuple[t.TypeObject, ...]:
    """The types of the elements of a tuple or pair."""
    if isinstance(type_object, t.Pair):
        return (type_object.first, type_object.second)
    return type_object.accepted


def fits(extents: tuple[int | None, ...], pattern: tuple[int | None, ...]) -> bool:
    """Whether extents are those of a pattern, where None is any number and 1 at either end does not count.

    Both are taken to go on with 1 in both directions and may be shifted: 3, 3 x 1 and 1 x 3 are the same.
    """
    if len(extents) == len(pattern) and all(map(_fit, extents, pattern)):
        return True
    return any(
        all(
            _fit(_at(extents, index), _at(pattern, index - shift))
            for index in range(min(0, shift), max(len(extents), shift + len(pattern)))
        )
        for shift in range(-len(pattern), len(extents) + 1)
    )


def _fit(extent: int | None, wanted: int | None) -> bool:
    return wanted is None or extent == wanted


def _at(extents: tuple[int | None, ...], index: int) -> int | None:
    return extents[index] if 0 <= index < len(extents) else 1


def name_of(type_object: t.TypeObject) -> str:
    """A type object in one word or two, for messages."""
    match type_object:
        case t.Object() | t.IntEnum():
            return repr(type_object.name)
        case t.List() | t.Dict():
            return f"{type(type_object).__name__} of {name_of(type_object.accepted)}"
        case t.NDArray(shape=None):
            return f"NDArray of {type_object.element or 'anything'}"
        case t.NDArray():
            shape = [extent if extent is not None else "any" for extent in type_object.shape or ()]
            order = " in either order" if type_object.either_order else ""
            return f"NDArray of {shape}{order} {type_object.element or 'anything'}".replace("'", "")
        case _:
            return type(type_object).__name__


def _listed(what: str, items: Iterable[str]) -> str:
    every = list(items)
    more = f" and {len(every) - SHOWN} more" if len(every) > SHOWN else ""
    return f"{what}: {', '.join(every[:SHOWN])}{more}" if every else ""
