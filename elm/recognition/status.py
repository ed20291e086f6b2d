"""The status of recognizers: how each is doing, as its strand told with the last batch."""

from __future__ import annotations

from dataclasses import dataclass, field

from elm.log import Log, Progress
from elm.recognition.reports import RecognizerReport, StrandReport


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


def status(log: Log, consumer: str | None = None) -> list[RecognizerStatus]:
    """How all recognizers of a memory are doing, or those of one consumer, by consumer and name.

    Who may only read the memory may ask, too; `lag` then counts what others have brought into the log.
    """
    head = log.head()
    found = [
        _status(each, report, told, head)
        for each in log.progress()
        if (report := StrandReport.of(each)) is not None and consumer in (None, report.consumer)
        for told in report.recognizers
    ]
    return sorted(found, key=lambda each: (each.consumer, each.name))


def _status(progress: Progress, report: StrandReport, told: RecognizerReport, head: int) -> RecognizerStatus:
    return RecognizerStatus(
        name=told.name,
        version=told.version,
        consumer=report.consumer,
        position=progress.position,
        lag=head - progress.position,
        fed=told.fed,
        found=told.found,
        partial=told.partial,
        dropped=told.dropped,
        split=told.split,
        late=report.late,
        passed_over=report.passed_over,
        cut=told.cut,
        forgotten=report.forgotten,
        events_per_second=round(told.fed_here / told.seconds, 1) if told.seconds else None,
        slowest=told.slowest,
        is_failing=report.is_failing,
        failures=report.failures,
        error=report.error,
        outputs=told.outputs,
    )
