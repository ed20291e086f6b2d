"""Under which circumstances the figures were measured, as Markdown: when, how long, on what, and what to doubt."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from simulators.bench.markdown import duration, table
from simulators.report.sources import Source

_ALIKE = ("machine", "versions", "settings")
_HEAD = ("file", "measured", "took", "commit", "load average before, after", "remarks")


def overview(measured: Mapping[Source, Mapping[str, Any]]) -> str:
    """A table with a row for each file; then each machine with its versions and settings, once."""
    rows = [_row(source, figures["run"]) for source, figures in measured.items()]
    return table(_HEAD, rows) + "".join(_machines(measured))


def options(run: Mapping[str, Any]) -> str:
    """The options that a measurement was run with."""
    given = " ".join(f"{name}={value}" for name, value in run.get("options", {}).items())
    return f"Options: `{given}`\n\n" if given else ""


def _row(source: Source, run: Mapping[str, Any]) -> list[str]:
    load = run["load_average"]
    return [
        source.file,
        run["started"],
        duration(run["seconds"]),
        (run["commit"] or "unknown")[:10],
        f"{load['before'][0]:g}, {load['after'][0]:g}",
        "; ".join(_doubts(run)),
    ]


def _doubts(run: Mapping[str, Any]) -> list[str]:
    """What makes figures say less."""
    cores = run["machine"]["cores"]
    load = max(run["load_average"][when][0] for when in ("before", "after"))
    doubts = {
        "a quick run: too short to judge": run.get("options", {}).get("quick") == "True",
        f"the machine was busy: load {load:g} on {cores} cores": cores is not None and load > cores,
        "files differed from the commit": (run["commit"] or "").endswith("-dirty"),
        "fsync was off: nothing was durable": run["settings"].get("fsync", "on") != "on",
    }
    return [doubt for doubt, applies in doubts.items() if applies]


def _machines(measured: Mapping[Source, Mapping[str, Any]]) -> list[str]:
    alike: dict[str, list[Source]] = {}
    for source, figures in measured.items():
        alike.setdefault(json.dumps([figures["run"][name] for name in _ALIKE]), []).append(source)
    found = []
    for key, sources in alike.items():
        machine, versions, settings = json.loads(key)
        files = ", ".join(source.file for source in sources)
        found.append(
            f"**{files if len(alike) > 1 else 'All files'}**: {machine['cpu']}, {machine['cores']} cores, "
            f"{machine['memory_gb']} GB, {machine['system']}.\n"
            f"Versions: {_pairs(versions)}.\nServer settings: {_pairs(settings)}.\n\n"
        )
    return found


def _pairs(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values.items())
