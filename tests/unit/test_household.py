"""Tests of the household: its flat, its days, what is true behind the events, its pictures, and its files."""

from __future__ import annotations

import math
import tracemalloc
from collections import Counter, defaultdict
from datetime import date, datetime, timedelta
from itertools import islice, pairwise
from pathlib import Path
from uuid import UUID

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString

import elm
from elm import cues
from elm.errors import InvalidValue
from elm.event import Event
from elm.exchange import event_from_json, parse_json, type_from_json
from elm.interval import Interval
from elm.recognizers import Pattern, same, step
from elm.taxonomy import Taxonomy
from simulators import __main__ as command_line
from simulators.worlds.household import FIRST_DAY, Household, Move, event_types, last_places, moves, simulate_household
from simulators.worlds.household.floor_plan import (
    DOORS,
    FLAT,
    FRAME,
    FURNITURE,
    ROOMS,
    Point,
    length,
    route,
    swept,
)
from simulators.worlds.household.kinds import DAY, ROUTINES
from simulators.worlds.household.pictures import (
    COLUMN,
    FARTHEST,
    NAMES,
    NEAREST,
    PATTERNS,
    ROW,
    Polar,
    cell_of,
    draw,
    found,
    point_at,
    polar_of,
)
from simulators.worlds.household.things import COMMUTERS, OUTSIDE, PEOPLE, THINGS
from simulators.worlds.household.views import View, last_seen, views

DAYS = 14
TAXONOMY = Taxonomy(event_types())


@pytest.fixture(scope="module")
def life() -> list[Event]:
    """Two weeks with all that is known about them."""
    return list(simulate_household(1, structured=True, days=DAYS))


@pytest.fixture(scope="module")
def atomic(life: list[Event]) -> list[Event]:
    return [event for event in life if not event.is_complex]


@pytest.fixture(scope="module")
def by_uid(life: list[Event]) -> dict[UUID, Event]:
    return {event.uid: event for event in life}


@pytest.fixture(scope="module")
def seen() -> list[View]:
    return list(islice(views(1), 20_000))


def when(event: Event) -> tuple[datetime, datetime]:
    """Begin and end of an atomic event."""
    assert isinstance(event.interval, Interval)
    assert event.interval.end is not None
    return event.interval.begin, event.interval.end


def span(event: Event, known: dict[UUID, Event]) -> tuple[datetime, datetime]:
    """Begin and end of any event, from its parts."""
    if not event.is_complex:
        return when(event)
    spans = [span(known[part], known) for part in event.parts]
    return min(begin for begin, _ in spans), max(end for _, end in spans)


def days_of(life: list[Event], by_uid: dict[UUID, Event]) -> list[list[Event]]:
    """The routines of each day."""
    return [[by_uid[part] for part in event.parts] for event in life if event.type == DAY]


# The flat


def test_the_rooms_make_up_the_flat_and_do_not_overlap() -> None:
    assert len(ROOMS) == 6
    polygons = [room.region.polygon for room in ROOMS.values()]
    assert shapely.union_all(polygons).equals(FLAT.polygon)
    assert sum(polygon.area for polygon in polygons) == pytest.approx(FLAT.polygon.area)
    for door in DOORS:
        walls = [ROOMS[room].region.polygon for room in door.rooms]
        assert all(wall.boundary.distance(shapely.Point(door.middle)) < 1e-9 for wall in walls)
        assert all(wall.contains(shapely.Point(door.side(room))) for room, wall in zip(door.rooms, walls, strict=True))


def test_furniture_stands_in_its_room_with_space_to_use_it() -> None:
    pieces = list(FURNITURE.values())
    for piece in pieces:
        room = ROOMS[piece.room].region.polygon
        assert room.covers(piece.region.polygon)
        for place in (piece.spot, piece.seat):
            assert room.buffer(-0.25).contains(shapely.Point(place))
            assert all(other.region.polygon.distance(shapely.Point(place)) > 0.2 for other in pieces)
        assert all(piece.region.polygon.covers(slot.region.polygon) for slot in piece.slots)
        for one, other in pairwise(sorted(piece.slots, key=lambda slot: slot.at)):
            assert math.dist(one.at, other.at) > 0.09
    for number, piece in enumerate(pieces):
        assert all(piece.region.polygon.intersection(other.region.polygon).area == 0 for other in pieces[:number])


