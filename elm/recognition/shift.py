"""A shift: the strands of a consumer at work for as long as its name is held, batch by batch."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from threading import Event as Signal

from elm.errors import (
    ConflictingContent,
    CycleRefused,
    ExtentRefused,
    ForgottenEvent,
    InvalidValue,
    PositionLost,
    UnknownEvent,
    UnknownType,
)
from elm.interval import to_micros
from elm.log import Advance, Consumer, LogEntry, LoggedStore
from elm.recognition.bench import RecognizerFailure
from elm.recognition.clocks import Clocks, Timing
from elm.recognition.fold import Fold, Harvest
from elm.recognition.judging import TypeJudge
from elm.recognition.keeping import keep_results
from elm.recognition.lanes import SLOW, Lane, joined, lane_as_left
from elm.recognition.latecomers import Latecomers
from elm.recognition.reports import Failures, StrandReport, report_of
from elm.recognition.results import Result
from elm.recognition.strands import Strand
from elm.recognition.work import Work
from elm.store import Arrival

POLL = 1.0
"""Seconds after which the log is looked at again though nothing woke the manager."""
GLANCE = 0.02
"""Seconds between two looks at a slow strand."""
RETRY_FIRST, RETRY_MOST = 0.5, 60.0
"""Seconds until a failed strand is tried again: doubled with every failure, up to the second."""
ERROR_SHOWN = 1_000
"""Characters of an error that a status keeps."""
_REFUSALS = (
    ConflictingContent,
    CycleRefused,
    ExtentRefused,
    ForgottenEvent,
    InvalidValue,
    UnknownEvent,
    UnknownType,
)
"""What a memory says of results that cannot be kept."""

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Orders:
    """What a shift is to do: which strands, under which consumer's name, from where and how much at once."""

    consumer: str
    strands: Mapping[str, Strand]
    own: frozenset[str]
    timing: Timing
    since: int
    batch: int


