"""What the store in this process forgets: events go, tombstones come, and each forgetting leaves one of its own."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from uuid import UUID

import msgspec

from elm.event import StoredEvent
from elm.extents import span
from elm.geometry import Region, derived_region
from elm.storage.memory_index import EventIndex
from elm.store import BatchReport, ForgettingCount, Refusal
from elm.tombstone import Forgotten, RunTombstone, Tombstone, other_tombstone

_ROW = 200
"""Bytes of an event beside what differs from event to event."""


class Forgetting:
    """Takes events from an index and keeps tombstones. Not locked: its store does that."""

    def __init__(self, index: EventIndex, contents: dict[UUID, bytes]) -> None:
        self._index = index
        self._contents = contents
        self._runs: dict[UUID, RunTombstone] = {}

    @property
    def runs(self) -> list[RunTombstone]:
        """What is left of the rest of each forgetting, oldest first."""
        return sorted(self._runs.values(), key=lambda run: (run.at, run.run))

    def count(self) -> ForgettingCount:
        """How many runs there were, and of how many events they tell."""
        return ForgettingCount(runs=len(self._runs), events=sum(run.events for run in self._runs.values()))

    def forget(self, ids: Sequence[int], *, run: UUID, at: datetime) -> Forgotten:
        """Forget those of these events that have ended."""
        told, kept, dissolved = self._looked_at(ids)
        going = self._ended(ids)
        for event in going:
            for part in event.parts:
                self._index.unlink(part, event.uid)
        rest: list[StoredEvent | Tombstone] = [event for event in going if event.uid not in kept]
        rest += [self._index.tombstones[uid] for uid in dissolved]
        if going:
            self._count_in(rest, run, at)
        for event in going:
            # Wholes that are going too have let go of it by now.
            wholes = self._index[event.uid].wholes
            self._index.remove(event.uid)
            del self._contents[event.uid]
            if event.uid in kept:
                self._index.bury(_tombstone(event, run), wholes)
        for uid in dissolved:
            self._index.dissolve(uid)
        return told

    def would_forget(self, ids: Sequence[int]) -> Forgotten:
        """What forgetting these events would do."""
        return self._looked_at(ids)[0]

    def keep(self, given: Sequence[Tombstone | RunTombstone]) -> BatchReport:
        """Keep tombstones of another memory."""
        new = existing = 0
        refused: list[Refusal] = []
        for index, each in enumerate(given):
            known: Tombstone | RunTombstone | None
            if isinstance(each, Tombstone):
                known = self._index.tombstones.get(each.uid)
                is_there = each.uid in self._index
            else:
                known, is_there = self._runs.get(each.run), False
            if is_there or known == each:
                existing += 1
            elif known is not None:
                refused.append(Refusal(index=index, reason=other_tombstone(each)))
            else:
                new += 1
                if isinstance(each, Tombstone):
                    self._index.bury(replace(each, id=self._index.next_id()), ())
                else:
                    self._runs[each.run] = each
        return BatchReport(new=new, existing=existing, refused=tuple(refused))

    def _looked_at(self, ids: Iterable[int]) -> tuple[Forgotten, set[UUID], set[UUID]]:
        """What would be told, the events that will leave a tombstone, and the tombstones that will dissolve."""
        index = self._index
        known = [index.events[number] for number in set(ids) if number in index.events]
        going = {event.uid: event for event in known if not event.interval.is_open}
        kept = {uid for uid, event in going.items() if any(whole not in going for whole in event.wholes)}
        touched = {part for event in going.values() for part in event.parts if part in index.tombstones}
        dissolved = {uid for uid in touched if all(whole in going for whole in index.wholes_of_tombstone(uid))}
        told = Forgotten(
            events=len(going),
            tombstones=len(kept),
            dissolved=len(dissolved),
            still_open=len(known) - len(going),
            bytes=sum(map(_bytes, going.values())),
            types=Counter(event.type for event in going.values()),
        )
        return told, kept, dissolved

    def _ended(self, ids: Iterable[int]) -> list[StoredEvent]:
        known = (self._index.events[number] for number in sorted(set(ids)) if number in self._index.events)
        return [event for event in known if not event.interval.is_open]

    def _count_in(self, gone: Sequence[StoredEvent | Tombstone], run: UUID, at: datetime) -> None:
        before = self._runs.get(run) or RunTombstone(run=run, at=at, events=0)
        intervals = [each.interval for each in gone] + ([before.interval] if before.interval else [])
        self._runs[run] = RunTombstone(
            run=run,
            at=before.at,
            events=before.events + len(gone),
            interval=span(intervals) if intervals else None,
            regions=tuple(_hulls([*before.regions, *(each.region for each in gone)])),
            subjects=tuple(_hulls([*before.subjects, *(each.subject for each in gone)])),
        )


def _hulls(places: Iterable[Region | None]) -> Iterator[Region]:
    """The convex hull of what lies in each frame."""
    frames: dict[str, list[Region]] = {}
    for place in places:
        if place is not None:
            frames.setdefault(place.frame, []).append(place)
    for together in frames.values():
        hull = derived_region(together)
        assert hull is not None  # noqa: S101 - of places in one frame there is one
        yield hull


def _tombstone(event: StoredEvent, run: UUID) -> Tombstone:
    return Tombstone(
        id=event.id,
        uid=event.uid,
        interval=event.interval,
        region=event.region,
        subject=event.subject,
        agent=event.agent,
        run=run,
    )


def _bytes(event: StoredEvent) -> int:
    places = sum(len(place.wkb) for place in (event.region, event.subject) if place is not None)
    payload = 0 if event.payload is None else len(event.payload.data)
    return _ROW + len(msgspec.json.encode(event.features)) + 16 * len(event.parts) + places + payload
