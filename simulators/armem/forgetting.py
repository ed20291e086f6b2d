"""What forgetting costs and saves: table 5.1 again, on the household's views and a real mower's runs (section 5.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from armem_bridge.forgetting import PCA, RandomProjection
from elm.demo.recording import RUNS
from simulators.armem.episodes import Episode
from simulators.armem.forgetting_trials import Trial, Trials
from simulators.armem.heard_beacons import plaza_episode
from simulators.armem.mechanism_rows import ROWS, Grid, Row, settings
from simulators.armem.seen_things import household_episode
from simulators.bench import markdown

SECONDS, QUICK_SECONDS = 512.0, 256.0
"""Length of an episode in the household: that of the thesis, 8 minutes and 32 seconds."""
EPISODES, QUICK_EPISODES = 3, 2

HOUSEHOLD = Grid(
    waits=(0.4, 0.6, 1.0, 2.0, 4.0),
    distances=MappingProxyType(
        {
            "mse": (0.0009, 0.0012, 0.002, 0.004, 0.008),
            "mae": (0.017, 0.018, 0.02, 0.025, 0.035),
            "cosine": (0.05, 0.1, 0.15, 0.2, 0.3),
        }
    ),
    idle=(400.0, 300.0, 200.0, 150.0, 100.0),
    latent=(0.05, 0.1, 0.2, 0.3, 0.4),
    size=32,
)
PLAZA = Grid(
    waits=(2.0, 10.0, 30.0, 60.0, 120.0),
    distances=MappingProxyType(
        {
            "mse": (0.5, 5.0, 50.0, 150.0, 400.0),
            "mae": (0.5, 2.0, 5.0, 10.0, 20.0),
            "cosine": (0.0003, 0.003, 0.03, 0.1, 0.3),
        }
    ),
    idle=(800.0, 400.0, 300.0, 200.0, 100.0),
    latent=(0.001, 0.01, 0.1, 0.3, 1.0),
    size=2,
)
"""Thresholds of the mower's readings, which are in metres and square metres."""

CODES = MappingProxyType({"household": (8, 32, 128), "plaza": (1, 2, 3)})
"""Lengths of codes whose reconstruction is measured."""

STEPS = 2 * len(ROWS)
"""How often `measure` says that it is one step further."""

Advance = Callable[[int], None]


def measure(seed: int, quick: bool, advance: Advance) -> dict[str, Any]:
    """The figures of both parts, as JSON has them; `advance` is told after each of the `STEPS`.

    Of each row two sets of thresholds are searched for: `best`, those that leave the least of the first
    episode with everything still found in it, as in the thesis; and `safe`, the same among those with which
    everything is found in the other episodes too. Both are run on all episodes.
    """
    seconds, episodes = (QUICK_SECONDS, QUICK_EPISODES) if quick else (SECONDS, EPISODES)
    household = [household_episode(seed + number, seconds=seconds) for number in range(episodes)]
    plaza = [plaza_episode(name) for name in RUNS]
    return {
        "seed": seed,
        "quick": quick,
        "household": compared(household, HOUSEHOLD.coarser() if quick else HOUSEHOLD, CODES["household"], advance),
        "plaza": compared(plaza, PLAZA.coarser() if quick else PLAZA, CODES["plaza"], advance),
    }


def table(figures: Mapping[str, Any]) -> str:
    """Markdown about the figures of `measure`."""
    return "".join(_paragraphs(figures))


def compared(episodes: Sequence[Episode], grid: Grid, codes: Sequence[int], advance: Advance) -> dict[str, Any]:
    """The figures of all rows on some episodes, and of codes of these sizes."""
    trials = [Trials(episode) for episode in episodes]
    rows: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    for row in ROWS:
        tried = [trials[0].run(setting) for setting in settings(row, grid)]
        rows[str(row.number)] = _row(row, tried, trials)
        curves[str(row.number)] = [_trial(trial) for trial in tried]
        advance(1)
    return {
        "episodes": [{"name": episode.name, "snapshots": len(episode.left)} for episode in episodes],
        "rows": rows,
        "curves": curves,
        "codes": [
            {
                "size": size,
                "pca": trials[0].encoded(PCA(size)),
                "random_projection": trials[0].encoded(RandomProjection(size)),
            }
            for size in codes
        ],
        "code_size": grid.size,
    }


