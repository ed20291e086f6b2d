"""The three data objects of section 5.2: their types, the classes generated from these, and the bytes in them."""

from __future__ import annotations

import random
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String
from armem_bridge.aron.generation import generate

IMAGE: Final = (128, 128, 3)
"""Height, width and channels of the complex object's image."""

KEYS: Final = ("x", "y")
"""What the maps of the complex object have values of."""

_LINK = ALIASES["MemoryID"]
_PART = t.Object(name="Part", members={"number": t.Long(), "label": t.String()})
_MAP = t.Dict(accepted=t.Float())

SIMPLE: Final = t.Object(name="Simple", members={"number": t.Long()})
MODERATE: Final = t.Object(name="Moderate", members={"number": t.Long(), "text": t.String(), "link": _LINK})
COMPLEX: Final = t.Object(
    name="Complex",
    members={
        "first_link": _LINK,
        "second_link": _LINK,
        "part": _PART,
        "image": t.NDArray(shape=IMAGE, element="uint8"),
        "first_map": _MAP,
        "second_map": _MAP,
    },
)

_CLASSES: Final[dict[str, Any]] = generate(SIMPLE, MODERATE, COMPLEX)
_SIZES: Final = {Int: 4, Long: 8, Float: 4, Double: 8, Bool: 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """One of the data objects."""

    name: str
    type_object: t.Object
    information: int
    """So many bytes of information are in it, as the thesis counts them."""

    @property
    def business_class(self) -> Any:
        """The class that is generated from its type: a dataclass with `to_aron` and `from_aron`."""
        return _CLASSES[self.type_object.name]

    def make(self, number: int) -> Any:
        """A value of that class; the same for the same number."""
        made = self.business_class()
        if self.type_object == COMPLEX:
            made.first_link, made.second_link = _link(number), _link(number + 1)
            made.part.number, made.part.label = number, _text(number)
            made.image = np.random.default_rng(number).integers(0, 256, IMAGE, np.uint8)
            made.first_map = dict(zip(KEYS, (0.5, float(number)), strict=True))
            made.second_map = dict(zip(KEYS, (1.5, -float(number)), strict=True))
            return made
        made.number = number
        if self.type_object == MODERATE:
            made.text, made.link = _text(number), _link(number)
        return made


KINDS: Final = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            Kind(name="simple", type_object=SIMPLE, information=8),
            Kind(name="moderate", type_object=MODERATE, information=33),
            Kind(name="complex", type_object=COMPLEX, information=49_225),
        )
    }
)
"""By their names, in the order of their sizes."""


def information(data: Data | None, type_object: t.TypeObject) -> int:
    """So many bytes say all that `data` say beyond their type: numbers, texts, arrays, and the keys of maps."""
    match data:
        case None:
            return 0
        case String(value=text):
            return len(text.encode())
        case NDArray(data=content):
            return len(content)
        case List(elements=elements):
            assert isinstance(type_object, t.List)  # noqa: S101 - none of the objects has tuples
            return sum(information(element, type_object.accepted) for element in elements)
        case Dict(elements=members) if isinstance(type_object, t.Object):
            return sum(information(member, type_object.members[name]) for name, member in members.items())
        case Dict(elements=items):
            assert isinstance(type_object, t.Dict)  # noqa: S101 - what is no object is a map
            return sum(len(key.encode()) + information(item, type_object.accepted) for key, item in items.items())
        case _:
            return _SIZES[type(data)]


def _text(number: int) -> str:
    return "".join(random.Random(number).choices("abcdefgh", k=5))


def _link(number: int) -> Any:
    link = _CLASSES["MemoryID"]()
    link.memoryName, link.coreSegmentName, link.providerSegmentName, link.entityName = "MCPE"
    link.timestamp.timeSinceEpoch.microSeconds = number
    return link