def test_every_way_leads_through_doors_and_around_furniture() -> None:
    for start in FURNITURE:
        for goal in FURNITURE:
            if start == goal:
                continue
            way = LineString(route(start, goal))
            assert length(start, goal) == pytest.approx(way.length)
            assert FLAT.polygon.covers(swept(start, goal).polygon)
            assert not any(way.intersects(piece.region.polygon) for piece in FURNITURE.values())
            # A way crosses a wall only where a door is.
            for room in ROOMS.values():
                crossed = shapely.get_coordinates(way.intersection(room.region.polygon.boundary))
                assert all(min(math.dist(point, door.middle) for door in DOORS) < 0.45 for point in crossed)


def test_forty_things_are_at_home_in_the_flat() -> None:
    assert len(THINGS) == 40
    assert all(THINGS[name].home in FURNITURE for name in THINGS)
    assert len(PEOPLE) == 3


# Types


def test_the_types_are_a_small_hierarchy_with_second_parents() -> None:
    types = event_types()
    assert 40 <= len(types) <= 60
    assert sum(len(each.parents) == 2 for each in types) >= 2
    assert TAXONOMY.is_a("Carry", "Motion")
    assert TAXONOMY.is_a("Carry", "Action")
    assert TAXONOMY.is_a("PersonPuts", "Perception")
    assert not TAXONOMY.is_a("Drive", "Action")


def test_two_weeks_show_most_types(life: list[Event]) -> None:
    leaves = {each.name for each in event_types()} - {parent for each in event_types() for parent in each.parents}
    told = {event.type for event in life}
    assert leaves <= told <= {each.name for each in event_types()}


# Events


def test_begins_and_ends_ascend_and_some_events_overlap(atomic: list[Event]) -> None:
    times = [when(event) for event in atomic]
    assert all(earlier[0] < later[0] for earlier, later in pairwise(times))
    assert all(earlier[1] <= later[1] for earlier, later in pairwise(times))
    assert sum(earlier[1] > later[0] for earlier, later in pairwise(times)) > 0.1 * len(times)
    assert max(end - begin for begin, end in times) <= timedelta(minutes=31)
    assert times[0][0].date() == FIRST_DAY


def test_everything_lies_inside_the_flat(atomic: list[Event]) -> None:
    inside = FLAT.polygon.buffer(1e-9)
    for event in atomic:
        assert event.region is not None
        for place in (event.region, event.subject):
            assert place is None or (place.frame == FRAME and inside.covers(place.polygon))


def test_people_rooms_furniture_and_things_are_known(atomic: list[Event]) -> None:
    known: dict[str, set[object]] = {
        "room": {*ROOMS},
        "object": {*THINGS},
        "category": {thing.category for thing in THINGS.values()},
        "person": {*PEOPLE, "courier"},
        "furniture": {*FURNITURE},
        "place": {*FURNITURE, *PEOPLE, "robot", OUTSIDE},
        "from": {*FURNITURE, *ROOMS, OUTSIDE},
        "to": {*ROOMS, OUTSIDE},
    }
    met: dict[str, set[object]] = defaultdict(set)
    for event in atomic:
        assert event.agent == "robot"
        for name, value in event.features:
            if name in known:
                assert value in known[name], (event.type, name, value)
                met[name].add(value)
    assert met["room"] == {*ROOMS}
    assert met["object"] == {*THINGS}
    assert met["person"] == {*PEOPLE, "courier"}


def test_what_is_seen_is_in_the_room_of_the_robot(atomic: list[Event]) -> None:
    for event in atomic:
        if event.type in ("SeeObject", "Place", "SeePerson", "PersonReads") and event.subject is not None:
            room = ROOMS[str(event.value("room"))].region.polygon
            assert room.covers(event.subject.polygon)
            assert event.region is not None
            assert room.covers(event.region.polygon)


