"""Tests of the mower's demo: what its loader finds against the raw files, its questions, its tour and its picture."""

from __future__ import annotations

import csv
import gzip
import os
import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from io import StringIO
from itertools import pairwise
from pathlib import Path
from uuid import UUID

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from rich.console import Console

import elm.demo
from elm import cues
from elm.app import Memory
from elm.demo import episodes, motion, plaza, questions, recording
from elm.errors import MissingPackage
from elm.event import Event, content_hash
from elm.interval import Interval
from elm.storage.memory import MemoryStore

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


@pytest.fixture(scope="module")
def runs() -> dict[str, plaza.Run]:
    return {name: plaza.load(name) for name in NAMES}


@pytest.fixture(scope="module")
def memory(runs: dict[str, plaza.Run]) -> Memory:
    filled = Memory(MemoryStore(memory="demo"))
    filled.add_types(plaza.TYPES)
    for run in runs.values():
        report = filled.load(run.events)
        assert report.refused == 0
    return filled


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
def test_motions_meet_and_last_as_long_as_the_run(runs: dict[str, plaza.Run], name: str) -> None:
    motions, raw = runs[name].motions, RAW[name]
    spans = [_seconds(event.interval) for event in motions]
    assert spans[0][0] == pytest.approx(raw.path[0, 0], abs=1e-6)
    assert spans[-1][1] == pytest.approx(raw.path[-1, 0], abs=1e-6)
    assert all(earlier[1] == later[0] for earlier, later in pairwise(spans))
    assert all(begin < end for begin, end in spans)
    assert all(earlier.type != later.type or earlier.type == "Turn" for earlier, later in pairwise(motions))


@pytest.mark.parametrize(("name", "metres"), [("plaza1", 1858.980), ("plaza2", 1353.862)])
def test_distances_add_up_to_the_path(runs: dict[str, plaza.Run], name: str, metres: float) -> None:
    run, path = runs[name], RAW[name].path
    total = np.hypot(*np.diff(path[:, 1:3], axis=0).T).sum()
    assert total == pytest.approx(metres, abs=0.01)
    assert sum(_number(event, "distance") for event in run.motions) == pytest.approx(total, abs=0.1)
    assert _number(run.session, "distance") == pytest.approx(total, abs=0.1)


@pytest.mark.parametrize("name", NAMES)
def test_turns_and_drives_have_the_angles_and_speeds_of_the_path(runs: dict[str, plaza.Run], name: str) -> None:
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


def test_the_path_stands_still_only_in_stands(runs: dict[str, plaza.Run]) -> None:
    path = RAW["plaza1"].path
    frozen = path[1:][(np.diff(path[:, 1:3], axis=0) == 0).all(axis=1), 0]
    stands = [_seconds(event.interval) for event in runs["plaza1"].motions if event.type == "Stand"]
    inside = sum(any(begin <= time <= end for begin, end in stands) for time in frozen)
    assert len(frozen) == 516
    assert inside / len(frozen) > 0.98
    # Counted in a plot of speed over time.
    assert len(stands) == 10


def test_a_motion_sweeps_its_path(runs: dict[str, plaza.Run]) -> None:
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
def test_contacts_are_merged_readings(runs: dict[str, plaza.Run], name: str) -> None:
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


def test_a_single_reading_is_an_instant(runs: dict[str, plaza.Run]) -> None:
    singles = [event for event in runs["plaza2"].contacts if event.value("readings") == 1]
    assert len(singles) == 18
    for event in singles:
        assert event.interval is not None
        assert event.interval.is_instant


# Rows, laps, sessions


@pytest.mark.parametrize(("name", "rows", "laps"), [("plaza1", 42, 20), ("plaza2", 21, 7)])
def test_rows_and_laps_as_counted_by_eye(runs: dict[str, plaza.Run], name: str, rows: int, laps: int) -> None:
    run = runs[name]
    assert (len(run.rows), len(run.laps)) == (rows, laps)
    assert [row.value("number") for row in run.rows] == list(range(1, rows + 1))
    assert [lap.value("complete") for lap in run.laps] == [True] * (laps - 1) + [False]
    assert sum(_number(lap, "rows") for lap in run.laps) == rows


