"""Tests of the rover Spirit: its files' counts and nesting, cues answered as they say, and what is recognized in it."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from uuid import UUID

import pytest
import shapely

from elm import cues
from elm.app import Memory
from elm.demo import rover_recognizers, spirit
from elm.errors import InvalidValue
from elm.event import Event, StoredEvent
from elm.geometry import Region
from elm.query import ByFeature, Nearest
from elm.storage.memory import MemoryStore

Line = dict[str, str]


@pytest.fixture(scope="module")
def folder() -> Path:
    if not (given := os.environ.get("ELM_TEST_DATA")):
        pytest.skip("ELM_TEST_DATA is not set: the rover's files are not here")
    found = Path(given) / "spirit"
    if not found.is_dir():
        pytest.skip(f"ELM_TEST_DATA has no folder spirit: {given}")
    return found


@pytest.fixture(scope="module")
def lines(folder: Path) -> list[Line]:
    with (folder / "traverse_path.csv").open(encoding="utf-8") as text:
        return list(csv.DictReader(text))


@pytest.fixture(scope="module")
def noons(folder: Path) -> dict[int, datetime]:
    with (folder / "sol_utc.tsv").open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text, delimiter="\t"))
    return {int(row["Sol"]): datetime.fromisoformat(row["UTC"].replace(".", ":") + "+00:00") for row in rows}


@pytest.fixture(scope="module")
def traverse(folder: Path) -> spirit.Traverse:
    return spirit.load(folder)


@pytest.fixture(scope="module")
def memory(traverse: spirit.Traverse) -> Iterator[Memory]:
    with Memory(MemoryStore(memory="spirit")) as filled:
        filled.add_types(spirit.TYPES)
        report = filled.load(traverse.events)
        assert (report.new, report.refused) == (8_765 + 834 + 139 + 1, 0)
        yield filled


def _sol(line: Line, which: str = "START") -> int:
    return int(line[f"{which}_SOL"])


def _place(line: Line) -> tuple[float, float]:
    return float(line["CORRECTED_X"]), float(line["CORRECTED_Y"])


def _begin_of(noons: dict[int, datetime], sol: int) -> datetime:
    return noons[sol] - timedelta(seconds=44_388)


def _end(event: StoredEvent) -> datetime:
    assert event.interval.end is not None
    return event.interval.end


def test_the_files_and_their_oddities_are_counted(traverse: spirit.Traverse, lines: list[Line]) -> None:
    report = traverse.report
    assert report == replace(
        report,
        rows=8_804,
        duplicates=39,
        off_table=0,
        stays=8_765,
        drive_days=834,
        sites=139,
        sols_with_driving=713,
        stays_over_a_sol=614,
        longest_stay=130,
        touching_sites=127,
        sites_apart=11,
        overlapping_sites=0,
        sites_without_sols=3,
        sites_of_other_sols=52,
        sites_unlisted=7,
        drives_of_other_sols=1,
    )
    assert report.path_metres == pytest.approx(7_211, abs=0.5)
    along = sum(math.dist(_place(one), _place(other)) for one, other in pairwise(lines))
    assert report.path_metres == pytest.approx(along, abs=1e-6)
    assert len({tuple(line.values()) for line in lines}) == report.stays


def test_stays_have_the_times_of_their_sols(
    memory: Memory, lines: list[Line], noons: dict[int, datetime], traverse: spirit.Traverse
) -> None:
    distinct = [line for before, line in pairwise([None, *lines]) if line is not None and line != before]
    for stay, line in zip(traverse.stays, distinct, strict=True):
        assert stay.interval is not None
        assert stay.interval.begin == _begin_of(noons, _sol(line))
        if (after := _sol(line, "END") + 1) in noons:
            assert stay.interval.end == _begin_of(noons, after)
        assert stay.value("drive") == int(line["DRIVE"])
        assert stay.region is not None
        assert stay.region.polygon.contains(shapely.Point(_place(line)))
    last = memory.recall(order="-begin").first()
    assert last is not None
    assert _end(last) == _begin_of(noons, 2209) + spirit.SOL
    assert _begin_of(noons, 1) == datetime(2004, 1, 3, 13, 45, 46, tzinfo=UTC)


def test_mission_sites_days_and_stays_nest(memory: Memory, traverse: spirit.Traverse, lines: list[Line]) -> None:
    assert [(group.key, group.count) for group in memory.recall().groups("type")] == [
        ("DriveDay", 834),
        ("Mission", 1),
        ("Site", 139),
        ("Stay", 8_765),
    ]
    below = {"Mission": "Site", "Site": "DriveDay", "DriveDay": "Stay"}
    for kind, part_kind in below.items():
        held: list[UUID] = []
        for whole in memory.recall(cues.exactly(kind)):
            parts = [memory.get(part) for part in whole.parts]
            assert {part.type for part in parts} == {part_kind}
            assert whole.interval.begin == min(part.interval.begin for part in parts)
            assert _end(whole) == max(map(_end, parts))
            assert whole.agent == "spirit"
            held += whole.parts
        assert len(held) == len(set(held)) == memory.recall(cues.exactly(part_kind)).count()
    keys = {(int(line["SITE"]), _sol(line)) for line in lines}
    assert {(day.value("site"), day.value("start_sol")) for day in traverse.days} == keys


def test_distances_add_up(traverse: spirit.Traverse) -> None:
    for events in (traverse.stays, traverse.days, traverse.sites, (traverse.mission,)):
        distances = [event.value("distance") for event in events]
        assert sum(d for d in distances if isinstance(d, float)) == pytest.approx(7_211.269, abs=0.001)


def test_regions_derive_in_one_frame(memory: Memory, traverse: spirit.Traverse, lines: list[Line]) -> None:
    mission = memory.get(traverse.mission.uid)
    assert mission.region is not None
    assert mission.region.frame == "mars2000"
    hull = shapely.MultiPoint([_place(line) for line in lines]).convex_hull
    assert shapely.hausdorff_distance(mission.region.polygon, hull) < 1.01 * spirit.FOOTPRINT
    assert [(group.key, group.count) for group in memory.recall().groups("frame")] == [("mars2000", 9_739)]


def test_where_it_wintered(memory: Memory, lines: list[Line]) -> None:
    long = memory.recall(cues.exactly("Stay") & cues.lasting(">", timedelta(days=100)))
    expected = [line for line in lines if _sol(line, "END") - _sol(line) >= 97]
    assert [(s.value("start_sol"), s.value("end_sol")) for s in long] == [
        (_sol(line), _sol(line, "END")) for line in expected
    ]
    assert len(expected) >= 2


def test_who_was_there_on_a_day_shared_by_two_sites(memory: Memory, noons: dict[int, datetime]) -> None:
    """Sites 13 and 14 touch on sol 63: at this resolution both were there at its noon."""
    at_noon = cues.time("superset", noons[63], noons[63])
    sites = memory.recall(cues.exactly("Site") & at_noon)
    assert [site.value("site") for site in sites] == [13, 14]


def test_stays_within_a_distance(memory: Memory, lines: list[Line]) -> None:
    x, y = -1262.62, -863234.78
    place = Region.around(x, y, 0.01, frame="mars2000")
    found = memory.recall(cues.exactly("Stay") & cues.within(10.0 - spirit.FOOTPRINT, place))
    near = {tuple(line.values()) for line in lines if math.dist(_place(line), (x, y)) < 9.95}
    far = {tuple(line.values()) for line in lines if math.dist(_place(line), (x, y)) < 10.2}
    assert len(near) <= found.count() <= len(far)
    assert len(near) == 21
    first = memory.recall(cues.exactly("Stay"), order=Nearest(to=place), limit=1).first()
    assert first is not None
    assert first.region is not None
    assert first.region.polygon.contains(shapely.Point(x, y))


def test_what_happened_in_a_year(memory: Memory, lines: list[Line], noons: dict[int, datetime]) -> None:
    begin, end = datetime(2005, 1, 1, tzinfo=UTC), datetime(2006, 1, 1, tzinfo=UTC)
    year = cues.exactly("DriveDay") & cues.time("subset", begin, end)
    days: dict[tuple[str, int], int] = {}
    for line in lines:
        key = (line["SITE"], _sol(line))
        days[key] = max(days.get(key, 0), _sol(line, "END"))
    expected = [
        first
        for (_, first), last in days.items()
        if last < 2209 and _begin_of(noons, first) >= begin and _begin_of(noons, last + 1) <= end
    ]
    assert memory.recall(year).count() == len(expected) > 100


def test_stays_by_site_and_through_the_parts(memory: Memory, traverse: spirit.Traverse, lines: list[Line]) -> None:
    distinct = {tuple(line.values()): line for line in lines}.values()
    at_88 = sum(line["SITE"] == "88" for line in distinct)
    (site,) = [event for event in traverse.sites if event.value("site") == 88]
    by_part = cues.exactly("Stay") & cues.wholes("superset", [site.uid], transitive=True)
    by_feature = cues.exactly("Stay") & cues.feature("site", "=", 88)
    assert memory.recall(by_part).count() == memory.recall(by_feature).count() == at_88 > 10
    groups = {group.key: group.count for group in memory.recall(cues.exactly("Stay")).groups(ByFeature(name="site"))}
    assert len(groups) == 139
    assert groups[88] == at_88


def test_the_longest_drive_days(memory: Memory, lines: list[Line]) -> None:
    distances: dict[tuple[str, int], float] = {}
    for before, line in pairwise([lines[0], *lines]):
        key = (line["SITE"], _sol(line))
        distances[key] = distances.get(key, 0.0) + math.dist(_place(before), _place(line))
    expected = sorted((int(site), sol) for (site, sol), metres in distances.items() if metres > 80)
    found = memory.recall(cues.exactly("DriveDay") & cues.feature("distance", ">", 80))
    assert sorted((day.value("site"), day.value("start_sol")) for day in found) == expected
    assert len(expected) >= 5


def test_sites_have_the_latitude_that_is_listed(traverse: spirit.Traverse, folder: Path) -> None:
    with (folder / "sites.tsv").open(encoding="utf-8") as text:
        listed = {int(row["rmcSite"]): row for row in csv.DictReader(text, delimiter="\t")}
    for site in traverse.sites:
        number = site.value("site")
        assert isinstance(number, int)
        expected = float(listed[number]["latitude"]) if number in listed else None
        assert site.value("latitude") == expected
    assert sum(site.value("longitude") is None for site in traverse.sites) == 7


def test_loading_twice_changes_nothing(memory: Memory, folder: Path) -> None:
    report = memory.load(spirit.load(folder).events)
    assert (report.new, report.existing, report.refused) == (0, 9_739, 0)


def test_rows_of_unknown_sols_are_left_out_and_counted(folder: Path, tmp_path: Path) -> None:
    for name in ("traverse_path.csv", "sites.tsv", "drives.tsv"):
        (tmp_path / name).write_text((folder / name).read_text(encoding="utf-8"), encoding="utf-8")
    table = (folder / "sol_utc.tsv").read_text(encoding="utf-8").splitlines()
    (tmp_path / "sol_utc.tsv").write_text("\n".join([table[0], *table[1:1001]]), encoding="utf-8")
    cut = spirit.load(tmp_path)
    assert cut.report.off_table > 0
    assert cut.report.stays + cut.report.off_table + cut.report.duplicates == 8_804
    assert max(int(str(stay.value("end_sol"))) for stay in cut.stays) <= 1000
    (tmp_path / "sol_utc.tsv").write_text(table[0], encoding="utf-8")
    with pytest.raises(InvalidValue, match=r"traverse_path\.csv has no row with a sol"):
        spirit.load(tmp_path)


# Recognized from the positions alone


@pytest.fixture(scope="module")
def watched(traverse: spirit.Traverse) -> Iterator[Memory]:
    """A memory that was told of the positions, and of nothing that the loader made of them."""
    with Memory(MemoryStore(memory="watched")) as filled:
        filled.add_types(spirit.TYPES)
        assert filled.load(traverse.stays).new == 8_765
        filled.punctuate(_last_of(traverse.stays) + 3 * rover_recognizers.LONGEST, agent=spirit.AGENT)
        manager = filled.recognition(rover_recognizers.RECOGNIZERS)
        manager.catch_up()
        for each in manager.status():
            assert (each.lag, each.late, each.partial, each.dropped, each.is_failing) == (0, 0, 0, 0, False), each.name
        yield filled


def _last_of(events: Iterable[Event]) -> datetime:
    return max(e.interval.end for e in events if e.interval is not None and e.interval.end is not None)


def test_drives_are_the_loaders_drive_days(watched: Memory, memory: Memory, traverse: spirit.Traverse) -> None:
    """All of it agrees: parts in their order, extents, and features but for the recognizer's own."""
    drives = list(watched.recall(cues.exactly("Drive")))
    days = {(day.value("site"), day.value("start_sol")): day for day in traverse.days}
    assert len(drives) == len(days) == 834
    for drive in drives:
        day = days.pop((drive.value("site"), drive.value("start_sol")))
        assert drive.parts == day.parts
        assert (drive.value("distance"), drive.value("positions")) == (day.value("distance"), len(day.parts))
        _assert_same_extent(drive, memory.get(day.uid))


