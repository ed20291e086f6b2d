"""Random data objects and type objects, and data that realize a given type."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.arrays import PLAIN, STRUCTURED
from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String

TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
NAMES = st.one_of(st.sampled_from(["a", "b", "pose", "class", "x.y", "", "ü", "type"]), TEXTS)

INT32 = st.integers(-(2**31), 2**31 - 1)
INT64 = st.integers(-(2**63), 2**63 - 1)
FLOAT32 = st.floats(width=32)

SIZES = {**{name: np.dtype(name).itemsize for name in sorted(PLAIN)}, "float": 4, "double": 8}
OTHERS = {**{name: dtype.itemsize for name, dtype in STRUCTURED.items()}, "mystery": 3, "": 1}


@st.composite
def arrays(draw: st.DrawFn) -> NDArray:
    """Arrays of known and unknown elements, of no extents and of extents of 0 too."""
    if draw(st.integers(0, 9)) == 0:
        return NDArray((), draw(TEXTS), b"")
    name, size = draw(st.sampled_from(sorted({**SIZES, **OTHERS}.items())))
    extents = tuple(draw(st.lists(st.integers(0, 3), max_size=3)))
    count = math.prod(extents) * size
    return NDArray((*extents, size), name, draw(st.binary(min_size=count, max_size=count)))


LEAVES: st.SearchStrategy[Data] = st.one_of(
    st.builds(String, TEXTS),
    st.builds(Bool, st.booleans()),
    st.builds(Int, INT32),
    st.builds(Long, INT64),
    st.builds(Float, FLOAT32),
    st.builds(Double, st.floats()),
    arrays(),
)


def _containers(inner: st.SearchStrategy[Data]) -> st.SearchStrategy[Data]:
    elements = st.none() | inner
    lists: st.SearchStrategy[Data] = st.builds(List, st.lists(elements, max_size=4))
    dicts: st.SearchStrategy[Data] = st.builds(Dict, st.dictionaries(NAMES, elements, max_size=4))
    return lists | dicts


DATA: st.SearchStrategy[Data] = st.recursive(LEAVES, _containers, max_leaves=12)


def _container_types(inner: st.SearchStrategy[t.TypeObject]) -> st.SearchStrategy[t.TypeObject]:
    maybe = st.booleans()
    return st.one_of(
        st.builds(t.List, accepted=inner, maybe=maybe),
        st.builds(t.Dict, accepted=inner, maybe=maybe),
        st.builds(t.Tuple, accepted=st.lists(inner, max_size=3), maybe=maybe),
        st.builds(t.Pair, first=inner, second=inner, maybe=maybe),
        st.builds(_object, NAMES, st.dictionaries(NAMES, inner, max_size=4), st.integers(0, 4), maybe),
    )


def _object(name: str, members: dict[str, t.TypeObject], inherited: int, maybe: bool) -> t.Object:
    """An object type that has the first members from one it extends."""
    items = list(members.items())
    if not inherited:
        return t.Object(name=name, members=members, maybe=maybe)
    base = t.Object(name=f"{name}Base", members=dict(items[:inherited]))
    return t.Object(name=name, members=dict(items[inherited:]), extends=base, maybe=maybe)


TYPES: st.SearchStrategy[t.TypeObject] = st.recursive(
    st.one_of(
        *(st.builds(kind, maybe=st.booleans()) for kind in (t.String, t.Bool, t.Int, t.Long, t.Float, t.Double, t.Any)),
        st.builds(
            t.NDArray,
            shape=st.none() | st.lists(st.none() | st.integers(0, 3), max_size=3),
            element=st.sampled_from(["", "float", "float32", "uint8", "pcl::PointXYZRGBA", "mystery"]),
            maybe=st.booleans(),
        ),
        st.builds(
            t.IntEnum,
            name=NAMES,
            values=st.dictionaries(NAMES, INT32, min_size=1, max_size=3).filter(
                lambda values: len(set(values.values())) == len(values)
            ),
            maybe=st.booleans(),
        ),
    ),
    _container_types,
    max_leaves=6,
)


@st.composite
def realizing(draw: st.DrawFn, type_object: t.TypeObject) -> Any:
    """Data that realize a type fully."""
    if type_object.maybe and draw(st.booleans()):
        return None
    match type_object:
        case t.String():
            return String(draw(TEXTS))
        case t.Bool():
            return Bool(draw(st.booleans()))
        case t.Int():
            return Int(draw(INT32))
        case t.Long():
            return Long(draw(INT64))
        case t.Float():
            return Float(draw(FLOAT32))
        case t.Double():
            return Double(draw(st.floats()))
        case t.Any():
            return draw(LEAVES)
        case t.IntEnum():
            return Int(draw(st.sampled_from(sorted(type_object.values.values()))))
        case t.NDArray():
            extents = tuple(draw(st.integers(0, 2)) if extent is None else extent for extent in type_object.shape or ())
            name = type_object.element or "uint8"
            size = {**SIZES, **OTHERS}[name]
            return NDArray((*extents, size), name, bytes(math.prod(extents) * size))
        case t.List():
            return List(draw(st.lists(realizing(type_object.accepted), max_size=2)))
        case t.Dict():
            return Dict(draw(st.dictionaries(NAMES, realizing(type_object.accepted), max_size=2)))
        case t.Tuple():
            return List([draw(realizing(part)) for part in type_object.accepted])
        case t.Pair():
            return List([draw(realizing(type_object.first)), draw(realizing(type_object.second))])
        case t.Object():
            return Dict({name: draw(realizing(member)) for name, member in type_object.all_members.items()})
