"""Tests of the simulators: what is drawn, how often, how large, whether seeds repeat it, and what class cues are of."""

from __future__ import annotations

import gc
import subprocess
import sys
import tracemalloc
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from datetime import timedelta
from itertools import islice, pairwise
from statistics import fmean

import pytest
import shapely

from elm import cues
from elm.cues.algebra import Cue
from elm.errors import InvalidValue
from elm.event import Event, StoredEvent
from elm.features import kind_of
from elm.geometry import Region
from elm.interval import Interval
from elm.query import Order, Query
from elm.storage.memory import MemoryStore
from elm.store import Arrival
from elm.taxonomy import EventType, Taxonomy
from simulators import __main__ as command_line
from simulators.worlds import hierarchy, vocabulary
from simulators.worlds.events import World, simulate
from simulators.worlds.household import simulate_household
from simulators.worlds.queries import CLASSES, classes_of, cue_of, simulate_queries

COUNT = 20_000


@pytest.fixture(scope="module")
def life() -> list[Event]:
    return list(islice(simulate(1), COUNT))


@pytest.fixture(scope="module")
def atomic(life: list[Event]) -> list[Event]:
    return [event for event in life if not event.is_complex]


@pytest.fixture(scope="module")
def store(life: list[Event]) -> MemoryStore:
    store = MemoryStore()
    store.add_types(hierarchy.event_types())
    report = store.load([Arrival(event=event) for event in life[:2_000]])
    assert (report.new, report.refused) == (2_000, ())
    return store


@pytest.fixture(scope="module")
def stored(store: MemoryStore) -> list[StoredEvent]:
    return list(store.find(Query(order=Order.ID)))


def intervals(events: Sequence[Event]) -> list[Interval]:
    return [event.interval for event in events if event.interval is not None]


def regions(events: Sequence[Event]) -> list[Region]:
    return [event.region for event in events if event.region is not None]


# Types


def test_the_hierarchy_has_ten_roots_and_ten_children_to_an_inner_node() -> None:
    types = hierarchy.event_types()
    assert [len(level) for level in hierarchy.levels()] == [10, 100, 1_000, 10_000]
    assert len({one.name for one in types}) == len(types) == 11_110
    first = Counter(one.parents[0] for one in types if one.parents)
    assert len(first) == 1_110
    assert set(first.values()) == {10}
    assert sum(not one.parents for one in types) == 10


def test_some_nodes_have_a_second_parent_one_level_above() -> None:
    types = hierarchy.event_types()
    several = [one for one in types if len(one.parents) > 1]
    assert 0.03 * len(types) < len(several) < 0.07 * len(types)
    assert all(len({parent.count(".") for parent in one.parents}) == 1 for one in several)
    assert all(one.parents[1].count(".") == one.name.count(".") - 1 for one in several)


def test_the_hierarchy_is_acyclic_and_always_the_same() -> None:
    types = hierarchy.event_types()
    assert types == hierarchy.event_types()
    taxonomy = Taxonomy(types)
    under_roots = [taxonomy.descendants(f"type-{root}") for root in range(10)]
    assert all(len(names) >= 1_111 for names in under_roots)
    assert len(frozenset().union(*under_roots)) == 11_110


# Events


def test_types_are_drawn_uniformly_over_all_nodes(life: list[Event]) -> None:
    counts = Counter(event.type for event in life)
    names = [name for level in hierarchy.levels() for name in level]
    assert set(counts) <= set(names)
    expected = COUNT / len(names)
    assert 10_600 < sum((counts[name] - expected) ** 2 / expected for name in names) < 11_600
    for level in hierarchy.levels()[1:]:
        share = len(level) / len(names)
        assert abs(sum(counts[name] for name in level) - COUNT * share) < 4 * (COUNT * share) ** 0.5


def test_every_tenth_event_is_complex_with_the_nine_before_it(life: list[Event]) -> None:
    for start in range(0, COUNT, 10):
        *nine, tenth = life[start : start + 10]
        assert all(not event.is_complex for event in nine)
        assert tenth.parts == tuple(event.uid for event in nine)
        assert (tenth.interval, tenth.region) == (None, None)


def test_five_features_of_fifty_names_and_four_kinds(life: list[Event]) -> None:
    assert all(len({name for name, _ in event.features}) == len(event.features) == 5 for event in life)
    names = Counter(name for event in life for name, _ in event.features)
    assert len(names) == len(vocabulary.table()) == 50
    assert all(abs(count - COUNT / 10) < 5 * (COUNT / 10) ** 0.5 for count in names.values())
    kinds = Counter((kind_of(value), type(value)) for event in life for _, value in event.features)
    assert set(kinds) == {("s", str), ("n", int), ("n", float), ("b", bool)}
    for name in names:
        assert len({kind_of(value) for event in life[:5_000] for value in event.values(name)}) == 1


