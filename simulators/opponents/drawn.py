"""The section about elm beside other stores: who was asked what, how many times elm's time each took, who wins."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from simulators.bench import plots
from simulators.bench.markdown import number, table
from simulators.opponents.catalogue import ELM
from simulators.opponents.compared import CANNOT, cell, complaints, in_digits, opponents, title
from simulators.opponents.protocol import FILTERED, MODES, NATIVE
from simulators.opponents.runner import LIMIT

_DASHES = ((0, (5, 3)), (0, (1, 2)))
_FEW = 6
"""Kinds of questions that a sentence names; of more it says how many."""


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `opponents`; draws into the directory `pictures`."""
    return "".join(_paragraphs(figures, pictures))


def _paragraphs(figures: Mapping[str, Any], pictures: Path) -> Iterator[str]:
    yield (
        f"{figures['events']:,} events of {figures['types']:,} types and {figures['questions_per_kind']} questions of "
        f"each kind, the same for all. Each side is a process that has a store of its own, set up as a competent user "
        f"would (docs/benchmarks.md, and the first lines of each module in simulators/opponents/sides); they took "
        f"turns. Every answer had to be the one that the meaning of the cue gives (`elm.cues.match`), row by row, and "
        f"is timed until all that an event holds is fetched. The limit is PostgreSQL and a table that has nothing "
        f"but a primary key: its bare commits, its bare COPY, the bare fetch of the same rows by their "
        f"keys, as tuples of Python values (elm's objects decode a field when it is first looked at).\n\n"
    )
    notes = list(complaints(figures))
    if notes:
        yield "To know before reading on:\n\n" + "".join(f"- {note}\n" for note in notes) + "\n"
    yield "### Who wins, and why\n\n"
    yield from (f"- **{title(figures, name)}**: {_verdict(figures, name)}\n" for name in opponents(figures))
    yield f"\n{_floor(figures)}\n\n"
    yield "### Answers\n\n"
    yield (
        "How many times elm's median time each side's is: above 1 elm is faster. An asterisk: the tool prunes, and "
        "Python finishes with the exact test. Reasons for *cannot* are below.\n\n"
    )
    yield table(
        ("question", "elm, ms", "rows", *(title(figures, name) for name in (*opponents(figures), LIMIT))),
        _ratio_rows(figures),
    )
    yield plots.picture(_ratios(figures, pictures), "Times of the answers against elm's") + "\n\n"
    yield "### Writing\n\n"
    yield (
        f"The first {figures['committed_one_by_one']:,} events were committed one by one, the rest loaded in the "
        f"tool's best way. Durable and relaxed do not compare with each other: only a durable commit waits for the "
        f"disk.\n\n"
    )
    for mode in MODES:
        yield f"{mode.capitalize()}:\n\n"
        yield table(
            ("", "commit, ms", "p95", "max", "times elm's", "load, events/s", "times elm's"), _write_rows(figures, mode)
        )
    yield plots.picture(_commits(figures, pictures), "One commit, durable and relaxed") + "\n\n"
    yield plots.picture(_loads(figures, pictures), "Bulk loads") + "\n\n"
    yield "### The sides\n\n"
    yield table(("", "version", "durable", "relaxed", "bytes an event"), _side_rows(figures))
    reasons = list(_reasons(figures))
    if reasons:
        yield "What they cannot:\n\n" + "".join(reasons) + "\n"


def _verdict(figures: Mapping[str, Any], name: str) -> str:
    """Wins and losses in words, then why."""
    against = figures["against"][name]
    faster, slower = against["elm_faster"], against["elm_slower"]
    words = []
    if faster or slower:
        ratio = in_digits(against["median_ratio"])
        words.append(
            f"elm is faster at {_kinds(len(faster))} and slower at {len(slower)}; the median ratio is {ratio}."
        )
    if faster and slower:
        fewer = f"elm loses at {_some(slower)}." if len(slower) <= len(faster) else f"elm wins at {_some(faster)}."
        words.append(fewer)
    if against[CANNOT]:
        words.append(f"It cannot answer {_some(against[CANNOT])}.")
    if against["wrong"]:
        words.append(f"It is WRONG at {_some(against['wrong'])}: no ratio there.")
    if against["failed"]:
        words.append(f"It failed before {_some(against['failed'])}.")
    for what, series in (("A commit takes", figures["commit"]), ("a load", figures["load"])):
        times = [f"{in_digits(found[name]['ratio'])} ({mode})" for mode, found in series.items() if name in found]
        if times:
            words.append(f"{what} {' and '.join(times)} times elm's" + ("," if what == "A commit takes" else "."))
    return " ".join([*words, figures["sides"][name]["why"]])


def _floor(figures: Mapping[str, Any]) -> str:
    """What of elm's time is PostgreSQL's, whatever stands in front of it."""
    cells = [found for found in figures["classes"].values() if "median_ms" in found[ELM]]
    ours = statistics.median(found[ELM]["median_ms"] for found in cells)
    bare = statistics.median(found[LIMIT]["median_ms"] for found in cells)
    return (
        f"Over all kinds of questions elm's median is {number(ours, 'ms')}; to fetch the same rows by their keys, "
        f"nothing searched, takes the server {number(bare, 'ms')}. A store in the user's own process has no server to "
        f"ask, and gives up what a server is for: several writers at once, other processes and machines that read."
    )


