"""Where the store in this process finds events: by id, in order of time, by place and by kin, as one fixed view."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from uuid import UUID

from rtree.index import Index
from sortedcontainers import SortedKeyList

from elm.cues.algebra import Cue, KinCue, RegionCue, TypeCue, UidCue
from elm.cues.match import match
from elm.cues.relations import Kin, Place, SetRelation
from elm.event import StoredEvent
from elm.geometry import SpatialRelation
from elm.interval import to_micros
from elm.query import Cursor, Nearest, Order, Query
from elm.storage.hints import conditions, conjuncts
from elm.storage.memory_events import changed
from elm.taxonomy import Taxonomy
from elm.tombstone import Tombstone

Position = tuple[int, int]
"""Begin in microseconds and id: the order of time."""

_MARGIN = 1e-6
"""Metres by which a search box is widened, so that rounding a distance never loses a candidate."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Kinship:
    """Who is part of whom, among the given events by id, and the wholes of tombstones; `ids` may know more than those.

    A tombstone is a part that has no parts.
    """

    events: Mapping[int, StoredEvent]
    ids: Mapping[UUID, int]
    forgotten: Mapping[UUID, tuple[UUID, ...]]

    def of(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        """The direct parts or wholes of an event, or all of Def 4 when transitive."""
        direct = self._direct(uid, kin)
        if not transitive:
            return frozenset(direct)
        found: set[UUID] = set()
        waiting = [*direct]
        while waiting:
            relative = waiting.pop()
            if relative not in found:
                found.add(relative)
                waiting += self._direct(relative, kin)
        return found

    def _direct(self, uid: UUID, kin: Kin) -> tuple[UUID, ...]:
        if uid in self.forgotten:
            return () if kin is Kin.PARTS else self.forgotten[uid]
        event = self.events[self.ids[uid]]
        return event.parts if kin is Kin.PARTS else event.wholes


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """The candidates for one query as the memory stood at one moment, and what judging them takes."""

    cue: Cue
    candidates: list[StoredEvent]
    descendants: Mapping[str, Set[str]]
    kinship: Kinship

    def __iter__(self) -> Iterator[StoredEvent]:
        """The candidates that match, in their order."""
        return self.matching(self.candidates)

    def matching(self, events: list[StoredEvent]) -> Iterator[StoredEvent]:
        """Those of `events` that match the cue."""
        return (event for event in events if match(self.cue, event, self))

    def is_a(self, name: str, ancestor: str) -> bool:
        """Whether the type `name` is `ancestor` or a sub-type of it."""
        return name in self.descendants[ancestor]

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        """The direct parts or wholes of an event, or all of Def 4 when transitive."""
        return self.kinship.of(uid, kin, transitive=transitive)


class EventIndex:
    """The events of a memory by id, uid, begin and place, and its tombstones. Not locked: its store does that.

    Ids are given from 1 without gaps; none is given twice.
    """

    def __init__(self) -> None:
        self.events: dict[int, StoredEvent] = {}
        self.ids: dict[UUID, int] = {}
        self.tombstones: dict[UUID, Tombstone] = {}
        self._wholes_of_tombstones: dict[UUID, tuple[UUID, ...]] = {}
        self.ids_given = 0
        self._positions = SortedKeyList(key=self._position)
        self._places: dict[tuple[str, Place], Index] = {}
        self._placed: Counter[tuple[str, Place]] = Counter()

    def __contains__(self, uid: object) -> bool:
        return uid in self.ids

    def __getitem__(self, uid: UUID) -> StoredEvent:
        return self.events[self.ids[uid]]

    def __len__(self) -> int:
        return len(self.events)

    @property
    def frames(self) -> set[str]:
        """The frames that regions and subjects are in."""
        return {frame for frame, place in self._places if self._placed[frame, place]}

    def next_id(self) -> int:
        """An id that nothing has had yet."""
        self.ids_given += 1
        return self.ids_given

    def add(self, event: StoredEvent) -> None:
        """Take in a new event."""
        self.ids_given = max(self.ids_given, event.id)
        self.events[event.id] = event
        self.ids[event.uid] = event.id
        self._positions.add(event.id)
        for place, region in ((Place.REGION, event.region), (Place.SUBJECT, event.subject)):
            if region is not None:
                if (region.frame, place) not in self._places:
                    self._places[region.frame, place] = Index()
                self._places[region.frame, place].insert(event.id, region.polygon.bounds)
                self._placed[region.frame, place] += 1

    def link(self, part: UUID, whole: UUID) -> None:
        """Note that a part, or a tombstone, is one of a whole."""
        if part in self.tombstones:
            self._wholes_of_tombstones[part] = (*self._wholes_of_tombstones[part], whole)
        else:
            known = self[part]
            self.replace(changed(known, wholes=(*known.wholes, whole)))

    def unlink(self, part: UUID, whole: UUID) -> None:
        """Note that a part, or a tombstone, is one of a whole no more."""
        if part in self.tombstones:
            wholes = self._wholes_of_tombstones[part]
            self._wholes_of_tombstones[part] = tuple(each for each in wholes if each != whole)
        else:
            known = self[part]
            self.replace(changed(known, wholes=tuple(each for each in known.wholes if each != whole)))

    def remove(self, uid: UUID) -> None:
        """Let go of an event."""
        event = self[uid]
        self._positions.remove(event.id)
        for place, region in ((Place.REGION, event.region), (Place.SUBJECT, event.subject)):
            if region is not None:
                self._places[region.frame, place].delete(event.id, region.polygon.bounds)
                self._placed[region.frame, place] -= 1
        del self.events[event.id], self.ids[uid]

    def bury(self, tombstone: Tombstone, wholes: tuple[UUID, ...]) -> None:
        """Take in the tombstone of an event that is a part of these."""
        self.tombstones[tombstone.uid] = tombstone
        self._wholes_of_tombstones[tombstone.uid] = wholes

    def dissolve(self, uid: UUID) -> None:
        """Let go of a tombstone."""
        del self.tombstones[uid], self._wholes_of_tombstones[uid]

    def wholes_of_tombstone(self, uid: UUID) -> tuple[UUID, ...]:
        """The events that have a tombstone as their part."""
        return self._wholes_of_tombstones[uid]

    def part(self, uid: UUID) -> StoredEvent | Tombstone:
        """What counts as a part: an event or a tombstone."""
        return self.tombstones[uid] if uid in self.tombstones else self[uid]

    def replace(self, event: StoredEvent) -> None:
        """Put `event` for the one with its id; neither its begin nor its places differ."""
        self.events[event.id] = event

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        """The direct parts or wholes of an event, or all of Def 4 when transitive."""
        known = Kinship(events=self.events, ids=self.ids, forgotten=self._wholes_of_tombstones)
        return known.of(uid, kin, transitive=transitive)

    def view(self, query: Query, taxonomy: Taxonomy) -> View:
        """The candidates for `query` in its order (by id for the nearest); unknown types in its cue are refused."""
        named = list(conditions(query.cue))
        descendants = {cue.type: taxonomy.descendants(cue.type) for cue in named if isinstance(cue, TypeCue)}
        asks_for_kin = any(isinstance(cue, KinCue) for cue in named)
        order = Order.ID if isinstance(query.order, Nearest) else query.order
        return View(
            cue=query.cue,
            candidates=[self.events[number] for number in self._ordered(self._narrowed(query.cue), order, query.after)],
            descendants=descendants,
            kinship=self._kinship() if asks_for_kin else Kinship(events={}, ids={}, forgotten={}),
        )

    def _kinship(self) -> Kinship:
        """Who is part of whom, as it is now."""
        return Kinship(events=self.events.copy(), ids=self.ids.copy(), forgotten=self._wholes_of_tombstones.copy())

    def _position(self, number: int) -> Position:
        return to_micros(self.events[number].interval.begin), number

    def _ordered(self, numbers: Set[int] | None, order: Order, after: Cursor | None) -> Iterator[int]:
        """`numbers` (None: all) beyond the cursor, in order."""
        if order is Order.ID:
            start = 0 if after is None else after.id
            return (number for number in sorted(self.events if numbers is None else numbers) if number > start)
        chosen = self._positions if numbers is None else SortedKeyList(numbers, key=self._position)
        bound = None if after is None else (to_micros(after.begin), after.id)
        if order is Order.BEGIN:
            found: Iterator[int] = chosen.irange_key(min_key=bound, inclusive=(False, True))
        else:
            found = chosen.irange_key(max_key=bound, inclusive=(True, False), reverse=True)
        return found

    def _narrowed(self, cue: Cue) -> Set[int] | None:
        """Ids among which all matches are; None where no index tells."""
        known = [found for part in conjuncts(cue) if (found := self._candidates(part)) is not None]
        return set.intersection(*known) if known else None

    def _candidates(self, cue: Cue) -> set[int] | None:
        if isinstance(cue, UidCue):
            return {self.ids[uid] for uid in cue.uids if uid in self.ids}
        if isinstance(cue, RegionCue) and cue.relation is not SpatialRelation.DISJOINT:
            return self._near(cue)
        if isinstance(cue, KinCue) and cue.uids:
            return self._relatives(cue)
        return None

    def _near(self, cue: RegionCue) -> set[int]:
        tree = self._places.get((cue.region.frame, cue.place))
        if tree is None:
            return set()
        wider = _MARGIN + (cue.distance or 0.0)
        xmin, ymin, xmax, ymax = cue.region.polygon.bounds
        return set(tree.intersection((xmin - wider, ymin - wider, xmax + wider, ymax + wider)))

    def _relatives(self, cue: KinCue) -> set[int] | None:
        """The relatives, seen from the uids of the cue, of which a match must be one."""
        if cue.relation in (SetRelation.SUBSET, SetRelation.DISJOINT):
            return None
        known = [uid for uid in cue.uids if uid in self.ids or uid in self.tombstones]
        if cue.relation is not SetRelation.INTERSECTS and len(known) < len(cue.uids):
            return set()
        back = Kin.WHOLES if cue.kin is Kin.PARTS else Kin.PARTS
        found = [
            {self.ids[relative] for relative in self.kin(uid, back, transitive=cue.transitive) if relative in self.ids}
            for uid in known
        ]
        return set().union(*found) if cue.relation is SetRelation.INTERSECTS else set.intersection(*found)
