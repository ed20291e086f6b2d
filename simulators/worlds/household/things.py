"""Who lives in the flat and what lies about in it: three people, and forty things with a home and other places."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

PEOPLE = ("Anna", "Ben", "Carla")
COMMUTERS = ("Anna", "Ben")
"""Those who are out on weekdays."""
PARCEL = "parcel"
CAN = "watering can"
OUTSIDE = "outside"
"""Where things and people are that are not in the flat."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """Something that is handled: its kind, the furniture where it belongs, and who takes it along when going out."""

    name: str
    category: str
    home: str
    owner: str | None = None


def _things() -> list[Thing]:
    colours = ("red", "blue", "green")
    dishes = [
        Thing(name=f"{colour} {dish}", category=dish, home="cupboard")
        for dish in ("cup", "plate", "bowl", "glass")
        for colour in colours
    ]
    own = [
        Thing(name=f"{person}'s {kind}", category=kind, home=home, owner=person)
        for kind, home in (("keys", "hall table"), ("phone", "nightstand"), ("jacket", "coat rack"))
        for person in PEOPLE
    ]
    others = [
        Thing(name=name, category=category, home=home)
        for name, category, home in (
            ("milk", "food", "fridge"),
            ("juice", "food", "fridge"),
            ("butter", "food", "fridge"),
            ("jam", "food", "fridge"),
            ("bread", "food", "counter"),
            ("cereal", "food", "counter"),
            ("apples", "food", "counter"),
            ("novel", "reading", "bookshelf"),
            ("atlas", "reading", "bookshelf"),
            ("cookbook", "reading", "counter"),
            ("newspaper", "reading", "coffee table"),
            ("reading glasses", "device", "sideboard"),
            ("remote control", "device", "coffee table"),
            ("tablet", "device", "sofa"),
            ("laptop", "device", "desk"),
            ("printer paper", "supply", "shelf"),
            ("towel", "linen", "washbasin"),
            (CAN, "tool", "sideboard"),
            (PARCEL, "parcel", "hall table"),
        )
    ]
    return [*dishes, *own, *others]


THINGS = MappingProxyType({thing.name: thing for thing in _things()})

_ABOUT = {
    **dict.fromkeys(("cup", "plate", "bowl", "glass"), ("coffee table", "dining table", "desk", "counter")),
    "food": ("counter", "kitchen table", "dining table"),
    "keys": ("hall table", "sideboard", "kitchen table", "desk"),
    "phone": ("sofa", "kitchen table", "desk", "bed", "washbasin"),
    "jacket": ("coat rack", "sofa", "bed", "armchair"),
    "reading": ("sofa", "coffee table", "bed", "armchair", "desk", "bookshelf"),
    "device": ("sofa", "coffee table", "desk", "dining table", "sideboard"),
    "supply": ("shelf", "desk"),
    "linen": ("washbasin", "bed", "washing machine"),
    "tool": ("sideboard", "counter"),
    "parcel": ("hall table", "desk", "kitchen table"),
}
PLACES = MappingProxyType({thing.name: _ABOUT[thing.category] for thing in THINGS.values()})
"""Where people put each thing down."""


def of_category(category: str) -> tuple[Thing, ...]:
    """The things of a kind."""
    return tuple(thing for thing in THINGS.values() if thing.category == category)


DISHES = frozenset(thing.name for category in ("cup", "plate", "bowl", "glass") for thing in of_category(category))