def _kinds(count: int) -> str:
    return f"{count} {'kind' if count == 1 else 'kinds'} of questions"


def _some(kinds: Sequence[str]) -> str:
    if len(kinds) > _FEW:
        return f"{len(kinds)} kinds, {', '.join(kinds[:_FEW])} among them"
    return ", ".join(kinds)


def _ratio_rows(figures: Mapping[str, Any]) -> Iterator[list[str]]:
    for kind, cells in figures["classes"].items():
        ours = cells[ELM]
        shown = number(ours["median_ms"]) if "median_ms" in ours else cell(ours)
        others = (cell(cells[name]) for name in (*opponents(figures), LIMIT))
        yield [f"`{kind}`", shown, f"{cells['rows']:,.0f}", *others]


def _write_rows(figures: Mapping[str, Any], mode: str) -> Iterator[list[str]]:
    commits, loads = figures["commit"][mode], figures["load"][mode]
    for name in (ELM, *opponents(figures), LIMIT):
        if name not in commits:
            continue
        found, load = commits[name], loads.get(name)
        row = [title(figures, name), *(number(found[figure]) for figure in ("median", "p95", "max"))]
        rate = (number(load["events_per_second"]), in_digits(load["ratio"])) if load else ("-", "-")
        yield [*row, in_digits(found["ratio"]), *rate]


def _side_rows(figures: Mapping[str, Any]) -> Iterator[list[str]]:
    for name in (ELM, *opponents(figures)):
        about = figures["sides"][name]
        modes = (about["durability"].get(mode, "-") for mode in MODES)
        yield [about["title"], about["version"], *modes, number(figures["bytes_per_event"].get(name))]


def _reasons(figures: Mapping[str, Any]) -> Iterator[str]:
    """For each side its reasons, each once with the kinds that it is the reason for."""
    for name in opponents(figures):
        by_reason: dict[str, list[str]] = {}
        for kind, ability in figures["sides"][name]["abilities"].items():
            if ability not in (NATIVE, FILTERED):
                by_reason.setdefault(ability, []).append(f"`{kind}`")
        for reason, kinds in by_reason.items():
            yield f"- {title(figures, name)}: {', '.join(kinds)}: {reason}\n"


def _ratios(figures: Mapping[str, Any], pictures: Path) -> Path:
    kinds = list(figures["classes"])
    drawn, axes = plots.figure(
        "Times of the answers against elm's", "times elm's median; right of 1 elm is faster", "", log="x", size=(9, 10)
    )
    for index in range(0, len(kinds), 2):
        axes.axhspan(index - 0.5, index + 0.5, color=plots.RULE, alpha=0.5, linewidth=0, zorder=0)
    axes.axvline(1.0, color=plots.INK, linewidth=1.2)
    for index, name in enumerate((*opponents(figures), LIMIT)):
        cells = ((row, figures["classes"][kind][name].get("ratio")) for row, kind in enumerate(kinds))
        known = [(ratio, row) for row, ratio in cells if ratio is not None]
        look: dict[str, Any] = {
            "marker": plots.MARKERS[index % len(plots.MARKERS)],
            "color": plots.colour(index),
            "markersize": 5.5,
        }
        if name == LIMIT:
            look = {"marker": "|", "color": plots.LIMIT, "markersize": 11.0, "markeredgewidth": 2.5}
        xs, ys = [ratio for ratio, _ in known], [row for _, row in known]
        axes.plot(xs, ys, linestyle="none", label=_label(figures, name), **look)
    left, right = axes.get_xlim()
    axes.set_xticks([10.0**power for power in range(math.ceil(math.log10(left)), math.ceil(math.log10(right)))])
    axes.set_yticks(range(len(kinds)), kinds)
    axes.set_ylim(len(kinds) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    return plots.write(drawn, pictures, "opponents-answers")


def _commits(figures: Mapping[str, Any], pictures: Path) -> Path:
    found = {mode: {name: each["median"] for name, each in figures["commit"][mode].items()} for mode in MODES}
    return _bars(figures, found, "One commit", "ms, median", pictures, "opponents-commits")


def _loads(figures: Mapping[str, Any], pictures: Path) -> Path:
    found = {mode: {name: each["events_per_second"] for name, each in figures["load"][mode].items()} for mode in MODES}
    return _bars(figures, found, "Bulk load", "events/s", pictures, "opponents-loads")


def _bars(
    figures: Mapping[str, Any],
    found: Mapping[str, Mapping[str, float]],
    what: str,
    unit: str,
    pictures: Path,
    file: str,
) -> Path:
    """Bars for each side, and a dashed grey line where the limit of each mode is."""
    names = [ELM, *opponents(figures), LIMIT]
    series = {mode: [values.get(name) for name in names] for mode, values in found.items()}
    drawn = plots.bars([_label(figures, name) for name in names], series, what, unit, log=True, missing="not run so")
    (axes,) = drawn.axes
    for style, (mode, values) in zip(_DASHES, found.items(), strict=True):
        axes.axvline(values[LIMIT], color=plots.LIMIT, linestyle=style, linewidth=1.6, label=f"limit, {mode}")
    return plots.write(drawn, pictures, file)


def _label(figures: Mapping[str, Any], name: str) -> str:
    return f"limit: {title(figures, name)}" if name == LIMIT else title(figures, name)
