"""What is known of the snapshots of one entity that were consolidated, and of those that were forgotten."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import OrderedDict
from typing import Final

from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.distances import Compared
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.history import History, Source
from armem_bridge.working.snapshot import Snapshot

REMEMBERED: Final = 256
"""So many reference times of an entity are remembered of what was consolidated."""

FORGOTTEN: Final = 256
"""So many are remembered of what was forgotten, which cannot be looked up: not earlier, and not before a restart."""


class Consolidated:
    """The consolidated snapshots of one entity, as decisions look at them: when, which version, and their numbers.

    The last reference times are remembered, and the numbers of few snapshots. All others are looked up in a
    source, where there is one: so what comes late is compared with what is there at its own time, and a
    restart changes nothing.
    """

    def __init__(self, entity: MemoryID, comparing: int, source: Source | None) -> None:
        self._entity = entity
        self._comparing = comparing
        self._begin = 0
        """From here on all reference times are remembered."""
        self._moments: list[int] = []
        self._sent: dict[int, int] = {}
        self._numbers: OrderedDict[int, Compared] = OrderedDict()
        self._forgotten: OrderedDict[int, int] = OrderedDict()
        if source is not None:
            count = max(comparing, 1)
            last = source.history(entity).latest(count)
            for snapshot in last:
                self._add(snapshot)
            self._begin = last[0].referenced if len(last) == count else 0

    # What happened

    def add(self, candidate: Candidate) -> None:
        """The candidate was consolidated."""
        if self._add(candidate.snapshot) and self._comparing:
            self._note_numbers(candidate.id.timestamp, candidate.compared)

    def forget(self, candidate: Candidate) -> None:
        """The candidate was forgotten."""
        moment = candidate.id.timestamp
        self._forgotten[moment] = max(candidate.snapshot.sent, self._forgotten.pop(moment, candidate.snapshot.sent))
        if len(self._forgotten) > FORGOTTEN:
            self._forgotten.popitem(last=False)

    def _add(self, snapshot: Snapshot) -> bool:
        """Remember a consolidated version; whether it is none that another one there supersedes."""
        moment, sent = snapshot.referenced, snapshot.sent
        if moment < self._begin:
            return True
        known = self._sent.get(moment)
        if known is None:
            insort(self._moments, moment)
        elif known > sent:
            return False
        self._sent[moment] = sent
        if len(self._moments) > REMEMBERED:
            earliest = self._moments.pop(0)
            del self._sent[earliest]
            self._begin = earliest + 1
        return True

    # What decisions look at

    def sent_at(self, moment: int, source: Source | None) -> int | None:
        """When the consolidated version of a reference time was sent, None where there is none."""
        if moment >= self._begin or source is None:
            return self._sent.get(moment)
        found = source.history(self._entity).at(moment)
        return None if found is None else found.sent

    def forgotten_at(self, moment: int) -> int | None:
        """When the version of a reference time was sent that was forgotten, None where that is not known."""
        return self._forgotten.get(moment)

    def nearest(self, moment: int, source: Source | None) -> int | None:
        """The time to the nearest consolidated snapshot, in microseconds, before or after; None where there is none."""
        place = bisect_left(self._moments, moment)
        around = self._moments[max(place - 1, 0) : place + 1]
        if moment < self._begin or (not place and self._begin):
            around += _around(moment, source.history(self._entity)) if source is not None else []
        return min((abs(each - moment) for each in around), default=None)

    def before(self, moment: int, source: Source | None) -> list[Compared]:
        """The numbers of the last consolidated snapshots before a reference time, as many as are compared."""
        place = bisect_left(self._moments, moment)
        wanted = self._moments[max(place - self._comparing, 0) : place]
        is_complete = len(wanted) == self._comparing or not self._begin
        if source is None or (is_complete and all(each in self._numbers for each in wanted)):
            return [self._recently(each) for each in wanted if each in self._numbers]
        found = source.history(self._entity).before(moment, self._comparing)
        for each in found:
            numbers = self._numbers.get(each.referenced)
            self._note_numbers(each.referenced, _numbers(each) if numbers is None else numbers)
        return [self._numbers[each.referenced] for each in found]

    def _recently(self, moment: int) -> Compared:
        self._numbers.move_to_end(moment)
        return self._numbers[moment]

    def _note_numbers(self, moment: int, numbers: Compared) -> None:
        self._numbers[moment] = numbers
        self._numbers.move_to_end(moment)
        # Those of two places: what comes late and what comes in time are compared in turn.
        if len(self._numbers) > 2 * self._comparing:
            self._numbers.popitem(last=False)


def _numbers(snapshot: Snapshot) -> Compared:
    return Compared.of(instance.data for instance in snapshot.instances)


def _around(moment: int, history: History) -> list[int]:
    """The reference times next to a moment, one before and one after."""
    return [each.referenced for each in (*history.before(moment, 1), *history.after(moment, 1))]
