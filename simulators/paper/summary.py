"""The figures of the experiments, in milliseconds: over all calls, class by class, and by the size of the memory."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from simulators.paper import published
from simulators.paper.finished import Finished
from simulators.paper.moments import BySize, Moments
from simulators.paper.schedule import Answer
from simulators.paper.times import ALL, Times
from simulators.worlds.queries import CLASSES


def figures(runs: Iterable[Finished], *, events: int) -> dict[str, Any]:
    """All runs together: insertion over all of them, and each experiment by itself."""
    finished = list(runs)
    everything = _together(finished)
    experiments = {}
    for components in sorted({run.course.components for run in finished}):
        own = [run for run in finished if run.course.components == components]
        answers = [answer for answer in Answer if any(run.course.answer is answer for run in own)]
        experiments[str(components)] = {
            "runs": len(own),
            "insertion": _insertion(_together(own), events),
            "queries": {
                str(answer): _queries(_together(run for run in own if run.course.answer is answer), events)
                for answer in answers
            },
        }
    return {
        "events": events,
        "step": everything.step,
        "insertion": _insertion(everything, events),
        "experiments": experiments,
        "published": published.as_json(),
        "runs": [
            {
                "name": run.course.name,
                "components": run.course.components,
                "answer": str(run.course.answer),
                "seed": run.course.own_seed,
                "started": run.started,
                "seconds": run.seconds,
                "load_average": dict(run.load_average),
            }
            for run in finished
        ],
    }


def _together(runs: Iterable[Finished]) -> Times:
    first, *others = runs
    together = Times(first.times.step)
    for run in (first, *others):
        together.merge(run.times)
    return together


def _insertion(times: Times, events: int) -> dict[str, Any]:
    ours, bare = times.insertion.total(), times.bare.total()
    return {
        **_moments(ours),
        "growth": _rounded(times.insertion.growth(events)),
        "bare": {**_moments(bare), "growth": _rounded(times.bare.growth(events))},
        "vs_bare": _rounded(ours.mean / bare.mean) if bare.count else None,
        "by_size": {**_by_size(times.insertion), "bare_mean": _means(times.bare, times.insertion)},
    }


def _queries(times: Times, events: int) -> dict[str, Any]:
    asked = {name: _asked(times.asked[name], events) for name in (ALL, *CLASSES) if name in times.asked}
    longest = times.longest
    return {
        "runs": times.insertion.total().count // events,
        "all": asked.pop(ALL),
        "classes": asked,
        "longest": {
            "ms": _millis(longest.seconds),
            "classes": list(longest.classes),
            "rows": longest.rows,
            "events": longest.events,
        },
    }


def _asked(series: dict[str, BySize], events: int) -> dict[str, Any]:
    time, rows = series["time"], series["rows"].total()
    fetched, whole = series["fetched"].total(), series["fetch_whole"].total()
    return {
        **_moments(time.total()),
        "rows": _rounded(rows.mean),
        "most_rows": int(rows.max),
        "growth": _rounded(time.growth(events)),
        "fetch": _moments(series["fetch"].total()),
        "vs_fetch": _rounded(fetched.mean / whole.mean) if whole.count else None,
        "by_size": {
            **_by_size(time),
            "rows": [_rounded(value) for value in _raw_means(series["rows"], time)],
            "fetch_mean": _means(series["fetch"], time),
        },
    }


def _moments(found: Moments) -> dict[str, Any]:
    return {"count": found.count, "mean": _millis(found.mean), "sd": _millis(found.sd), "max": _millis(found.max)}


def _by_size(series: BySize) -> dict[str, list[Any]]:
    """Columns, a row for each size of the memory."""
    sizes = sorted(series.bins)
    rows = [_moments(series.bins[size]) for size in sizes]
    return {"size": sizes, **{name: [row[name] for row in rows] for name in ("count", "mean", "sd", "max")}}


def _means(series: BySize, like: BySize) -> list[float | None]:
    """The means, in milliseconds, at the sizes of another series; None where there are none."""
    return [_millis(mean) for mean in _raw_means(series, like)]


def _raw_means(series: BySize, like: BySize) -> list[float | None]:
    return [series.bins[size].mean if size in series.bins else None for size in sorted(like.bins)]


def _millis(value: float | None) -> float | None:
    return _rounded(None if value is None else value * 1e3)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)
