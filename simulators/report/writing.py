"""The sections about what writing costs: commits and loads against bare rows, type hierarchies against a bare COPY."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simulators.bench import plots
from simulators.bench.markdown import number, table

_COLUMNS = ("mean", "median", "p95", "p99", "max")
_SERIES = {
    "event": "one event",
    "bare": "limit: one bare row",
    "complex_event": "a complex event with nine parts",
    "ten_rows": "limit: ten bare rows, one by one",
    "ten_rows_executemany": "limit: ten bare rows by executemany",
}
_LIMIT = "limit: bare rows with their commit"


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `insert`."""
    load = figures["load"]
    return (
        "One call with its commit, in ms; durable, and with `synchronous_commit=off` (relaxed), where nothing waits "
        "for the disk:\n\n"
        + table(("", "calls", *_COLUMNS), [row for mode in ("durable", "relaxed") for row in _rows(mode, figures)])
        + plots.picture(_commits(figures, pictures), "Mean time of a commit against bare rows")
        + "\n\n"
        + f"{load['events']:,} events in batches of {load['batch']:,}:\n\n"
        + table(
            ("", "events/s"),
            [
                ["`memory.load`", number(load["events_per_second"])],
                ["limit: bare COPY of the finished rows", number(load["copy_events_per_second"])],
            ],
        )
    )


def hierarchy_section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `types`."""
    rows = figures["rows"]
    names = ["read the file", "memory.add_types", "limit: bare COPY"]
    seconds = [figures[name] for name in ("read_seconds", "add_seconds", "copy_seconds")]
    drawn = plots.bars(
        names,
        {"": seconds},
        f"A hierarchy of {rows['event_type']:,} types, {rows['type_closure']:,} pairs in its closure",
        "s",
        limits=names[-1:],
    )
    return (
        table(("", "s"), [[name, number(value)] for name, value in zip(names, seconds, strict=True)])
        + plots.picture(plots.write(drawn, pictures, "types"), "Adding a type hierarchy against a bare COPY")
        + "\n\n"
    )


def _rows(mode: str, figures: Mapping[str, Any]) -> list[list[str]]:
    return [
        [f"{mode}: {shown}", f"{found['count']:,}", *(number(found[column]) for column in _COLUMNS)]
        for name, shown in _SERIES.items()
        for found in [figures[mode][name]]
    ]


def _commits(figures: Mapping[str, Any], pictures: Path) -> Path:
    sides = (("event", "bare"), ("complex_event", "ten_rows"))
    pairs = [(mode, pair) for mode in ("durable", "relaxed") for pair in sides]
    names = {"event": "one event", "complex_event": "event with nine parts"}
    drawn = plots.bars(
        [f"{mode}: {names[ours]}" for mode, (ours, _) in pairs],
        {
            "elm": [figures[mode][ours]["mean"] for mode, (ours, _) in pairs],
            _LIMIT: [figures[mode][bare]["mean"] for mode, (_, bare) in pairs],
        },
        "Mean time of a commit",
        "ms",
        limit_label=_LIMIT,
    )
    return plots.write(drawn, pictures, "insert")
