"""What a strand tells of itself with every step, as plain JSON: what it is, what it did, and what went wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from elm.cues.codec import cue_to_json
from elm.interval import from_micros
from elm.log import Consumer, Log
from elm.recognition.clocks import Clocks
from elm.recognition.work import Work

SHOWN = 100
"""Agents whose watermarks are told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Failures:
    """How often a strand has failed, how often since it last did anything, and of what the last time."""

    count: int = 0
    in_a_row: int = 0
    error: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecognizerStatus:
    """How one recognizer is doing.

    `lag` is how many entries of the log it has not dealt with; `partial` its unfinished matches, `dropped` those
    given up for its bounds, `split` episodes cut in pieces for them; `late` events came too late to be fed to its
    strand, `passed_over` were too many to be held, `forgotten` had been forgotten before they were read; `cut`
    results were left out because it feeds itself; `slowest` is the longest single call, in seconds.
    """

    name: str
    version: int
    consumer: str
    position: int
    lag: int
    fed: int = 0
    found: int = 0
    partial: int = 0
    dropped: int = 0
    split: int = 0
    late: int = 0
    passed_over: int = 0
    cut: int = 0
    forgotten: int = 0
    events_per_second: float | None = None
    slowest: float = 0.0
    is_failing: bool = False
    failures: int = 0
    error: str | None = None
    outputs: tuple[str, ...] = field(default=())


def report_of(work: Work, consumer: str, clocks: Clocks, failures: Failures | None) -> dict[str, Any]:
    """The report of a strand that is at work."""
    tally, counts = work.tally, work.counts()
    recognizers = []
    for each, count in zip(work.strand.recognizers, tally.counts, strict=True):
        name = each.name
        recognizers.append(
            {
                "name": name,
                "version": each.version,
                "interest": cue_to_json(each.interest),
                "outputs": [output.name for output in each.outputs],
                "fed": count.fed,
                "found": count.found,
                "cut": count.cut,
                "seconds": round(count.seconds, 6),
                "fed_here": count.fed_here,
                "slowest": round(count.slowest, 6),
                "partial": counts[name].get("partial", 0),
                "dropped": counts[name].get("dropped", 0),
                "split": counts[name].get("split", 0),
            }
        )
    watermarks = {agent or "": _shown(clocks.watermark(agent)) for agent in [*clocks.agents][:SHOWN]}
    report: dict[str, Any] = {
        "consumer": consumer,
        "recognizers": recognizers,
        "late": tally.late,
        "passed_over": tally.passed_over,
        "forgotten": tally.forgotten,
        "watermarks": watermarks,
        "is_failing": False,
    }
    if failures is not None:
        report |= {"failures": failures.count, "error": failures.error}
    return report


def _shown(moment: int) -> str | None:
    try:
        return from_micros(moment).isoformat()
    except OverflowError:
        # Events of the year 1 leave watermarks before it.
        return None


def report_of_failure(known: Mapping[str, Any], failures: Failures) -> dict[str, Any]:
    """The report of a strand that is not at work for it failed."""
    return {**known, "is_failing": True, "failures": failures.count, "error": failures.error}


def status(log: Log, consumer: str | None = None) -> list[RecognizerStatus]:
    """How all recognizers of a memory are doing, or those of one consumer, by consumer and name."""
    head = log.head()
    found = [
        _status(each, told, head)
        for each in log.consumers()
        if "recognizers" in each.report and consumer in (None, each.report.get("consumer"))
        for told in each.report["recognizers"]
    ]
    return sorted(found, key=lambda each: (each.consumer, each.name))


def _status(consumer: Consumer, told: Mapping[str, Any], head: int) -> RecognizerStatus:
    report = consumer.report
    seconds, fed_here = told.get("seconds", 0.0), told.get("fed_here", 0)
    outputs: Sequence[str] = told["outputs"]
    return RecognizerStatus(
        name=told["name"],
        version=told["version"],
        consumer=report["consumer"],
        position=consumer.position,
        lag=head - consumer.position,
        fed=told.get("fed", 0),
        found=told.get("found", 0),
        partial=told.get("partial", 0),
        dropped=told.get("dropped", 0),
        split=told.get("split", 0),
        late=report.get("late", 0),
        passed_over=report.get("passed_over", 0),
        cut=told.get("cut", 0),
        forgotten=report.get("forgotten", 0),
        events_per_second=round(fed_here / seconds, 1) if seconds else None,
        slowest=told.get("slowest", 0.0),
        is_failing=report.get("is_failing", False),
        failures=report.get("failures", 0),
        error=report.get("error"),
        outputs=tuple(outputs),
    )
