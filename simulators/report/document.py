"""The report on all measurements as one Markdown document: circumstances, goals, and a section for each file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from simulators.bench.markdown import number, table
from simulators.report.circumstances import options, overview
from simulators.report.sources import SOURCES, Source

PICTURES = "pictures"
"""The directory of the pictures, beside the report."""


def document(measured: Mapping[Source, Mapping[str, Any]], *, origin: Path, target: Path) -> str:
    """The whole report on the figures found in `origin`; draws into `PICTURES` in `target`."""
    return "".join(_parts(measured, origin, target)).rstrip("\n") + "\n"


def _parts(measured: Mapping[Source, Mapping[str, Any]], origin: Path, target: Path) -> Iterator[str]:
    yield "# Measurements of elm\n\n"
    yield (
        "Made by `python -m simulators report` from the figures that the measurements left. docs/benchmarks.md says "
        "what each figure means. Dashed grey lines and grey bars are limits: what the same work costs on this machine "
        "without a memory around it.\n\n"
    )
    yield "## Circumstances\n\n"
    yield overview(measured)
    missing = [source for source in SOURCES if source not in measured]
    if missing:
        yield "Missing:\n\n"
        yield "".join(f"- {source.file}: `{source.command(origin)}`\n" for source in missing) + "\n"
    yield "## Goals\n\n"
    yield table(("file", "met", "missed"), [_kept(source, figures["goals"]) for source, figures in measured.items()])
    for source, figures in measured.items():
        yield f"## {source.title}\n\n"
        yield options(figures["run"])
        if figures["goals"]:
            yield table(("figure", "value", "goal", ""), _goal_rows(figures["goals"]))
        yield source.draw(figures, target / PICTURES)


def _kept(source: Source, goals: Mapping[str, Any]) -> list[str]:
    missed = [f"`{name}`" for name, goal in goals.items() if not goal["met"]]
    return [source.file, f"{len(goals) - len(missed)} of {len(goals)}", ", ".join(missed)]


def _goal_rows(goals: Mapping[str, Any]) -> list[list[str]]:
    return [
        [f"`{name}`", number(goal["value"]), goal["goal"], "met" if goal["met"] else "**missed**"]
        for name, goal in goals.items()
    ]