def test_the_robot_holds_what_it_carries_and_puts_down(atomic: list[Event]) -> None:
    held: object = None
    for event in atomic:
        thing = event.value("object")
        match event.type:
            case "Grasp" | "Receive":
                assert held is None
                held = thing if event.value("place") == "robot" else None
            case "Carry" | "Pour":
                assert held == thing
            case "Place" | "HandOver":
                assert held == thing
                held = None
            case "Drive":
                assert held is None
            case _:
                pass


# Days


def test_the_routines_repeat_daily(life: list[Event], by_uid: dict[UUID, Event]) -> None:
    days = days_of(life, by_uid)
    assert len(days) == DAYS
    for number, routines in enumerate(days):
        day = FIRST_DAY + timedelta(days=number)
        counts = Counter(event.type for event in routines)
        assert all(counts[meal] == 1 for meal in ("Breakfast", "Lunch", "Dinner")), day
        assert counts["Night"] == 1
        assert counts["Patrol"] == 2
        assert counts["StandBy"] >= 5
        work = day.weekday() < 5
        assert (counts["Departure"], counts["Homecoming"]) == ((1, 1) if work else (0, 0))
        assert {(event.value("weekday"), event.value("weekend")) for event in routines} == {(f"{day:%A}", not work)}
    deliveries = [sum(event.type == "Delivery" for event in routines) for routines in days]
    assert 0 < sum(deliveries) < DAYS


def test_meals_are_at_their_times_and_no_two_days_are_alike(life: list[Event], by_uid: dict[UUID, Event]) -> None:
    begins = defaultdict(list)
    for event in life:
        if event.type in ("Breakfast", "Dinner"):
            begin, _ = span(event, by_uid)
            begins[event.type, event.value("weekend")].append(begin.hour + begin.minute / 60)
    assert all(6.7 < hour < 7.5 for hour in begins["Breakfast", False])
    assert all(8.7 < hour < 9.6 for hour in begins["Breakfast", True])
    assert all(18.7 < hour < 20 for hour in begins["Dinner", False])
    kinds = [tuple(by_uid[part].type for part in event.parts) for event in life if event.type == "Breakfast"]
    assert len(set(kinds)) == len(kinds)


def test_nobody_who_is_out_is_seen(atomic: list[Event]) -> None:
    out: set[object] = set()
    for event in atomic:
        person = event.value("person")
        if person not in COMMUTERS:
            continue
        if event.type == "PersonLeaves" and event.value("to") == OUTSIDE:
            out.add(person)
        elif event.type == "PersonEnters" and event.value("from") == OUTSIDE:
            out.discard(person)
        elif event.type != "Say":
            assert person not in out, event
    assert not out


def test_wholes_contain_their_parts_in_time(life: list[Event], by_uid: dict[UUID, Event]) -> None:
    position = {event.uid: number for number, event in enumerate(life)}
    wholes = [event for event in life if event.is_complex]
    assert {event.type for event in wholes} == {DAY, *ROUTINES}
    for whole in wholes:
        assert all(position[part] < position[whole.uid] for part in whole.parts)
        assert (whole.interval, whole.region) == (None, None)
    routines = [event for event in wholes if event.type != DAY]
    spans = [span(event, by_uid) for event in routines]
    # One routine after another: the last perception of one may reach into the next.
    assert all(earlier[0] < later[0] and earlier[1] <= later[1] for earlier, later in pairwise(spans))
    parts = [part for event in routines for part in event.parts]
    assert parts == [event.uid for event in life if not event.is_complex]
    assert [part for event in wholes if event.type == DAY for part in event.parts] == [each.uid for each in routines]


def test_a_memory_takes_it_all_and_derives_the_extents(life: list[Event], by_uid: dict[UUID, Event]) -> None:
    with elm.connect("memory://") as memory:
        memory.add_types(event_types())
        first = life[: 1 + next(number for number, event in enumerate(life) if event.type == DAY)]
        report = memory.load(first)
        assert (report.new, report.refused) == (len(first), 0)
        day = memory.get(first[-1].uid)
        assert (day.interval.begin, day.interval.end) == span(first[-1], by_uid)
        assert day.agent == "robot"
        assert day.region is not None
        assert FLAT.polygon.buffer(1e-9).covers(day.region.polygon)


