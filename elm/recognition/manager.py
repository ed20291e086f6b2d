"""The RecognitionManager: has recognizers work on the log of a memory, in a thread, a process, or once."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Condition, Thread
from threading import Event as Signal
from typing import Self

from elm.errors import DatabaseUnreachable, InvalidValue, PositionLost, StoreClosed, UnknownConsumer
from elm.log import LoggedStore
from elm.recognition.clocks import Timing
from elm.recognition.enrolment import check_recognizers, enrolled
from elm.recognition.judging import TypeJudge
from elm.recognition.reports import Failures
from elm.recognition.shift import RETRY_FIRST, RETRY_MOST, Orders, Shift
from elm.recognition.status import RecognizerStatus, status
from elm.recognizers.base import Recognizer
from elm.text import check_short_name

BATCH = 2_000
"""Entries of the log that are dealt with in one transaction."""

log = logging.getLogger(__name__)


class RecognitionManager:
    """Recognition in one memory by some recognizers, under one consumer's name (the paper's RecognitionManager).

    `start()` and `stop()` have it work in a thread beside a writer; `run()` works until it is told to stop;
    `catch_up()` deals with what the log holds and returns. What is found is committed in one transaction with
    the position in the log: killed at any point, it goes on where it was and finds the same.
    A recognizer that raises stops its own strand only (those that feed each other); it is tried again, and
    `status()` says so. New recognizers begin behind position `since`.
    """

    def __init__(
        self,
        store: LoggedStore,
        recognizers: Sequence[Recognizer],
        *,
        consumer: str = "recognition",
        timing: Timing | None = None,
        since: int = 0,
        batch: int = BATCH,
    ) -> None:
        self.consumer = check_short_name(consumer, what="the name of a consumer")
        self.timing = Timing() if timing is None else timing
        if not isinstance(self.timing, Timing):
            raise InvalidValue(f"timing is given as Timing(lateness=..., idle=...), not {timing!r:.80}")
        check_recognizers(recognizers)
        if isinstance(batch, bool) or not isinstance(batch, int) or batch < 1:
            raise InvalidValue(f"a batch has at least one entry, not {batch!r}")
        self._store = store
        self._recognizers = tuple(recognizers)
        self._since = since
        self._batch = batch
        self._judge = TypeJudge(store.types)
        self._orders: Orders | None = None
        self._failures: dict[str, Failures] = {}
        self._stop = Signal()
        self._began = Signal()
        """Set when the thread has got its name, waits for a server that is away, or has ended."""
        self._thread: Thread | None = None
        self._went_on = Condition()
        """Told when a round is over or has failed, and when the thread ends."""
        self._is_running = False
        self._broke: BaseException | None = None

    # Running

    def catch_up(self, stop: Signal | None = None) -> int:
        """Deal with all that the log holds by now, or until `stop` is set; how many entries that were.

        Entries count once for each group of strands that goes by itself. No time passes meanwhile: what the last
        entries leave waiting stays so.
        """
        with self._shift() as shift:
            done = 0
            while not (stop is not None and stop.is_set()) and (step := shift.round()):
                done += step
            return done

    def run(self, stop: Signal | None = None) -> None:
        """Deal with the log as it grows, until `stop` is set (or `stop()` called); outlives a server's restart."""
        asked = stop or self._stop
        if stop is None:
            self._stop.clear()
        pause = RETRY_FIRST
        while not asked.is_set():
            try:
                with self._shift() as shift, ThreadPoolExecutor(thread_name_prefix=f"elm {self.consumer}") as pool:
                    while not asked.is_set():
                        done = shift.round(pool)
                        self._tell_who_waits()
                        if done == 0:
                            shift.wait(asked)
                        pause = RETRY_FIRST
            except (DatabaseUnreachable, PositionLost, UnknownConsumer) as error:
                # The server is away, or somebody rewound a consumer: it goes on from what is committed.
                self._began.set()
                log.warning("recognition %r begins anew where it was, when it can: %s", self.consumer, error)
                self._tell_who_waits()
                asked.wait(pause)
                pause = min(2 * pause, RETRY_MOST)

    def start(self) -> None:
        """Work in a thread of this process until `stop()`; `ConsumerBusy` when another works under this name."""
        if self._thread is not None:
            raise InvalidValue("this manager is running already: stop it before starting it again")
        self._stop.clear()
        self._began.clear()
        self._broke = None
        self._enrol()
        self._is_running = True
        self._thread = Thread(target=self._run_guarded, name=f"elm {self.consumer}", daemon=True)
        self._thread.start()
        self._began.wait()
        if self._broke is not None:
            self.stop()

    def stop(self) -> None:
        """End the thread after the batch it is at, however long a call takes; what broke it is raised here, once."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        broke, self._broke = self._broke, None
        if broke is not None:
            raise broke

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Deal with what was committed until now, and stop."""
        head = self._store.log.head()
        with self._went_on:
            # Looked at under the lock: what is committed after the look is told of after it, too.
            while self._is_running and self._is_behind(head):
                self._went_on.wait()
        self.stop()

    def _is_behind(self, head: int) -> bool:
        told = self.status()
        return not told or any(each.position < head and not each.is_failing for each in told)

    def status(self) -> list[RecognizerStatus]:
        """How each of the recognizers is doing, as last committed."""
        return status(self._store.log, self.consumer)

    def _run_guarded(self) -> None:
        try:
            self.run(self._stop)
        except StoreClosed:
            log.info("recognition %r ends: the memory was closed", self.consumer)
        except BaseException as error:
            self._broke = error
            # Before that, it is `start` that raises it.
            if self._began.is_set():
                log.exception("recognition %r stopped", self.consumer)
        finally:
            self._is_running = False
            self._began.set()
            self._tell_who_waits()

    def _tell_who_waits(self) -> None:
        with self._went_on:
            self._went_on.notify_all()

    def _enrol(self) -> Orders:
        """See to types and definitions, the first time; what is to be done."""
        if self._orders is None:
            found = enrolled(self._store, self._recognizers, self.consumer, self.timing, self._judge)
            self._orders = Orders(
                consumer=self.consumer,
                strands={each.name: each for each in found},
                own=frozenset(each.name for each in self._recognizers),
                timing=self.timing,
                since=self._since,
                batch=self._batch,
            )
        return self._orders

    @contextmanager
    def _shift(self) -> Iterator[Shift]:
        orders = self._enrol()
        with self._store.log.exclusive(self.consumer):
            self._began.set()
            yield Shift(self._store, orders, self._judge, self._failures)
