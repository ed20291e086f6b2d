"""Subscriptions: the events that match a cue, as they enter the log of a memory, for as long as somebody looks."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import nullcontext

from elm.cues.algebra import And, Cue, UidCue
from elm.errors import InvalidValue, StoreClosed
from elm.event import StoredEvent
from elm.log import LogEntry, LoggedStore, Step, check_position
from elm.query import Query

PAGE = 1_000
"""Entries of the log that are looked at together, and after which a named subscription keeps its place."""

_PATIENCE = 60.0
"""Seconds of waiting at a time where there is no timeout."""


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
    `timeout` seconds without any (None: never), and when the memory is closed.

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


def _events(
    store: LoggedStore, cue: Cue, position: int, name: str | None, timeout: float | None
) -> Iterator[StoredEvent]:
    log = store.log
    try:
        with nullcontext() if name is None else log.exclusive(name):
            forgotten = 0
            if name is not None:
                known = log.register(name, position=position)
                position, forgotten = known.position, known.report.get("forgotten", 0)
            quiet_since = time.monotonic()
            while True:
                if log.head() > position:
                    before, page = position, log.read(position, PAGE)
                    position = page[-1].position
                    for event in _matching(store, cue, page):
                        yield event
                        quiet_since = time.monotonic()
                    if name is not None:
                        forgotten += sum(entry.is_forgotten for entry in page)
                        report = {"forgotten": forgotten} if forgotten else {}
                        log.advance([Step(name=name, before=before, position=position, report=report)])
                else:
                    left = _PATIENCE if timeout is None else quiet_since + timeout - time.monotonic()
                    if left <= 0:
                        return
                    log.wait(position, min(left, _PATIENCE))
    except StoreClosed:
        return


def _matching(store: LoggedStore, cue: Cue, page: Sequence[LogEntry]) -> Iterator[StoredEvent]:
    """The events of a page that match, in its order: asked of the store, which alone says what a cue means."""
    uids = dict.fromkeys(entry.event.uid for entry in page if entry.event is not None)
    if not uids:
        return
    found = {event.id: event for event in store.find(Query(cue=And(args=(cue, UidCue(uids=tuple(uids))))))}
    for entry in page:
        if entry.event is not None and entry.event.id in found:
            yield found[entry.event.id]
