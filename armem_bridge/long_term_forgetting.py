"""Offline forgetting in long-term memory: what there is to forget, and how elm forgets it (section 4.5.3)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final
from uuid import UUID

from armem_bridge.forgetting.candidates import Candidate
from armem_bridge.forgetting.mechanisms import LatentSimilarity, Offline
from armem_bridge.forgetting.offline import make_plan
from armem_bridge.forgetting.plan import Plan
from armem_bridge.long_term.contents import entities
from armem_bridge.long_term.mapping import below, is_snapshot
from armem_bridge.long_term.source import LongTermSource
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import to_datetime
from elm.app import Memory
from elm.cues import any_of, time, uid
from elm.cues.algebra import Cue
from elm.interval import Interval, to_micros

AT_ONCE: Final = 100
"""Snapshots of one entity that one cue names."""

_EVERYTHING = MemoryID()


def plan_forgetting(
    elm: Memory, mechanisms: Sequence[Offline], *, now: int, wanted: MemoryID = _EVERYTHING, keep_newest: bool = True
) -> Plan:
    """What the mechanisms would forget of the consolidated snapshots that an ID contains, as of `now`.

    They are read one after another; their data are kept in main memory only for mechanisms that compare
    them. When a snapshot was used last is not kept with it: here it was when it arrived.
    """
    found = _candidates(elm, wanted)
    if not any(isinstance(each, LatentSimilarity) for each in mechanisms):
        found = (replace(each, snapshot=each.snapshot.without_data()) for each in found)
    return make_plan(found, mechanisms, now=now, keep_newest=keep_newest)


def _candidates(elm: Memory, wanted: MemoryID) -> Iterator[Candidate]:
    source = LongTermSource(elm)
    for entity in entities(elm, wanted):
        history = source.history(entity)
        snapshots = history.all() if wanted.timestamp < 0 else history.between(wanted.timestamp, wanted.timestamp)
        yield from map(Candidate.of, snapshots)


class LongTermForgetting:
    """The port `forgetting.Forgetting` over an elm memory.

    What recognizers hold stays for now, and so `held` counts it; parts of complex events leave tombstones.
    """

    def __init__(self, elm: Memory) -> None:
        self._elm = elm
        self.events = 0
        """So many events went: one for each version of a snapshot."""

        self.held = 0
        """So many events were to go and did not, for recognizers have not finished with them."""

    def forget(self, snapshots: Sequence[MemoryID]) -> int:
        """Forget every version of these snapshots, and say of how many none is left."""
        went = 0
        by_entity: dict[MemoryID, list[int]] = {}
        for snapshot in snapshots:
            by_entity.setdefault(snapshot.entity_id, []).append(snapshot.timestamp)
        for entity, moments in by_entity.items():
            for start in range(0, len(moments), AT_ONCE):
                cue = _versions(entity, moments[start : start + AT_ONCE])
                there = self._found(cue)
                if not there:
                    continue
                # Named by their uids: others may have events with these features at these times, which stay.
                report = self._elm.forget(uid(*there))
                self.events += report.events
                self.held += report.held
                left = set(self._found(cue).values()) if report.held else set()
                went += len(set(there.values()) - left)
        return went

    def _found(self, cue: Cue) -> dict[UUID, int]:
        """The versions of snapshots that a cue finds, with their reference times."""
        return {event.uid: to_micros(event.interval.begin) for event in self._elm.recall(cue) if is_snapshot(event)}


def _versions(entity: MemoryID, moments: Iterable[int]) -> Cue:
    return below(entity) & any_of(*(time("equal", Interval.at(to_datetime(moment))) for moment in moments))