def test_atomic_events_are_the_same_with_and_without_structure(atomic: list[Event]) -> None:
    bare = list(simulate_household(1, days=2))
    assert bare == atomic[: len(bare)]
    assert not any(event.is_complex for event in bare)


def test_seeds_reproduce_exactly(life: list[Event]) -> None:
    assert list(islice(simulate_household(1, structured=True), 4_000)) == life[:4_000]
    other = list(islice(simulate_household(2, structured=True), 4_000))
    assert not {event.uid for event in other} & {event.uid for event in life}
    assert [event.type for event in other] != [event.type for event in life[:4_000]]
    assert {event.uid.version for event in life} == {7}
    assert len({event.uid for event in life}) == len(life)


def test_another_first_day_is_another_weekday() -> None:
    saturday = date(2024, 1, 6)
    told = list(simulate_household(1, structured=True, days=1, first_day=saturday))
    assert when(told[0])[0].date() == saturday
    assert told[-1].value("weekday") == "Saturday"
    assert not any(event.type == "Departure" for event in told)


def test_a_household_streams_in_constant_memory_and_lives_once() -> None:
    household = Household(1)
    stream = household.events()
    for _ in islice(stream, 5_000):
        pass
    tracemalloc.start()
    try:
        for _ in islice(stream, 3_000):
            pass
        early = tracemalloc.get_traced_memory()[1]
        for _ in islice(stream, 6_000):
            pass
        late = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert late < 1.5 * early
    assert late < 10_000_000
    with pytest.raises(InvalidValue, match="lives once"):
        household.events()
    with pytest.raises(InvalidValue, match="one day at least"):
        simulate_household(1, days=0)


# The truth


def test_what_was_seen_last_was_true_then() -> None:
    household = Household(5)
    told: list[Event] = []
    for event in household.events(days=3):
        told.append(event)
        thing, place = event.value("object"), event.value("place")
        if isinstance(thing, str) and place is not None:
            assert household.places[thing].place == place, event
            if event.type in ("SeeObject", "Place", "PersonPuts"):
                assert household.places[thing].region == event.subject
    sightings = last_places(told)
    assert sightings == last_places(reversed(told))
    assert len(sightings) > 35
    for thing, sighting in sightings.items():
        last = [event for event in told if event.value("object") == thing and event.value("place") is not None][-1]
        assert (sighting.uid, sighting.place) == (last.uid, last.value("place"))
    right = [thing for thing, sighting in sightings.items() if household.places[thing].place == sighting.place]
    # Most things are where they were seen last, and not all: people move some unseen.
    assert 20 < len(right) < 40


def test_moves_tell_where_everything_is(atomic: list[Event]) -> None:
    household = Household(1)
    places = dict(household.places)
    assert set(places) == {*THINGS}
    told = list(household.happenings(days=2))
    moved = [each for each in told if isinstance(each, Move)]
    assert [each for each in told if isinstance(each, Event)] == atomic[: len(told) - len(moved)]
    for move in moved:
        assert places[move.thing] == move.origin != move.goal
        assert (move.goal.region is None) == (move.goal.place not in FURNITURE)
        places[move.thing] = move.goal
    assert places == household.places
    assert all(earlier.at <= later.at for earlier, later in pairwise(moved))
    assert {*PEOPLE, "robot"} <= {move.by for move in moved} <= {*PEOPLE, "robot", "courier"}
    assert list(islice(moves(1), len(moved))) == moved
    lying = [where.region for where in places.values() if where.region is not None]
    assert len(set(lying)) == len(lying)


# Recognition