def test_rows_up_and_down_against_the_raw_headings(runs: dict[str, plaza.Run]) -> None:
    """From the start of the mowing proper on, the heading swings between two directions once for each row."""
    path = RAW["plaza1"].path
    mowing = path[path[:, 0] > path[0, 0] + 284]
    along = np.cos(mowing[:, 3] - np.radians(155.5))
    headed = np.sign(along[np.abs(along) > 0.97])
    stretches = 1 + int((np.diff(headed) != 0).sum())
    assert stretches == len(runs["plaza1"].rows) - 4 == 38


def test_laps_against_the_crossings_of_a_line(runs: dict[str, plaza.Run]) -> None:
    """Every lap of the second run crosses the south side, at x = -20 m, once from east to west."""
    path = RAW["plaza2"].path
    south = path[path[:, 2] < 15]
    crossings = ((south[:-1, 1] > -20) & (south[1:, 1] <= -20)).sum()
    assert crossings == len(runs["plaza2"].laps) == 7


@pytest.mark.parametrize("name", NAMES)
def test_rows_are_as_defined(runs: dict[str, plaza.Run], name: str) -> None:
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


def _bare(event: Event) -> Event:
    """The event with no more than the definitions of rows and laps may look at."""
    kept = {name: value for name, value in event.features if name in {"distance", "heading", "turn"}}
    return Event(type=event.type, interval=event.interval, features=kept, uid=event.uid)


@pytest.mark.parametrize("name", NAMES)
def test_episodes_are_found_from_atomic_events_in_a_memory(
    runs: dict[str, plaza.Run], memory: Memory, name: str
) -> None:
    run = runs[name]
    in_run = cues.wholes("superset", [run.session.uid], transitive=True)
    motions = [_bare(event.as_event()) for event in memory.recall(cues.is_a("Motion") & in_run)]
    contacts = [_bare(event.as_event()) for event in memory.recall(cues.exactly("BeaconContact") & in_run)]
    rows = list(episodes.rows(motions, lambda ordinal: plaza.uid(name, "row", ordinal)))
    laps = list(episodes.laps(motions, rows, lambda ordinal: plaza.uid(name, "lap", ordinal)))
    session = episodes.session(motions, contacts, rows, laps, name, plaza.uid(name, "session", 1))
    assert rows == list(run.rows)
    assert laps == list(run.laps)
    assert set(session.parts) == set(run.session.parts)


@pytest.mark.parametrize("name", NAMES)
def test_a_session_is_a_run_without_pause(runs: dict[str, plaza.Run], name: str) -> None:
    run = runs[name]
    spans = sorted(_seconds(event.interval) for event in (*run.motions, *run.contacts))
    latest = spans[0][1]
    for begin, end in spans:
        assert begin - latest < 60
        latest = max(latest, end)


def test_short_drives_of_another_heading_do_not_end_a_row() -> None:
    row = _made(("Drive", 10, 90), ("Drive", 2.9, 200), ("Drive", 10, 120), ("Turn", 0, -40))
    assert [list(found.parts) for found in episodes.rows(row, _ordinal)] == [[event.uid for event in row]]


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
    assert [[place[part] for part in row.parts] for row in episodes.rows(made, _ordinal)] == expected


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
    rows = list(episodes.rows(made, _ordinal))
    assert [lap.value("rows") for lap in episodes.laps(made, rows, lambda n: _ordinal(100 + n))] == expected


def _ordinal(number: int) -> UUID:
    return plaza.uid("made", "episode", number)


