"""Tests of the mower's demo: what it finds against the raw files and an oracle, its questions, tour and picture."""

from __future__ import annotations

import csv
import gzip
import os
import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from io import StringIO
from itertools import pairwise
from pathlib import Path
from uuid import UUID

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console

import elm.demo
from elm import cues
from elm.app import Memory
from elm.demo import by_run, motion, mower_recognizers, plaza, questions, recording
from elm.errors import MissingPackage
from elm.event import Event, StoredEvent, content_hash
from elm.geometry import Region
from elm.interval import Interval
from elm.recognizers.base import DEPTH, OUTPUT, RECOGNIZER, VERSION
from elm.storage.memory import MemoryStore
from tests.unit import mower_episodes

Numbers = npt.NDArray[np.float64]
DATA = Path(elm.demo.__file__).parent / "data"
GLOSSARY = Path(__file__).parents[2] / "docs" / "glossary.md"
NAMES = ("plaza1", "plaza2")
MIDNIGHT = datetime(2000, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True, kw_only=True)
class Raw:
    """One run's files as they are."""

    path: Numbers
    odometry: Numbers
    ranges: Numbers
    beacons: Numbers

    def between(self, interval: Interval) -> Numbers:
        """The rows of the path within an interval."""
        begin, end = _seconds(interval)
        return self.path[(self.path[:, 0] >= begin - 1e-6) & (self.path[:, 0] <= end + 1e-6)]


def _raw(name: str) -> Raw:
    def numbers(part: str) -> Numbers:
        with gzip.open(DATA / f"{name}_{part}.csv.gz", "rt", encoding="utf-8") as lines:
            return np.array([[float(cell) for cell in row] for row in list(csv.reader(lines))[1:]])

    return Raw(path=numbers("path"), odometry=numbers("odometry"), ranges=numbers("ranges"), beacons=numbers("beacons"))


RAW = {name: _raw(name) for name in NAMES}


@dataclass(frozen=True, slots=True, kw_only=True)
class Lived:
    """One run as loaded, and the episodes that were recognized in it."""

    motions: tuple[Event, ...]
    contacts: tuple[Event, ...]
    rows: tuple[Event, ...]
    laps: tuple[Event, ...]
    session: Event

    @property
    def events(self) -> list[Event]:
        return [*self.motions, *self.contacts, *self.rows, *self.laps, self.session]


@pytest.fixture(scope="module")
def memory() -> Memory:
    filled = Memory(MemoryStore(memory="demo"))
    filled.add_types(plaza.TYPES)
    runs = plaza.load_all()
    report = filled.load(event for run in runs for event in run.events)
    assert (report.new, report.refused) == (463, 0)
    mower_recognizers.recognize(filled, runs)
    return filled


@pytest.fixture(scope="module")
def runs(memory: Memory) -> dict[str, Lived]:
    lived = {}
    for name in NAMES:
        loaded = plaza.load(name)
        (session,) = _recognized(memory, "Session", name)
        lived[name] = Lived(
            motions=loaded.motions,
            contacts=loaded.contacts,
            rows=_recognized(memory, "Row", name),
            laps=_recognized(memory, "Lap", name),
            session=session,
        )
    return lived


def _recognized(memory: Memory, kind: str, frame: str) -> tuple[Event, ...]:
    found = memory.recall(cues.exactly(kind))
    return tuple(event.as_event() for event in found if event.region is not None and event.region.frame == frame)


def _seconds(interval: Interval | None) -> tuple[float, float]:
    assert interval is not None
    assert interval.end is not None
    return (interval.begin - MIDNIGHT).total_seconds(), (interval.end - MIDNIGHT).total_seconds()


def _number(event: Event, name: str) -> float:
    value = event.value(name)
    assert isinstance(value, int | float)
    return value


def _apart(one: float, other: float) -> float:
    return abs((one - other + 180) % 360 - 180)


# The files


def test_the_data_ship_with_their_notices_and_stay_small() -> None:
    assert "Redistributions in binary form" in (DATA / "LICENSE.BSD").read_text(encoding="utf-8")
    assert "Djugash" in (DATA / "SOURCES.md").read_text(encoding="utf-8")
    assert sum(file.stat().st_size for file in DATA.iterdir()) < 400_000


def test_the_shipped_files_are_the_source() -> None:
    if not (given := os.environ.get("ELM_TEST_DATA")):
        pytest.skip("ELM_TEST_DATA is not set: the source files are not here")
    packed = sorted(DATA.glob("*.csv.gz"))
    assert len(packed) == 8
    for file in packed:
        source = Path(given) / "plaza" / file.name.removesuffix(".gz")
        assert gzip.decompress(file.read_bytes()) == source.read_bytes(), file.name


