"""What a strand tells of itself with every batch: the report of its consumer, written and read here alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import msgspec

from elm.cues.codec import cue_to_json
from elm.interval import from_micros
from elm.log import Progress
from elm.recognition.clocks import Clocks
from elm.recognition.work import Work

SHOWN = 100
"""Agents whose watermarks are told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Failures:
    """How often a strand has failed, how often since it last did anything, and of what the last time."""

    count: int = 0
    in_a_row: int = 0
    error: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RecognizerReport:
    """What one recognizer of a strand is and did; `interest` is its cue as JSON, times are in seconds.

    `fed_here` and `seconds` are of the process at work alone, all else is counted from the beginning.
    """

    name: str
    version: int
    interest: Mapping[str, Any]
    outputs: tuple[str, ...]
    fed: int = 0
    found: int = 0
    cut: int = 0
    seconds: float = 0.0
    fed_here: int = 0
    slowest: float = 0.0
    partial: int = 0
    dropped: int = 0
    split: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class StrandReport:
    """What a strand is and did, how far the time of its agents has come, and of what it failed the last time.

    `consumer` is the name that all strands of one manager work under, not that of this strand's position.
    """

    consumer: str
    recognizers: tuple[RecognizerReport, ...]
    late: int = 0
    passed_over: int = 0
    forgotten: int = 0
    watermarks: Mapping[str, str | None] = field(default_factory=dict)
    is_failing: bool = False
    failures: int = 0
    error: str | None = None

    @classmethod
    def of(cls, consumer: Progress) -> Self | None:
        """The report of a strand; None where the consumer is none: a subscription, say, or one that only begins."""
        if "recognizers" not in consumer.report:
            return None
        return msgspec.convert(consumer.report, cls)

    def failing(self, failures: Failures) -> Self:
        """The report of a strand that is not at work, for it failed."""
        return replace(self, is_failing=True, failures=failures.count, error=failures.error)

    def to_json(self) -> dict[str, Any]:
        """The report as plain JSON."""
        told: dict[str, Any] = msgspec.to_builtins(self)
        return told


def report_of(work: Work, consumer: str, clocks: Clocks, failures: Failures) -> StrandReport:
    """The report of a strand that is at work."""
    tally, counts = work.tally, work.counts()
    recognizers = [
        RecognizerReport(
            name=each.name,
            version=each.version,
            interest=cue_to_json(each.interest),
            outputs=tuple(output.name for output in each.outputs),
            fed=count.fed,
            found=count.found,
            cut=count.cut,
            seconds=round(count.seconds, 6),
            fed_here=count.fed_here,
            slowest=round(count.slowest, 6),
            partial=counts[each.name].get("partial", 0),
            dropped=counts[each.name].get("dropped", 0),
            split=counts[each.name].get("split", 0),
        )
        for each, count in zip(work.strand.recognizers, tally.counts, strict=True)
    ]
    return StrandReport(
        consumer=consumer,
        recognizers=tuple(recognizers),
        late=tally.late,
        passed_over=tally.passed_over,
        forgotten=tally.forgotten,
        watermarks={agent or "": _shown(clocks.watermark(agent)) for agent in [*clocks.agents][:SHOWN]},
        failures=failures.count,
        error=failures.error,
    )


def _shown(moment: int) -> str | None:
    try:
        return from_micros(moment).isoformat()
    except OverflowError:
        # Events of the year 1 leave watermarks before it.
        return None