def test_site_visits_are_the_loaders_sites(watched: Memory, memory: Memory, traverse: spirit.Traverse) -> None:
    """Their count, order, extents and drives agree. Latitude and longitude cannot: they are of a table, not of the
    positions; nor can the uids, which are hashes."""
    visits = list(watched.recall(cues.exactly("SiteVisit")))
    assert [visit.value("site") for visit in visits] == [site.value("site") for site in traverse.sites]
    assert len(visits) == 139
    days = {day.uid: (day.value("site"), day.value("start_sol")) for day in traverse.days}
    for visit, site in zip(visits, traverse.sites, strict=True):
        drives = [watched.get(part) for part in visit.parts]
        assert [(drive.value("site"), drive.value("start_sol")) for drive in drives] == [days[p] for p in site.parts]
        assert (visit.value("distance"), visit.value("drives")) == (site.value("distance"), len(site.parts))
        assert visit.value("latitude") is None
        _assert_same_extent(visit, memory.get(site.uid))


def _assert_same_extent(one: StoredEvent, other: StoredEvent) -> None:
    assert one.interval == other.interval
    assert one.region is not None
    assert other.region is not None
    assert one.region.frame == other.region.frame
    assert shapely.hausdorff_distance(one.region.polygon, other.region.polygon) < 1e-6


