"""An episodic memory in plain sets, straight from Appendix A: what a store must hold after what it was told."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from datetime import datetime
from uuid import UUID

from shapely.geometry import MultiPoint

from elm.cues.algebra import Cue
from elm.cues.match import match
from elm.cues.relations import Kin
from elm.event import Event, StoredEvent
from elm.geometry import Region
from elm.interval import Interval
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at


class Model:
    """A set of events, the sub-event relation, and the types; everything derived is computed when it is asked for.

    It is the `Surroundings` that `match` looks around in, so that `scan` is the full scan by which stores are judged.
    """

    def __init__(self, types: Iterable[EventType], arrivals: Iterable[Arrival] = ()) -> None:
        self.parents = {event_type.name: event_type.parents for event_type in types}
        self.events: dict[UUID, Event] = {}
        self.ids: dict[UUID, int] = {}
        self.recorded: dict[UUID, datetime] = {}
        self.ends: dict[UUID, datetime] = {}
        for number, arrival in enumerate(arrivals, start=1):
            self.commit(arrival, id=number)

    def commit(self, arrival: Arrival, *, id: int) -> None:  # noqa: A002 - the field's name in every format
        """Definition 11: the event and its links are there."""
        uid = arrival.event.uid
        self.events[uid] = arrival.event
        self.ids[uid] = id
        self.recorded[uid] = at(0) if arrival.recorded_at is None else arrival.recorded_at

    def close(self, uid: UUID, end: datetime) -> None:
        """The event is no longer going on."""
        self.ends[uid] = end

    # What a cue asks of the surroundings

    def is_a(self, name: str, ancestor: str) -> bool:
        """Definition 1, reflexive: by going through all parents."""
        return name == ancestor or any(self.is_a(parent, ancestor) for parent in self.parents[name])

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        """Definition 4: the direct relatives, or those and all of theirs."""
        direct = set(self.events[uid].parts) if kin is Kin.PARTS else set(self._wholes(uid))
        if not transitive:
            return direct
        return direct.union(*(self.kin(relative, kin, transitive=True) for relative in direct))

    def _wholes(self, uid: UUID) -> tuple[UUID, ...]:
        return tuple(whole for whole, event in self.events.items() if uid in event.parts)

    # What derives

    def interval(self, uid: UUID) -> Interval:
        """Definition 7: of a complex event from the first begin to the last end; open while a part is."""
        event = self.events[uid]
        if event.parts:
            spans = [self.interval(part) for part in event.parts]
            ends = [one.end for one in spans if one.end is not None]
            return Interval(begin=min(one.begin for one in spans), end=max(ends) if len(ends) == len(spans) else None)
        assert event.interval is not None
        return Interval(begin=event.interval.begin, end=self.ends.get(uid, event.interval.end))

    def place(self, uid: UUID, name: str) -> Region | None:
        """Definition 10: of a complex event the hull of the corners of its parts' places, in their one frame."""
        event = self.events[uid]
        if not event.parts:
            region: Region | None = getattr(event, name)
            return region
        known = [place for part in event.parts if (place := self.place(part, name)) is not None]
        if len({place.frame for place in known}) != 1:
            return None
        corners = [corner for place in known for corner in place.polygon.exterior.coords]
        return Region(polygon=MultiPoint(corners).convex_hull, frame=known[0].frame)

    def agent(self, uid: UUID) -> str | None:
        """The agent given; of a complex event without one, that of all its parts."""
        event = self.events[uid]
        if event.agent is not None or not event.parts:
            return event.agent
        agents = {self.agent(part) for part in event.parts}
        return agents.pop() if len(agents) == 1 else None

    def stored(self, uid: UUID) -> StoredEvent:
        """The event as a store must hold it."""
        event = self.events[uid]
        return StoredEvent(
            id=self.ids[uid],
            uid=uid,
            type=event.type,
            interval=self.interval(uid),
            region=self.place(uid, "region"),
            subject=self.place(uid, "subject"),
            features=event.features,
            agent=self.agent(uid),
            payload=event.payload,
            parts=event.parts,
            wholes=self._wholes(uid),
            recorded_at=self.recorded[uid],
        )

    # Recollection

    def scan(self, cue: Cue) -> list[StoredEvent]:
        """Definition 15: every event that the cue maps to 1, by (begin, id)."""
        every = sorted(map(self.stored, self.events), key=lambda event: (event.interval.begin, event.id))
        return [event for event in every if match(cue, event, self)]


def ids_of(events: Iterable[StoredEvent]) -> list[int]:
    """The ids of events, in order."""
    return [event.id for event in events]


def same_events(found: Sequence[StoredEvent], expected: Sequence[StoredEvent]) -> bool:
    """Whether both are the same events in the same order; the order of an event's wholes means nothing."""
    return list(map(_comparable, found)) == list(map(_comparable, expected))


def _comparable(event: StoredEvent) -> dict[str, object]:
    shown = {name: getattr(event, name) for name in StoredEvent.FIELDS}
    kinds = [(name, type(value), value) for name, value in event.features]
    return {**shown, "features": kinds, "wholes": frozenset(event.wholes)}
