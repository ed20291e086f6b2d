"""A robot's life in the flat, doing by doing: the clock, where everything is, and what the robot tells of it."""

from __future__ import annotations

import random
from collections.abc import Sequence
from datetime import datetime
from functools import cache
from uuid import UUID

from elm.event import Event
from elm.features import Feature
from elm.geometry import Region
from elm.interval import Interval, from_micros, to_micros
from simulators.worlds.household.floor_plan import (
    BODY,
    DOCK,
    FOOTPRINT,
    FRONT_DOOR,
    FURNITURE,
    Point,
    Slot,
    around,
    length,
    pieces,
    swept,
)
from simulators.worlds.household.things import DISHES, OUTSIDE, PARCEL, PEOPLE, PLACES, THINGS
from simulators.worlds.household.truth import Move, Whereabouts

AGENT = "robot"
SPEED = 0.45
"""Metres a second that the robot drives, on average."""

_STANCES = 6
"""Places, a little beside each other, where the robot stops at one piece of furniture."""
_AWAY = Whereabouts(place=OUTSIDE)


@cache
def stance(furniture: str, number: int) -> Region:
    """What the robot covers when it stands in front of a piece of furniture, never quite at the same place."""
    x, y = FURNITURE[furniture].spot
    chance = random.Random(f"{furniture} {number}")
    return around(Point(x + chance.uniform(-0.05, 0.05), y + chance.uniform(-0.05, 0.05)), FOOTPRINT)


@cache
def seat(furniture: str) -> Region:
    """What a person covers who is at a piece of furniture."""
    return around(FURNITURE[furniture].seat, BODY)


AT_FRONT_DOOR = around(FRONT_DOOR, BODY)


@cache
def _in(slot: Slot) -> Whereabouts:
    return Whereabouts(place=slot.furniture, room=slot.room, region=slot.region)