def _made(*given: tuple[str, float, float]) -> list[Event]:
    """Motions of ten seconds each: (type, distance, heading of a drive or angle of a turn)."""
    made = []
    for index, (kind, metres, degrees) in enumerate(given):
        begin = MIDNIGHT + timedelta(seconds=10 * index)
        made.append(
            Event(
                type=kind,
                interval=Interval(begin=begin, end=begin + timedelta(seconds=10)),
                features={"distance": metres, "heading" if kind == "Drive" else "turn": degrees},
                uid=plaza.uid("made", "motion", index),
            )
        )
    return made


# In a memory


def test_extents_derive_and_parts_lie_inside(runs: dict[str, plaza.Run], memory: Memory) -> None:
    for run in runs.values():
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
            assert stored.region.frame == run.name
            assert shapely.hausdorff_distance(stored.region.polygon, hull) < 1e-6
            assert all(event.uid in part.wholes for part in parts)
        heard = memory.get(run.session.uid).subject
        assert heard is not None
        assert all(heard.polygon.buffer(1e-6).contains(shapely.Point(x, y)) for _, x, y in RAW[run.name].beacons)


def _end(interval: Interval) -> datetime:
    assert interval.end is not None
    return interval.end


def test_everything_is_part_of_its_session(runs: dict[str, plaza.Run], memory: Memory) -> None:
    for run in runs.values():
        below = memory.recall(cues.wholes("superset", [run.session.uid], transitive=True))
        assert below.count() == sum(1 for _ in run.events) - 1


def test_loading_again_changes_nothing(runs: dict[str, plaza.Run], memory: Memory) -> None:
    before = memory.statistics()
    again = plaza.load_all()
    report = memory.load(event for run in again for event in run.events)
    assert (report.new, report.refused, report.existing) == (0, 0, before.events)
    assert memory.statistics() == before
    for run in again:
        assert [content_hash(event) for event in run.events] == [content_hash(e) for e in runs[run.name].events]


def test_the_clock_is_anchored(runs: dict[str, plaza.Run]) -> None:
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


def test_rows_near_beacon_6(runs: dict[str, plaza.Run], memory: Memory) -> None:
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


def test_contacts_at_stands(runs: dict[str, plaza.Run], memory: Memory) -> None:
    overlapping = 0
    for run in runs.values():
        stands = [_seconds(event.interval) for event in run.motions if event.type == "Stand"]
        spans = [_seconds(event.interval) for event in run.contacts]
        overlapping += sum(any(b <= end and begin <= e for b, e in stands) for begin, end in spans)
    assert _asked(memory, "Which beacon contacts")[0].startswith(f"{overlapping} contacts: ")


def test_the_last_contact_before_each_turn(runs: dict[str, plaza.Run], memory: Memory) -> None:
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


def test_far_from_every_beacon(runs: dict[str, plaza.Run], memory: Memory) -> None:
    places = [shapely.Point(x, y) for _, x, y in RAW["plaza1"].beacons]
    far = [
        event
        for event in runs["plaza1"].motions
        if event.region is not None and all(event.region.polygon.distance(place) > 28.2 for place in places)
    ]
    assert len(_asked(memory, "What did it do in plaza1 farther")) == len(far) == 5


def test_out_of_touch(runs: dict[str, plaza.Run], memory: Memory) -> None:
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
    assert "Loaded 555 events" in told
    for question in questions.QUESTIONS:
        assert question.text in told
        assert all(line in told for line in question.answer(memory))
    assert "runs no SQL" in told
    assert "63 events by itself" in told
    assert "Picture" not in told
    assert "Loaded 0 events" in (again := _tour(memory, None))
    assert "555 were there already" in again


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
    stated("differ by at most {} degrees", [episodes.SAME_WAY])
    stated("a turn of {} degrees or more", [episodes.TURN_BACK])
    stated("a drive of {} m or more", [episodes.SHORT_DRIVE])
    stated("less than {} m of drives", [episodes.ROW_LENGTH])
