"""What came out of a comparison: figures as JSON, tables of ratios, and a line for whatever went wrong."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.table import Table

from simulators.bench.findings import table_of
from simulators.bench.timing import in_milliseconds
from simulators.opponents.catalogue import ELM
from simulators.opponents.protocol import KINDS, MODES, NATIVE, can
from simulators.opponents.runner import LIMIT, Answers, Race, Writes
from simulators.opponents.workload import Task

LIMIT_TITLE = "bare PostgreSQL"
WRONG = "WRONG"
CANNOT = "cannot"


def figures(race: Race, task: Task, commits: int) -> dict[str, Any]:
    """All figures; a ratio is the opponent's median over elm's, above 1 where elm is faster."""
    events = len(task.workload.records)
    classes = {kind: _kind(kind, race) for kind in KINDS}
    return {
        "events": events,
        "committed_one_by_one": commits,
        "questions_per_kind": len(task.workload.questions) // len(KINDS),
        "types": len(task.workload.types),
        "sides": race.abouts,
        "failed": race.failed,
        "commit": {mode: _commits(writes) for mode, writes in race.writes.items()},
        "load": {mode: _loads(writes, events - commits) for mode, writes in race.writes.items()},
        "bytes_per_event": _sizes(race, events),
        "classes": classes,
        "against": {name: _against(name, classes) for name in race.abouts if name != ELM},
    }


def _commits(writes: Mapping[str, Writes]) -> dict[str, Any]:
    elm = statistics.median(writes[ELM].commits)
    return {
        name: in_milliseconds(each.commits) | {"ratio": statistics.median(each.commits) / elm}
        for name, each in writes.items()
        if each.commits
    }


def _loads(writes: Mapping[str, Writes], events: int) -> dict[str, Any]:
    elm = writes[ELM].loaded
    return {
        name: {"events_per_second": events / each.loaded, "ratio": each.loaded / elm}
        for name, each in writes.items()
        if each.loaded is not None and elm is not None
    }


def _sizes(race: Race, events: int) -> dict[str, float]:
    found: dict[str, float] = {}
    for mode in MODES:
        for name, each in race.writes[mode].items():
            if each.bytes is not None:
                found.setdefault(name, each.bytes / events)
    return found


def _kind(kind: str, race: Race) -> dict[str, Any]:
    answers = race.answers[kind]
    found: dict[str, Any] = {"rows": statistics.fmean(answers[LIMIT].rows)}
    for name, about in race.abouts.items():
        ability = about["abilities"][kind]
        theirs = answers.get(name, Answers())
        if not can(ability):
            found[name] = {CANNOT: ability}
        elif theirs.wrong is not None:
            found[name] = {"wrong": theirs.wrong}
        elif theirs.seconds:
            found[name] = _asked(theirs, answers[ELM]) | {"how": ability}
        else:
            found[name] = {"failed": race.failed.get(name, "not asked")}
    return found | {LIMIT: _asked(answers[LIMIT], answers[ELM])}


def _asked(theirs: Answers, ours: Answers) -> dict[str, Any]:
    """The medians of a side, and elm's over the questions that this side was asked; no ratio to a wrong elm."""
    taken = {"median_ms": statistics.median(theirs.seconds.values()) * 1e3, "questions": len(theirs.seconds)}
    if ours.wrong is not None:
        return taken | {"elm_ms": None, "ratio": None}
    both = [number for number in theirs.seconds if number in ours.seconds]
    elm = statistics.median(ours.seconds[number] for number in both)
    return taken | {"elm_ms": elm * 1e3, "ratio": statistics.median(theirs.seconds[number] for number in both) / elm}


def _against(name: str, classes: Mapping[str, Any]) -> dict[str, Any]:
    """Where elm wins and loses against one side: kinds of questions by outcome, and the median of the ratios."""
    found: dict[str, list[str]] = {"elm_faster": [], "elm_slower": [], CANNOT: [], "wrong": [], "failed": []}
    ratios: list[float] = []
    for kind, cells in classes.items():
        outcome = next((each for each in (CANNOT, "wrong", "failed") if each in cells[name]), None)
        if outcome is not None:
            found[outcome].append(kind)
        elif (ratio := cells[name]["ratio"]) is not None:
            ratios.append(ratio)
            found["elm_faster" if ratio > 1 else "elm_slower"].append(kind)
    return found | {"median_ratio": statistics.median(ratios) if ratios else None}


def complaints(figures: Mapping[str, Any]) -> Iterator[str]:
    """What to know before believing the rest: who was left out, who gave out, who answered something else."""
    for name, remedy in figures["missing"].items():
        yield f"{name} is left out: {remedy}"
    for name, reason in figures["failed"].items():
        yield f"{title(figures, name)} failed: {reason}"
    for kind, cells in figures["classes"].items():
        for name in (*figures["sides"], LIMIT):
            if (wrong := cells[name].get("wrong")) is not None:
                yield (
                    f"{title(figures, name)} is WRONG at {kind}: {wrong['rows']:,} rows instead of "
                    f"{wrong['expected']:,} ({wrong['missing']:,} missing, {wrong['extra']:,} others)"
                )


def title(figures: Mapping[str, Any], name: str) -> str:
    """A side as the tables call it."""
    if name == LIMIT:
        return LIMIT_TITLE
    return str(figures["sides"].get(name, {}).get("title", name))


def cell(found: Mapping[str, Any]) -> str:
    """An entry of the table of ratios; an asterisk where the adapter's own Python finishes the work."""
    if CANNOT in found:
        return CANNOT
    if "wrong" in found:
        return WRONG
    if "failed" in found:
        return "failed"
    star = "" if found.get("how", NATIVE) == NATIVE else "*"
    return f"{'-' if found['ratio'] is None else in_digits(found['ratio'])}{star}"


def in_digits(ratio: float) -> str:
    """A ratio in two or three digits."""
    return f"{ratio:.2f}" if ratio < 10 else f"{ratio:,.0f}"


def opponents(figures: Mapping[str, Any]) -> Sequence[str]:
    """The sides beside elm that took part."""
    return [name for name in figures["sides"] if name != ELM]


def tables(figures: Mapping[str, Any]) -> dict[str, Table]:
    """For the terminal: writes by mode, and the ratios by kind."""
    writes = table_of(
        "", *(f"{mode}: {what}" for mode in MODES for what in ("commit, ms", "load, events/s")), "B/event"
    )
    for name in (ELM, *opponents(figures), LIMIT):
        row = []
        for mode in MODES:
            commit, load = figures["commit"][mode].get(name), figures["load"][mode].get(name)
            row += [f"{commit['median']:.3f}" if commit else "-", f"{load['events_per_second']:,.0f}" if load else "-"]
        size = figures["bytes_per_event"].get(name)
        writes.add_row(title(figures, name), *row, "-" if size is None else f"{size:,.0f}")
    names = [*opponents(figures), LIMIT]
    ratios = table_of("", "elm, ms", "rows", *(title(figures, name) for name in names))
    ratios.columns[0].min_width = max(map(len, KINDS))
    for kind, cells in figures["classes"].items():
        ours = cells[ELM]
        shown = f"{ours['median_ms']:.2f}" if "median_ms" in ours else cell(ours)
        ratios.add_row(kind, shown, f"{cells['rows']:.0f}", *(cell(cells[name]) for name in names))
    return {
        "writing: medians": writes,
        "answers: how many times elm's time (* = the tool prunes, Python finishes)": ratios,
    }