def test_what_is_odd_is_counted() -> None:
    first, second = (recording.read(name).oddities for name in NAMES)
    for oddities, raw in ((first, RAW["plaza1"]), (second, RAW["plaza2"])):
        jumps = np.abs(np.diff(raw.path[:, 3])) > 3.2
        assert oddities.heading_wraps == jumps.sum() > 0
        assert oddities.frozen_steps == (np.diff(raw.path[:, 1:3], axis=0) == 0).all(axis=1).sum()
        times = set(raw.path[:, 0])
        assert oddities.readings_between_rows == sum(time not in times for time in raw.ranges[:, 0])
        assert oddities.longest_silence == pytest.approx(np.diff(sorted(raw.ranges[:, 0])).max())
        assert oddities.range_excess == pytest.approx(0.07, abs=0.005)
    assert (first.readings_out_of_order, second.readings_out_of_order) == (2, 0)
    assert (first.readings_at_once, second.readings_at_once) == (2, 0)
    assert (first.jumps, second.jumps) == (5, 0)
    assert (first.path_gaps, second.path_gaps) == (0, 1)
    assert first.backward_share < 0.01
    assert second.backward_share > 0.99
    assert second.odometry_turn_drift == pytest.approx(-126, abs=1)
    assert "no beacon answered for 96.8 s" in first.lines()
    assert not any("out of time order" in line for line in second.lines())


# Motions


@pytest.mark.parametrize("name", NAMES)
def test_motions_meet_and_last_as_long_as_the_run(runs: dict[str, Lived], name: str) -> None:
    motions, raw = runs[name].motions, RAW[name]
    spans = [_seconds(event.interval) for event in motions]
    assert spans[0][0] == pytest.approx(raw.path[0, 0], abs=1e-6)
    assert spans[-1][1] == pytest.approx(raw.path[-1, 0], abs=1e-6)
    assert all(earlier[1] == later[0] for earlier, later in pairwise(spans))
    assert all(begin < end for begin, end in spans)
    assert all(earlier.type != later.type or earlier.type == "Turn" for earlier, later in pairwise(motions))


@pytest.mark.parametrize(("name", "metres"), [("plaza1", 1858.980), ("plaza2", 1353.862)])
def test_distances_add_up_to_the_path(runs: dict[str, Lived], name: str, metres: float) -> None:
    run, path = runs[name], RAW[name].path
    total = np.hypot(*np.diff(path[:, 1:3], axis=0).T).sum()
    assert total == pytest.approx(metres, abs=0.01)
    assert sum(_number(event, "distance") for event in run.motions) == pytest.approx(total, abs=0.1)
    assert _number(run.session, "distance") == pytest.approx(total, abs=0.1)


@pytest.mark.parametrize("name", NAMES)
def test_turns_and_drives_have_the_angles_and_speeds_of_the_path(runs: dict[str, Lived], name: str) -> None:
    raw = RAW[name]
    for event in runs[name].motions:
        rows = raw.between(event.interval or Interval.at(MIDNIGHT))
        begin, end = _seconds(event.interval)
        assert _number(event, "speed") == pytest.approx(_number(event, "distance") / (end - begin), abs=0.002)
        if event.type == "Stand":
            assert end - begin >= motion.STAND_SECONDS
            assert np.ptp(rows[:, 1:3], axis=0).max() < 0.9
            continue
        turned = np.degrees(np.unwrap(rows[:, 3]))
        assert _number(event, "turn") == pytest.approx(turned[-1] - turned[0], abs=0.06)
        if event.type == "Turn":
            assert abs(_number(event, "turn")) >= motion.TURN_DEGREES
            assert _number(event, "rate") > 0
        else:
            course = np.degrees(np.arctan2(rows[-1, 2] - rows[0, 2], rows[-1, 1] - rows[0, 1]))
            assert 0 <= _number(event, "heading") < 360
            assert _apart(_number(event, "heading"), course) < 0.06


def test_the_path_stands_still_only_in_stands(runs: dict[str, Lived]) -> None:
    path = RAW["plaza1"].path
    frozen = path[1:][(np.diff(path[:, 1:3], axis=0) == 0).all(axis=1), 0]
    stands = [_seconds(event.interval) for event in runs["plaza1"].motions if event.type == "Stand"]
    inside = sum(any(begin <= time <= end for begin, end in stands) for time in frozen)
    assert len(frozen) == 516
    assert inside / len(frozen) > 0.98
    # Counted in a plot of speed over time.
    assert len(stands) == 10


