"""The shared look of all plots: one palette, lines with spread, bars, the limit line; written as PNG and SVG."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from elm.errors import MissingPackage
from simulators.bench import markdown

try:
    import matplotlib
    from matplotlib.container import Container
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
except ImportError as error:
    raise MissingPackage("drawing plots needs the package matplotlib: pip install 'elm-memory[plot]'") from error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Log = Literal["", "x", "y", "xy"]
"""Which axes are logarithmic."""

PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7A5195", "#8C6D31", "#000000")
"""Colours in the order in which series get them: those of Okabe and Ito, told apart by colour-blind readers too."""

INK, MUTED, RULE, PAPER = "#22303c", "#6b7885", "#e3e6ea", "#ffffff"
LIMIT = "#8a8f95"
"""The colour of what the machine itself costs: the bare insert, the bare COPY, the bare fetch."""

MARKERS = "osD^vPX*h"
"""Markers in the order in which series get them."""

_SIZE = (8.0, 4.8)
_DPI = 140
_STYLE: dict[Any, Any] = {
    "font.size": 10.0,
    "svg.hashsalt": "elm",
    "axes.unicode_minus": False,
}


def figure(title: str, x: str, y: str, *, log: Log = "", size: tuple[float, float] = _SIZE) -> tuple[Figure, Axes]:
    """An empty plot with one pair of axes, labelled `x` and `y`."""
    drawn, (axes,) = panels(title, [""], x, y, log=log, size=size)
    return drawn, axes


def panels(
    title: str, names: Sequence[str], x: str, y: str, *, log: Log = "", size: tuple[float, float] = _SIZE
) -> tuple[Figure, list[Axes]]:
    """An empty plot with axes side by side, one below each of `names`, which share their scale of y."""
    with matplotlib.rc_context(_STYLE):
        drawn = Figure(figsize=size, facecolor=PAPER, layout="constrained")
        drawn.suptitle(title, x=0.02, ha="left", size=13, weight="bold", color=INK)
        row: list[Axes] = list(drawn.subplots(1, len(names), sharey=True, squeeze=False)[0])
        for name, axes in zip(names, row, strict=True):
            axes.set_title(name, size=11, color=INK)
            axes.set_xlabel(x, color=INK)
            _quiet(axes, log)
        row[0].set_ylabel(y, color=INK)
    return drawn, row


def colour(number: int) -> str:
    """The colour of the series `number`, from 0; beyond the palette they repeat."""
    return PALETTE[number % len(PALETTE)]


def line(
    axes: Axes,
    xs: Sequence[float],
    ys: Sequence[float],
    label: str,
    *,
    number: int = 0,
    spread: Sequence[float] | None = None,
) -> None:
    """A series with the colour and the marker of its number; `spread` is drawn as error bars, cut off at zero."""
    marker = MARKERS[number % len(MARKERS)]
    look: dict[str, Any] = {"color": colour(number), "marker": marker, "markersize": 4.0, "linewidth": 1.6}
    if spread is None:
        axes.plot(xs, ys, label=label, **look)
        return
    # A time is never negative: an error bar that reaches below zero says nothing, and has no place on a log axis.
    below = [min(wide, y) for wide, y in zip(spread, ys, strict=True)]
    pale = (colour(number), 0.45)
    axes.errorbar(xs, ys, [below, list(spread)], label=label, elinewidth=0.8, capsize=1.5, ecolor=pale, **look)


def limit(axes: Axes, xs: Sequence[float], ys: Sequence[float], label: str) -> None:
    """The limit line, dashed and grey: what the same work costs without any memory around it."""
    axes.plot(xs, ys, color=LIMIT, linestyle=(0, (5, 3)), linewidth=1.6, label=label, zorder=1.5)


def level(axes: Axes, value: float, label: str) -> None:
    """A published or agreed value, as a dotted line across the axes."""
    axes.axhline(value, color=INK, linestyle=":", linewidth=1.4, label=label, zorder=1.4)


def bars(
    names: Sequence[str],
    series: Mapping[str, Sequence[float | None]],
    title: str,
    x: str,
    *,
    log: bool = False,
    limit_label: str | None = None,
    limits: Collection[str] = (),
    goal: float | None = None,
    missing: str = "cannot",
) -> Figure:
    """Horizontal bars in groups, a group for each of `names` from the top, a bar for each of `series`.

    The series called `limit_label` and the groups named in `limits` are grey, as all limits are; `goal`
    is a dotted line. Where a value is None there is the word `missing` instead of a bar. A series called
    "" is not explained below.
    """
    thick = 0.8 / len(series)
    height = 1.6 + len(names) * max(0.26, 0.16 * len(series))
    drawn, axes = figure(title, x, "", log="x" if log else "", size=(_SIZE[0], height))
    known = [value for values in series.values() for value in values if value is not None and value > 0]
    smallest = min(known, default=1.0)
    left = smallest / 2 if log else 0.0
    numbers = iter(range(len(series)))
    for row, (label, values) in enumerate(series.items()):
        shade = LIMIT if label == limit_label else colour(next(numbers))
        places = [index - 0.4 + (row + 0.5) * thick for index in range(len(names))]
        widths = [(value or left) - left for value in values]
        shades = [LIMIT if name in limits else shade for name in names]
        axes.barh(places, widths, height=thick * 0.92, left=left, color=shades)
        axes.plot([], [], marker="s", markersize=9, linestyle="", color=shade, label=label)
        for place, value in zip(places, values, strict=True):
            text = missing if value is None else markdown.number(value)
            axes.annotate(
                text,
                (left if value is None else value, place),
                (4, 0),
                textcoords="offset points",
                va="center",
                size=7,
                color=MUTED,
                bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 0.6},
            )
    if goal is not None:
        axes.axvline(goal, color=INK, linestyle=":", linewidth=1.4, label=f"goal {goal:g}")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(visible=False, axis="y")
    largest = max([*known, goal or 0.0], default=1.0)
    axes.set_xlim(left, largest * (largest / left) ** 0.12 if log else (largest or 1.0) * 1.12)
    return drawn


def write(drawn: Figure, directory: Path, name: str) -> Path:
    """Write NAME.png and NAME.svg, the same bytes for the same figures; the path of the PNG.

    What has labels is explained below the axes, each label once.
    """
    with matplotlib.rc_context(_STYLE):
        _explain(drawn)
        directory.mkdir(parents=True, exist_ok=True)
        file = directory / f"{name}.png"
        drawn.savefig(file, dpi=_DPI, metadata={"Software": None})
        drawn.savefig(file.with_suffix(".svg"), metadata={"Date": None})
    return file


def picture(file: Path, text: str) -> str:
    """Markdown that shows a PNG which `write` made and links its SVG, from a document beside its directory."""
    place = f"{file.parent.name}/{file.name}"
    return f"[![{text}]({place})]({place.removesuffix('.png')}.svg)"


def _explain(drawn: Figure) -> None:
    found: list[tuple[str, Any]] = []
    for axes in drawn.axes:
        handles, labels = axes.get_legend_handles_labels()
        found += zip(labels, handles, strict=True)
    # Bars and lines with spread, which matplotlib lists last, are what the plot is about.
    explained: dict[str, Any] = {}
    for label, handle in sorted(found, key=lambda pair: not isinstance(pair[1], Container)):
        if label:
            explained.setdefault(label, handle)
    if explained and not drawn.legends:
        drawn.legend(
            handles=list(explained.values()),
            labels=list(explained),
            loc="outside lower left",
            ncols=max(1, int(drawn.get_size_inches()[0] * 13 / (max(map(len, explained)) + 8))),
            frameon=False,
            fontsize=9,
            labelcolor=INK,
        )


def _quiet(axes: Axes, log: Log) -> None:
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(MUTED)
    axes.grid(visible=True, color=RULE, linewidth=0.8)
    axes.set_axisbelow(True)
    for name, axis in (("x", axes.xaxis), ("y", axes.yaxis)):
        if name in log:
            axes.set(**{f"{name}scale": "log"})
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
            axis.set_minor_formatter(NullFormatter())
        axis.set_major_formatter(FuncFormatter(lambda value, _: _tick(value)))
    axes.tick_params(which="both", colors=MUTED, length=0, labelcolor=INK)


def _tick(value: float) -> str:
    """A number on an axis, as short as can be: 50k and 2M for the sizes of memories."""
    for unit, name in ((1e6, "M"), (1e3, "k")):
        if abs(value) >= unit:
            return f"{value / unit:g}{name}"
    return f"{value:g}"
