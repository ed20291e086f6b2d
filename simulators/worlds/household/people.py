"""The people of the household: how they go about, speak, take things and put them elsewhere, seen or not."""

from __future__ import annotations

from elm.interval import from_micros
from simulators.worlds.household.floor_plan import FURNITURE
from simulators.worlds.household.life import Life
from simulators.worlds.household.things import OUTSIDE, PARCEL, PEOPLE, THINGS
from simulators.worlds.household.truth import Whereabouts

_HAUNTS: tuple[tuple[int, tuple[str, ...]], ...] = (
    (6, ("bed", "bed", "washbasin", "wardrobe", "nightstand")),
    (9, ("kitchen table", "washbasin", "wardrobe", "counter", "hall table")),
    (17, ("desk", "desk", "desk", "shelf", "sofa", "counter", "armchair", "washbasin")),
    (21, ("sofa", "sofa", "dining table", "counter", "coffee table", "desk", "bookshelf", "armchair", "bed")),
    (24, ("bed", "bed", "sofa", "washbasin", "nightstand")),
)
"""Up to which hour the people are at which furniture, as often as it is named."""
_SAYINGS = (
    "Where is the remote control?",
    "Have you seen my keys?",
    "It smells of coffee.",
    "Could you turn the light on?",
    "I am going to work for a while.",
    "What shall we have for dinner?",
    "The novel is really good.",
    "Please bring me a glass.",
)
_PASTIMES = {"desk": "PersonWorks", "sofa": "PersonReads", "armchair": "PersonReads", "bookshelf": "PersonReads"}


def at_home(life: Life) -> list[str]:
    """The people who are in the flat."""
    return [person for person in PEOPLE if life.people[person] != OUTSIDE]


def go(life: Life, person: str, furniture: str) -> None:
    """A person goes to some furniture; the robot sees that where it is the room left or entered."""
    before, room = life.people[person], FURNITURE[furniture].room
    was_here = life.is_here(person)
    if was_here and room != life.room:
        life.see_person("PersonLeaves", person, life.between(1, 3), (("to", room),))
    life.people[person] = furniture
    if life.is_here(person) and not was_here:
        source = OUTSIDE if before == OUTSIDE else FURNITURE[before].room
        life.see_person("PersonEnters", person, life.between(1, 3), (("from", source),))


def take(life: Life, person: str, thing: str, *, goal: Whereabouts | None = None) -> None:
    """A person takes a thing that lies somewhere, or takes it along out of the flat."""
    origin, region = life.places[thing], life.slot_region(thing)
    go(life, person, origin.place)
    life.move(thing, goal or Whereabouts(place=person), by=person)
    if life.is_here(person):
        life.see_handled("PersonTakes", person, thing, origin.place, (goal or life.places[thing]).place, region)


def lay_down(life: Life, person: str, thing: str, furniture: str) -> None:
    """A person puts down a thing."""
    furniture = life.with_room(furniture)
    go(life, person, furniture)
    life.lay(thing, furniture, by=person)
    if life.is_here(person):
        life.see_handled("PersonPuts", person, thing, furniture, furniture, life.slot_region(thing))


def stir(life: Life) -> None:
    """One of the people at home does something: goes elsewhere, speaks, moves a thing, or passes the time."""
    present = at_home(life)
    if not present:
        return
    chance = life.chance
    person = chance.choice(present)
    held = [thing for thing, at in life.places.items() if at.place == person]
    what = chance.random()
    if held:
        lay_down(life, person, held[0], life.some_place_of(held[0]))
    elif what < 0.35:
        hour = from_micros(life.now).hour
        go(life, person, chance.choice(next(names for until, names in _HAUNTS if hour < until)))
    elif what < 0.5:
        thing = chance.choice([name for name, at in life.places.items() if at.region is not None])
        take(life, person, thing)
        if thing == PARCEL:
            # It is unpacked, and no parcel any more.
            life.move(PARCEL, Whereabouts(place=OUTSIDE), by=person)
        elif chance.random() < 0.8:
            lay_down(life, person, thing, life.some_place_of(thing))
    elif life.is_here(person):
        if what < 0.75:
            life.hear(person, chance.choice(_SAYINGS))
        else:
            kind = _PASTIMES.get(life.people[person], "SeePerson")
            life.see_person(kind, person, life.between(5, 60))


def leave(life: Life, person: str) -> None:
    """A person puts down what is at hand, takes what one takes along, and leaves the flat."""
    for thing, at in [*life.places.items()]:
        if at.place == person:
            lay_down(life, person, thing, life.some_place_of(thing))
    away = Whereabouts(place=OUTSIDE)
    for own in THINGS.values():
        if own.owner == person and life.places[own.name].region is not None:
            take(life, person, own.name, goal=away)
    go(life, person, "hall table")
    if life.is_here(person):
        life.see_person("PersonLeaves", person, life.between(2, 4), (("to", OUTSIDE),), at_door=True)
    life.people[person] = OUTSIDE


def come_home(life: Life, person: str) -> None:
    """A person comes home and puts things where they belong, or somewhere."""
    go(life, person, "hall table")
    for thing in THINGS.values():
        if thing.owner == person and life.places[thing.name].place == OUTSIDE:
            tidy = life.chance.random() < 0.7
            lay_down(life, person, thing.name, thing.home if tidy else life.some_place_of(thing.name))
    if life.is_here(person):
        life.hear(person, "Hello, I am back.")