def test_a_motion_sweeps_its_path(runs: dict[str, Lived]) -> None:
    raw = RAW["plaza2"]
    for event in runs["plaza2"].motions:
        assert event.region is not None
        assert event.region.frame == "plaza2"
        line = shapely.LineString(raw.between(event.interval or Interval.at(MIDNIGHT))[:, 1:3])
        assert event.region.polygon.covers(line)
        wide = line.buffer(plaza.FOOTPRINT + recording.PATH_TOLERANCE)
        assert wide.covers(event.region.polygon)


# Contacts


@pytest.mark.parametrize("name", NAMES)
def test_contacts_are_merged_readings(runs: dict[str, Lived], name: str) -> None:
    raw, gap = RAW[name], {"plaza1": 5.0, "plaza2": 1.25}[name]
    found = runs[name].contacts
    assert sum(_number(event, "readings") for event in found) == len(raw.ranges)
    for number, x, y in raw.beacons:
        of_one = [(time, metres) for time, beacon, metres in raw.ranges.tolist() if beacon == number]
        readings = sorted(of_one, key=lambda reading: reading[0])
        merged = [[readings[0]]]
        for earlier, later in pairwise(readings):
            if later[0] - earlier[0] > gap:
                merged.append([])
            merged[-1].append(later)
        of_beacon = [event for event in found if event.value("beacon") == number]
        assert len(of_beacon) == len(merged)
        for event, expected in zip(of_beacon, merged, strict=True):
            assert _seconds(event.interval) == pytest.approx((expected[0][0], expected[-1][0]), abs=1e-6)
            assert event.value("readings") == len(expected)
            assert event.value("min_range") == min(metres for _, metres in expected)
            assert _number(event, "mean_range") == pytest.approx(np.mean([m for _, m in expected]), abs=0.001)
            assert event.subject is not None
            assert event.subject.polygon.contains(shapely.Point(x, y))
            assert event.payload is not None
            rows = list(csv.reader(StringIO(event.payload.data.decode())))
            assert [(float(time), float(metres)) for time, metres in rows[1:]] == expected


def test_a_single_reading_is_an_instant(runs: dict[str, Lived]) -> None:
    singles = [event for event in runs["plaza2"].contacts if event.value("readings") == 1]
    assert len(singles) == 18
    for event in singles:
        assert event.interval is not None
        assert event.interval.is_instant


# Rows, laps, sessions


@pytest.mark.parametrize(("name", "rows", "laps"), [("plaza1", 42, 20), ("plaza2", 21, 7)])
def test_rows_and_laps_as_counted_by_eye(runs: dict[str, Lived], name: str, rows: int, laps: int) -> None:
    run = runs[name]
    assert (len(run.rows), len(run.laps)) == (rows, laps)
    assert [row.value("number") for row in run.rows] == list(range(1, rows + 1))
    assert [lap.value("complete") for lap in run.laps] == [True] * (laps - 1) + [False]
    assert sum(_number(lap, "rows") for lap in run.laps) == rows


def test_rows_up_and_down_against_the_raw_headings(runs: dict[str, Lived]) -> None:
    """From the start of the mowing proper on, the heading swings between two directions once for each row."""
    path = RAW["plaza1"].path
    mowing = path[path[:, 0] > path[0, 0] + 284]
    along = np.cos(mowing[:, 3] - np.radians(155.5))
    headed = np.sign(along[np.abs(along) > 0.97])
    stretches = 1 + int((np.diff(headed) != 0).sum())
    assert stretches == len(runs["plaza1"].rows) - 4 == 38


def test_laps_against_the_crossings_of_a_line(runs: dict[str, Lived]) -> None:
    """Every lap of the second run crosses the south side, at x = -20 m, once from east to west."""
    path = RAW["plaza2"].path
    south = path[path[:, 2] < 15]
    crossings = ((south[:-1, 1] > -20) & (south[1:, 1] <= -20)).sum()
    assert crossings == len(runs["plaza2"].laps) == 7


@pytest.mark.parametrize("name", NAMES)
def test_rows_are_as_defined(runs: dict[str, Lived], name: str) -> None:
    run = runs[name]
    place = {event.uid: index for index, event in enumerate(run.motions)}
    taken: list[int] = []
    ends: list[tuple[int, int]] = []
    for row in run.rows:
        indices = [place[part] for part in row.parts]
        assert indices == list(range(indices[0], indices[-1] + 1))
        taken += indices
        motions = [run.motions[index] for index in indices]
        drives = [event for event in motions if event.type == "Drive"]
        assert motions[0].type == "Drive"
        last = max(index for index in indices if run.motions[index].type == "Drive")
        between = run.motions[indices[0] : last + 1]
        assert all(event.type == "Turn" for event in run.motions[last + 1 : indices[-1] + 1])
        assert all(abs(_number(event, "turn")) < 90 for event in between if event.type == "Turn")
        first = _number(drives[0], "heading")
        assert all(_apart(first, _number(d, "heading")) <= 30 for d in drives if _number(d, "distance") >= 3)
        assert _number(row, "length") == pytest.approx(sum(_number(d, "distance") for d in drives), abs=0.01)
        assert _number(row, "length") >= 5
        assert _number(row, "distance") == pytest.approx(sum(_number(m, "distance") for m in motions), abs=0.01)
        assert _apart(_number(row, "heading"), first) <= 30
        ends.append((indices[0], indices[-1]))
    assert len(set(taken)) == len(taken)
    for (_, end), (begin, _) in pairwise(ends):
        breaks = [
            event
            for event in run.motions[end - 3 : begin + 1]
            if (event.type == "Turn" and abs(_number(event, "turn")) >= 90)
            or (event.type == "Drive" and _number(event, "distance") >= 3)
        ]
        assert breaks