class Life:
    """The state of the household, and the doings by which it goes on; `told` gathers events and moves in order.

    Begins and ends of the events told ascend alike: events may overlap, but none lies within another.
    """

    def __init__(self, seed: int, begin: datetime) -> None:
        self.chance = random.Random(seed)
        self.now = to_micros(begin)
        """Microseconds since 1970 at which the next doing begins."""
        self.told: list[Event | Move] = []
        self.at = DOCK
        """The furniture in front of which the robot stands."""
        self.battery = 1.0
        self.people: dict[str, str] = dict.fromkeys(PEOPLE, "bed")
        """The furniture at which each person is, or `OUTSIDE`."""
        self.places: dict[str, Whereabouts] = {}
        self._region = stance(DOCK, 0)
        self._last_end = self.now
        self._slots: dict[str, Slot] = {}
        self._free = {name: list(piece.slots) for name, piece in FURNITURE.items()}
        for thing in THINGS.values():
            if thing.name == PARCEL:
                self.places[thing.name] = _AWAY
            else:
                self._slots[thing.name] = self._take_slot(thing.home)
                self.places[thing.name] = _in(self._slots[thing.name])

    # Telling

    @property
    def room(self) -> str:
        """The room in which the robot is."""
        return FURNITURE[self.at].room

    def uid(self, micros: int) -> UUID:
        """A UUID of version 7 of that time."""
        bits = self.chance.getrandbits(74)
        high = (micros // 1000) << 16 | 0x7000 | bits >> 62
        return UUID(int=high << 64 | 0b10 << 62 | bits & (1 << 62) - 1)

    def tell(
        self,
        kind: str,
        seconds: float,
        features: Sequence[Feature] = (),
        *,
        subject: Region | None = None,
        region: Region | None = None,
        until_next: float = 1.0,
    ) -> None:
        """An event that begins now; the next one begins when `until_next` of it is over."""
        begin = self.now
        end = max(begin + round(seconds * 1e6), self._last_end)
        event = Event(
            type=kind,
            interval=Interval(begin=from_micros(begin), end=from_micros(end)),
            region=region or self._region,
            subject=subject,
            features=(*features, ("room", self.room)),
            agent=AGENT,
            uid=self.uid(begin),
        )
        self.told.append(event)
        self._last_end = end
        self.now = max(begin + 1, begin + round((end - begin) * until_next))

    def between(self, least: float, most: float) -> float:
        """A number drawn uniformly."""
        return self.chance.uniform(least, most)

    def pause(self, seconds: float) -> None:
        """Time in which nothing is told."""
        self.now += round(seconds * 1e6)

    # Moving about

    def drive_to(self, furniture: str, *, holding: str | None = None) -> None:
        """Drive, or carry what the robot holds, to the furniture; no event where it stands there already."""
        if self.at == furniture:
            return
        metres = length(self.at, furniture)
        seconds = 2 + metres / SPEED * self.between(0.9, 1.3)
        told: list[Feature] = [("from", self.room), ("distance", round(metres, 2))]
        kind = "Drive"
        if holding is not None:
            kind = "Carry"
            told += [*self._about(holding), ("place", AGENT)]
        region = swept(self.at, furniture)
        self.battery = max(0.2, self.battery - metres * 0.0008)
        self.at = furniture
        self.tell(kind, seconds, told, region=region)
        self._region = stance(furniture, self.chance.randrange(_STANCES))

    # Handling things

    def pick(self, thing: str) -> bool:
        """Fetch a thing from where it lies; it slips now and then. False where it cannot be fetched."""
        slot = self._slots.get(thing)
        if slot is None:
            return False
        piece = FURNITURE[slot.furniture]
        self.drive_to(piece.name)
        if piece.closed:
            self.tell("Open", self.between(2, 4), (("furniture", piece.name),), subject=piece.region)
        told = (*self._about(thing), ("from", piece.name))
        while self.chance.random() < 0.03:
            self.tell("Grasp", self.between(3, 6), (*told, ("place", piece.name)), subject=slot.region)
            self.tell("Drop", 0, (*told, ("place", piece.name)), subject=slot.region)
        self.move(thing, Whereabouts(place=AGENT), by=AGENT)
        self.tell("Grasp", self.between(3, 6), (*told, ("place", AGENT)), subject=slot.region)
        if piece.closed:
            self.tell("Close", self.between(2, 4), (("furniture", piece.name),), subject=piece.region)
        return True

    def put(self, thing: str, furniture: str) -> None:
        """Carry what the robot holds to the furniture and put it down there, or beside where no room is left."""
        furniture = self.with_room(furniture)
        piece = FURNITURE[furniture]
        self.drive_to(furniture, holding=thing)
        if piece.closed:
            self.tell("Open", self.between(2, 4), (("furniture", furniture),), subject=piece.region)
        self.lay(thing, furniture, by=AGENT)
        self.tell(
            "Place",
            self.between(2, 5),
            (*self._about(thing), ("place", furniture)),
            subject=self._slots[thing].region,
        )
        if piece.closed:
            self.tell("Close", self.between(2, 4), (("furniture", furniture),), subject=piece.region)

    def bring(self, thing: str, furniture: str) -> bool:
        """Fetch a thing and put it down on the furniture, unless it is there or cannot be fetched."""
        if self.places[thing].place == furniture or not self.pick(thing):
            return False
        self.put(thing, furniture)
        return True

    def home_of(self, thing: str) -> str:
        """Where the robot tidies a thing to: what was used to eat from goes into the dishwasher."""
        return "dishwasher" if thing in DISHES else THINGS[thing].home

    def with_room(self, furniture: str) -> str:
        """The furniture, or if it is full, the next in its room that is not."""
        candidates = [furniture, *(piece.name for piece in pieces(FURNITURE[furniture].room))]
        return next(name for name in candidates if self._free[name])

    def lay(self, thing: str, furniture: str, *, by: str) -> None:
        """The thing comes to lie on or in the furniture."""
        slot = self._take_slot(furniture)
        self.move(thing, _in(slot), by=by)
        self._slots[thing] = slot

    def move(self, thing: str, goal: Whereabouts, *, by: str) -> None:
        """A thing is somewhere else from now on; where it lay there is room again."""
        origin, self.places[thing] = self.places[thing], goal
        if (slot := self._slots.pop(thing, None)) is not None:
            self._free[slot.furniture].append(slot)
        self.told.append(Move(at=from_micros(self.now), thing=thing, by=by, origin=origin, goal=goal))

    def lying(self, *furniture: str) -> list[str]:
        """The things on or in the furniture."""
        return [thing for thing, slot in self._slots.items() if slot.furniture in furniture]

    def misplaced(self, room: str) -> list[str]:
        """The things that lie openly in a room and belong elsewhere."""
        return [
            thing
            for thing, slot in self._slots.items()
            if slot.room == room and not FURNITURE[slot.furniture].closed and slot.furniture != THINGS[thing].home
        ]

    def _take_slot(self, furniture: str) -> Slot:
        free = self._free[furniture]
        return free.pop(self.chance.randrange(len(free)))

    def _about(self, thing: str) -> tuple[Feature, ...]:
        return ("object", thing), ("category", THINGS[thing].category)

    # Looking

    def look_around(self, share: float = 0.85) -> None:
        """See most of what lies openly in the room, and who is there."""
        self.tell("Turn", self.between(2, 5), (("degrees", round(self.between(-180, 180), 1)),), until_next=0.6)
        here = self.room
        for thing, slot in [*self._slots.items()]:
            if slot.room == here and self.chance.random() < share and not FURNITURE[slot.furniture].closed:
                self.see(thing)
        for person in PEOPLE:
            if self.is_here(person):
                self.see_person("SeePerson", person, self.between(1, 4))

    def see(self, thing: str) -> None:
        """See where a thing lies."""
        slot = self._slots[thing]
        confidence = round(self.between(0.6, 1.0), 2)
        told = (*self._about(thing), ("place", slot.furniture), ("confidence", confidence))
        self.tell("SeeObject", self.between(0.5, 2), told, subject=slot.region, until_next=0.5)

    def is_here(self, person: str) -> bool:
        """Whether a person is in the robot's room."""
        at = self.people[person]
        return at != OUTSIDE and FURNITURE[at].room == self.room

    def see_person(
        self, kind: str, person: str, seconds: float, features: Sequence[Feature] = (), *, at_door: bool = False
    ) -> None:
        """See a person, or what a person does, in the robot's room."""
        subject = AT_FRONT_DOOR if at_door else seat(self.people[person])
        self.tell(kind, seconds, (("person", person), *features), subject=subject, until_next=self.between(0.4, 1))

    def see_handled(self, kind: str, person: str, thing: str, furniture: str, place: str, region: Region) -> None:
        """See a person take a thing from the furniture, or put it there; `place` is where the thing is then."""
        told = (("person", person), *self._about(thing), ("furniture", furniture), ("place", place))
        self.tell(kind, self.between(1, 4), told, subject=region)

    def say(self, person: str, text: str) -> None:
        """Speak to a person."""
        self.tell("Say", 0.5 + 0.06 * len(text), (("person", person), ("text", text)))

    def hear(self, person: str, text: str) -> None:
        """Hear a person who is in the room speak."""
        told = (("person", person), ("text", text))
        self.tell("HearSpeech", 0.5 + 0.06 * len(text), told, subject=seat(self.people[person]), until_next=0.8)

    def some_place_of(self, thing: str) -> str:
        """Where a person puts a thing down, with room for it."""
        return self.with_room(self.chance.choice(PLACES[thing]))

    def slot_region(self, thing: str) -> Region:
        """Where a thing lies that lies somewhere."""
        return self._slots[thing].region