def test_payloads_are_about_two_hundred_bytes(life: list[Event]) -> None:
    payloads = [event.payload.data for event in life if event.payload is not None]
    sizes = [len(data) for data in payloads]
    assert len(sizes) == COUNT
    assert (min(sizes), max(sizes)) == (180, 220)
    assert abs(fmean(sizes) - 200) < 1
    assert len(set(payloads)) == COUNT


def test_time_passes(atomic: list[Event]) -> None:
    times = intervals(atomic)
    gaps = [later.begin - earlier.begin for earlier, later in pairwise(times)]
    assert min(gaps) > timedelta()
    assert timedelta(seconds=1.9) < sum(gaps, timedelta()) / len(gaps) < timedelta(seconds=2.2)
    lengths = [time.end - time.begin for time in times if time.end is not None]
    assert len(lengths) == len(times)
    assert 0.08 < sum(length == timedelta() for length in lengths) / len(lengths) < 0.12
    assert max(lengths) <= timedelta(seconds=60)
    assert any(earlier.end > later.begin for earlier, later in pairwise(times) if earlier.end is not None)


def test_the_robot_stays_on_the_map_and_gets_about(atomic: list[Event]) -> None:
    world = World()
    places = regions(atomic)
    assert len(places) == len(atomic)
    whole_map = shapely.box(0, 0, world.side, world.side).buffer(1e-9)
    polygons = [place.polygon for place in places]
    assert shapely.covered_by(polygons, whole_map).all()
    assert shapely.is_valid(polygons).all()
    assert shapely.area(polygons).min() > 0.25
    assert shapely.area(polygons).max() < 2 * world.footprint * (world.top_speed * 60) + 1
    centres = shapely.get_coordinates(shapely.centroid(polygons))
    assert (centres.max(axis=0) - centres.min(axis=0) > world.side / 2).all()
    steps = [abs(complex(*later) - complex(*earlier)) for earlier, later in pairwise(centres)]
    assert max(steps) < 60
    assert 0.5 < fmean(steps) < 3


def test_a_small_world_keeps_its_robot_in() -> None:
    world = World(side=5.0, frame="lab", agent="rob")
    box = shapely.box(0, 0, 5, 5).buffer(1e-9)
    for event in islice(simulate(3, world), 3_000):
        assert event.agent == "rob"
        if event.region is not None:
            assert event.region.frame == "lab"
            assert event.region.polygon.covered_by(box)


def test_a_moving_robot_sweeps_its_way(atomic: list[Event]) -> None:
    for event in atomic[:200]:
        assert event.region is not None
        corners = event.region.polygon.exterior.coords
        assert len(corners) == 9
        assert event.region.polygon.equals(event.region.polygon.convex_hull)
        if event.interval is not None and event.interval.is_instant:
            assert event.region.polygon.area == pytest.approx(2 * 2**0.5 * 0.3**2)


def test_seeds_reproduce_exactly(life: list[Event]) -> None:
    assert list(islice(simulate(1), 2_500)) == life[:2_500]
    others = list(islice(simulate(2), 2_500))
    assert not {event.uid for event in others} & {event.uid for event in life}
    assert [event.type for event in others] != [event.type for event in life[:2_500]]


def test_uids_are_of_version_seven_and_in_order_of_time(life: list[Event]) -> None:
    assert {event.uid.version for event in life} == {7}
    assert len({event.uid for event in life}) == COUNT
    millis = [event.uid.int >> 80 for event in life]
    assert millis == sorted(millis)
    first = life[0].interval
    assert first is not None
    assert millis[0] == int(first.begin.timestamp() * 1000)


def test_events_stream_in_constant_memory() -> None:
    tracemalloc.start()
    try:
        stream = simulate(1)
        for _ in islice(stream, 4_000):
            pass
        early = tracemalloc.get_traced_memory()[1]
        for _ in islice(stream, 8_000):
            pass
        late = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert late < 1.2 * early


@pytest.mark.slow
@pytest.mark.parametrize("stream", [simulate, simulate_household])
def test_two_hundred_thousand_events_leave_nothing_behind(stream: Callable[[int], Iterator[Event]]) -> None:
    events = stream(1)

    def held_after(count: int) -> int:
        for _ in islice(events, count):
            pass
        gc.collect()
        return len(gc.get_objects())

    early, late = held_after(20_000), held_after(180_000)
    assert late < early + 10_000


# Queries


def test_there_are_twenty_seven_classes() -> None:
    assert len(set(CLASSES)) == 27
    assert {"time.subset", "type.is_a", "feature_names.intersects", "payload.equal"} <= set(CLASSES)


@pytest.mark.parametrize("name", CLASSES)
def test_a_cue_is_of_its_class_and_recalls_its_source(name: str, store: MemoryStore, stored: list[StoredEvent]) -> None:
    for event in (stored[0], stored[9], stored[1_234], stored[1_239]):
        cue = cue_of(name, event)
        assert classes_of(cue) == (name,)
        empty = (name == "parts.intersects" and not event.parts) or (name == "wholes.intersects" and not event.wholes)
        assert (event.id in set(store.ids(Query(cue=cue)))) is not empty


