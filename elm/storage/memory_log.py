"""The log of the store in this process: what was committed, in order, and the consumers that read it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from threading import Condition
from typing import Any

import msgspec

from elm.event import content_hash
from elm.log import (
    Advance,
    Consumer,
    LogEntry,
    Progress,
    Tick,
    beyond_the_end,
    check_position,
    consumer_busy,
    position_lost,
    unknown_consumer,
)
from elm.storage.memory_changes import Changes
from elm.storage.memory_index import EventIndex
from elm.store import Arrival, Committed
from elm.text import check_short_name


class MemoryLog:
    """The `Log` of a memory in this process. The list in which changes are noted is the log itself.

    `locked` gives its store's lock while the store is open; `changed` is told of every change.
    """

    def __init__(
        self,
        changes: Changes,
        index: EventIndex,
        locked: Callable[[], AbstractContextManager[None]],
        changed: Condition,
    ) -> None:
        self._changes = changes
        self._index = index
        self._locked = locked
        self._changed = changed
        self._consumers: dict[str, Consumer] = {}
        self._definitions: dict[str, str] = {}
        self._held: set[str] = set()

    # Entries

    def head(self) -> int:
        """The position of the last entry, 0 when there is none."""
        with self._locked():
            return len(self._changes.log)

    def read(self, after: int, limit: int) -> list[LogEntry]:
        """Up to `limit` entries behind position `after`."""
        check_position(after)
        check_position(limit, what="the number of entries to read")
        with self._locked():
            return [
                LogEntry(
                    position=position,
                    kind=row.kind,
                    at=row.at,
                    agent=row.agent,
                    event=None if row.event_id is None else self._index.events.get(row.event_id),
                    deadline=row.deadline,
                )
                for position, row in enumerate(self._changes.log[after : after + limit], start=after + 1)
            ]

    def write(self, ticks: Sequence[Tick]) -> None:
        """Write entries of clocks."""
        with self._locked():
            self._changes.tick(ticks)
            self._changed.notify_all()

    def wait(self, after: int, seconds: float) -> bool:
        """Wait until there is more than position `after`, at most `seconds`; whether there is."""
        check_position(after)
        until = time.monotonic() + seconds
        with self._changed:
            # The head of a closed store is refused: closing it wakes its waiters too.
            while not (more := self.head() > after) and (left := until - time.monotonic()) > 0:
                self._changed.wait(left)
        return more

    # Consumers

    def consumers(self) -> list[Consumer]:
        """All consumers, by name."""
        with self._locked():
            return [self._consumers[name] for name in sorted(self._consumers)]

    def progress(self) -> list[Progress]:
        """How far all consumers got, by name, without what they know."""
        return [
            Progress(name=each.name, position=each.position, report=each.report, updated_at=each.updated_at)
            for each in self.consumers()
        ]

    def consumer(self, name: str) -> Consumer | None:
        """The consumer of this name."""
        with self._locked():
            return self._consumers.get(name)

    def register(self, name: str, *, position: int = 0) -> Consumer:
        """The consumer of this name; a new one begins behind `position`."""
        check_short_name(name, what="the name of a consumer")
        check_position(position)
        with self._locked():
            if name not in self._consumers:
                self._check_reached(name, position)
                self._consumers[name] = Consumer(
                    name=name,
                    position=position,
                    checkpoint=position,
                    state=None,
                    report={},
                    updated_at=datetime.now(UTC),
                )
            return self._consumers[name]

    def advance(self, advances: Sequence[Advance], results: Sequence[Arrival] = ()) -> list[Committed]:
        """Commit results and move consumers on, all or nothing.

        A consumer that is not at the `before` of its advance refuses the whole call with `PositionLost`.
        """
        contents = [content_hash(arrival.event) for arrival in results]
        with self._locked():
            moved: dict[str, Consumer] = {}
            for each in advances:
                moved[each.name] = self._after(each, moved.get(each.name) or self._known(each.name))
            done = self._changes.keep(results, contents)
            self._consumers.update(moved)
            self._changed.notify_all()
            return done

    def _after(self, advance: Advance, consumer: Consumer) -> Consumer:
        if consumer.position != advance.before:
            raise position_lost(advance, consumer.position)
        self._check_reached(advance.name, advance.position)
        return replace(
            consumer,
            position=advance.position,
            checkpoint=consumer.checkpoint if advance.state is None else advance.position,
            state=consumer.state if advance.state is None else advance.state,
            report=_as_kept(advance.report),
            updated_at=datetime.now(UTC),
        )

    def rewind(self, name: str, position: int) -> None:
        """Have a consumer begin again behind `position`, without state."""
        check_position(position)
        with self._locked():
            known = self._known(name)
            self._check_reached(name, position)
            self._consumers[name] = replace(
                known, position=position, checkpoint=position, state=None, updated_at=datetime.now(UTC)
            )

    def remove(self, name: str) -> None:
        """Forget a consumer; an unknown one is no error."""
        with self._locked():
            self._consumers.pop(name, None)

    def _known(self, name: str) -> Consumer:
        if name not in self._consumers:
            raise unknown_consumer(name)
        return self._consumers[name]

    def _check_reached(self, name: str, position: int) -> None:
        if position > len(self._changes.log):
            raise beyond_the_end(name, position, len(self._changes.log))

    @contextmanager
    def exclusive(self, name: str) -> Iterator[None]:
        """Be the only one to work under this name while the context is open; `ConsumerBusy` when another does."""
        check_short_name(name, what="the name of a consumer")
        with self._locked():
            if name in self._held:
                raise consumer_busy(name)
            self._held.add(name)
        try:
            yield
        finally:
            # Also after the store was closed.
            self._held.discard(name)

    # Definitions

    def definitions(self) -> dict[str, str]:
        """Fingerprints of the definitions that have been at work here, by name and version."""
        with self._locked():
            return dict(sorted(self._definitions.items()))

    def define(self, fingerprints: Mapping[str, str]) -> None:
        """Remember definitions; the first fingerprint of a name stays."""
        for name in fingerprints:
            check_short_name(name, what="the name of a definition")
        with self._locked():
            self._definitions = {**fingerprints, **self._definitions}


def _as_kept(report: Mapping[str, Any]) -> dict[str, Any]:
    """A report as it comes back from where it is kept as JSON."""
    kept: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(dict(report)))
    return kept
