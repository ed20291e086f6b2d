"""One run of CMU's autonomous mower as it was recorded: path, beacon readings, beacons, and what is odd in them."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from importlib.resources import files
from io import TextIOWrapper

import numpy as np
import numpy.typing as npt
import shapely

Numbers = npt.NDArray[np.float64]
Millis = npt.NDArray[np.int64]

RUNS = ("plaza2", "plaza1")
"""The runs in the order of their clocks: seconds of a day that nobody wrote down, perhaps not the same day."""

ANCHOR = datetime(2000, 1, 1, tzinfo=UTC)
"""The midnight that second 0 of the unnamed day is taken for."""

CREDIT = (
    "Plaza range-only data of Carnegie Mellon University (Djugash, Singh, Kantor): an autonomous mower and four "
    "ultra-wide-band radio beacons; as distributed with GTSAM, (c) Georgia Tech Research Corporation, BSD licence"
)

JUMP = 0.1
"""Metres by which path and odometry may differ over one step before it counts as a jump of the path."""
PATH_TOLERANCE = 0.05
"""Metres by which a path may be straightened where its corners are not needed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Oddities:
    """What is odd in one run's files, counted; nothing of it is repaired but what the fields say."""

    heading_wraps: int
    """Headings that jump by a full circle between rows, though said to be unwrapped; they are unwrapped here."""
    backward_share: float
    """Share of the moving steps on which the recorded heading points against the direction of travel."""
    path_gaps: int
    """Steps of the path more than twice as long in time as the median."""
    frozen_steps: int
    """Steps on which the path repeats its position digit by digit."""
    jumps: int
    """Steps on which path and odometry disagree by more than `JUMP` metres."""
    readings_out_of_order: int
    """Readings that stand in the file after a later one; they are sorted here."""
    readings_at_once: int
    """Readings of a beacon at the very time of another reading of it; both are kept."""
    readings_between_rows: int
    """Readings at no row's time, for the clocks are not synchronous; their place is interpolated."""
    longest_silence: float
    """Seconds without a reading of any beacon, at most."""
    range_excess: float
    """Share by which ranges exceed the distances from the path to the beacons as surveyed (least squares)."""
    odometry_turn_drift: float
    """Degrees by which the odometry's turns add up to something else than the recorded headings."""

    def lines(self) -> list[str]:
        """The counts as sentences, those that are not nought."""
        backwards = (
            f"the recorded heading points backwards on {self.backward_share:.1%} of the moving steps "
            f"(the direction of travel is used)"
        )
        said = [
            (self.heading_wraps, f"{self.heading_wraps} headings jump by a full circle (unwrapped)"),
            (self.backward_share > 0.5, backwards),
            (self.path_gaps, f"{self.path_gaps} of the path's steps took over twice the usual time"),
            (self.frozen_steps, f"{self.frozen_steps} path rows repeat the position before them digit by digit"),
            (self.jumps, f"{self.jumps} steps of the path disagree with the odometry by more than {JUMP} m"),
            (self.readings_out_of_order, f"{self.readings_out_of_order} readings are out of time order (sorted)"),
            (self.readings_at_once, f"{self.readings_at_once} readings have the time of another of the same beacon"),
            (
                self.readings_between_rows,
                f"{self.readings_between_rows:,} readings fall between two path rows (their place is interpolated)",
            ),
            (self.longest_silence > 10, f"no beacon answered for {self.longest_silence:.1f} s"),
            (
                abs(self.range_excess) > 0.01,
                f"ranges differ from the distances as surveyed by {self.range_excess:+.1%} (kept as measured)",
            ),
            (
                abs(self.odometry_turn_drift) > 1,
                f"the odometry's turns drift from the recorded headings by {self.odometry_turn_drift:+.0f} degrees",
            ),
        ]
        return [sentence for odd, sentence in said if odd]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """One run: the path row by row, the readings in time order, and the oddities."""

    name: str
    time: Millis
    x: Numbers
    y: Numbers
    heading: Numbers
    """Degrees, unwrapped, counter-clockwise."""
    reading_time: Millis
    reading_beacon: npt.NDArray[np.int64]
    reading_range: Numbers
    oddities: Oddities

    @property
    def steps(self) -> Numbers:
        """Metres driven between each row and the next."""
        return np.hypot(np.diff(self.x), np.diff(self.y))

    def path(self, begin: int, end: int) -> list[tuple[float, float]]:
        """Where the robot went from `begin` to `end` (ms), the ends interpolated, straightened by a few centimetres."""
        inside = np.flatnonzero((self.time > begin) & (self.time < end))
        times = np.concatenate(([begin], self.time[inside], [end]))
        points = np.column_stack((np.interp(times, self.time, self.x), np.interp(times, self.time, self.y)))
        if (points == points[0]).all():
            return [(float(points[0, 0]), float(points[0, 1]))]
        line = shapely.simplify(shapely.LineString(points), PATH_TOLERANCE)
        return [(float(x), float(y)) for x, y in shapely.get_coordinates(line)]