MARKS = {RECOGNIZER, VERSION, OUTPUT, DEPTH}


def _told(events: Sequence[Event], names: dict[UUID, str]) -> list[object]:
    """What episodes are: type, features but for the recognizer's, and parts in their order; parts that are episodes
    by name, for recognized ones have other uids."""
    return [
        (
            event.type,
            {(name, value) for name, value in event.features if name not in MARKS},
            [names.get(part, part) for part in event.parts],
        )
        for event in events
    ]


def _named(rows: Sequence[Event], laps: Sequence[Event]) -> dict[UUID, str]:
    return {event.uid: f"{event.type} {event.value('number')}" for event in (*rows, *laps)}


@pytest.mark.parametrize("name", NAMES)
def test_what_is_recognized_is_what_the_oracle_finds(runs: dict[str, Lived], name: str) -> None:
    run = runs[name]
    oracle = mower_episodes.episodes(run.motions, run.contacts, name)
    names, known = _named(oracle.rows, oracle.laps), _named(run.rows, run.laps)
    assert _told(run.rows, known) == _told(oracle.rows, names)
    assert _told(run.laps, known) == _told(oracle.laps, names)
    assert _told([run.session], known) == _told([oracle.session], names)


def test_episodes_say_who_found_them(runs: dict[str, Lived]) -> None:
    for run in runs.values():
        for event in (*run.rows, *run.laps, run.session):
            recognizer = f"mower-{event.type.lower()}s"
            assert [event.value(name) for name in (RECOGNIZER, VERSION, OUTPUT)] == [recognizer, 1, "match"]


@pytest.mark.parametrize("name", NAMES)
def test_beacon_visits_are_stretches_of_motions_near_a_beacon(
    runs: dict[str, Lived], memory: Memory, name: str
) -> None:
    """In the raw path the mower was near a beacon in the motions of its visits and passages, and in no others."""
    path = RAW[name].path
    found = [*memory.recall(cues.exactly("BeaconVisit") | cues.exactly("BeaconPassage"))]
    reach = mower_recognizers.NEAR_BEACON + plaza.FOOTPRINT + plaza.BEACON_RADIUS
    for number, x, y in RAW[name].beacons:
        near = np.hypot(path[:, 1] - x, path[:, 2] - y) < reach
        expected: list[list[UUID]] = []
        was_near = False
        for event in runs[name].motions:
            begin, end = _seconds(event.interval)
            is_near = bool(near[(path[:, 0] >= begin - 1e-6) & (path[:, 0] <= end + 1e-6)].any())
            if is_near and not was_near:
                expected.append([])
            if is_near:
                expected[-1].append(event.uid)
            was_near = is_near
        visits = [event for event in found if event.value("place") == f"beacon {number:g} of {name}"]
        assert [list(visit.parts) for visit in visits] == expected
        for visit in visits:
            begin, end = _seconds(visit.interval)
            assert visit.type == ("BeaconVisit" if end - begin >= 10 else "BeaconPassage")
            assert visit.value("motions") == len(visit.parts)
    assert len(found) == 27
    assert sum(visit.type == "BeaconVisit" for visit in found) == 8


def _remember(motions: Sequence[Event], *, batch: int = 2_000, runs_of: int = 10**6) -> Memory:
    """The episodes of made-up motions; a new manager takes over after every so many."""
    made = Memory(MemoryStore(memory="made"))
    made.add_types(plaza.TYPES)
    for first in range(0, len(motions), runs_of):
        made.load(motions[first : first + runs_of])
        made.recognition(mower_recognizers.RECOGNIZERS, batch=batch).catch_up()
    made.punctuate(MIDNIGHT + timedelta(days=300), agent=plaza.AGENT)
    made.recognition(mower_recognizers.RECOGNIZERS, batch=batch).catch_up()
    return made