def test_the_cues_of_one_event_differ_from_class_to_class(stored: list[StoredEvent]) -> None:
    assert len({repr(cue_of(name, stored[9])) for name in CLASSES}) == 27


def test_classes_and_events_are_drawn_with_equal_probability(stored: list[StoredEvent]) -> None:
    queries = list(islice(simulate_queries(stored, seed=5), 5_400))
    classes = Counter(query.classes for query in queries)
    assert set(classes) == {(name,) for name in CLASSES}
    assert all(abs(count - 200) < 4.5 * 200**0.5 for count in classes.values())
    assert all(classes_of(query.cue) == query.classes for query in queries)
    sources = Counter(query.source for query in queries)
    assert len(sources) > 0.9 * len(stored)
    assert max(sources.values()) < 15


@pytest.mark.parametrize("components", [2, 3])
def test_several_components_speak_of_different_fields(components: int, stored: list[StoredEvent]) -> None:
    for query in islice(simulate_queries(stored, seed=6, components=components), 500):
        assert len({name.partition(".")[0] for name in query.classes}) == len(query.classes) == components
        assert classes_of(query.cue) == query.classes


@pytest.mark.parametrize("components", [2, 3])
def test_each_further_component_is_drawn_with_equal_probability(components: int, stored: list[StoredEvent]) -> None:
    number = 5_400
    queries = list(islice(simulate_queries(stored, seed=7, components=components), number))
    first = Counter(query.classes[0] for query in queries)
    assert set(first) == set(CLASSES)
    assert all(abs(count - number / 27) < 4.5 * (number / 27) ** 0.5 for count in first.values())
    drawn = Counter(name for query in queries for name in query.classes[1:])
    assert set(drawn) == set(CLASSES)
    for field in {name.partition(".")[0] for name in CLASSES}:
        relations = [drawn[name] for name in CLASSES if name.partition(".")[0] == field]
        fair = sum(relations) / len(relations)
        assert all(abs(count - fair) < 4.5 * fair**0.5 for count in relations), field
    sources = Counter(query.source for query in queries)
    assert len(sources) > 0.9 * len(stored)


@pytest.mark.parametrize("components", [2, 3])
def test_a_cue_of_several_components_recalls_its_source(
    components: int, store: MemoryStore, stored: list[StoredEvent]
) -> None:
    known = {event.uid: event for event in stored}
    for query in islice(simulate_queries(stored, seed=8, components=components), 60):
        event = known[query.source]
        empty = ("parts.intersects" in query.classes and not event.parts) or (
            "wholes.intersects" in query.classes and not event.wholes
        )
        assert (event.id in set(store.ids(Query(cue=query.cue)))) is not empty


def test_queries_follow_their_seed_and_a_growing_memory(stored: list[StoredEvent]) -> None:
    def drawn(seed: int) -> list[Cue]:
        return [query.cue for query in islice(simulate_queries(stored, seed=seed), 100)]

    assert drawn(1) == drawn(1)
    assert drawn(1) != drawn(2)
    known = stored[:1]
    queries = simulate_queries(known, seed=1)
    assert next(queries).source == stored[0].uid
    known += stored[1:]
    assert len({query.source for query in islice(queries, 50)}) > 40


def test_what_an_event_lacks_makes_no_cue() -> None:
    store = MemoryStore()
    store.add_types([EventType(name="Act")])
    moment = Interval.at(World().begin)
    store.commit(Arrival(event=Event(type="Act", interval=moment)))
    (bare,) = store.find(Query())
    for name in ("region.equal", "payload.equal"):
        with pytest.raises(InvalidValue, match="draw another"):
            cue_of(name, bare)
    fields = {query.classes[0].partition(".")[0] for query in islice(simulate_queries([bare], seed=1), 500)}
    assert fields == {"type", "time", "parts", "wholes", "features", "feature_names"}


def test_other_cues_are_of_no_class(stored: list[StoredEvent]) -> None:
    region = stored[0].region
    assert region is not None
    for cue in (
        cues.agent("robot"),
        cues.time("disjoint", World().begin),
        cues.time("during", World().begin),
        cues.recorded("subset", World().begin),
        cues.subject("equal", region),
        cues.region("touches", region),
        cues.parts("equal", [], transitive=True),
        ~cues.payload(b""),
    ):
        with pytest.raises(InvalidValue, match="27 classes"):
            classes_of(cue)
    with pytest.raises(InvalidValue, match="choose one of"):
        cue_of("time.disjoint", stored[0])
    with pytest.raises(InvalidValue, match="1 to 7"):
        next(simulate_queries(stored, seed=1, components=8))


# The command line


def test_the_command_line_lists_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert {"insert", "recall", "types", "household"} <= command_line.COMMANDS.keys()
    assert all(f"  {name} " in shown for name in command_line.COMMANDS)
    assert command_line.main(["fly"]) == 2
    assert "usage" in capsys.readouterr().err


def test_without_a_command_it_says_how_it_is_called() -> None:
    done = subprocess.run([sys.executable, "-m", "simulators"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert "usage: python -m simulators" in done.stderr
