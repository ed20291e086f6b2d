"""Whether one type object can stand where another is asked for: a provider segment's for its core segment's."""

from __future__ import annotations

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import element_name
from armem_bridge.aron.realization import Path, fits, name_of, parts_of, show_path


def is_base_of(base: t.TypeObject, extending: t.TypeObject) -> bool:
    """Whether whatever fully realizes `extending` also realizes `base`, if only partially.

    What counts is the structure, so that a type that came over the wire with its members written out is
    as good as one that says `extends`: an object type has all members of its base, each of a type that
    extends the base's, and may have more; an enumeration has no values that its base has not; a maybe
    type only extends maybe types. Any is the base of all, where null is concerned too when it is maybe.
    """
    return not faults(base, extending)


def faults(base: t.TypeObject, extending: t.TypeObject) -> tuple[str, ...]:
    """Why `extending` does not extend `base`, with the paths; nothing when it does."""
    found: list[str] = []
    _compare(base, extending, (), found)
    return tuple(found)


def _compare(base: t.TypeObject, extending: t.TypeObject, path: Path, found: list[str]) -> None:
    if extending.maybe and not base.maybe:
        found.append(f"{show_path(path)} may be null in {name_of(extending)} and not in {name_of(base)}")
    match base, extending:
        case t.Object(), t.Object():
            for name, member in base.all_members.items():
                if name not in extending.all_members:
                    found.append(f"{show_path((*path, name))} is missing in {name_of(extending)}")
                else:
                    _compare(member, extending.all_members[name], (*path, name), found)
        case t.List(), t.List():
            _compare(base.accepted, extending.accepted, (*path, 0), found)
        case t.Dict(), t.Dict():
            _compare(base.accepted, extending.accepted, (*path, "*"), found)
        case (t.Tuple() | t.Pair()) as one, (t.Tuple() | t.Pair()) as other:
            wanted, given = parts_of(one), parts_of(other)
            if len(wanted) != len(given):
                found.append(f"{show_path(path)} has {len(given)} elements, not {len(wanted)}")
            for index, parts in enumerate(zip(wanted, given, strict=False)):
                _compare(*parts, (*path, index), found)
        case t.NDArray(), t.NDArray():
            _compare_arrays(base, extending, path, found)
        case t.IntEnum(), t.IntEnum():
            beyond = sorted(extending.numbers - base.numbers)
            if beyond:
                found.append(f"{show_path(path)} has the values {beyond[:5]} that {name_of(base)} has not")
        case (t.Any(), _) | (t.Int(), t.IntEnum()):
            return
        case _ if type(base) is not type(extending):
            found.append(f"{show_path(path)} is {name_of(extending)}, not {name_of(base)}")
        case _:
            return


def _compare_arrays(base: t.NDArray, extending: t.NDArray, path: Path, found: list[str]) -> None:
    if base.element and element_name(base.element) != element_name(extending.element):
        given = repr(extending.element) if extending.element else "any"
        found.append(f"{show_path(path)} has elements of type {given}, not {base.element!r}")
    if base.shape is None:
        return
    shapes = extending.shapes
    if not shapes or not all(any(fits(shape, wanted) for wanted in base.shapes) for shape in shapes):
        found.append(f"{show_path(path)} is {name_of(extending)}, not {name_of(base)}")