def test_standstills_against_a_search_by_hand(watched: Memory, traverse: spirit.Traverse) -> None:
    """From each position on: how long did the rover cover that point? The loader's structure has no such thing.

    What must agree with it: whoever stays ten days at one position stands still. What cannot: standing still does not
    mind where one site ends and the next begins, so that some standstills are of two sites. For 225 days of 2008 the
    path says nothing: a standstill ends there, and another begins.
    """
    stays = traverse.stays
    ends = [_last_of([stay]) for stay in stays]
    assert ends == sorted(ends)
    assert max(later - end for end, later in pairwise(ends)) > rover_recognizers.LONGEST
    expected: list[list[UUID]] = []
    at = 0
    while at < len(stays):
        region = stays[at].region
        assert region is not None
        end = at + 1
        while end < len(stays) and _covers(stays[end].region, region.polygon.centroid):
            if ends[end] - ends[end - 1] > rover_recognizers.LONGEST:
                break
            end += 1
        first = min(e.interval.begin for e in stays[at:end] if e.interval is not None)
        if ends[end - 1] - first >= timedelta(days=10):
            expected.append([stay.uid for stay in stays[at:end]])
            at = end
        else:
            at += 1
    found = list(watched.recall(cues.exactly("Standstill")))
    assert [list(standstill.parts) for standstill in found] == expected
    assert len(found) == 41
    inside = {part: standstill for standstill in found for part in standstill.parts}
    long = [stay for stay in stays if _lasted(stay) >= timedelta(days=10)]
    assert len(long) > 10
    assert all(stay.uid in inside for stay in long)
    site_of = {stay.uid: stay.value("site") for stay in stays}
    assert sum(len({site_of[part] for part in standstill.parts}) > 1 for standstill in found) == 15


def _covers(region: Region | None, point: shapely.Point) -> bool:
    return region is not None and bool(region.polygon.intersects(point))


def test_a_replay_finds_the_same(watched: Memory) -> None:
    again = watched.recognize(rover_recognizers.RECOGNIZERS, commit=False)
    assert (again.new, again.missing, again.late) == ((), (), 0)
    assert len(again.found) == 834 + 139 + 41


def _lasted(event: Event) -> timedelta:
    assert event.interval is not None
    return event.interval.duration or timedelta()
