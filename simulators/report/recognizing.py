"""The section about recognition: rates of the engine and of catching up, latency, memory over a long stream."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simulators.bench import plots
from simulators.bench.markdown import number, table

_WAITED = {
    "bare_commit": "limit: bare row, commit",
    "event_commit": "event, commit",
    "in_process": "complex event, manager in a thread",
    "own_process": "complex event, manager in its own process",
}
_STAGE = {
    "events": "after events",
    "runs": "runs",
    "most_runs": "most runs",
    "held_events": "events held",
    "checkpoint_bytes": "checkpoint, bytes",
    "peak_mb": "peak memory, MB",
}


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `recognize`."""
    rates = _rates(figures)
    waited = figures["latency"]
    stages = figures["stream"]["stages"]
    return (
        table(("", "events/s"), [[name, number(rate)] for name, rate in rates.items()])
        + plots.picture(_rate_plot(rates, pictures), "Rates of recognition")
        + "\n\nFrom the commit of the last part until the complex event is committed, in ms:\n\n"
        + table(
            ("", "calls", "median", "p95", "max"),
            [
                [shown, f"{waited[name]['count']:,}", *(number(waited[name][key]) for key in ("median", "p95", "max"))]
                for name, shown in _WAITED.items()
            ],
        )
        + plots.picture(_latency_plot(waited, pictures), "Latency of recognition")
        + "\n\nOne process over a long stream of events:\n\n"
        + table(tuple(_STAGE.values()), [[number(stage[name]) for name in _STAGE] for stage in stages])
    )


def _rates(figures: Mapping[str, Any]) -> dict[str, float | None]:
    alone, many, database = figures["engine"]["events_per_second"], figures["twenty"], figures["database"]
    return {
        "engine alone": alone["elm"],
        "BoboCEP, one decider": alone["bobocep_together"],
        "BoboCEP, one per object": alone["bobocep_divided"],
        "twenty patterns at once": many["twenty_events_per_second"],
        "one of them, on average": many["one_events_per_second"],
        "catch up, in the database": database["events_per_second"],
        "limit: load": database["load_events_per_second"],
    }


def _rate_plot(rates: Mapping[str, float | None], pictures: Path) -> Path:
    drawn = plots.bars(
        list(rates),
        {"": list(rates.values())},
        "Events recognized in, per second",
        "events/s",
        log=True,
        limits=("limit: load",),
        missing="not installed",
    )
    return plots.write(drawn, pictures, "recognize-rates")


def _latency_plot(waited: Mapping[str, Any], pictures: Path) -> Path:
    drawn = plots.bars(
        list(_WAITED.values()),
        {which: [waited[name][which] for name in _WAITED] for which in ("median", "p95")},
        "From the last part's commit to the complex event",
        "ms",
        log=True,
    )
    return plots.write(drawn, pictures, "recognize-latency")
