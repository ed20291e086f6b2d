"""Subscriptions: the events that match a cue, as they enter the log of a memory, for as long as somebody looks."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass

from elm.cues.algebra import And, Cue, UidCue
from elm.errors import DatabaseUnreachable, InvalidValue, StoreClosed
from elm.event import StoredEvent
from elm.log import Advance, LogEntry, LoggedStore, check_position
from elm.query import Query

PAGE = 1_000
"""Entries of the log that are looked at together, and after which a named subscription keeps its place."""

_PATIENCE = 60.0
"""Seconds of waiting at a time where there is no timeout."""
_RETRY_FIRST, _RETRY_MOST = 0.25, 10.0
"""Seconds before the log is asked again when the server is away, doubled from the first to the last."""

log = logging.getLogger(__name__)


def subscribe(
    store: LoggedStore,
    cue: Cue | None = None,
    *,
    since: int | None = None,
    name: str | None = None,
    timeout: float | None = None,
) -> Iterator[StoredEvent]:
    """The events that match `cue` (all without one) and enter the log behind position `since` (None: from now on).

    They come in the order of the log, each as it stands when it is read: an event that was going on when it was
    committed comes then, and once more when it is closed. The iterator waits for more; it ends after
    `timeout` seconds without any (None: never), and when the memory is closed. When the server goes away it waits,
    says so in the log of the program, and goes on where it was: nothing is missed or comes twice.

    With a `name` the place is kept in the memory after each page that was handed over completely, and the
    next subscription of that name goes on from there; `since` is where a new one begins. After a crash the
    last page comes again. Two subscriptions of one name at once are refused with `ConsumerBusy`.

    Events that were forgotten before they were handed over are passed over; the report of the named consumer
    counts them as `forgotten`.
    """
    if timeout is not None and (isinstance(timeout, bool) or not isinstance(timeout, int | float) or not timeout >= 0):
        raise InvalidValue(f"the timeout of a subscription is a number of seconds, or None for no end, not {timeout!r}")
    if cue is not None and not isinstance(cue, Cue):
        raise InvalidValue(f"a subscription looks for what a cue (elm.cues) says, not for {cue!r:.80}")
    wanted = And() if cue is None else cue
    # A cue that cannot be answered is refused here, not when the first event comes.
    for _ in store.ids(Query(cue=wanted, limit=0)):
        pass
    start = store.log.head() if since is None else check_position(since)
    if name is not None:
        store.log.register(name, position=start)
    return _events(store, wanted, start, name, timeout)


@dataclass(slots=True)
class _Place:
    """How far a subscription is: all up to `position` was handed over, and up to `kept` the memory knows it."""

    position: int
    quiet_since: float
    kept: int | None = None
    forgotten: int = 0


def _events(
    store: LoggedStore, cue: Cue, position: int, name: str | None, timeout: float | None
) -> Iterator[StoredEvent]:
    place = _Place(position=position, quiet_since=time.monotonic())
    pause = _RETRY_FIRST
    while True:
        start = place.position
        try:
            yield from _followed(store, cue, place, name, timeout)
            return
        except StoreClosed:
            return
        except DatabaseUnreachable as error:
            pause = _RETRY_FIRST if place.position > start else min(2 * pause, _RETRY_MOST)
            left = pause if timeout is None else place.quiet_since + timeout - time.monotonic()
            if left <= 0:
                return
            log.warning("a subscription goes on behind position %d, when it can: %s", place.position, error)
            time.sleep(min(left, pause))


def _followed(
    store: LoggedStore, cue: Cue, place: _Place, name: str | None, timeout: float | None
) -> Iterator[StoredEvent]:
    with nullcontext() if name is None else store.log.exclusive(name):
        if name is not None:
            known = store.log.register(name, position=place.position)
            if known.position != place.kept:
                place.position = place.kept = known.position
                place.forgotten = known.report.get("forgotten", 0)
        while True:
            if name is not None and place.kept is not None and place.kept < place.position:
                report = {"forgotten": place.forgotten} if place.forgotten else {}
                advance = Advance(name=name, before=place.kept, position=place.position, report=report)
                store.log.advance([advance])
                place.kept = place.position
            if store.log.head() > place.position:
                page = store.log.read(place.position, PAGE)
                for event in _matching(store, cue, page):
                    yield event
                    place.quiet_since = time.monotonic()
                place.position = page[-1].position
                place.forgotten += sum(entry.is_forgotten for entry in page)
                continue
            left = _PATIENCE if timeout is None else place.quiet_since + timeout - time.monotonic()
            if left <= 0:
                return
            store.log.wait(place.position, min(left, _PATIENCE))


def _matching(store: LoggedStore, cue: Cue, page: Sequence[LogEntry]) -> Iterator[StoredEvent]:
    """The events of a page that match, in its order: asked of the store, which alone says what a cue means."""
    uids = dict.fromkeys(entry.event.uid for entry in page if entry.event is not None)
    if not uids:
        return
    found = {event.id: event for event in store.find(Query(cue=And(args=(cue, UidCue(uids=tuple(uids))))))}
    for entry in page:
        if entry.event is not None and entry.event.id in found:
            yield found[entry.event.id]