def test_recognizers_find_the_routines(life: list[Event], by_uid: dict[UUID, Event]) -> None:
    number = next(count for count, day in enumerate(days_of(life, by_uid)) if any(e.type == "Delivery" for e in day))
    last = [event for event in life if event.type == DAY][max(number, 4)]
    first = life[: life.index(last) + 1]
    # One more event, for what ended last is told when it is certain that nothing earlier is to come.
    lived = [event for event in life[: len(first) + 1] if not event.is_complex]
    patterns = {
        "Delivery": Pattern(
            name="delivery",
            version=1,
            type="Delivered",
            elements=[
                step("rung", cues.is_a("HearSound") & cues.feature("sound", "=", "doorbell")),
                step("received", cues.is_a("Receive")),
                step("put", cues.is_a("Place"), same("object", "received")),
            ],
            within=timedelta(minutes=5),
        ),
        "Night": Pattern(
            name="night",
            version=1,
            type="Slept",
            elements=[
                step("docked", cues.is_a("Dock")),
                step("charged", cues.is_a("Charge")).one_or_more(),
                step("undocked", cues.is_a("Undock")),
            ],
            within=timedelta(hours=12),
        ),
        "Breakfast": Pattern(
            name="breakfast",
            version=1,
            type="Eaten",
            elements=[
                step(
                    "served",
                    cues.is_a("Place")
                    & cues.feature("object", "=", "cereal")
                    & cues.feature("place", "=", "kitchen table"),
                ),
                step("eaten", cues.is_a("PersonEats")).one_or_more(),
                step("wiped", cues.is_a("Wipe") & cues.feature("furniture", "=", "kitchen table")),
            ],
            within=timedelta(hours=3),
        ),
    }
    truth = {name: [set(event.parts) for event in first if event.type == name] for name in patterns}
    served = [
        parts
        for parts in truth["Breakfast"]
        if any(by_uid[part].type == "Place" and by_uid[part].value("object") == "cereal" for part in parts)
        and any(by_uid[part].type == "PersonEats" for part in parts)
    ]
    with elm.connect("memory://") as memory:
        memory.add_types(event_types())
        assert memory.load(lived).refused == 0
        replay = memory.recognize(patterns.values())
        assert replay.late == 0
        for name, pattern in patterns.items():
            expected = served if name == "Breakfast" else truth[name]
            results = [set(result.parts) for result in memory.recall(cues.exactly(pattern.type))]
            assert len(results) == len(expected) > 0, name
            assert all(result <= whole for result, whole in zip(results, expected, strict=True)), name


# Views


def test_patterns_differ_in_two_places_at_least() -> None:
    flat = PATTERNS.reshape(len(NAMES), -1)
    assert len(flat) == 40
    for number, pattern in enumerate(flat):
        assert all((pattern != other).sum() >= 2 for other in flat[:number])


def test_cells_are_true_to_half_a_cell() -> None:
    for bearing in np.linspace(-0.75, 0.75, 41):
        for distance in np.linspace(0.5, 4.7, 37):
            cell = cell_of(Polar(float(bearing), float(distance)))
            assert cell is not None
            shown = polar_of(*cell)
            assert abs(shown.bearing - bearing) <= COLUMN / 2 + 1e-9
            assert abs(shown.distance - distance) <= ROW / 2 + 1e-9
    for out in (Polar(0.8, 1.0), Polar(-0.8, 1.0), Polar(0.0, NEAREST), Polar(0.0, FARTHEST)):
        assert cell_of(out) is None


def test_things_that_hide_each_other_are_not_both_drawn() -> None:
    walls = np.full(32, 4.0)
    picture, drawn = draw(walls, [(0, Polar(0.0, 2.0)), (1, Polar(0.02, 1.9)), (2, Polar(0.5, 1.9))])
    assert drawn == [1, 2]
    assert set(found(picture)) == {NAMES[1], NAMES[2]}
    assert found(np.zeros_like(picture)) == {}


def test_views_are_pictures_from_a_pose_five_times_a_second(seen: list[View]) -> None:
    assert all(view.picture.shape == (24, 32) and view.picture.dtype == np.float32 for view in seen[::100])
    assert {later.time - earlier.time for earlier, later in pairwise(seen)} == {timedelta(seconds=0.2)}
    inside = FLAT.polygon.buffer(-0.25)
    poses = {(view.x, view.y) for view in seen}
    assert all(inside.contains(shapely.Point(pose)) for pose in poses)
    steps = [math.dist((earlier.x, earlier.y), (later.x, later.y)) for earlier, later in pairwise(seen)]
    assert 0.09 < max(steps) < 0.11
    still = sum(earlier.picture is later.picture for earlier, later in pairwise(seen)) / len(seen)
    assert 0.6 < still < 0.95
    with pytest.raises(ValueError, match="read-only"):
        seen[0].picture[0, 0] = 1


