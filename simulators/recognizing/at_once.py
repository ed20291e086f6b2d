"""Twenty patterns at once against one: the fold over a log in memory, fed as a RecognitionManager feeds it."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from itertools import islice
from typing import Any

from elm.errors import StoreFailure
from elm.log import LogEntry
from elm.recognition import Timing
from elm.recognition.fold import Fold
from elm.recognition.judging import TypeJudge
from elm.recognition.manager import BATCH
from elm.recognition.strands import strands
from elm.recognition.work import Work
from elm.recognizers import Pattern
from elm.recognizers.base import RECOGNIZER
from elm.taxonomy import EventType
from simulators.bench.timing import in_turn, seconds, steady_heap
from simulators.worlds import habits, handling


def measure(*, events: int, rounds: int, seed: int, advance: Callable[[int], None]) -> dict[str, Any]:
    """The time of all twenty together over the mean time of each of them alone; medians over rounds."""
    entries = [handling.entry(done, at) for at, done in enumerate(islice(handling.live(seed), events), start=1)]
    patterns = habits.twenty()
    runs: dict[str, Sequence[Pattern]] = {"twenty": patterns, **{each.name: [each] for each in patterns}}
    times: dict[str, list[float]] = {name: [] for name in runs}
    found: dict[str, dict[str, int]] = {}
    with steady_heap():
        for turn in range(rounds):
            for name in in_turn(list(runs), turn):
                fold = _fold(runs[name])
                results = dict.fromkeys((each.name for each in runs[name]), 0)
                times[name].append(seconds(lambda fold=fold, results=results: _feed(fold, entries, results)))  # type: ignore[misc]
                found[name] = results
            advance(1)
    alone = {name: count for each in patterns for name, count in found[each.name].items()}
    check_same(found["twenty"], alone)
    medians = {name: statistics.median(series) for name, series in times.items()}
    all_at_once = medians.pop("twenty")
    one = statistics.fmean(medians.values())
    return {
        "events": events,
        "rounds": rounds,
        "twenty_vs_one": all_at_once / one,
        "twenty_events_per_second": events / all_at_once,
        "one_events_per_second": events / one,
        "matches": found["twenty"],
        "events_per_second": {name: events / median for name, median in medians.items()},
    }


def check_same(together: dict[str, int], alone: dict[str, int]) -> None:
    """Refuse to compare if a pattern finds something else in company."""
    differing = {name: (together[name], count) for name, count in alone.items() if together[name] != count}
    if differing:
        raise StoreFailure(f"patterns found other numbers of results together than alone: {differing}")


def _fold(patterns: Sequence[Pattern]) -> Fold:
    outputs = {output.name: output for pattern in patterns for output in pattern.outputs}
    types: list[EventType] = [*handling.types(), *outputs.values()]
    judge, timing = TypeJudge(lambda: types), Timing()
    works = [Work(strand, judge) for strand in strands(patterns, judge, timing)]
    return Fold(works, timing, frozenset(each.name for each in patterns))


def _feed(fold: Fold, entries: Sequence[LogEntry], results: dict[str, int]) -> None:
    for first in range(0, len(entries), BATCH):
        taken = fold.take(entries[first : first + BATCH])
        for _, failure in taken.failures:
            raise failure
        for _, result in taken.results:
            results[str(result.fed.event.value(RECOGNIZER))] += 1
