"""The rover Spirit, 2004-2010, as events: the mission, its sites, their drive days and every stay; from a folder."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from pathlib import Path
from uuid import NAMESPACE_URL, UUID, uuid5

from elm.errors import InvalidValue
from elm.event import Event
from elm.features import FeatureValue
from elm.geometry import Region
from elm.interval import Interval
from elm.taxonomy import EventType

AGENT = "spirit"
FRAME = "mars2000"
"""Metres of one equirectangular plane over the whole traverse (sphere Mars 2000): the columns CORRECTED_*."""
FOOTPRINT = 1.2
"""Radius of the rover in metres."""
NOON = timedelta(seconds=44_388)
"""From the begin of a sol to its local noon, which the table of sols gives in UTC."""
SOL = timedelta(seconds=88_775, microseconds=244_000)
"""A mean solar day on Mars, for the end of the table's last sol."""
UNKNOWN_SOL = -1
"""What the table of sites says where it knows no sol."""

TYPES = (
    EventType(name="Motion"),
    EventType(name="Stay", parents=("Motion",)),
    EventType(name="Episode"),
    EventType(name="DriveDay", parents=("Episode",)),
    EventType(name="Site", parents=("Episode",)),
    EventType(name="Mission", parents=("Episode",)),
)

_NAMESPACE = uuid5(NAMESPACE_URL, "urn:elm:demo:spirit")
_STAYS = uuid5(_NAMESPACE, "Stay")


@dataclass(frozen=True, slots=True, kw_only=True)
class SpiritReport:
    """What was read and what is odd in it, counted."""

    rows: int
    """Rows of the path."""
    duplicates: int
    """Rows that repeat the one before them in every column; they are left out."""
    off_table: int
    """Rows with a sol that the table of sols does not have; they are left out."""
    stays: int
    drive_days: int
    sites: int
    sols_with_driving: int
    path_metres: float
    stays_over_a_sol: int
    """Stays that end on a later sol than they began."""
    longest_stay: int
    """Sols between the first and the last of the longest stay: a winter."""
    touching_sites: int
    """Sites that begin on the very sol on which the one before ends: at this resolution their times overlap."""
    sites_apart: int
    """Sites that begin on a later sol than the one before ends."""
    overlapping_sites: int
    """Sites that begin on an earlier sol than the one before ends."""
    sites_without_sols: int
    """Rows of the table of sites that say -1 for their sols; the path knows better."""
    sites_of_other_sols: int
    """Rows of the table of sites with other sols than the path has; the path is believed."""
    sites_unlisted: int
    """Sites of the path that the table of sites lacks; they have no latitude and longitude."""
    drives_of_other_sols: int
    """Rows of the table of drives with sols on which the path has the rover elsewhere; they are not used."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Traverse:
    """The rover's life as events and what was odd in the files."""

    stays: tuple[Event, ...]
    days: tuple[Event, ...]
    sites: tuple[Event, ...]
    mission: Event
    report: SpiritReport

    @property
    def events(self) -> Iterator[Event]:
        """Every event, parts before wholes."""
        yield from self.stays
        yield from self.days
        yield from self.sites
        yield self.mission


@dataclass(frozen=True, slots=True, kw_only=True)
class _Row:
    site: int
    drive: int
    first_sol: int
    last_sol: int
    raw: tuple[float, float]
    place: tuple[float, float]


def load(folder: Path) -> Traverse:
    """The traverse in `folder`: traverse_path.csv, sol_utc.tsv, sites.tsv and drives.tsv."""
    begins = _sol_begins(_table(folder / "sol_utc.tsv", "\t"))
    read = [_row(line) for line in _table(folder / "traverse_path.csv", ",")]
    distinct = [row for before, row in pairwise([None, *read]) if row is not None and row != before]
    rows = [row for row in distinct if row.first_sol in begins and row.last_sol in begins]
    if not rows:
        raise InvalidValue(f"{folder / 'traverse_path.csv'} has no row with a sol that sol_utc.tsv knows")
    steps = [0.0, *(math.dist(one.place, other.place) for one, other in pairwise(rows))]
    stays = [_stay(row, step, begins, ordinal) for ordinal, (row, step) in enumerate(zip(rows, steps, strict=True))]
    by_day: dict[tuple[int, int], list[int]] = {}
    for index, row in enumerate(rows):
        by_day.setdefault((row.site, row.first_sol), []).append(index)
    by_site: dict[int, list[tuple[int, int]]] = {}
    for key in by_day:
        by_site.setdefault(key[0], []).append(key)
    listed = {int(line["rmcSite"]): line for line in _table(folder / "sites.tsv", "\t")}
    days = {
        (site, sol): _whole(
            "DriveDay", f"{site}/{sol}", [stays[index] for index in indices], {"site": site, "start_sol": sol}
        )
        for (site, sol), indices in by_day.items()
    }
    sites = [
        _whole("Site", str(site), [days[key] for key in keys], {"site": site, **_position(listed.get(site))})
        for site, keys in by_site.items()
    ]
    return Traverse(
        stays=tuple(stays),
        days=tuple(days.values()),
        sites=tuple(sites),
        mission=_whole("Mission", "spirit", sites, {}),
        report=_report(
            read,
            distinct,
            rows,
            steps,
            drive_days=len(days),
            listed=listed,
            drives=_table(folder / "drives.tsv", "\t"),
        ),
    )