MADE = st.lists(
    st.one_of(
        st.tuples(
            st.just("Drive"), st.sampled_from([1.0, 2.9, 3.0, 5.0, 12.5]), st.sampled_from([0.0, 20, 50, 180, 350])
        ),
        st.tuples(st.just("Turn"), st.just(0.5), st.sampled_from([-120.0, -40, 30, 90, 180])),
        st.tuples(st.just("Stand"), st.just(0.0), st.just(0.0)),
    ),
    min_size=1,
    max_size=40,
)


@settings(max_examples=60, deadline=None)
@given(given=MADE, batch=st.sampled_from([1, 3, 2_000]), runs_of=st.integers(1, 40))
def test_random_motions_make_the_episodes_of_the_oracle(
    given: list[tuple[str, float, float]], batch: int, runs_of: int
) -> None:
    """Whatever the batches, and whenever another manager goes on from what the one before left."""
    motions = _made(*given)
    with _remember(motions, batch=batch, runs_of=runs_of) as made:
        rows, laps = _recognized(made, "Row", "made"), _recognized(made, "Lap", "made")
        sessions = _recognized(made, "Session", "made")
        assert not any(each.is_failing for each in made.recognition(mower_recognizers.RECOGNIZERS).status())
    oracle = mower_episodes.episodes(motions, (), "made")
    names, known = _named(oracle.rows, oracle.laps), _named(rows, laps)
    assert _told(rows, known) == _told(oracle.rows, names)
    assert _told(laps, known) == _told(oracle.laps, names)
    assert _told(sessions, known) == _told([oracle.session], names)


def test_a_run_of_too_many_events_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(by_run, "MOST_HELD", 50)
    motions = _made(*[("Stand", 0.0, 0.0)] * 120)
    with _remember(motions, batch=1) as made:
        sessions = _recognized(made, "Session", "made")
        assert [len(session.parts) for session in sessions] == [51, 51, 18]
        assert not any(each.is_failing for each in made.recognition(mower_recognizers.RECOGNIZERS).status())


def test_a_run_ends_after_a_pause() -> None:
    one, two, three = _made(("Drive", 10, 0), ("Drive", 10, 0), ("Drive", 10, 0))
    at = MIDNIGHT + timedelta(seconds=20) + by_run.PAUSE
    within = replace(three, interval=Interval(begin=at - timedelta(seconds=1), end=at))
    after = replace(three, interval=Interval(begin=at - timedelta(seconds=1), end=at + timedelta(microseconds=1)))
    for last, expected in ((within, [3]), (after, [2, 1])):
        with _remember([one, two, last]) as made:
            for kind, number in (("Session", None), ("Row", 1)):
                found = [*made.recall(cues.exactly(kind))]
                assert [len(_atomic(made, event)) for event in found] == expected
                assert {event.value("number") for event in found} == {number}


def _atomic(memory: Memory, event: StoredEvent) -> set[UUID]:
    below = cues.wholes("superset", [event.uid], transitive=True) & cues.is_a("Motion")
    return {part.uid for part in memory.recall(below)}


@pytest.mark.parametrize("name", NAMES)
def test_a_session_is_a_run_without_pause(runs: dict[str, Lived], name: str) -> None:
    run = runs[name]
    spans = sorted(_seconds(event.interval) for event in (*run.motions, *run.contacts))
    latest = spans[0][1]
    for begin, end in spans:
        assert begin - latest < by_run.PAUSE.total_seconds()
        latest = max(latest, end)


def _rows_of(made: list[Event]) -> list[list[UUID]]:
    with _remember(made) as memory:
        return [list(row.parts) for row in memory.recall(cues.exactly("Row"))]


def test_short_drives_of_another_heading_do_not_end_a_row() -> None:
    row = _made(("Drive", 10, 90), ("Drive", 2.9, 200), ("Drive", 10, 120), ("Turn", 0, -40))
    assert _rows_of(row) == [[event.uid for event in row]]


@pytest.mark.parametrize(
    ("motions", "expected"),
    [
        ([("Drive", 10, 90), ("Drive", 3, 121), ("Drive", 10, 90)], [[0], [2]]),
        ([("Drive", 10, 350), ("Drive", 10, 19), ("Drive", 10, 21)], [[0, 1], [2]]),
        ([("Drive", 10, 90), ("Turn", 0, 89.9), ("Drive", 10, 90)], [[0, 1, 2]]),
        ([("Drive", 10, 90), ("Turn", 0, -90), ("Drive", 10, 90)], [[0, 1], [2]]),
        ([("Drive", 10, 90), ("Stand", 0, 0), ("Turn", 0, 90), ("Drive", 10, 90)], [[0], [3]]),
        ([("Drive", 4.9, 90), ("Turn", 0, 90), ("Drive", 5, 180), ("Stand", 0, 0)], [[2]]),
        ([("Turn", 0, 90), ("Drive", 10, 90), ("Turn", 0, 10), ("Turn", 0, 10), ("Stand", 0, 0)], [[1, 2, 3]]),
        ([("Stand", 0, 0), ("Turn", 0, 50)], []),
    ],
)
def test_where_rows_begin_and_end(motions: list[tuple[str, float, float]], expected: list[list[int]]) -> None:
    made = _made(*motions)
    place = {event.uid: index for index, event in enumerate(made)}
    assert [[place[part] for part in row] for row in _rows_of(made)] == expected


