"""Tests of the paper's experiments: their schedule, their statistics, the runs that are kept, and a small run."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest

from elm.errors import InvalidValue
from elm.event import Payload, StoredEvent
from elm.geometry import Region
from elm.interval import Interval
from simulators.__main__ import main
from simulators.bench.scratch import connect
from simulators.paper import course as experimental_run
from simulators.paper.copies import Copies
from simulators.paper.finished import Finished, beside, differences, find, keep
from simulators.paper.moments import BySize, Moments
from simulators.paper.schedule import Answer, Course, courses
from simulators.paper.summary import figures
from simulators.paper.times import ALL, Longest, Times
from simulators.worlds.queries import CLASSES
from tests.servers import Server

COURSE = Course(components=1, number=0, events=1000, answer=Answer.IDS, seed=1)
UNDER = {"machine": {"cores": 2}, "versions": {"python": "3.11.2"}, "settings": {"fsync": "on"}, "code": "abc"}


@pytest.fixture(scope="module")
def dsn(postgres_server: Server) -> Iterator[str]:
    """A database of these tests."""
    with postgres_server.database() as address:
        yield address


def moments(*values: float) -> Moments:
    found = Moments()
    for value in values:
        found.add(value)
    return found


# The schedule


def test_insertions_and_queries_alternate_as_in_the_paper() -> None:
    whole = replace(COURSE, events=100_000)
    periods = list(whole.periods())
    assert periods[:2] == [(1, 100), (101, 200)]
    assert periods[-1] == (99_901, 100_000)
    assert all(last - first + 1 == 100 for first, last in periods)
    assert len(periods) == 1000
    assert whole.queries == 25_000
    assert (whole.step, COURSE.step) == (1000, 100)


def test_a_run_has_whole_tenths_and_up_to_three_components() -> None:
    for events in (0, 500, 1050, 10_500):
        with pytest.raises(InvalidValue, match=r"a multiple of 1,000 events"):
            replace(COURSE, events=events)
    with pytest.raises(InvalidValue, match="of 1, 2 and 3 components, not of 4"):
        replace(COURSE, components=4)
    with pytest.raises(InvalidValue, match="one run at least"):
        courses(runs=0, events=1000, components=[1], seed=1)


def test_runs_take_turns_by_experiment_and_the_first_of_each_reads_objects() -> None:
    planned = courses(runs=3, events=1000, components=[1, 3], seed=7)
    assert [(run.components, run.number) for run in planned] == [(1, 0), (3, 0), (1, 1), (3, 1), (1, 2), (3, 2)]
    assert [run.answer for run in planned] == [Answer.OBJECTS] * 2 + [Answer.IDS] * 4
    assert len({run.own_seed for run in planned}) == len({run.name for run in planned}) == 6
    assert [run.answer for run in courses(runs=1, events=1000, components=[2], seed=7)] == [Answer.IDS]


# Statistics


def test_moments_of_a_series_worked_out_by_hand() -> None:
    found = moments(2, 4, 4, 4, 5, 5, 7, 9)
    assert (found.count, found.mean, found.max) == (8, 5.0, 9)
    # Squares of the deviations 3, 1, 1, 1, 0, 0, 2, 4 from the mean: 32, over 8 - 1.
    assert found.sd == pytest.approx(math.sqrt(32 / 7))
    assert moments(3.0).sd is None
    assert moments().sd is None
    assert moments(-3, -2).max == -2


def test_merged_moments_are_those_of_all_values() -> None:
    for split in range(9):
        values = (2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0)
        found = moments(*values[:split])
        found.merge(moments(*values[split:]))
        assert (found.count, found.max) == (8, 9)
        assert found.mean == pytest.approx(5)
        assert found.sd == pytest.approx(math.sqrt(32 / 7))


def test_sizes_of_the_memory_are_rounded_up() -> None:
    series = BySize(100)
    for events, value in ((1, 1.0), (100, 3.0), (101, 10.0), (1000, 5.0)):
        series.add(events, value)
    assert {size: found.mean for size, found in series.bins.items()} == {100: 2.0, 200: 10.0, 1000: 5.0}
    assert series.total().mean == 4.75
    assert series.between(100, 900).mean == 10.0
    assert BySize.of_rows(100, json.loads(json.dumps(series.as_rows()))) == series


def test_growth_is_the_last_tenth_over_the_second() -> None:
    series = BySize(100)
    for events in range(1, 2001):
        series.add(events, 100.0 if events <= 200 else events)
    # 201 to 400 against 1,801 to 2,000.
    assert series.growth(2000) == pytest.approx(1900.5 / 300.5)
    assert BySize(100).growth(2000) is None


def finished(course: Course, insertion: list[tuple[int, float]], queries: list[tuple[int, float, int]]) -> Finished:
    times = Times(course.step)
    for size, seconds in insertion:
        times.insertion.add(size, seconds)
        times.bare.add(size, 0.001)
    for size, seconds, rows in queries:
        for key in (ALL, "type.is_a"):
            series = times.of(key)
            series["time"].add(size, seconds)
            series["rows"].add(size, rows)
            series["fetch"].add(size, 0.002)
            series["fetched"].add(size, seconds)
            series["fetch_whole"].add(size, 0.002)
    longest = max(queries, key=lambda query: query[1])
    times.longest = Longest(seconds=longest[1], classes=("type.is_a",), rows=longest[2], events=longest[0])
    return Finished(course=course, times=times, seconds=3.0, started="2026-01-01", load_average={})


def test_the_figures_of_two_runs_worked_out_by_hand() -> None:
    first = finished(COURSE, [(200, 0.001), (1000, 0.003)], [(200, 0.004, 2), (1000, 0.006, 4)])
    other = replace(COURSE, number=1)
    second = finished(other, [(200, 0.003), (1000, 0.005)], [(200, 0.008, 6), (1000, 0.010, 8)])
    found = figures([first, second], events=1000)
    insertion = found["insertion"]
    # 1, 3, 3, 5 ms: squares of the deviations 4, 0, 0, 4.
    assert (insertion["count"], insertion["mean"], insertion["max"]) == (4, 3.0, 5.0)
    assert insertion["sd"] == pytest.approx(math.sqrt(8 / 3), abs=1e-4)
    assert (insertion["growth"], insertion["bare"]["growth"], insertion["vs_bare"]) == (2.0, 1.0, 3.0)
    assert insertion["by_size"]["size"] == [200, 1000]
    assert insertion["by_size"]["mean"] == [2.0, 4.0]
    assert insertion["by_size"]["sd"] == pytest.approx([math.sqrt(2), math.sqrt(2)], abs=1e-4)
    assert insertion["by_size"]["bare_mean"] == [1.0, 1.0]
    asked = found["experiments"]["1"]["queries"]["ids"]
    assert asked["all"] == asked["classes"]["type.is_a"]
    assert (asked["all"]["mean"], asked["all"]["rows"], asked["all"]["most_rows"]) == (7.0, 5.0, 8)
    assert (asked["all"]["vs_fetch"], asked["all"]["growth"]) == (3.5, round(8 / 6, 4))
    assert asked["longest"] == {"ms": 10.0, "classes": ["type.is_a"], "rows": 8, "events": 1000}
    assert [run["seed"] for run in found["runs"]] == [COURSE.own_seed, other.own_seed]
    assert found["published"]["retrieval"]["1"]["class_means"] == (14.0, 589.0)


# Copies


def stored(number: int) -> StoredEvent:
    begin = datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=number)
    return StoredEvent(
        id=number,
        uid=UUID(int=number),
        type="type-1",
        interval=Interval(begin=begin, end=begin + timedelta(seconds=1)),
        recorded_at=begin,
        region=Region.box(0, 0, number, 1),
        features=(("count", number), ("name", "cup")),
        payload=Payload(data=b"x" * number),
        wholes=(UUID(int=1000 + number),),
    )


def test_copies_are_the_events_and_may_grow_between_reads() -> None:
    events = [stored(number) for number in range(1, 7)]
    with Copies() as copies:
        assert len(copies) == 0
        copies.extend(events[:3])
        assert copies[1] == events[1]
        copies.extend(events[3:])
        assert list(copies) == events
        assert copies[2:4] == events[2:4]
        with pytest.raises(IndexError, match="no copy 6"):
            copies[6]


# Finished runs


def test_a_finished_run_is_found_again(tmp_path: Path) -> None:
    done = finished(COURSE, [(200, 0.001), (1000, 0.003)], [(200, 0.004, 2)])
    assert find(tmp_path, COURSE, UNDER) is None
    keep(tmp_path, done, UNDER)
    assert find(tmp_path, COURSE, UNDER) == done
    assert [file.suffix for file in tmp_path.iterdir()] == [".json"]
    assert beside(tmp_path / "paper.json") == tmp_path / "paper.runs"


@pytest.mark.parametrize(
    ("course", "under", "difference"),
    [
        (replace(COURSE, seed=2), UNDER, {"seed"}),
        (replace(COURSE, events=2000), UNDER, {"events"}),
        (COURSE, UNDER | {"code": "def"}, {"code"}),
        (COURSE, UNDER | {"code": "def", "settings": {}}, {"code", "settings"}),
        (replace(COURSE, answer=Answer.OBJECTS), UNDER, set()),
    ],
)
def test_a_run_under_other_conditions_is_none_of_these_and_stays(
    course: Course, under: dict[str, Any], difference: set[str], tmp_path: Path
) -> None:
    before = finished(COURSE, [(200, 0.001)], [(200, 0.004, 2)])
    keep(tmp_path, before, UNDER)
    assert find(tmp_path, course, under) is None
    assert differences(tmp_path, course, under) == difference
    after = finished(course, [(200, 0.002)], [(200, 0.005, 3)])
    keep(tmp_path, after, under)
    assert find(tmp_path, COURSE, UNDER) == before
    assert find(tmp_path, course, under) == after


def test_without_a_file_for_the_figures_nothing_is_kept() -> None:
    keep(None, finished(COURSE, [(200, 0.001)], [(200, 0.004, 2)]), UNDER)
    assert find(None, COURSE, UNDER) is None
    assert differences(None, COURSE, UNDER) == set()


# The runs


def measured(file: Path, *arguments: str) -> dict[str, Any]:
    assert main(["paper", *arguments, "--json", str(file)]) == 0
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


def test_the_experiment_runs_once_and_not_again(dsn: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, arguments = tmp_path / "out" / "paper.json", ("--quick", "--runs", "2", "--components", "1", "--dsn", dsn)
    found = measured(file, *arguments)
    assert "2 of 2 runs were finished" not in capsys.readouterr().err
    insertion = found["insertion"]
    assert (insertion["count"], insertion["bare"]["count"]) == (2000, 200)
    assert insertion["by_size"]["count"] == [200] * 10
    assert insertion["by_size"]["size"] == list(range(100, 1001, 100))
    assert set(found["goals"]) == {"insert_growth", "insert_vs_bare", "growth.1.objects", "growth.1.ids"}
    assert found["goals"]["insert_growth"]["value"] == insertion["growth"]
    for answer, asked in found["experiments"]["1"]["queries"].items():
        assert asked["all"]["count"] == 250
        assert asked["all"]["fetch"]["count"] == 25
        assert asked["all"]["max"] == asked["longest"]["ms"]
        assert set(asked["classes"]) <= set(CLASSES)
        assert sum(each["count"] for each in asked["classes"].values()) == 250
        # An atomic event has no parts: all events have at least those.
        assert asked["classes"]["parts.superset"]["most_rows"] > 100
        assert asked["classes"]["time.equal"]["rows"] >= 1
        assert answer in ("objects", "ids")
    with connect(dsn) as connection:
        left = connection.execute("SELECT count(*) FROM pg_namespace WHERE nspname LIKE 'bench%'").fetchone()
    assert left == (0,)
    again = measured(file, *arguments)
    assert "2 of 2 runs were finished before" in capsys.readouterr().err
    assert {**again, "run": None} == {**found, "run": None}


def test_queries_of_several_components_count_for_each_class(dsn: str) -> None:
    ticks: list[int] = []
    times = experimental_run.run(dsn, replace(COURSE, components=3), ticks.append)
    assert ticks == [125] * 10
    counts = {key: series["time"].total().count for key, series in times.asked.items()}
    assert counts.pop(ALL) == 250
    assert sum(counts.values()) == 750
    assert len(times.longest.classes) == 3
    assert times.asked[ALL]["fetch_whole"].total().count == 25
    assert Times.of_json(json.loads(json.dumps(times.as_json()))) == times
