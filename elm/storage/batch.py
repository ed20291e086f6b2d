"""A batch of events made ready to be loaded: sorted into levels, and what needs no database refused."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from uuid import UUID

from elm.event import Event
from elm.storage.encoding import Row
from elm.storage.event_writing import encoder
from elm.storage.names import NameCache
from elm.store import Arrival


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """What is refused already, the rows whose uid stands earlier, the rest by their index, and what encodes them."""

    arrivals: Sequence[Arrival]
    now: datetime
    unknown: Mapping[int, str]
    """Rows that are refused for their type, with the reason: they say nothing of later rows of their uid."""
    doubles: Mapping[int, int]
    """For each row whose uid stands earlier, the first row that has it."""
    rest: Sequence[int]
    heights: Mapping[int, int]
    """Of the rest."""
    encode: Callable[[Arrival], Row]

    def cut(self, start: int, stop: int) -> Batch:
        """The rows from `start` to before `stop`, as a batch of their own."""
        unknown = {index - start: reason for index, reason in self.unknown.items() if start <= index < stop}
        return _sorted(self.arrivals[start:stop], self.now, unknown, self.encode)


def made_ready(arrivals: Sequence[Arrival], names: NameCache) -> Batch:
    """What can be done for a batch without waiting for the database, but for names it has not seen yet."""
    now = datetime.now(UTC)
    types = names.known_type_ids([arrival.event.type for arrival in arrivals])
    unknown = {
        index: f"unknown event type {arrival.event.type!r}: add it first (`elm types add`)"
        for index, arrival in enumerate(arrivals)
        if arrival.event.type not in types
    }
    events = [arrival.event for index, arrival in enumerate(arrivals) if index not in unknown]
    return _sorted(arrivals, now, unknown, encoder(events, names, now))


def _sorted(
    arrivals: Sequence[Arrival], now: datetime, unknown: Mapping[int, str], encode: Callable[[Arrival], Row]
) -> Batch:
    known = [index for index in range(len(arrivals)) if index not in unknown]
    doubles = repeated(arrivals, known)
    rest = [index for index in known if index not in doubles] if doubles else known
    heights = levels([arrivals[index].event for index in rest])
    return Batch(
        arrivals=arrivals,
        now=now,
        unknown=unknown,
        doubles=doubles,
        rest=rest,
        heights=dict(zip(rest, heights, strict=True)),
        encode=encode,
    )


def levels(events: Sequence[Event]) -> list[int]:
    """How many steps each event stands above those of the batch that come before it and are its parts."""
    level: dict[UUID, int] = {}
    found = []
    for event in events:
        height = 1 + max((level.get(part, 0) for part in event.parts), default=-1) if event.parts else 0
        level.setdefault(event.uid, height)
        found.append(height)
    return found


def repeated(arrivals: Sequence[Arrival], rows: Iterable[int]) -> dict[int, int]:
    """Those of some rows whose uid stands earlier among them, each with the first row that has it."""
    first: dict[UUID, int] = {}
    found: dict[int, int] = {}
    for index in rows:
        earlier = first.setdefault(arrivals[index].event.uid, index)
        if earlier != index:
            found[index] = earlier
    return found


def parts_to_come(batch: Batch) -> dict[int, set[UUID]]:
    """For each row of the rest the parts that stand only later in it."""
    place = {batch.arrivals[index].event.uid: index for index in batch.rest}
    found = {
        index: {part for part in batch.arrivals[index].event.parts if place.get(part, -1) > index}
        for index in batch.rest
        if batch.arrivals[index].event.parts
    }
    return {index: parts for index, parts in found.items() if parts}