def _row(row: Row, tried: Sequence[Trial], trials: Sequence[Trials]) -> dict[str, Any]:
    """The best and the safe thresholds of a row, and what they do; None where there are none."""
    complete = sorted((trial for trial in tried if trial.found == 1.0), key=lambda trial: trial.kept)
    # Nearly always one of the first is safe already: the others need not be run on the other episodes.
    ran = ([trial, *(other.run(trial.setting) for other in trials[1:])] for trial in complete)
    safe = next((everywhere for everywhere in ran if all(trial.found == 1.0 for trial in everywhere)), None)
    best = [complete[0], *(other.run(complete[0].setting) for other in trials[1:])] if complete else None
    return {
        "frequency": row.frequency,
        "similarity": row.similarity,
        "decay": row.decay,
        "latent": row.latent,
        "published_percent": row.published,
        "tried": len(tried),
        "best": _everywhere(best, trials) if best else None,
        "safe": _everywhere(safe, trials) if safe else None,
    }


def _everywhere(ran: Sequence[Trial], trials: Sequence[Trials]) -> dict[str, Any]:
    """One setting on all episodes: times, size and error of the first, sizes and shares found of each."""
    return {
        **_trial(ran[0]),
        "error": trials[0].error(ran[0]),
        "kept_percent_of_each": [trial.kept * 100 for trial in ran],
        "found_percent_of_each": [trial.found * 100 for trial in ran],
    }


def _trial(trial: Trial) -> dict[str, Any]:
    return {
        "thresholds": trial.setting.thresholds(),
        "kept_percent": trial.kept * 100,
        "found_percent": trial.found * 100,
        "online_seconds": trial.online,
        "offline_seconds": trial.offline,
    }


def _paragraphs(figures: Mapping[str, Any]) -> Iterator[str]:
    yield "### The household's views\n\n"
    yield from _part(figures["household"])
    yield "### The mower's readings\n\n"
    yield from _part(figures["plaza"])


def _part(figures: Mapping[str, Any]) -> Iterator[str]:
    named = [f"{each['name']} ({each['snapshots']:,} snapshots)" for each in figures["episodes"]]
    yield f"Episodes: {', '.join(named)}. Codes have {figures['code_size']} numbers.\n\n"
    yield "With thresholds that leave everything found in all episodes; sizes and errors are of the first one.\n\n"
    yield markdown.table(
        (*_MECHANISMS, "online, s", "offline, s", "size, %", "average, %", "error", "thesis, %"),
        [_safe(number, row) for number, row in figures["rows"].items()],
    )
    yield "With thresholds that leave everything found in the first episode, whatever they do to the others.\n\n"
    yield markdown.table(
        (*_MECHANISMS, "size, %", "average, %", "found in the others, %", "error"),
        [_best(number, row) for number, row in figures["rows"].items()],
    )
    yield "What codes lose (root mean square difference):\n\n"
    yield markdown.table(
        ("numbers in a code", "PCA", "random projection"),
        [
            (str(each["size"]), markdown.number(each["pca"]), markdown.number(each["random_projection"]))
            for each in figures["codes"]
        ],
    )


_MECHANISMS = ("", "delta_wait, s", "D", "d_min", "decay", "a_min", "latent", "d_min")


def _thresholds(number: str, row: Mapping[str, Any], ran: Mapping[str, Any]) -> tuple[str, ...]:
    used = ran.get("thresholds", {})
    return (
        f"({number})",
        markdown.number(used.get("delta_wait")),
        row["similarity"] or "-",
        markdown.number(used.get("d_min")),
        row["decay"] or "-",
        markdown.number(used.get("a_min")),
        row["latent"] or "-",
        markdown.number(used.get("d_min_latent")),
    )


def _safe(number: str, row: Mapping[str, Any]) -> tuple[str, ...]:
    ran = row["safe"] or {}
    return (
        *_thresholds(number, row, ran),
        _seconds(ran.get("online_seconds")),
        _seconds(ran.get("offline_seconds")),
        markdown.number(ran.get("kept_percent")),
        _mean(ran.get("kept_percent_of_each")),
        markdown.number(ran.get("error")),
        markdown.number(row["published_percent"]),
    )


def _best(number: str, row: Mapping[str, Any]) -> tuple[str, ...]:
    ran = row["best"] or {}
    return (
        *_thresholds(number, row, ran),
        markdown.number(ran.get("kept_percent")),
        _mean(ran.get("kept_percent_of_each")),
        markdown.span(ran.get("found_percent_of_each", [])[1:]),
        markdown.number(ran.get("error")),
    )


def _seconds(value: float | None) -> str:
    return markdown.number(value) if value is None or value >= 0.001 or not value else "< 0.001"


def _mean(values: Sequence[float] | None) -> str:
    return markdown.number(sum(values) / len(values) if values else None)
