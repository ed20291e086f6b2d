"""The map of one run: the plaza as mowed, coloured by time, with its beacons, stands and laps."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import combinations
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PatchCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from shapely.geometry import Point

from elm import cues
from elm.app import Memory
from elm.demo.plaza import beacon_places
from elm.demo.style import CONTACT, GROUND, INK, MOTIONS, MUTED, PAPER, inside, minutes, quiet, since
from elm.event import StoredEvent
from elm.query import ByFeature

COLOURS = "viridis"
TITLES = {
    "plaza1": "plaza1, up and down",
    "plaza2": "plaza2, round and round",
}
LABELS_APART = 1.5
"""Metres below which the numbers of two laps would stand on top of each other."""
DASHED = (0, (4, 3))
LONG_STAND = 10.0
"""Seconds from which a stand is marked on the map."""


def draw_map(figure: Figure, axes: Axes, memory: Memory, session: StoredEvent) -> None:
    """Draw on `axes` where the robot was in one session, and what it heard there."""
    run = str(session.value("run"))
    begin = session.interval.begin
    moved = list(memory.recall(inside("Motion", session)))
    scale = Normalize(0, minutes(begin, session))
    mowed = PatchCollection(
        [_patch(event) for event in moved if event.region is not None], cmap=COLOURS, norm=scale, linewidth=0, zorder=2
    )
    mowed.set_array([(since(begin, event.interval.begin) + minutes(begin, event)) / 2 for event in moved])
    axes.add_collection(mowed)
    assert session.region is not None  # noqa: S101 - the parts of a session have regions of one frame
    hull = session.region.polygon.exterior.coords
    axes.add_patch(Polygon(hull, facecolor=PAPER, edgecolor=MUTED, linewidth=1, linestyle=DASHED, zorder=1))
    _mark_stands(axes, moved)
    _label_ends(axes, moved)
    laps = list(memory.recall(inside("Lap", session)))
    rows = memory.recall(inside("Row", session)).count()
    numbered = _number_laps(axes, memory, laps)
    _label_beacons(axes, memory, session, run)
    title = f"{TITLES[run]}: {len(laps)} laps{' (numbered)' if numbered else ''}, {rows} rows"
    axes.set_title(title, loc="left", size=14, weight="bold", color=INK, pad=9)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.09)
    axes.set_facecolor(GROUND)
    axes.set_xlabel(f"x in metres, frame {run}", color=MUTED)
    axes.set_ylabel("y in metres", color=MUTED)
    quiet(axes)
    bar = figure.colorbar(ScalarMappable(norm=scale, cmap=COLOURS), ax=axes, fraction=0.035, pad=0.02, aspect=32)
    bar.set_label("minutes since the run began", color=MUTED)
    bar.ax.tick_params(colors=MUTED, length=0)
    bar.outline.set_visible(False)
    handles = [
        Line2D([], [], color=MUTED, linewidth=1, linestyle=DASHED, label="hull of the session"),
        _marker("^", CONTACT, 11, "radio beacon"),
        _marker("o", MOTIONS["Stand"], 8, f"stand of {LONG_STAND:.0f} s or more"),
    ]
    axes.legend(handles=handles, loc="lower left", frameon=False, fontsize=9.5, labelcolor=INK)


def _marker(shape: str, colour: str, size: float, label: str) -> Line2D:
    return Line2D([], [], color=colour, linestyle="", marker=shape, markersize=size, markeredgecolor=PAPER, label=label)


def _patch(event: StoredEvent) -> PathPatch:
    assert event.region is not None  # noqa: S101 - asked only of events with a region
    polygon = event.region.polygon
    rings = [polygon.exterior, *polygon.interiors]
    return PathPatch(Outline.make_compound_path(*(Outline(ring.coords, closed=True) for ring in rings)))


def _mark_stands(axes: Axes, moved: Iterable[StoredEvent]) -> None:
    for event in moved:
        lasted = event.interval.duration
        if event.type != "Stand" or event.region is None or lasted is None or lasted.total_seconds() < LONG_STAND:
            continue
        centre = event.region.polygon.centroid
        axes.plot(
            centre.x,
            centre.y,
            "o",
            color=MOTIONS["Stand"],
            markersize=7,
            markeredgecolor=PAPER,
            zorder=5,
            clip_on=False,
        )


def _number_laps(axes: Axes, memory: Memory, laps: Iterable[StoredEvent]) -> bool:
    """Write each lap's number in the middle of its first row, unless laps lie on top of each other."""
    places: list[tuple[str, Point]] = []
    for lap in laps:
        drives = memory.recall(cues.exactly("Drive") & cues.wholes("superset", [lap.uid], transitive=True))
        first = next(iter(drives))
        assert first.region is not None  # noqa: S101 - every motion of the demo has a region
        places.append((str(lap.value("number")), first.region.polygon.representative_point()))
    if any(one.distance(other) < LABELS_APART for (_, one), (_, other) in combinations(places, 2)):
        return False
    for ordinal, point in places:
        axes.text(
            point.x,
            point.y,
            ordinal,
            size=8,
            weight="bold",
            color=PAPER,
            ha="center",
            va="center_baseline",
            zorder=4,
            path_effects=[withStroke(linewidth=2, foreground=INK)],
        )
    return True


def _label_ends(axes: Axes, moved: list[StoredEvent]) -> None:
    for word, event in (("start", moved[0]), ("end", moved[-1])):
        assert event.region is not None  # noqa: S101 - every motion of the demo has a region
        centre = event.region.polygon.centroid
        _annotate(axes, word, (centre.x, centre.y), (7, 6), ha="left", va="bottom", size=9.5, weight="bold")


def _label_beacons(axes: Axes, memory: Memory, session: StoredEvent, run: str) -> None:
    contacts = memory.recall(inside("BeaconContact", session)).groups(ByFeature(name="beacon"))
    heard = {group.key: group for group in contacts}
    assert session.region is not None  # noqa: S101 - the parts of a session have regions of one frame
    hull = session.region.polygon
    west, _, east, _ = hull.bounds
    for beacon, place in beacon_places(run).items():
        centre, group = place.polygon.centroid, heard[beacon]
        words = (
            f"beacon {beacon}\n{group.count} contact{'s' if group.count > 1 else ''}\n"
            f"{group.duration.total_seconds() / 60:.1f} min"
        )
        axes.plot(centre.x, centre.y, "^", color=CONTACT, markersize=13, markeredgecolor=PAPER, zorder=6)
        at = (centre.x, centre.y)
        if hull.contains(centre):
            _annotate(axes, words, at, (11, 0), ha="left", va="center")
        elif west < centre.x < east and centre.y > hull.centroid.y:
            _annotate(axes, words, at, (0, 11), ha="center", va="bottom")
        else:
            _annotate(axes, words, at, (0, -11), ha="center", va="top")
        axes.update_datalim([(centre.x - 6, centre.y - 7), (centre.x + 6, centre.y + 7)])
    axes.autoscale_view()


def _annotate(
    axes: Axes,
    words: str,
    at: tuple[float, float],
    away: tuple[float, float],
    *,
    ha: Literal["left", "center", "right"],
    va: Literal["bottom", "center", "top"],
    size: float = 9,
    weight: str = "normal",
) -> None:
    axes.annotate(
        words,
        at,
        xytext=away,
        textcoords="offset points",
        size=size,
        weight=weight,
        color=INK,
        ha=ha,
        va=va,
        linespacing=1.25,
        zorder=7,
        path_effects=[withStroke(linewidth=2.5, foreground=GROUND)],
    )