def moment(millis: int) -> datetime:
    """The instant that a run's clock (ms) names when its unnamed day is `ANCHOR`'s."""
    return ANCHOR + timedelta(milliseconds=int(millis))


def read(name: str) -> Recording:
    """The run `name` as shipped with this package."""
    path, odometry, ranges = (_numbers(f"{name}_{part}") for part in ("path", "odometry", "ranges"))
    in_time = ranges[np.argsort(ranges[:, 0], kind="stable")]
    time, x, y, raw_heading = path.T
    heading = np.unwrap(raw_heading)
    return Recording(
        name=name,
        time=_millis(time),
        x=x,
        y=y,
        heading=np.degrees(heading),
        reading_time=_millis(in_time[:, 0]),
        reading_beacon=in_time[:, 1].astype(np.int64),
        reading_range=in_time[:, 2],
        oddities=_oddities(path, heading, odometry, ranges, surveyed(name)),
    )


def surveyed(name: str) -> dict[int, tuple[float, float]]:
    """Where the beacons of the run `name` stand, by their numbers."""
    return {int(number): (float(x), float(y)) for number, x, y in sorted(_numbers(f"{name}_beacons").tolist())}


def _oddities(
    path: Numbers, heading: Numbers, odometry: Numbers, ranges: Numbers, places: dict[int, tuple[float, float]]
) -> Oddities:
    time, x, y, raw_heading = path.T
    pause = np.diff(time)
    step = np.hypot(np.diff(x), np.diff(y))
    course = np.arctan2(np.diff(y), np.diff(x))
    moving = step > 0.5 * pause
    beacons = np.array([places[int(number)] for number in ranges[:, 1]])
    true_range = np.hypot(
        np.interp(ranges[:, 0], time, x) - beacons[:, 0], np.interp(ranges[:, 0], time, y) - beacons[:, 1]
    )
    return Oddities(
        heading_wraps=int((np.abs(np.diff(raw_heading)) > np.pi).sum()),
        backward_share=float((np.cos(course - heading[:-1])[moving] < 0).mean()),
        path_gaps=int((pause > 2 * np.median(pause)).sum()),
        frozen_steps=int((step == 0).sum()),
        jumps=int((np.abs(step - odometry[:, 1]) > JUMP).sum()),
        readings_out_of_order=int((np.diff(ranges[:, 0]) < 0).sum()),
        readings_at_once=len(ranges) - len(np.unique(ranges[:, :2], axis=0)),
        readings_between_rows=int((~np.isin(_millis(ranges[:, 0]), _millis(time))).sum()),
        longest_silence=float(np.diff(np.sort(ranges[:, 0])).max()),
        range_excess=float(ranges[:, 2] @ true_range / (true_range @ true_range)) - 1,
        odometry_turn_drift=float(np.degrees(odometry[:, 2].sum() - (heading[-1] - heading[0]))),
    )


def _numbers(name: str) -> Numbers:
    resource = files("elm.demo").joinpath("data", f"{name}.csv.gz")
    with resource.open("rb") as packed, gzip.open(packed) as raw, TextIOWrapper(raw, encoding="utf-8") as text:
        lines: Iterable[Sequence[str]] = csv.reader(text)
        return np.array([[float(cell) for cell in line] for line in list(lines)[1:]])


def _millis(seconds: Numbers) -> Millis:
    return np.rint(seconds * 1000).astype(np.int64)
