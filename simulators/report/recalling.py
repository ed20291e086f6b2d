"""The section about what recalling costs: each class of cues against its statement by hand, and large answers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simulators.bench import plots
from simulators.bench.markdown import number, table

_SMALL = "up_to_1000_rows"
_GOAL = 1.5
_LIMIT = "limit: statement by hand, psycopg"
_SIDES = {
    "objects": "`list(memory.recall())`: Event objects",
    "objects_read": "the same, each field looked at",
    "fetch": "limit: psycopg, its own loaders",
    "raw_fetch": "limit: psycopg, values left as bytes",
    "arrow": "`memory.recall().to_arrow()`",
    "adbc": "limit: ADBC",
}


def section(figures: Mapping[str, Any], pictures: Path) -> str:
    """Markdown about the figures of the command `recall`."""
    classes = figures["classes"]
    rows = [
        [
            f"`{name}`",
            f"{found['cues']}",
            number(found["rows"]),
            number(found["elm_ms"]),
            number(found["hand_ms"]),
            number(found["ratio"]),
            number(found[_SMALL]["ratio"] if _SMALL in found else None),
        ]
        for name, found in classes.items()
    ]
    head = ("class", "cues", "mean rows", "elm, ms", "by hand, ms", "ratio", "ratio up to 1,000 rows")
    rates = figures["rows_per_second"]
    return (
        f"One recall by a cue of one component among {figures['events']:,} events, medians:\n\n"
        + table(head, rows)
        + plots.picture(_times(classes, pictures), "Median time of a recall by class, elm and the statement by hand")
        + "\n\n"
        + plots.picture(_ratios(classes, pictures), "Ratio of elm to the statement by hand by class")
        + "\n\n"
        + "All events in order of begin:\n\n"
        + table(
            ("read as", "rows/s"), [[shown, number(rates[side])] for side, shown in _SIDES.items() if side in rates]
        )
    )


def _times(classes: Mapping[str, Any], pictures: Path) -> Path:
    drawn = plots.bars(
        list(classes),
        {
            "elm": [found["elm_ms"] for found in classes.values()],
            _LIMIT: [found["hand_ms"] for found in classes.values()],
        },
        "Recall by one component, median",
        "ms",
        log=True,
        limit_label=_LIMIT,
    )
    return plots.write(drawn, pictures, "recall-times")


def _ratios(classes: Mapping[str, Any], pictures: Path) -> Path:
    drawn = plots.bars(
        list(classes),
        {"elm": [found.get(_SMALL, found)["ratio"] for found in classes.values()]},
        "Recall by one component: times the statement by hand",
        "ratio; where there are some, of answers of up to 1,000 rows",
        goal=_GOAL,
    )
    return plots.write(drawn, pictures, "recall-ratios")
