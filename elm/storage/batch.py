"""A batch of events made ready to be loaded: sorted into levels, and what needs no database refused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from uuid import UUID

from elm.event import Event, content_hash
from elm.storage.encoding import Row
from elm.storage.event_writing import encoder
from elm.storage.names import NameCache
from elm.store import Arrival


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """What is refused already, the rows that repeat an earlier one, the rest by their index, and what encodes it."""

    arrivals: Sequence[Arrival]
    now: datetime
    heights: Sequence[int]
    refused: dict[int, str]
    repeats: set[int]
    rest: Sequence[int]
    encode: Callable[[Arrival], Row]


def made_ready(arrivals: Sequence[Arrival], names: NameCache) -> Batch:
    """What can be done for a batch without waiting for the database, but for names it has not seen yet."""
    now = datetime.now(UTC)
    refused, repeats = repeated(arrivals)
    types = names.known_type_ids([arrival.event.type for arrival in arrivals])
    for index, arrival in enumerate(arrivals):
        if arrival.event.type not in types:
            refused[index] = f"unknown event type {arrival.event.type!r}: add it first (`elm types add`)"
    rest = [index for index in range(len(arrivals)) if index not in refused and index not in repeats]
    return Batch(
        arrivals=arrivals,
        now=now,
        heights=levels([arrival.event for arrival in arrivals]),
        refused=refused,
        repeats=repeats,
        rest=rest,
        encode=encoder([arrivals[index].event for index in rest], names, now),
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


def repeated(arrivals: Sequence[Arrival]) -> tuple[dict[int, str], set[int]]:
    """The rows of a batch whose uid stands earlier in it: those with other content, with a reason, and the rest."""
    first: dict[UUID, Event] = {}
    other: dict[int, str] = {}
    same: set[int] = set()
    for index, arrival in enumerate(arrivals):
        known = first.get(arrival.event.uid)
        if known is None:
            first[arrival.event.uid] = arrival.event
        elif known is arrival.event or content_hash(known) == content_hash(arrival.event):
            same.add(index)
        else:
            other[index] = f"the uid {known.uid} stands earlier with other content: give one of them a new uid"
    return other, same


def parts_to_come(arrivals: Sequence[Arrival]) -> dict[int, set[UUID]]:
    """For each row the parts that stand only later in the batch."""
    place = {arrival.event.uid: index for index, arrival in reversed(list(enumerate(arrivals)))}
    found = {
        index: {part for part in arrival.event.parts if place.get(part, -1) > index}
        for index, arrival in enumerate(arrivals)
        if arrival.event.parts
    }
    return {index: parts for index, parts in found.items() if parts}
