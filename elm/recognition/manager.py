"""The RecognitionManager: has recognizers work on the log of a memory, in a thread, a process, or once."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Event as Signal
from threading import Thread
from typing import Self

from elm.errors import DatabaseUnreachable, InvalidValue, PositionLost, StoreClosed, UnknownConsumer
from elm.log import LoggedStore
from elm.recognition.clocks import Timing
from elm.recognition.enrolment import enrolled
from elm.recognition.judging import TypeJudge
from elm.recognition.shift import RETRY_FIRST, RETRY_MOST, Orders, Shift
from elm.recognition.status import Failures, RecognizerStatus, status
from elm.recognizers.base import Recognizer
from elm.text import check_short_name

BATCH = 2_000
"""Entries of the log that are dealt with in one transaction."""
NAP = 0.005
"""Seconds between two looks at how far the thread is."""

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
        _check_recognizers(recognizers)
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
        self._thread: Thread | None = None
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
                        if shift.round(pool) == 0:
                            shift.wait(asked)
                        pause = RETRY_FIRST
            except (DatabaseUnreachable, PositionLost, UnknownConsumer) as error:
                # The server is away, or somebody rewound a consumer: it goes on from what is committed.
                log.warning("recognition %r begins anew where it was, when it can: %s", self.consumer, error)
                asked.wait(pause)
                pause = min(2 * pause, RETRY_MOST)

    def start(self) -> None:
        """Work in a thread of this process until `stop()`."""
        if self._thread is not None:
            raise InvalidValue("this manager is running already: stop it before starting it again")
        self._stop.clear()
        self._broke = None
        self._enrol()
        self._thread = Thread(target=self._run_guarded, name=f"elm {self.consumer}", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread after the batch it is at, however long a call takes; what broke it is raised here."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._broke is not None:
            raise self._broke

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Deal with what was committed until now, and stop."""
        head = self._store.log.head()
        while self._thread is not None and self._thread.is_alive() and self._is_behind(head):
            time.sleep(NAP)
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
            log.exception("recognition %r stopped", self.consumer)
            self._broke = error

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
            yield Shift(self._store, orders, self._judge, self._failures)


def _check_recognizers(recognizers: Sequence[Recognizer]) -> None:
    if isinstance(recognizers, str) or not isinstance(recognizers, Sequence) or not recognizers:
        raise InvalidValue(f"recognition needs a list of recognizers, at least one, not {recognizers!r:.80}")
    for each in recognizers:
        if isinstance(each, type) or not isinstance(each, Recognizer):
            raise InvalidValue(f"this is no recognizer (see elm.recognizers.Recognizer): {each!r:.80}")
