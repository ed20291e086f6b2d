"""The servant of one memory: what remote clients call to commit and to query (sections 1.5 and 1.6 of the facts)."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from threading import Lock
from typing import Any

from armem_bridge.errors import ArmemError
from armem_bridge.ice.communicators import servant_of
from armem_bridge.ice.wire import Wire
from armem_bridge.moments import Clock, now
from armem_bridge.working.commit import Commit, EntityUpdate, UpdateResult
from armem_bridge.working.segments import SegmentResult
from armem_bridge.working.server import MemoryServer

_logger = logging.getLogger(__name__)


class MemoryServant:
    """Answers for a memory server. Whatever goes wrong is told in the answer, never by an exception.

    An update that the wire brings malformed is refused by itself. One without a valid referenced time gets
    the time of its arrival, which is counted and logged: clients of another generation than the loaded slice
    files send such updates, and their data are good.
    """

    def __init__(self, server: MemoryServer, wire: Wire, *, clock: Clock = now) -> None:
        self.server = server
        self.servant = servant_of(
            wire.words.member(wire.words.server, "MemoryInterface"),
            query=self.query,
            commit=self.commit,
            addSegments=self.add_segments,
        )
        self._commits, self._queries, self._results = wire.commits, wire.queries, wire.results
        self._clock = clock
        self._lock = Lock()
        self._malformed = self._untimed = 0

    @property
    def malformed(self) -> int:
        """So many updates and queries could not be read."""
        return self._malformed

    @property
    def untimed(self) -> int:
        """So many updates had no valid referenced time, and got that of their arrival."""
        return self._untimed

    def query(self, wire: Any, current: Any) -> Any:
        """ReadingMemoryInterface.query."""
        try:
            query = self._queries.read(wire)
        except ArmemError as error:
            self._note_malformed()
            return self._results.write_failure(self.server.name, str(error))
        except Exception as error:
            return self._results.write_failure(self.server.name, self._unexpected("a query", error, current))
        try:
            return self._results.write(self.server.query(query))
        except ArmemError as error:
            return self._results.write_failure(self.server.name, str(error))
        except Exception as error:
            return self._results.write_failure(self.server.name, self._unexpected("a query", error, current))

    def commit(self, wire: Any, current: Any) -> Any:
        """WritingMemoryInterface.commit."""
        if wire is None:
            self._note_malformed()
            return self._commits.write_result(self._all_failed(1, "the commit is null: send one with its updates"))
        updates = wire.updates
        try:
            results = self._commit(updates, current)
        except ArmemError as error:
            results = self._all_failed(len(updates), str(error))
        except Exception as error:
            results = self._all_failed(len(updates), self._unexpected("a commit", error, current))
        return self._commits.write_result(results)

    def add_segments(self, wires: Sequence[Any], current: Any) -> list[Any]:
        """WritingMemoryInterface.addSegments."""
        why = ""
        try:
            results = self.server.add_segments([self._commits.read_segment(wire) for wire in wires])
        except ArmemError as error:
            why = str(error)
        except Exception as error:
            why = self._unexpected("new segments", error, current)
        if why:
            results = tuple(SegmentResult(success=False, error=why) for _ in wires)
        return self._commits.write_segment_results(results)

    def _commit(self, wires: Sequence[Any], current: Any) -> Sequence[UpdateResult]:
        outcomes = [self._read_update(wire, current) for wire in wires]
        updates = tuple([each for each in outcomes if type(each) is EntityUpdate])
        results = self.server.commit(Commit(updates=updates)).results
        if len(updates) == len(outcomes):
            return results
        arrived, made = self._clock(), iter(results)
        return [
            UpdateResult(success=False, error=each, arrived=arrived) if isinstance(each, str) else next(made)
            for each in outcomes
        ]

    def _read_update(self, wire: Any, current: Any) -> EntityUpdate | str:
        """The update, or why it cannot be one."""
        if wire is None:
            self._note_malformed()
            return "the update cannot be read: it is null"
        try:
            update = self._commits.read_update(wire)
        except ArmemError as error:
            self._note_malformed()
            return f"the update cannot be read: {error}"
        except Exception as error:
            self._note_malformed()
            return self._unexpected("an update", error, current)
        return update if update.referenced >= 0 else self._timed(update)

    def _timed(self, update: EntityUpdate) -> EntityUpdate:
        arrived = self._clock()
        with self._lock:
            first = not self._untimed
            self._untimed += 1
        # The first one is news, the others are only more of the same.
        _logger.log(
            logging.WARNING if first else logging.DEBUG,
            "an update of %s has no valid referenced time: its arrival at %d counts. Clients of another generation "
            "of the interface than the loaded slice files send such updates",
            update.entity,
            arrived,
        )
        return EntityUpdate(
            entity=update.entity,
            instances=update.instances,
            referenced=arrived,
            sent=update.sent,
            confidence=update.confidence,
        )

    def _all_failed(self, count: int, why: str) -> Sequence[UpdateResult]:
        arrived = self._clock()
        return [UpdateResult(success=False, error=why, arrived=arrived)] * count

    def _note_malformed(self) -> None:
        with self._lock:
            self._malformed += 1

    def _unexpected(self, what: str, error: Exception, current: Any) -> str:
        """Log what nobody foresaw, and the words for the client."""
        _logger.exception("the memory %s failed at %s from %s", self.server.name, what, current.con)
        return f"the memory {self.server.name!r:.80} failed at {what}: {type(error).__name__}: {error}"