@pytest.mark.parametrize(
    ("headings", "expected"),
    [
        ([0, 180, 0, 180, 0], [2, 2]),
        ([0, 180, 0, 180], [2, 2]),
        ([0, 0, 180, 0], [3]),
        ([0, 120, 240, 10, 130, 250, 5], [3, 3]),
        ([0, 0, 0], []),
        ([], []),
    ],
)
def test_where_laps_begin_and_end(headings: list[float], expected: list[int]) -> None:
    made = _made(*(motion for heading in headings for motion in (("Drive", 10.0, heading), ("Turn", 1.0, 170.0))))
    with _remember(made) as memory:
        assert [lap.value("rows") for lap in memory.recall(cues.exactly("Lap"))] == expected


def _made(*given: tuple[str, float, float]) -> list[Event]:
    """Motions of ten seconds each: (type, distance, heading of a drive or angle of a turn)."""
    made = []
    for index, (kind, metres, degrees) in enumerate(given):
        begin = MIDNIGHT + timedelta(seconds=10 * index)
        made.append(
            Event(
                type=kind,
                interval=Interval(begin=begin, end=begin + timedelta(seconds=10)),
                region=Region.around(0.0, 0.0, 0.5, frame="made"),
                features={"distance": metres, "heading" if kind == "Drive" else "turn": degrees},
                agent=plaza.AGENT,
                uid=plaza.uid("made", "motion", index),
            )
        )
    return made


# In a memory


def test_extents_derive_and_parts_lie_inside(runs: dict[str, Lived], memory: Memory) -> None:
    for name, run in runs.items():
        for event in (*run.rows, *run.laps, run.session):
            stored = memory.get(event.uid)
            parts = [memory.get(part) for part in event.parts]
            assert stored.agent == plaza.AGENT
            assert stored.interval.begin == min(part.interval.begin for part in parts)
            assert stored.interval.end == max(_end(part.interval) for part in parts)
            corners = np.concatenate(
                [shapely.get_coordinates(part.region.polygon) for part in parts if part.region is not None]
            )
            hull = shapely.MultiPoint(corners).convex_hull
            assert stored.region is not None
            assert stored.region.frame == name
            assert shapely.hausdorff_distance(stored.region.polygon, hull) < 1e-6
            assert all(event.uid in part.wholes for part in parts)
        heard = memory.get(run.session.uid).subject
        assert heard is not None
        assert all(heard.polygon.buffer(1e-6).contains(shapely.Point(x, y)) for _, x, y in RAW[name].beacons)


def _end(interval: Interval) -> datetime:
    assert interval.end is not None
    return interval.end


def test_everything_is_part_of_its_session(runs: dict[str, Lived], memory: Memory) -> None:
    for run in runs.values():
        below = memory.recall(cues.wholes("superset", [run.session.uid], transitive=True))
        assert below.count() == len(run.events) - 1


def test_doing_it_again_changes_nothing(memory: Memory) -> None:
    before, head = memory.statistics(), memory.log.head()
    runs, again = plaza.load_all(), plaza.load_all()
    report = memory.load(event for run in again for event in run.events)
    assert (report.new, report.refused, report.existing) == (0, 0, 463)
    mower_recognizers.recognize(memory, again)
    assert memory.statistics() == before
    assert memory.log.head() == head
    for one, other in zip(runs, again, strict=True):
        assert [content_hash(event) for event in one.events] == [content_hash(event) for event in other.events]


def test_what_was_left_unfinished_is_finished_the_next_time() -> None:
    runs = plaza.load_all()
    with Memory(MemoryStore(memory="unfinished")) as left:
        left.add_types(plaza.TYPES)
        left.load(runs[0].events)
        left.recognition(mower_recognizers.RECOGNIZERS, consumer=mower_recognizers.CONSUMER).catch_up()
        left.load(runs[1].events)
        assert not left.recall(cues.exactly("Session")).exists()
        mower_recognizers.recognize(left, runs)
        counts = {group.key: group.count for group in left.recall().groups("type")}
        assert (counts["Row"], counts["Lap"], counts["Session"]) == (63, 27, 2)