class Shift:
    """Strands at work in one memory; `failures` is what is known of them from shifts before, and goes on."""

    def __init__(self, store: LoggedStore, orders: Orders, judge: TypeJudge, failures: dict[str, Failures]) -> None:
        self._store = store
        self._orders = orders
        self._judge = judge
        self._failures = failures
        self._lanes: list[Lane] = []
        self._retry_at: dict[str, float] = {}
        self._latecomers = Latecomers(orders.consumer)
        self._open()

    # Where strands stand

    def _open(self) -> None:
        """Register a consumer for each strand, forget those of strands that are no more, and restore states."""
        names = {self._named(strand) for strand in self._orders.strands}
        for known in self._store.log.progress():
            report = StrandReport.of(known)
            if report is not None and report.consumer == self._orders.consumer and known.name not in names:
                log.info("%r is not among the recognizers any more: it is forgotten", known.name)
                self._store.log.remove(known.name)
        for strand in self._orders.strands.values():
            consumer = self._store.log.register(self._named(strand.name), position=self._orders.since)
            if not consumer.report:
                self._tell(consumer, self._first_report(strand))
            self._enter(strand)
        self._lanes = joined(self._lanes)

    def _named(self, strand: str) -> str:
        return f"{self._orders.consumer}/{strand}"

    def _first_report(self, strand: Strand) -> StrandReport:
        return report_of(Work(strand, self._judge), self._orders.consumer, Clocks(self._orders.timing), Failures())

    def _tell(self, consumer: Consumer, report: StrandReport) -> None:
        """Have a consumer tell something anew, where it stands."""
        at = consumer.position
        self._store.log.advance([Advance(name=consumer.name, before=at, position=at, report=report.to_json())])

    def _enter(self, strand: Strand) -> Lane | None:
        """A lane with a strand as its consumer was left; None if it fails at once."""
        consumer = self._store.log.consumer(self._named(strand.name))
        if consumer is None:
            raise PositionLost(f"consumer {self._named(strand.name)!r} was removed while it was at work: start again")

        def lost(forgotten: int) -> None:
            told = "recognition %r: %r goes on without what was unfinished with %d events that were forgotten"
            log.warning(told, self._orders.consumer, strand.name, forgotten)

        fold = Fold([Work(strand, self._judge)], self._orders.timing, self._orders.own)
        try:
            lane = lane_as_left(self._store, fold, strand.name, consumer, batch=self._orders.batch, lost=lost)
        except RecognizerFailure as failure:
            self._fail(strand, failure)
            return None
        self._latecomers.enter(lane.fold)
        self._lanes.append(lane)
        return lane

    # Working

    def round(self, pool: ThreadPoolExecutor | None = None) -> int:
        """One batch for every lane, slow ones in a thread of the pool; how many entries were dealt with."""
        self._retry()
        head = self._store.log.head()
        done = 0
        for lane in [*self._lanes]:
            if lane.is_busy:
                continue
            if lane.at_work is not None:
                # Only this thread commits and decides who goes on; the other one has fed a slow strand for it.
                at_work, lane.at_work = lane.at_work, None
                done += self._finish(lane, *at_work.result())
            elif lane.position < head:
                if lane.is_slow and pool is not None:
                    lane.at_work = pool.submit(self._harvest, lane)
                else:
                    done += self._finish(lane, *self._harvest(lane))
        self._lanes = joined(self._lanes)
        return done

    def _harvest(self, lane: Lane) -> tuple[list[LogEntry], Harvest]:
        entries = self._store.log.read(lane.position, lane.at_once or self._orders.batch)
        return entries, lane.fold.take(entries)

    def _finish(self, lane: Lane, entries: Sequence[LogEntry], harvest: Harvest) -> int:
        for name, failure in harvest.failures:
            self._fail(self._orders.strands[name], failure)
        if not lane.fold.works:
            self._lanes.remove(lane)
        elif entries:
            self._commit(lane, entries[-1].position, harvest.results)
        return len(entries)

    def _commit(self, lane: Lane, position: int, results: Sequence[tuple[str, Result]]) -> None:
        lane.batches += 1
        advances = self._advances(lane, position)
        if not advances:
            self._lanes.remove(lane)
            return
        of_these = lane.fold.works.keys()
        arrivals = [Arrival(event=event) for name, result in results if name in of_these for event in result.events]
        try:
            keep_results(self._store, arrivals, partial(self._store.log.advance, advances))
        except _REFUSALS as error:
            self._lanes.remove(lane)
            if len(advances) == 1:
                (name,) = lane.fold.works
                self._fail(self._orders.strands[name], error)
                return
            # One of them found what cannot be kept: each by itself now, so that the others are not held up.
            for name in [*lane.fold.works]:
                own = self._enter(self._orders.strands[name])
                if own is not None:
                    self._finish(own, *self._harvest(own))
            return
        lane.position = position
        self._latecomers.look(lane.fold)
        for name in lane.fold.works.keys() & self._failures.keys():
            self._failures[name] = replace(self._failures[name], in_a_row=0)
        self._set_slow_aside(lane)

    def _advances(self, lane: Lane, position: int) -> list[Advance]:
        """How far each strand of a lane goes that can tell how it stands."""
        found = []
        for name in [*lane.fold.works]:
            try:
                found.append(self._advance(lane, name, position))
            except RecognizerFailure as failure:
                lane.fold.remove(name)
                self._fail(self._orders.strands[name], failure)
        return found

    def _advance(self, lane: Lane, name: str, position: int) -> Advance:
        known = self._failures.get(name, Failures())
        report = report_of(lane.fold.works[name], self._orders.consumer, lane.fold.clocks, known)
        return Advance(
            name=self._named(name),
            before=lane.position,
            position=position,
            state=lane.checkpoint(name),
            report=report.to_json(),
        )

    def _set_slow_aside(self, lane: Lane) -> None:
        """Have a strand that was slow go by itself, entry by entry at first; one that is no more joins the others."""
        slow = lane.slow_strands()
        if lane.at_once is not None:
            lane.at_once = 1 if slow else 2 * lane.at_once
            if lane.at_once >= self._orders.batch:
                lane.at_once = None
            return
        for name in slow:
            told = "recognition %r: %r took over %g s in one call: it is set aside"
            log.warning(told, self._orders.consumer, name, SLOW)
            own: Lane | None = lane
            if len(lane.fold.works) > 1:
                lane.fold.remove(name)
                own = self._enter(self._orders.strands[name])
            if own is not None:
                own.at_once = 1

    # Failing

    def _fail(self, strand: Strand, error: Exception) -> None:
        known = self._failures.get(strand.name, Failures())
        # A file's name, say, may hold what is no text.
        said = f"{error}".encode("utf-8", "backslashreplace").decode()[:ERROR_SHOWN]
        failures = Failures(count=known.count + 1, in_a_row=known.in_a_row + 1, error=said)
        self._failures[strand.name] = failures
        pause = min(RETRY_FIRST * 2 ** min(failures.in_a_row - 1, 10), RETRY_MOST)
        self._retry_at[strand.name] = time.monotonic() + pause
        log.warning("recognition %r: %r failed (%d): %s", self._orders.consumer, strand.name, failures.count, said)
        consumer = self._store.log.consumer(self._named(strand.name))
        if consumer is not None:
            report = StrandReport.of(consumer) or self._first_report(strand)
            self._tell(consumer, report.failing(failures))

    def _retry(self) -> None:
        for name, due in [*self._retry_at.items()]:
            if time.monotonic() >= due:
                del self._retry_at[name]
                self._enter(self._orders.strands[name])

    # Waiting

    def wait(self, asked: Signal) -> None:
        """Wait for entries, for the time at which something is certain, or until a strand is to be tried again."""
        now = to_micros(datetime.now(UTC))
        seconds = POLL
        idle = [lane for lane in self._lanes if not lane.is_busy]
        for lane in idle:
            ticks, later = lane.fold.ticks(now)
            if ticks:
                self._store.log.write(ticks)
                return
            if later is not None:
                seconds = min(seconds, max(0.0, (later - now) / 1e6))
        for due in self._retry_at.values():
            seconds = min(seconds, max(0.0, due - time.monotonic()))
        if len(idle) < len(self._lanes):
            # A slow strand that is through with its entries wants more.
            seconds = min(seconds, GLANCE)
        if idle and not asked.is_set():
            self._store.log.wait(min(lane.position for lane in idle), seconds)
        else:
            asked.wait(min(seconds, GLANCE))
