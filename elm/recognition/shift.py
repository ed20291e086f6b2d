"""A shift: the strands of a consumer at work for as long as its name is held, batch by batch."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
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
from elm.log import LogEntry, LoggedStore, Step
from elm.recognition import checkpoint
from elm.recognition.bench import RecognizerFailure
from elm.recognition.clocks import Clocks, Timing
from elm.recognition.fold import Fold, Taken
from elm.recognition.judging import TypeJudge
from elm.recognition.keeping import keep_results
from elm.recognition.results import Result
from elm.recognition.status import Failures, report_of, report_of_failure
from elm.recognition.strands import Strand
from elm.recognition.work import Work
from elm.store import Arrival

POLL = 1.0
"""Seconds after which the log is looked at again though nothing woke the manager."""
GLANCE = 0.02
"""Seconds between two looks at a slow strand."""
RETRY_FIRST, RETRY_MOST = 0.5, 60.0
"""Seconds until a failed strand is tried again: doubled with every failure, up to the second."""
SLOW = 1.0
"""Seconds in one call from which a strand goes on in a thread of its own: others need not wait for it."""
ERROR_SHOWN = 1_000
"""Characters of an error that a status keeps."""
LARGE = 256 * 1024
"""Bytes from which a checkpoint is not taken with every batch but with every `LARGE_EVERY`-th."""
LARGE_EVERY = 16
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


class _Lane:
    """Strands that are at one position of the log and go on together."""

    def __init__(self, fold: Fold, position: int) -> None:
        self.fold = fold
        self.position = position
        self.checkpoint_bytes: dict[str, int] = {}
        self.batches = 0
        self.at_once: int | None = None
        """Entries of a batch, where a slow strand goes by itself: few, to be stopped and heard of soon."""
        self.at_work: Future[tuple[list[LogEntry], Taken]] | None = None

    @property
    def is_slow(self) -> bool:
        """Whether the others do not wait for it."""
        return self.at_once is not None

    @property
    def is_busy(self) -> bool:
        """Whether a thread is at it."""
        return self.at_work is not None and not self.at_work.done()


class Shift:
    """Strands at work in one memory; `failures` is what is known of them from shifts before, and goes on."""

    def __init__(self, store: LoggedStore, orders: Orders, judge: TypeJudge, failures: dict[str, Failures]) -> None:
        self._store = store
        self._orders = orders
        self._judge = judge
        self._failures = failures
        self._lanes: list[_Lane] = []
        self._retry_at: dict[str, float] = {}
        self._open()

    # Where strands stand

    def _open(self) -> None:
        """Register a consumer for each strand, forget those of strands that are no more, and restore states."""
        names = {self._named(strand) for strand in self._orders.strands}
        for known in self._store.log.consumers():
            if known.report.get("consumer") == self._orders.consumer and known.name not in names:
                log.info("%r is not among the recognizers any more: it is forgotten", known.name)
                self._store.log.remove(known.name)
        for strand in self._orders.strands.values():
            known = self._store.log.register(self._named(strand.name), position=self._orders.since)
            if not known.report:
                clocks = Clocks(self._orders.timing)
                report = report_of(Work(strand, self._judge), self._orders.consumer, clocks, None)
                step = Step(name=known.name, before=known.position, position=known.position, report=report)
                self._store.log.advance([step])
            self._enter(strand)
        self._join_lanes()

    def _named(self, strand: str) -> str:
        return f"{self._orders.consumer}/{strand}"

    def _enter(self, strand: Strand) -> _Lane | None:
        """A lane with a strand as its consumer was left: its checkpoint, and what the log held since, fed again."""
        consumer = self._store.log.consumer(self._named(strand.name))
        if consumer is None:
            raise PositionLost(f"consumer {self._named(strand.name)!r} was removed while it was at work: start again")
        fold = Fold([Work(strand, self._judge)], self._orders.timing, self._orders.own)
        at = consumer.checkpoint
        if consumer.state is not None:
            try:
                forgotten = checkpoint.restored(fold, strand.name, consumer.state, self._store.get)
            except RecognizerFailure as failure:
                self._fail(strand, failure)
                return None
            if forgotten:
                told = "recognition %r: %r goes on without what was unfinished with %d events that were forgotten"
                log.warning(told, self._orders.consumer, strand.name, forgotten)
        while at < consumer.position:
            entries = self._store.log.read(at, min(self._orders.batch, consumer.position - at))
            taken = fold.take(entries)
            if taken.failures:
                self._fail(strand, taken.failures[0][1])
                return None
            at = entries[-1].position
        self._lanes.append(_Lane(fold, at))
        return self._lanes[-1]

    def _join_lanes(self) -> None:
        """Strands that have come to one position, and know the same, go on together, but for slow ones."""
        first: dict[int, list[_Lane]] = {}
        for lane in [*self._lanes]:
            if lane.is_slow or lane.at_work is not None:
                continue
            here = first.setdefault(lane.position, [])
            known = next((each for each in here if each.fold.may_adopt(lane.fold)), None)
            if known is None:
                here.append(lane)
                continue
            known.fold.adopt(lane.fold)
            known.checkpoint_bytes |= lane.checkpoint_bytes
            self._lanes.remove(lane)

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
                    lane.at_work = pool.submit(self._taken, lane)
                else:
                    done += self._finish(lane, *self._taken(lane))
        self._join_lanes()
        return done

    def _taken(self, lane: _Lane) -> tuple[list[LogEntry], Taken]:
        entries = self._store.log.read(lane.position, lane.at_once or self._orders.batch)
        return entries, lane.fold.take(entries)

    def _finish(self, lane: _Lane, entries: Sequence[LogEntry], taken: Taken) -> int:
        for name, failure in taken.failures:
            self._fail(self._orders.strands[name], failure)
        if not lane.fold.works:
            self._lanes.remove(lane)
        elif entries:
            self._commit(lane, entries[-1].position, taken.results)
        return len(entries)

    def _commit(self, lane: _Lane, position: int, results: Sequence[tuple[str, Result]]) -> None:
        lane.batches += 1
        steps = self._steps(lane, position)
        if not steps:
            self._lanes.remove(lane)
            return
        of_these = lane.fold.works.keys()
        arrivals = [Arrival(event=event) for name, result in results if name in of_these for event in result.events]
        try:
            keep_results(self._store, arrivals, partial(self._store.log.advance, steps))
        except _REFUSALS as error:
            self._lanes.remove(lane)
            if len(steps) == 1:
                (name,) = lane.fold.works
                self._fail(self._orders.strands[name], error)
                return
            # One of them found what cannot be kept: each by itself now, so that the others are not held up.
            for name in [*lane.fold.works]:
                own = self._enter(self._orders.strands[name])
                if own is not None:
                    self._finish(own, *self._taken(own))
            return
        lane.position = position
        for name in lane.fold.works.keys() & self._failures.keys():
            self._failures[name] = replace(self._failures[name], in_a_row=0)
        self._set_slow_aside(lane)

    def _steps(self, lane: _Lane, position: int) -> list[Step]:
        """A step for each strand of a lane that can tell how it stands."""
        found = []
        for name in [*lane.fold.works]:
            try:
                found.append(self._step(lane, name, position))
            except RecognizerFailure as failure:
                lane.fold.remove(name)
                self._fail(self._orders.strands[name], failure)
        return found

    def _step(self, lane: _Lane, name: str, position: int) -> Step:
        work = lane.fold.works[name]
        state = None
        if lane.checkpoint_bytes.get(name, 0) < LARGE or lane.batches % LARGE_EVERY == 0:
            state = checkpoint.taken(lane.fold, name)
            lane.checkpoint_bytes[name] = len(state)
        report = report_of(work, self._orders.consumer, lane.fold.clocks, self._failures.get(name))
        return Step(name=self._named(name), before=lane.position, position=position, state=state, report=report)

    def _set_slow_aside(self, lane: _Lane) -> None:
        """Have a strand that was slow go by itself, entry by entry at first; one that is no more joins the others."""
        slow = [name for name, work in lane.fold.works.items() if work.tally.longest_call() > SLOW]
        if lane.at_once is not None:
            lane.at_once = 1 if slow else 2 * lane.at_once
            if lane.at_once >= self._orders.batch:
                lane.at_once = None
            return
        for name in slow:
            told = "recognition %r: %r took over %g s in one call: it is set aside"
            log.warning(told, self._orders.consumer, name, SLOW)
            own: _Lane | None = lane
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
            report = report_of_failure(consumer.report, failures)
            at = consumer.position
            self._store.log.advance([Step(name=consumer.name, before=at, position=at, report=report)])

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
