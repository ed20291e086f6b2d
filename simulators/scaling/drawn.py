"""The section of the report about growth: times against the size of the memory, with the limit lines, and tables."""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from simulators.bench import plots
from simulators.bench.markdown import number, table
from simulators.scaling import growth

_EVENTS = "events in the memory"
_PANELS = (
    ("scale_what_and_where", "Recalls by type, payload, time and region", ("type", "payload", "time", "region")),
    ("scale_kin_and_features", "Recalls by links and features", ("parts", "wholes", "features", "feature_names")),
)
_RELATIONS = ("equal", "subset", "superset", "intersects", "exactly", "is_a")
"""In the order of their colours, the same in all plots."""
_FETCH = "limit: fetch of the same rows by id"
_DEPTHS = {
    "root": "a root: 1,111 types",
    "one_below": "one below: 111 types",
    "two_below": "two below: 11 types",
    "leaf": "a leaf",
}
_KINDS = {"event": "an atomic event", "complex_event": "a complex event", "bare": "limit: bare insert"}


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `scale`; draws into the directory `pictures`."""
    return "".join(_paragraphs(figures, pictures))


def _paragraphs(figures: Mapping[str, Any], pictures: Path) -> Iterator[str]:
    sizes = [str(size) for size in figures["sizes"]]
    yield "### Memories\n\n"
    yield table(
        ("events", "load, s", "events/s", "bare COPY, events/s", "bytes per event", "MB"),
        [_memory(found) for found in figures["memories"].values()],
    )
    yield "### Commits\n\n"
    yield (
        f"Mean time of one call with its commit, in ms; growth between {growth.pair(figures['insert_between'])} "
        "events. The limit line is the insert of a bare row into a table of as many rows.\n\n"
    )
    yield table(("", *_heads(sizes), "growth", "growth of medians"), _commit_rows(figures, sizes))
    yield plots.picture(_commits(figures, pictures), "Mean time of a commit by the size of the memory") + "\n\n"
    yield "### Recalls\n\n"
    yield (
        f"Median time of `list(memory.recall(cue, limit={figures['limit']}))`, in ms, and the mean number of rows. "
        f"Growth between {growth.pair(figures['recall_between'])} events is that of answers with as many rows: where "
        f"the larger memory has more, both were asked again with the limit given. `first` is the growth of the first "
        f"time that a cue was asked, `fetch` that of fetching the same rows by their ids.\n\n"
    )
    head = ("", *_heads(sizes), *(f"rows, {size}" for size in _heads(sizes)), "limit", "growth", "first", "fetch")
    yield table(head, _recall_rows(figures["classes"], sizes))
    for name, title, fields in _PANELS:
        yield plots.picture(_classes(figures, pictures, name, title, fields), title) + "\n\n"
    yield plots.picture(_growth(figures, pictures), "Growth of each class of cues") + "\n\n"
    yield "### Sub-types\n\n"
    yield "`type.is_a` by the depth of its type:\n\n"
    yield table(head, _recall_rows(figures["subtypes"], sizes))
    yield plots.picture(_subtypes(figures, pictures), "type.is_a by the depth of the type") + "\n\n"
    yield "### The slowest classes\n\n"
    yield f"In the memory of {int(sizes[-1]):,} events, one cue each; the plans stand in the JSON under `slowest`.\n\n"
    yield table(
        ("", "elm, ms", "planning, ms", "execution, ms", "pages"),
        [_explained(name, found) for name, found in figures["slowest"].items()],
    )


def _heads(sizes: Iterable[str]) -> list[str]:
    return [f"{int(size):,}" for size in sizes]


def _memory(found: Mapping[str, Any]) -> list[str]:
    rates = [number(found[name]) for name in ("events_per_second", "copy_events_per_second", "bytes_per_event")]
    return [f"{found['events']:,}", number(found["load_seconds"]), *rates, number(found["bytes"] / 1e6)]


def _commit_rows(figures: Mapping[str, Any], sizes: Sequence[str]) -> Iterator[list[str]]:
    for mode, kinds in figures["insert"].items():
        for kind, found in kinds.items():
            means = [number(found["sizes"][size]["mean"]) for size in sizes]
            yield [f"{mode}: {_KINDS[kind]}", *means, number(found["growth"]), number(found["growth_of_medians"])]


def _recall_rows(asked: Mapping[str, Any], sizes: Sequence[str]) -> Iterator[list[str]]:
    for name, found in asked.items():
        times, rows = ([number(found["sizes"][size][figure]) for size in sizes] for figure in ("ms", "rows"))
        growths = [number(found[figure]) for figure in ("growth", "first_growth", "bare_growth")]
        yield [f"`{name}`", *times, *rows, str(found["limit"]), *growths]


def _explained(name: str, found: Mapping[str, Any]) -> list[str]:
    times = [number(found[figure]) for figure in ("elm_ms", "planning_ms", "execution_ms")]
    return [f"`{name}`", *times, number(found["pages_hit"] + found["pages_read"])]


def _commits(figures: Mapping[str, Any], pictures: Path) -> Path:
    drawn, row = plots.panels("Time of a commit", list(figures["insert"]), _EVENTS, "mean, ms", log="xy")
    for axes, kinds in zip(row, figures["insert"].values(), strict=True):
        for place, kind in enumerate(_KINDS):
            means = [kinds[kind]["sizes"][str(size)]["mean"] for size in figures["sizes"]]
            if kind == "bare":
                plots.limit(axes, figures["sizes"], means, _KINDS[kind])
            else:
                plots.line(axes, figures["sizes"], means, _KINDS[kind], number=place)
        axes.set_xticks(figures["sizes"])
    return plots.write(drawn, pictures, "scale_commits")


def _classes(figures: Mapping[str, Any], pictures: Path, name: str, title: str, fields: Sequence[str]) -> Path:
    drawn, row = plots.panels(title, fields, _EVENTS, "median, ms", log="xy", size=(11.0, 4.8))
    for axes, field in zip(row, fields, strict=True):
        of_field = {each: found for each, found in figures["classes"].items() if each.partition(".")[0] == field}
        for each, found in of_field.items():
            relation = each.partition(".")[2]
            times = _medians(found, figures["sizes"], "ms")
            plots.line(axes, figures["sizes"], times, relation, number=_RELATIONS.index(relation))
        fetched = [_medians(found, figures["sizes"], "bare_ms") for found in of_field.values()]
        plots.limit(axes, figures["sizes"], [*map(statistics.fmean, zip(*fetched, strict=True))], _FETCH)
        axes.set_xticks(figures["sizes"])
    return plots.write(drawn, pictures, name)


def _medians(found: Mapping[str, Any], sizes: Iterable[int], figure: str) -> list[float]:
    return [found["sizes"][str(size)][figure] for size in sizes]


def _growth(figures: Mapping[str, Any], pictures: Path) -> Path:
    asked = {**figures["classes"], **{f"is_a, {depth}": found for depth, found in figures["subtypes"].items()}}
    fetch = "limit: growth of fetching the same rows by id"
    drawn = plots.bars(
        list(asked),
        {
            "growth of the recall": [found["growth"] for found in asked.values()],
            fetch: [found["bare_growth"] for found in asked.values()],
        },
        f"Growth between {growth.pair(figures['recall_between'])} events",
        "times as long",
        log=True,
        limit_label=fetch,
        goal=growth.RECALL_GOAL,
    )
    return plots.write(drawn, pictures, "scale_growth")


def _subtypes(figures: Mapping[str, Any], pictures: Path) -> Path:
    drawn, axes = plots.figure("type.is_a by the depth of its type", _EVENTS, "median, ms", log="xy")
    for place, (depth, found) in enumerate(figures["subtypes"].items()):
        plots.line(axes, figures["sizes"], _medians(found, figures["sizes"], "ms"), _DEPTHS[depth], number=place)
    root = figures["subtypes"]["root"]
    plots.limit(axes, figures["sizes"], _medians(root, figures["sizes"], "bare_ms"), f"{_FETCH}, of a root")
    axes.set_xticks(figures["sizes"])
    return plots.write(drawn, pictures, "scale_subtypes")
