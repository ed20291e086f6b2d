"""The section of the report about ArmarX-style memory: figures 5.2 and 5.3 as this machine draws them, and tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import sqrt
from pathlib import Path
from typing import Any

from simulators.armem import forgetting
from simulators.bench import plots
from simulators.bench.markdown import number, table

_CALLS = {
    "ping": "limit: ping",
    "echo": "limit: echo of the object",
    "bare_commit": "limit: the messages of a commit",
    "commit": "commit",
    "core_commit": "commit, core",
    "bare_query": "limit: the messages of a query",
    "query": "query",
    "core_query": "query, core",
}
"""In the order of the plot; limits are what Ice takes without a memory."""
_LIMITS = [shown for shown in _CALLS.values() if shown.startswith("limit")]
_RATIOS = ("commit_vs_echo", "query_vs_echo", "commit_vs_bare_commit", "query_vs_bare_query")
_WAYS = {"direct": "direct call", "topic": "topic", "memory": "memory"}
_KEPT = ("query_ltm", "query_wm", "query_both", "durable_commit")
_PARTS = ("to_aron", "commit", "from_aron", "query")
"""Of each side; the store and the lookup are those of the core alone."""


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `armem`; draws into the directory `pictures`."""
    return "".join(_paragraphs(figures, pictures))


def _paragraphs(figures: Mapping[str, Any], pictures: Path) -> Iterator[str]:
    published, information = figures["published"], figures["information"]
    objects = ", ".join(f"{name} ({number(size)} B of information)" for name, size in information.items())
    yield f"Objects: {objects}. {figures['samples']:,} samples. Published: {published['source']}.\n\n"
    if figures["batches"] is not None:
        yield from _about_batches(figures, pictures)
    if figures["ages"] is not None:
        yield "### Age of data\n\n"
        yield "From the production of an object to its reception in another process, mean and deviation in µs:\n\n"
        yield table(("", *_WAYS.values()), _age_rows(figures["ages"]))
        yield plots.picture(_ages(figures, pictures), "Age of data, as figure 5.3 of the thesis") + "\n\n"
    if figures["calls"] is not None:
        yield "### What a call costs\n\n"
        yield "Single calls that take turns, with the data in hand as ARON, medians in µs:\n\n"
        yield table(("", *_CALLS.values(), *_RATIOS), _call_rows(figures["calls"]))
        yield plots.picture(_calls(figures["calls"], pictures), "Single calls through Ice and bare ones") + "\n\n"
    if figures["long_term"] is not None:
        yield "### Long-term memory\n\n"
        yield (
            "Write-through consolidation into PostgreSQL, until everything is durable; then queries for one "
            "snapshot, and commits that are acknowledged when they are durable, medians in ms:\n\n"
        )
        yield table(
            ("", "snapshots", "snapshots/s", "query LTM", "query WM", "query both", "durable commit"),
            _long_term_rows(figures["long_term"]),
        )
    if figures["forgetting"] is not None:
        yield "### Forgetting\n\n"
        yield "Table 5.1 of the thesis on data of our own: what mechanisms of forgetting keep, lose and cost.\n\n"
        yield forgetting.table(figures["forgetting"])


def _about_batches(figures: Mapping[str, Any], pictures: Path) -> Iterator[str]:
    times, published = figures["batches"], figures["published"]
    sides = _sides(figures)
    yield "### Commits and queries\n\n"
    yield (
        "Means and standard deviations in µs. Conversions from and to business objects are in `commit` and "
        "`query`, and told by themselves as `to_aron` and `from_aron`.\n\n"
    )
    for side in sides:
        parts = (*_PARTS, "store", "lookup") if side == "core" else _PARTS
        yield f"{_SIDES[side]}:\n\n"
        yield table(("object, batch", *(f"`{part}`" for part in parts)), _batch_rows(times, side, parts))
        yield plots.picture(_batches(figures, side, pictures), f"{_SIDES[side]}, as figure 5.2 of the thesis") + "\n\n"
    mean = {name: times[name]["1"]["core"]["to_aron"]["mean"] for name in ("simple", "moderate")}
    yield (
        f"The conversion of a moderate object takes {number(mean['moderate'] / mean['simple'])} times that of a simple "
        f"one (published: about {number(published['moderate_conversion_vs_simple'])} times).\n\n"
    )


