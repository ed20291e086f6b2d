"""Introspection: the type object that can be derived from a data object alone (section 4.3.2, figure 4.4)."""

from __future__ import annotations

from functools import reduce

import armem_bridge.aron.data as d
import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import element_of, extents_of


def infer(data: d.Data | None, *, name: str = "") -> t.TypeObject:
    """The narrowest type object that can be told from `data`, which realizes it fully.

    A dict becomes an object type, for its names are what is known of it; `name` is that of the outermost
    one, those inside have none. A list becomes a list of what its elements have in common: members that
    only some have, or have in several kinds, make it a list of anything. Null says only that null is
    allowed. An enumeration is not to be told from an Int, nor a tuple from a list, an image from an array.
    """
    match data:
        case None:
            return t.Any(maybe=True)
        case d.String():
            return t.String()
        case d.Bool():
            return t.Bool()
        case d.Int():
            return t.Int()
        case d.Long():
            return t.Long()
        case d.Float():
            return t.Float()
        case d.Double():
            return t.Double()
        case d.NDArray():
            return t.NDArray(shape=extents_of(data), element=element_of(data))
        case d.Dict():
            return t.Object(name=name, members={key: infer(element) for key, element in data.elements.items()})
        case d.List():
            return t.List(accepted=_common(data.elements))


def unify(one: t.TypeObject, other: t.TypeObject) -> t.TypeObject:
    """The narrowest type object that both extend, as far as `infer` makes such types; Any where there is none."""
    if one == other:
        return one
    maybe = one.maybe or other.maybe
    if t.as_maybe(one) == t.as_maybe(other):
        return t.as_maybe(one)
    match one, other:
        case t.Object(), t.Object() if one.all_members.keys() == other.all_members.keys() and one.name == other.name:
            members = {key: unify(member, other.all_members[key]) for key, member in one.all_members.items()}
            return t.Object(name=one.name, members=members, maybe=maybe)
        case t.List(), t.List():
            return t.List(accepted=unify(one.accepted, other.accepted), maybe=maybe)
        case t.NDArray(), t.NDArray():
            return t.NDArray(
                shape=_common_shape(one.shape, other.shape),
                element=one.element if one.element == other.element else "",
                maybe=maybe,
                either_order=one.either_order or other.either_order,
            )
        case _:
            return t.Any(maybe=maybe)


def _common(elements: tuple[d.Data | None, ...]) -> t.TypeObject:
    known = [infer(element) for element in elements if element is not None]
    # Equal types first: a list of thousands has few different ones.
    different = list(dict.fromkeys(known))
    accepted = reduce(unify, different) if different else t.Any(maybe=True)
    return t.as_maybe(accepted) if len(known) < len(elements) else accepted


def _common_shape(
    one: tuple[int | None, ...] | None, other: tuple[int | None, ...] | None
) -> tuple[int | None, ...] | None:
    if one is None or other is None or len(one) != len(other):
        return None
    return tuple(left if left == right else None for left, right in zip(one, other, strict=True))
