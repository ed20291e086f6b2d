"""The thread that empties the backlog into elm: batch after batch, oldest first, for as long as the database takes."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from threading import Lock, Thread
from typing import Final

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.long_term.backlog import Backlog, Waiting
from armem_bridge.long_term.gate import Gate
from armem_bridge.long_term.health import Health
from armem_bridge.long_term.settings import Consolidation
from armem_bridge.long_term.source import LongTermSource
from armem_bridge.long_term.writing import UNAVAILABLE, EventWriter, SetAside
from armem_bridge.working.archive import Evicted
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.union import UnionSource
from elm.app import Memory
from elm.errors import StoreFailure

SHOWN: Final = 100
"""So many of the snapshots that were set aside are kept to be looked at."""

GLANCE: Final = 0.02
"""So many seconds pass between two looks at snapshots that wait for poses of the robot."""

_logger = logging.getLogger(__name__)


class BacklogWorker:
    """Has `writer` write what waits in `backlog`, from its making until `stop`; what fails is tried again.

    Of what was evicted `gate` decides what is kept; without one all is. With `waits_for_poses` each snapshot waits
    for the patience of the settings, because poses of the robot may come later; `type_of` says of what type the
    segment of a snapshot is. `on_set_aside` is told of every snapshot that cannot be kept.
    """

    def __init__(
        self,
        backlog: Backlog,
        writer: EventWriter,
        *,
        memory: Memory,
        settings: Consolidation,
        health: Health,
        gate: Gate | None,
        type_of: Callable[[Snapshot], TypeObject | None],
        waits_for_poses: bool,
        on_set_aside: Callable[[SetAside], None] | None,
    ) -> None:
        self._backlog = backlog
        self._writer = writer
        self._memory = memory
        self._settings = settings
        self._health = health
        self._gate = gate
        self._let_in = UnionSource(backlog.let_in(), LongTermSource(memory))
        self._type_of = type_of
        self._waits_for_poses = waits_for_poses
        self._on_set_aside = on_set_aside
        self._lock = Lock()
        self._aside: deque[SetAside] = deque(maxlen=SHOWN)
        self._set_aside = self._forgotten = 0
        self._hurry = 0
        self._stopped = False
        self._thread = Thread(target=self._work, name=f"armem-consolidation-{memory.name}", daemon=True)
        self._thread.start()

    @property
    def set_aside(self) -> tuple[SetAside, ...]:
        """The last snapshots that could not be kept, with the reasons."""
        with self._lock:
            return tuple(self._aside)

    def status(self) -> Mapping[str, object]:
        """How many versions were forgotten, how many could not be kept, and the last of these with the reasons."""
        with self._lock:
            return {
                "forgotten": self._forgotten,
                "set_aside": self._set_aside,
                "last_set_aside": [str(each) for each in self._aside][-10:],
            }

    def hurry(self, last: int) -> None:
        """Have no snapshot up to number `last` wait for poses any longer."""
        self._hurry = max(self._hurry, last)
        self._backlog.wake()

    def stop(self) -> None:
        """End after the batch at hand, and return then; what waits goes on waiting."""
        self._stopped = True
        self._backlog.wake()
        self._thread.join()

    def _work(self) -> None:
        pause = self._settings.least_pause
        while not self._stopped:
            batch = self._backlog.take(self._settings.batch, self._is_ready, timeout=1.0)
            if not batch:
                if len(self._backlog):
                    time.sleep(GLANCE)
                continue
            try:
                self._consolidate(batch)
            except Exception as error:
                self._health.failed(error)
                self._sleep(pause)
                pause = min(2 * pause, self._settings.most_pause)
            else:
                self._health.worked()
                pause = self._settings.least_pause

    def _consolidate(self, batch: Sequence[Waiting]) -> None:
        self._writer.write(self._let_through(batch), done=self._backlog.done, aside=self._lay_aside)

    def _let_through(self, batch: Sequence[Waiting]) -> list[Waiting]:
        """What is to be kept of a batch: all that was committed, and of what was evicted what the gate keeps."""
        kept: list[Waiting] = []
        for waiting in batch:
            if waiting.evicted is not None:
                if not self._keeps(waiting, waiting.evicted):
                    with self._lock:
                        self._forgotten += 1
                    self._backlog.done([waiting])
                    continue
                # Decided once: the gate is not asked again when the database has to be.
                waiting.evicted = None
                waiting.aron_type = self._type_of(waiting.snapshot)
            kept.append(waiting)
        return kept

    def _keeps(self, waiting: Waiting, evicted: Evicted) -> bool:
        """What the gate says; where it fails itself, nothing is forgotten on that account."""
        if self._gate is None:
            return True
        if evicted.superseded:
            return False
        try:
            return self._gate.lets_through(evicted, waiting.moment, self._let_in)
        except (*UNAVAILABLE, StoreFailure):
            raise
        except Exception as error:
            _logger.exception("online forgetting failed on %s, which is consolidated", waiting.snapshot.id)
            self._health.stumbled(error)
            return True

    def _is_ready(self, waiting: Waiting) -> bool:
        """Whether a snapshot need not wait for poses of the robot any longer."""
        return (
            not self._waits_for_poses
            or waiting.number <= self._hurry
            or self._backlog.is_half_full
            or time.monotonic() - waiting.since >= self._settings.patience
        )

    def _sleep(self, pause: float) -> None:
        until = time.monotonic() + pause
        while not self._stopped and time.monotonic() < until:
            time.sleep(min(0.05, pause))

    def _lay_aside(self, what: SetAside) -> None:
        _logger.error("a snapshot cannot be consolidated, and is only in working memory: %s", what)
        with self._lock:
            self._set_aside += 1
            self._aside.append(what)
        if self._on_set_aside is not None:
            try:
                self._on_set_aside(what)
            except Exception:
                _logger.exception("what is told of snapshots that are set aside failed itself")