def test_the_clock_is_anchored(runs: dict[str, Lived]) -> None:
    for name, run in runs.items():
        assert run.motions[0].interval is not None
        assert run.motions[0].interval.begin == MIDNIGHT + timedelta(seconds=RAW[name].path[0, 0])
    assert [run.name for run in plaza.load_all()] == ["plaza2", "plaza1"]


# Questions


def _asked(memory: Memory, beginning: str) -> list[str]:
    (question,) = [one for one in questions.QUESTIONS if one.text.startswith(beginning)]
    return question.answer(memory)


def test_every_question_is_answered(memory: Memory) -> None:
    assert len(questions.QUESTIONS) >= 12
    for question in questions.QUESTIONS:
        lines = question.answer(memory)
        assert lines
        assert all(line and "None" not in line for line in lines), question.text
        assert question.recall(memory).exists(), question.text


def test_rows_near_beacon_6(runs: dict[str, Lived], memory: Memory) -> None:
    near = {}
    reach = 5 + plaza.FOOTPRINT + plaza.BEACON_RADIUS
    for name, run in runs.items():
        (x, y), by_uid = _place(name, 6), {event.uid: event for event in run.motions}
        near[name] = [
            row.value("number")
            for row in run.rows
            if min(_nearest(RAW[name].between(_given(by_uid[part])), x, y) for part in row.parts) < reach
        ]
    assert near == {"plaza1": [], "plaza2": [3, 6, 9, 12, 15, 18]}
    assert _asked(memory, "Which rows passed")[0] == "rows 3, 6, 9, 12, 15 and 18 of plaza2"


def test_last_near_beacon_0(memory: Memory) -> None:
    x, y = _place("plaza1", 0)
    path = RAW["plaza1"].path
    last = path[np.hypot(path[:, 1] - x, path[:, 2] - y) < 10 + plaza.FOOTPRINT, 0].max()
    event = questions.QUESTIONS[1].recall(memory).first()
    assert event is not None
    begin, end = _seconds(event.interval)
    assert begin <= last <= end
    assert _asked(memory, "When was it last")[0].startswith(f"at {event.interval.begin:%H:%M:%S}, turning 254° right")
    assert "row 13 of plaza1, in lap 6 of plaza1" in _asked(memory, "When was it last")[0]


def test_contacts_at_stands(runs: dict[str, Lived], memory: Memory) -> None:
    overlapping = 0
    for run in runs.values():
        stands = [_seconds(event.interval) for event in run.motions if event.type == "Stand"]
        spans = [_seconds(event.interval) for event in run.contacts]
        overlapping += sum(any(b <= end and begin <= e for b, e in stands) for begin, end in spans)
    assert _asked(memory, "Which beacon contacts")[0].startswith(f"{overlapping} contacts: ")


def test_the_last_contact_before_each_turn(runs: dict[str, Lived], memory: Memory) -> None:
    ends = [_given(contact).end for run in runs.values() for contact in run.contacts]
    back = cues.exactly("Turn") & (cues.feature("turn", ">=", 90) | cues.feature("turn", "<=", -90))
    pairs = list(memory.recall(back).latest_before(cues.exactly("BeaconContact")))
    turns = [t for run in runs.values() for t in run.motions if t.type == "Turn" and abs(_number(t, "turn")) >= 90]
    assert len(pairs) == len(turns)
    for turn, contact in pairs:
        earlier = [end for end in ends if end is not None and end < turn.interval.begin]
        assert (contact is None) == (not earlier)
        assert contact is None or contact.interval.end in earlier
    assert _asked(memory, "Before each turn")[0].startswith(f"before {len(turns)} of {len(turns)} turns back")


def test_time_in_touch(memory: Memory) -> None:
    ranges = RAW["plaza1"].ranges
    lines = _asked(memory, "How long was it")
    assert len(lines) == 4
    for beacon, line in zip((0, 1, 5, 6), lines, strict=True):
        gaps = np.diff(np.sort(ranges[ranges[:, 1] == beacon, 0]))
        assert line == f"beacon {beacon}: {gaps[gaps <= 5].sum() / 60:.1f} min in {(gaps > 5).sum() + 1} contacts"


def test_stands_and_laps(memory: Memory) -> None:
    assert _asked(memory, "Which stands lasted")[0] == "01:07:32 standing for 69.4 s in plaza1"
    assert _asked(memory, "What did it do right after") == ["01:08:41 turning 37° right for 2.0 s"]
    assert _asked(memory, "Which laps contain") == ["laps 1, 7, 13 and 14 of plaza1"]


def test_far_from_every_beacon(runs: dict[str, Lived], memory: Memory) -> None:
    places = [shapely.Point(x, y) for _, x, y in RAW["plaza1"].beacons]
    far = [
        event
        for event in runs["plaza1"].motions
        if event.region is not None and all(event.region.polygon.distance(place) > 28.2 for place in places)
    ]
    assert len(_asked(memory, "What did it do in plaza1 farther")) == len(far) == 5


