"""What waits for its time: queues of events by the moment at which they are fed, and how many there may be."""

from __future__ import annotations

from collections.abc import Callable
from heapq import heappop, heappush

from elm.event import StoredEvent
from elm.interval import to_micros
from elm.recognizers.base import Fed

MOST_HELD = 200_000
"""Events that wait for their time at once, for one agent; more are passed over, and counted."""

Queue = list[tuple[int, int, int, Fed]]
"""A heap of events by moment, begin and uid."""


class Waiting:
    """The moments of all events that wait for one watermark, whoever wants them: so many may wait, no more."""

    def __init__(self, moments: list[int]) -> None:
        self.moments = moments

    def passed(self, watermark: int) -> list[int]:
        """The moments that still wait: those before the watermark do no longer."""
        while self.moments and self.moments[0] < watermark:
            heappop(self.moments)
        return self.moments

    def has_room(self, moment: int, watermark: int) -> bool:
        """Whether one more event may wait."""
        moments = self.passed(watermark)
        if len(moments) >= MOST_HELD:
            return False
        heappush(moments, moment)
        return True


def push(queue: Queue, event: StoredEvent, moment: int) -> None:
    """Have an event wait for its moment."""
    fed = fed_at(event, moment)
    heappush(queue, (moment, fed.begin, event.uid.int, fed))


def fed_at(event: StoredEvent, moment: int) -> Fed:
    """An event as it is fed at a moment."""
    return Fed(event=event, moment=moment, begin=to_micros(event.interval.begin))


def keep(queue: Queue, is_wanted: Callable[[Fed], bool]) -> None:
    """Let go of what nobody wants."""
    # What is sorted is a heap.
    queue[:] = sorted(item for item in queue if is_wanted(item[3]))


def merge(into: Queue, queue: Queue) -> None:
    """Have all events of both wait in one, each once."""
    known = {item[2] for item in into}
    for item in queue:
        if item[2] not in known:
            heappush(into, item)