_SIDES = {"ice": "Through Ice", "core": "In this process"}


def _sides(figures: Mapping[str, Any]) -> list[str]:
    return [side for side in _SIDES if side in figures["batches"]["simple"]["1"]]


def _batch_rows(times: Mapping[str, Any], side: str, parts: tuple[str, ...]) -> Iterator[list[str]]:
    for name, of_kind in times.items():
        for size, found in of_kind.items():
            yield [f"{name}, {size}", *(_mean_and_sd(found[side][part]) for part in parts)]


def _mean_and_sd(series: Mapping[str, float]) -> str:
    return f"{number(series['mean'])} ± {number(sqrt(series['variance']))}"


def _age_rows(aged: Mapping[str, Any]) -> Iterator[list[str]]:
    for name, found in aged.items():
        yield [name, *(_mean_and_sd(found[way]) for way in _WAYS)]


def _call_rows(calls: Mapping[str, Any]) -> Iterator[list[str]]:
    for name, found in calls.items():
        medians = [number(found[call]["median"]) for call in _CALLS]
        yield [name, *medians, *(number(found[ratio]) for ratio in _RATIOS)]


def _long_term_rows(kept: Mapping[str, Any]) -> Iterator[list[str]]:
    for name, found in kept.items():
        medians = [number(found[part]["median"] / 1e3) for part in _KEPT]
        yield [name, f"{found['snapshots']:,}", number(found["snapshots_per_second"]), *medians]


def _batches(figures: Mapping[str, Any], side: str, pictures: Path) -> Path:
    """A panel for each part, a line for each kind of objects, by the size of the batch."""
    shown = {"commit": "full commit", "query": "full query"}
    if side == "core":
        shown = {"commit": "full commit", "store": "data storage", "query": "full query", "lookup": "memory lookup"}
    sizes, times = figures["batch_sizes"], figures["batches"]
    drawn, row = plots.panels(
        f"{_SIDES[side]} (figure 5.2)", list(shown.values()), "entries in a batch", "mean, µs", log="y", size=(9.0, 4.4)
    )
    for axes, part in zip(row, shown, strict=True):
        for place, (name, of_kind) in enumerate(times.items()):
            means = [of_kind[str(size)][side][part]["mean"] for size in sizes]
            plots.line(axes, sizes, means, name, number=place)
        if side == "ice":
            least = figures["published"]["least_microseconds"]
            plots.level(axes, least, f"published: {least:g} µs at least, over a network")
        axes.set_xticks(sizes)
    return plots.write(drawn, pictures, f"armem-batches-{side}")


def _ages(figures: Mapping[str, Any], pictures: Path) -> Path:
    aged, hertz = figures["ages"], figures["published"]["retrieval_hz"]
    series = {shown: [found[way]["mean"] for found in aged.values()] for way, shown in _WAYS.items()}
    title = f"Age of data at its reception (figure 5.3); published: {hertz:g} Hz"
    drawn = plots.bars(list(aged), series, title, "mean, µs", log=True, goal=1e6 / hertz)
    return plots.write(drawn, pictures, "armem-ages")


def _calls(calls: Mapping[str, Any], pictures: Path) -> Path:
    series = {name: [found[call]["median"] for call in _CALLS] for name, found in calls.items()}
    drawn = plots.bars(list(_CALLS.values()), series, "Single calls", "median, µs", log=True, limits=_LIMITS)
    return plots.write(drawn, pictures, "armem-calls")