def _stay(row: _Row, step: float, begins: Mapping[int, datetime], ordinal: int) -> Event:
    """The rover at one position, from the begin of its first sol to the end of its last.

    The end of a sol is the begin of the next one: stays that follow each other share that instant.
    """
    end = begins.get(row.last_sol + 1, begins[row.last_sol] + SOL)
    return Event(
        type="Stay",
        interval=Interval(begin=begins[row.first_sol], end=end),
        region=Region.around(*row.place, FOOTPRINT, frame=FRAME),
        features={
            "site": row.site,
            "drive": row.drive,
            "start_sol": row.first_sol,
            "end_sol": row.last_sol,
            "raw_x": row.raw[0],
            "raw_y": row.raw[1],
            "distance": step,
        },
        agent=AGENT,
        uid=_stay_uid(ordinal),
    )


def _whole(kind: str, name: str, parts: Sequence[Event], features: Mapping[str, FeatureValue]) -> Event:
    distances = [value for part in parts for value in part.values("distance") if isinstance(value, float)]
    return Event(
        type=kind,
        features={**features, "distance": math.fsum(distances)},
        parts=[part.uid for part in parts],
        uid=_uid(kind, name),
    )


def _stay_uid(ordinal: int) -> UUID:
    """Uids that grow along the path: of events at one time, recognizers are fed the one with the smaller uid first."""
    return UUID(int=_STAYS.int >> 32 << 32 | ordinal)


def _uid(kind: str, name: str) -> UUID:
    return uuid5(_NAMESPACE, f"{kind}/{name}")


def _position(listed: Mapping[str, str] | None) -> dict[str, FeatureValue]:
    if listed is None:
        return {}
    return {"latitude": float(listed["latitude"]), "longitude": float(listed["longitude"])}


def _report(
    read: Sequence[_Row],
    distinct: Sequence[_Row],
    rows: Sequence[_Row],
    steps: Sequence[float],
    *,
    drive_days: int,
    listed: Mapping[int, Mapping[str, str]],
    drives: Sequence[Mapping[str, str]],
) -> SpiritReport:
    spans: dict[int, tuple[int, int]] = {}
    stops: dict[tuple[int, int], tuple[int, int]] = {}
    for row in rows:
        spans[row.site] = _wider(spans.get(row.site), row)
        stops[row.site, row.drive] = _wider(stops.get((row.site, row.drive)), row)
    in_order = list(spans.values())
    meetings = Counter(_sign(later[0] - earlier[1]) for earlier, later in pairwise(in_order))
    given = {site: _sols(line) for site, line in listed.items()}
    known = {site: sols for site, sols in given.items() if UNKNOWN_SOL not in sols}
    return SpiritReport(
        rows=len(read),
        duplicates=len(read) - len(distinct),
        off_table=len(distinct) - len(rows),
        stays=len(rows),
        drive_days=drive_days,
        sites=len(spans),
        sols_with_driving=len({row.first_sol for row in rows}),
        path_metres=math.fsum(steps),
        stays_over_a_sol=sum(row.last_sol > row.first_sol for row in rows),
        longest_stay=max(row.last_sol - row.first_sol for row in rows),
        touching_sites=meetings[0],
        sites_apart=meetings[1],
        overlapping_sites=meetings[-1],
        sites_without_sols=len(given) - len(known),
        sites_of_other_sols=sum(spans.get(site) != sols for site, sols in known.items()),
        sites_unlisted=len(spans.keys() - listed.keys()),
        drives_of_other_sols=sum(not _within(_sols(line), stops.get(_stop(line))) for line in drives),
    )


def _wider(span: tuple[int, int] | None, row: _Row) -> tuple[int, int]:
    first, last = span or (row.first_sol, row.last_sol)
    return min(first, row.first_sol), max(last, row.last_sol)


def _within(sols: tuple[int, int], span: tuple[int, int] | None) -> bool:
    return span is not None and span[0] <= sols[0] and sols[1] <= span[1]


def _sign(number: int) -> int:
    return (number > 0) - (number < 0)


# The files


def _row(line: Mapping[str, str]) -> _Row:
    return _Row(
        site=int(line["SITE"]),
        drive=int(line["DRIVE"]),
        first_sol=int(line["START_SOL"]),
        last_sol=int(line["END_SOL"]),
        raw=(float(line["RAW_X"]), float(line["RAW_Y"])),
        place=(float(line["CORRECTED_X"]), float(line["CORRECTED_Y"])),
    )


def _sols(line: Mapping[str, str]) -> tuple[int, int]:
    return int(line["firstSol"]), int(line["lastSol"])


def _stop(line: Mapping[str, str]) -> tuple[int, int]:
    return int(line["rmcSite"]), int(line["rmcDrive"])


def _sol_begins(table: Sequence[Mapping[str, str]]) -> dict[int, datetime]:
    """When each sol begins; the table writes the time of day with dots."""
    return {
        int(line["Sol"]): datetime.strptime(line["UTC"], "%Y-%m-%d %H.%M.%S").replace(tzinfo=UTC) - NOON
        for line in table
    }


def _table(path: Path, delimiter: str) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines, delimiter=delimiter))