def test_out_of_touch(runs: dict[str, Lived], memory: Memory) -> None:
    silent = []
    for run in runs.values():
        spans = [_seconds(contact.interval) for contact in run.contacts]
        for event in run.motions:
            begin, end = _seconds(event.interval)
            if not any(b <= end and begin <= e for b, e in spans):
                silent.append(end - begin)
    assert _asked(memory, "When did it move")[0] == f"in {len(silent)} motions, {sum(silent):.1f} s together"


def _place(name: str, beacon: int) -> tuple[float, float]:
    ((_, x, y),) = [row for row in RAW[name].beacons.tolist() if row[0] == beacon]
    return x, y


def _nearest(rows: Numbers, x: float, y: float) -> float:
    return float(np.hypot(rows[:, 1] - x, rows[:, 2] - y).min())


def _given(event: Event) -> Interval:
    assert event.interval is not None
    return event.interval


def test_beacons_by_the_way(memory: Memory) -> None:
    assert _asked(memory, "Which beacons did it come")[1] == "beacon 1 of plaza2: 35.0 s in 6 times"
    assert _asked(memory, "Which laps led by a beacon") == ["laps 1, 2, 3, 4, 5, 19 and 20 of plaza1"]


# The tour and the picture


def _tour(memory: Memory, picture: Path | None) -> str:
    console = Console(file=StringIO(), width=120)
    elm.demo.run(memory, picture=picture, console=console)
    assert isinstance(console.file, StringIO)
    return console.file.getvalue()


def test_the_tour_tells_everything() -> None:
    told = _tour(memory := Memory(MemoryStore(memory="tour")), None)
    assert "Carnegie Mellon University" in told
    assert "BSD licence" in told
    assert "2000-01-01T00:00:00Z" in told
    assert "Loaded 463 events" in told
    assert "Recognized 119 episodes" in told
    for each in mower_recognizers.RECOGNIZERS:
        assert f"│ {each.name} " in told
    assert "What row 15 of plaza1 was recognized from, by mower-rows of version 1" in told
    for question in questions.QUESTIONS:
        assert question.text in told
        assert all(line in told for line in question.answer(memory))
    assert "runs no SQL" in told
    assert "63 events by itself" in told
    assert "Picture" not in told
    assert "Loaded 0 events" in (again := _tour(memory, None))
    assert "463 were there already" in again
    assert "Recognized 0 episodes" in again
    assert "119 were there already" in again


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed: no picture to test")
    path = tmp_path / "new" / "mower.png"
    told = _tour(Memory(MemoryStore(memory="picture")), path)
    assert str(path) in told
    png = path.read_bytes()
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", png[16:24])
    assert width > 1500
    assert height > 1200
    assert len(png) > 150_000


def test_without_matplotlib_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delitem(sys.modules, "elm.demo.picture", raising=False)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingPackage, match=r"pip install 'elm-memory\[plot\]'"):
        _tour(Memory(MemoryStore(memory="bare")), tmp_path / "never.png")


# The glossary


def test_the_glossary_states_the_numbers_in_use() -> None:
    said = GLOSSARY.read_text(encoding="utf-8")

    def stated(sentence: str, values: Sequence[float]) -> None:
        assert sentence.format(*(f"{value:g}" for value in values)) in said

    stated("stays below {} m/s for at least {} s; moves shorter than {} s", [motion.STAND_SPEED, 3, 1.5])
    stated("at least {} degrees a second", [motion.TURN_RATE])
    stated("less than {} s at a time, and adds up to at least {} degrees", [motion.TURN_PAUSE, motion.TURN_DEGREES])
    stated("A drive of less than {} s", [motion.DRIVE_SECONDS])
    stated("none more than {} s after the one before in `plaza1`", [plaza.CONTACT_GAP["plaza1"] / 1000])
    stated("{} s in `plaza2`", [plaza.CONTACT_GAP["plaza2"] / 1000])
    stated("{} m radius", [plaza.FOOTPRINT])
    stated("differ by at most {} degrees", [mower_recognizers.SAME_WAY])
    stated("a turn of {} degrees or more", [mower_recognizers.TURN_BACK])
    stated("a drive of {} m or more", [mower_recognizers.SHORT_DRIVE])
    stated("less than {} m of drives", [mower_recognizers.ROW_LENGTH])
    stated("within {} m of a beacon", [mower_recognizers.NEAR_BEACON])
    stated("at least {} s", [mower_recognizers.VISIT.total_seconds()])
    stated("by at most {} minutes", [by_run.PAUSE.total_seconds() / 60])
