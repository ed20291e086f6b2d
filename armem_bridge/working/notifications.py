"""Update notifications: who wants to hear of commits hears of them, without keeping anybody waiting (section 4.4.3)."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Sequence
from threading import Condition, Thread, current_thread
from typing import Final

import msgspec

from armem_bridge.memory_id import MemoryID
from armem_bridge.working.refusals import InvalidSubscription

Listener = Callable[[Sequence[MemoryID]], None]
"""Called with the IDs of the snapshots that one commit updated, in a thread of its own."""

QUEUE_LIMIT: Final = 1_000
"""So many messages wait for a slow listener before the oldest are dropped."""

_logger = logging.getLogger(__name__)


class ListenerStatus(msgspec.Struct, frozen=True, kw_only=True):
    """How a listener keeps up."""

    subscribed: MemoryID
    delivered: int
    """So many messages it was called with, those included on which it raised."""

    waiting: int
    dropped: int
    """So many messages it did not get, because it was too slow for its queue."""

    failures: int
    """So often it raised."""

    last_failure: str
    """What it raised last; empty if nothing."""


def check_listener(listener: Listener, subscribed: MemoryID) -> None:
    """Raise `InvalidSubscription` for what cannot be called, or not be asked what it contains."""
    if not callable(listener):
        raise InvalidSubscription(
            f"a listener is called with IDs, and a {type(listener).__name__} cannot be: give a function"
        )
    if not isinstance(subscribed, MemoryID):
        raise InvalidSubscription(
            f"what is subscribed to is a MemoryID, not {subscribed!r:.80}: make text one with MemoryID.parse"
        )


class Subscription:
    """One listener with its queue and its thread. `close` ends it.

    It is valid from birth, so that no offer fails: those come from commits that are made already.
    """

    def __init__(self, listener: Listener, subscribed: MemoryID, queue_limit: int) -> None:
        check_listener(listener, subscribed)
        if type(queue_limit) is not int or queue_limit < 1:
            raise InvalidSubscription(f"so many messages wait for a listener, 1 or more: not {queue_limit!r:.80}")
        self._listener = listener
        self._subscribed = subscribed
        self._limit = queue_limit
        self._queue: deque[Sequence[MemoryID]] = deque()
        self._changed = Condition()
        self._closed = False
        self._busy = False
        self._delivered = self._dropped = self._failures = 0
        self._last_failure = ""
        self._thread = Thread(target=self._deliver, name=f"armem listener to {subscribed}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Call the listener no more; returns when the call that is going on, if any, is over."""
        with self._changed:
            self._closed = True
            self._queue.clear()
            self._changed.notify_all()
        if current_thread() is not self._thread:
            self._thread.join()

    def flush(self, timeout: float | None = None) -> bool:
        """Wait until the listener was called with everything so far; False if that took longer than `timeout` s."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._queue and not self._busy, timeout)

    def status(self) -> ListenerStatus:
        """How the listener keeps up."""
        with self._changed:
            return ListenerStatus(
                subscribed=self._subscribed,
                delivered=self._delivered,
                waiting=len(self._queue),
                dropped=self._dropped,
                failures=self._failures,
                last_failure=self._last_failure,
            )

    @property
    def closed(self) -> bool:
        """Whether it has ended."""
        return self._closed

    def offer(self, updated: Sequence[MemoryID]) -> None:
        """Put a message into the queue, as far as it is of interest; never waits for the listener."""
        wanted = tuple(each for each in updated if self._subscribed.contains(each))
        if not wanted:
            return
        with self._changed:
            if self._closed:
                return
            if len(self._queue) >= self._limit:
                self._queue.popleft()
                self._dropped += 1
            self._queue.append(wanted)
            self._changed.notify_all()

    def _deliver(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._queue or self._closed)
                if self._closed:
                    return
                message = self._queue.popleft()
                self._busy = True
                self._delivered += 1
            try:
                self._listener(message)
            except Exception as error:
                # Whatever a listener raises is its own affair: it is told the next time all the same.
                _logger.exception("a listener to %s raised", self._subscribed)
                with self._changed:
                    self._failures += 1
                    self._last_failure = f"{type(error).__name__}: {error}"


class Notifier:
    """The listeners of one memory."""

    def __init__(self) -> None:
        self._subscriptions: tuple[Subscription, ...] = ()
        self._changing = Condition()

    def subscribe(self, listener: Listener, subscribed: MemoryID, queue_limit: int) -> Subscription:
        """Call `listener` with what is updated and contained in `subscribed`, from now on."""
        subscription = Subscription(listener, subscribed, queue_limit)
        with self._changing:
            self._subscriptions = (*(each for each in self._subscriptions if not each.closed), subscription)
        return subscription

    def publish(self, updated: Sequence[MemoryID]) -> None:
        """Tell the listeners of the snapshots that one commit updated."""
        for subscription in self._subscriptions:
            subscription.offer(updated)

    def status(self) -> tuple[ListenerStatus, ...]:
        """How each listener keeps up."""
        return tuple(each.status() for each in self._subscriptions if not each.closed)

    def close(self) -> None:
        """End all subscriptions."""
        with self._changing:
            ending, self._subscriptions = self._subscriptions, ()
        for subscription in ending:
            subscription.close()