def test_found_is_what_is_visible(seen: list[View]) -> None:
    checked = seen[::10]
    for view in checked:
        cells = {name: cell_of(polar) for name, polar in view.visible.items()}
        assert found(view.picture) == {name: polar_of(*cell) for name, cell in cells.items() if cell is not None}
    assert max(len(view.visible) for view in checked) >= 5
    assert sum(len(view.visible) for view in checked) > len(checked)


def test_found_is_robust_to_small_noise() -> None:
    total = wrong = 0
    for view in islice(views(2, noise=0.03), 0, 6_000, 10):
        expected = {name: polar_of(*cell) for name, polar in view.visible.items() if (cell := cell_of(polar))}
        things = found(view.picture)
        total += len(expected)
        wrong += len(expected.items() ^ things.items())
    assert total > 500
    assert wrong <= 0.005 * total


def test_visible_things_are_where_they_are_seen(seen: list[View]) -> None:
    for view in seen[::50]:
        for name, polar in view.visible.items():
            slot = view.places[name]
            assert math.dist(point_at(view.x, view.y, view.heading, polar), slot.at) < 1e-6
            assert ROOMS[slot.room].region.polygon.covers(shapely.Point(view.x, view.y))


def test_the_last_place_of_each_thing_is_found_again(seen: list[View]) -> None:
    truth = last_seen(seen)
    assert len(truth) >= 35
    searched: dict[str, tuple[datetime, Point]] = {}
    for view in seen[-6_000:]:
        for name, polar in found(view.picture).items():
            searched[name] = view.time, point_at(view.x, view.y, view.heading, polar)
    assert len(searched) > 10
    for name, (time, place) in searched.items():
        assert truth[name][0] == time
        assert math.dist(truth[name][1].at, place) < math.hypot(ROW / 2, FARTHEST * COLUMN / 2) + 1e-6
    moved = [name for name, (_, slot) in truth.items() if seen[-1].places[name] != slot]
    assert 0 < len(moved) < len(truth)


def test_views_repeat_with_their_seed() -> None:
    def drawn(seed: int, noise: float = 0.0) -> list[bytes]:
        return [view.picture.tobytes() for view in islice(views(seed, noise=noise), 300)]

    assert drawn(1, 0.02) == drawn(1, 0.02)
    assert drawn(1) != drawn(2)
    assert drawn(1) != drawn(1, 0.02)
    with pytest.raises(InvalidValue, match="rate above 0"):
        next(views(1, rate=0))


def test_one_thing_lies_at_one_place(seen: list[View]) -> None:
    for view in seen[::2_000]:
        assert set(view.places) == {*NAMES}
        assert len(set(view.places.values())) == len(NAMES)


# The command


@pytest.mark.parametrize("structured", [False, True])
def test_the_command_writes_what_a_memory_loads(
    structured: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "life.jsonl"
    options = ["--structured"] if structured else []
    assert command_line.main(["household", "--days", "1", "--seed", "4", "-o", str(file), *options]) == 0
    assert f"elm load {file}" in capsys.readouterr().out
    lines = file.read_text(encoding="utf-8").splitlines()
    events = [event_from_json(parse_json(line, what="a line")).event for line in lines]
    assert events == list(simulate_household(4, structured=structured, days=1))
    kinds = (tmp_path / "life.types.jsonl").read_text(encoding="utf-8").splitlines()
    assert [type_from_json(parse_json(line, what="a line")) for line in kinds] == event_types()


def test_the_command_says_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["household", "--days", "0", "-o", str(tmp_path / "life.jsonl")]) == 1
    assert "one day at least" in capsys.readouterr().err
    assert command_line.main(["household", "-o", str(tmp_path / "missing" / "life.jsonl")]) == 1
    assert "missing" in capsys.readouterr().err
