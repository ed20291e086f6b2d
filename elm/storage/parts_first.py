"""The order in which the events of one call are kept: as they were given, but each whole behind its parts."""

from __future__ import annotations

from collections.abc import Iterable
from heapq import heappop, heappush
from uuid import UUID

from elm.errors import CycleRefused
from elm.event import Event


def parts_first(events: Iterable[Event]) -> list[Event]:
    """The events, each uid where it comes first; one whose parts are among them and come later follows the last.

    Of several that follow the same part the one given first comes first. A circle is refused.
    """
    given: dict[UUID, Event] = {}
    for event in events:
        given.setdefault(event.uid, event)
    in_order = list(given.values())
    wholes: dict[UUID, list[int]] = {}
    missing = [0] * len(in_order)
    for place, event in enumerate(in_order):
        for part in event.parts:
            if part in given:
                wholes.setdefault(part, []).append(place)
                missing[place] += 1
    ready = [place for place, count in enumerate(missing) if count == 0]
    found: list[Event] = []
    while ready:
        event = in_order[heappop(ready)]
        found.append(event)
        for whole in wholes.get(event.uid, ()):
            missing[whole] -= 1
            if missing[whole] == 0:
                heappush(ready, whole)
    if len(found) < len(in_order):
        for event in found:
            del given[event.uid]
        raise CycleRefused(
            f"events cannot be parts of each other: {' has part '.join(map(str, _circle(given)))}. "
            f"Remove one of these links"
        )
    return found


def _circle(events: dict[UUID, Event]) -> list[UUID]:
    """A circle of links among events each of which has a part among them."""
    path: dict[UUID, None] = {}
    uid = next(iter(events))
    while uid not in path:
        path[uid] = None
        uid = next(part for part in events[uid].parts if part in events)
    ring = [*path]
    return [*ring[ring.index(uid) :], uid]
