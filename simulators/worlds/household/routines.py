"""The routines of the robot's day, each a function that goes through its actions; never twice quite the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime, time, timedelta
from functools import partial
from types import MappingProxyType

from elm.interval import from_micros, to_micros
from simulators.worlds.household.floor_plan import DOCK, FURNITURE, ROOMS, pieces
from simulators.worlds.household.life import AGENT, AT_FRONT_DOOR, Life, seat
from simulators.worlds.household.people import at_home, come_home, go, leave, stir
from simulators.worlds.household.things import (
    CAN,
    COMMUTERS,
    DISHES,
    OUTSIDE,
    PARCEL,
    PEOPLE,
    THINGS,
    of_category,
)
from simulators.worlds.household.truth import Whereabouts

CHARGED = timedelta(minutes=30)
"""Length of one event of charging: a night is many of them, so that it is known while it lasts."""
RISE = time(6, 20)
"""When the robot leaves its dock."""

_TABLES = ("counter", "kitchen table", "dining table", "coffee table", "desk", "sideboard", "washbasin")
_SOUNDS = ("a car", "rain", "steps", "a door", "the fridge")


def meal(life: Life, *, table: str, dishes: Sequence[str], foods: Sequence[str]) -> None:
    """Lay the table, be there while the people eat, clear away, and wipe the table."""
    guests = at_home(life)
    if not guests:
        return
    laid = [
        chosen
        for dish in dishes
        for chosen in _some(life, [thing.name for thing in of_category(dish)], len(guests))
        if life.bring(chosen, table)
    ]
    fetched = [food for food in foods if life.bring(food, table)]
    life.drive_to(table)
    for person in guests:
        if life.people[person] != table:
            go(life, person, table)
        life.say(person, "Breakfast is ready." if "cereal" in foods else "The meal is ready.")
    for person in guests:
        if life.people[person] == table:
            life.hear(person, life.chance.choice(("Thank you!", "That looks good.", "Good.")))
            life.see_person("PersonEats", person, life.between(240, 900))
    for thing in laid:
        life.bring(thing, "dishwasher")
    for thing in fetched:
        life.bring(thing, THINGS[thing].home)
    _wipe(life, table)


def patrol(life: Life) -> None:
    """Go into every room and look at what lies there."""
    rooms = life.chance.sample([*ROOMS], len(ROOMS))
    for room in rooms:
        for piece in _some(life, [piece.name for piece in pieces(room, open_only=True)], life.chance.choice((1, 2))):
            life.drive_to(piece)
            life.look_around()
        if life.chance.random() < 0.3:
            stir(life)


def tidy(life: Life) -> None:
    """Bring what lies about to where it belongs, in some of the rooms."""
    for room in _some(life, [*ROOMS], 4):
        found = life.misplaced(room)
        if found:
            life.drive_to(pieces(room, open_only=True)[0].name)
            life.look_around(share=0.6)
        for thing in _some(life, found, 6):
            life.bring(thing, life.home_of(thing))
        if life.chance.random() < 0.5:
            stir(life)


def unload(life: Life) -> None:
    """Put the clean dishes from the dishwasher into the cupboard."""
    for thing in life.lying("dishwasher"):
        if thing in DISHES:
            life.bring(thing, "cupboard")


def clean(life: Life) -> None:
    """Wipe some of the tables."""
    for table in _some(life, _TABLES, 4):
        _wipe(life, table)


def water(life: Life) -> None:
    """Water the plants with the can, and bring it back."""
    if not life.pick(CAN):
        return
    for furniture in _some(life, ("bookshelf", "shelf", "nightstand", "counter"), 3):
        life.drive_to(furniture, holding=CAN)
        life.tell("Pour", life.between(5, 12), (("object", CAN), ("place", AGENT)))
    life.put(CAN, THINGS[CAN].home)


def delivery(life: Life) -> None:
    """The doorbell rings: receive a parcel at the front door and put it where it is found."""
    if life.places[PARCEL].place != OUTSIDE:
        return
    life.tell("HearSound", life.between(1, 2), (("sound", "doorbell"),))
    life.drive_to("hall table")
    life.say("courier", "Good morning.")
    life.move(PARCEL, Whereabouts(place=AGENT), by="courier")
    told = (("object", PARCEL), ("category", "parcel"), ("person", "courier"), ("place", AGENT))
    life.tell("Receive", life.between(4, 9), told, subject=AT_FRONT_DOOR)
    if life.chance.random() < 0.3 and life.is_here("Carla"):
        life.say("Carla", "There is a parcel.")
    life.put(PARCEL, life.chance.choice(("hall table", "hall table", "desk")))


def departure(life: Life) -> None:
    """See the people off who go to work."""
    life.drive_to("hall table")
    for person in life.chance.sample(COMMUTERS, len(COMMUTERS)):
        if life.people[person] != OUTSIDE:
            life.say(person, f"Goodbye, {person}.")
            leave(life, person)
            life.pause(life.between(60, 600))


def homecoming(life: Life) -> None:
    """Welcome those who come home."""
    life.drive_to("hall table")
    for person in life.chance.sample(PEOPLE, len(PEOPLE)):
        if life.people[person] == OUTSIDE:
            life.tell("HearSound", life.between(1, 2), (("sound", "key in the lock"),))
            come_home(life, person)
            life.say(person, f"Hello, {person}.")
            life.pause(life.between(60, 900))


def bring_something(life: Life) -> None:
    """Hand a drink to somebody who works or rests, and see it put down."""
    drinkers = at_home(life)
    glasses = [thing for thing in life.lying("cupboard", "counter") if THINGS[thing].category in ("cup", "glass")]
    if not drinkers or not glasses:
        return
    person, thing = life.chance.choice(drinkers), life.chance.choice(glasses)
    if life.pick(thing):
        life.drive_to(life.people[person], holding=thing)
        life.move(thing, Whereabouts(place=person), by=AGENT)
        told = (("object", thing), ("category", THINGS[thing].category), ("person", person), ("place", person))
        life.tell("HandOver", life.between(3, 8), told, subject=seat(life.at))
        life.hear(person, "Thank you!")


def stand_by(life: Life, until: int) -> None:
    """Be about where people are, look here and there, and see what they do, up to a time."""
    life.drive_to(life.chance.choice(("counter", "sofa", "dining table", "desk", "hall table", "bed")))
    while life.now < until:
        what = life.chance.random()
        if what < 0.45:
            stir(life)
        elif what < 0.85:
            lying = _some(life, life.misplaced(life.room), life.chance.randint(1, 4))
            for thing in lying:
                life.see(thing)
            if not lying:
                life.tell("Look", life.between(1, 4))
        elif what < 0.9:
            life.look_around(share=0.5)
        elif what < 0.92:
            bring_something(life)
        else:
            life.tell("Wait", min(life.between(20, 90), max(1.0, (until - life.now) / 1e6)))
        life.pause(life.chance.expovariate(1 / 25))


def night(life: Life) -> None:
    """Charge in the dock until the next morning, and hear what there is to hear."""
    life.drive_to(DOCK)
    life.tell("Dock", life.between(8, 15), (("battery", round(life.battery, 3)),))
    evening = from_micros(life.now)
    day = evening.date() + timedelta(days=evening.time() > RISE)
    rise = to_micros(datetime.combine(day, RISE, tzinfo=UTC)) + round(life.chance.gauss(0, 240) * 1e6)
    for person in PEOPLE:
        if life.people[person] != OUTSIDE:
            life.people[person] = "bed"
    while life.now < rise:
        seconds = min(CHARGED.total_seconds(), max(1.0, (rise - life.now) / 1e6))
        life.battery = min(1.0, life.battery + seconds / 3600 / 5)
        life.tell("Charge", seconds, (("battery", round(life.battery, 3)),))
        if life.chance.random() < 0.1:
            life.tell("HearSound", life.between(1, 20), (("sound", life.chance.choice(_SOUNDS)),))
    life.tell("Undock", life.between(5, 10), (("battery", round(life.battery, 3)),))


def _wipe(life: Life, table: str) -> None:
    life.drive_to(table)
    for _ in range(life.chance.randint(2, 4)):
        life.tell("Wipe", life.between(4, 9), (("furniture", table),), subject=FURNITURE[table].region)


def _some(life: Life, given: Sequence[str], most: int) -> list[str]:
    return life.chance.sample(given, min(most, len(given)))


ROUTINES: Mapping[str, Callable[[Life], None]] = MappingProxyType(
    {
        "Breakfast": partial(
            meal, table="kitchen table", dishes=("bowl", "cup"), foods=("milk", "cereal", "bread", "butter", "jam")
        ),
        "Lunch": partial(meal, table="kitchen table", dishes=("plate", "glass"), foods=("juice", "bread", "apples")),
        "Dinner": partial(meal, table="dining table", dishes=("plate", "glass"), foods=("juice", "bread", "butter")),
        "Patrol": patrol,
        "Tidying": tidy,
        "Unloading": unload,
        "Cleaning": clean,
        "Watering": water,
        "Delivery": delivery,
        "Departure": departure,
        "Homecoming": homecoming,
        "Night": night,
    }
)
"""What is done in each routine, by its type; `StandBy` fills the time between them."""
