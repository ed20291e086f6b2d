"""Tombstones: what a memory keeps of events that it has forgotten."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from uuid import UUID

from elm.errors import InvalidValue
from elm.geometry import Region
from elm.interval import Interval, as_utc
from elm.text import check_short_name


@dataclass(frozen=True, slots=True, kw_only=True)
class Tombstone:
    """A forgotten event that is a part of one that remains: its uid and its extents, by which it still counts.

    It has ended. `run` is the forgetting it fell to, `id` the number that the memory gave to the event, 0 where
    that is not known; neither says what was forgotten, so tombstones are compared without them.
    """

    uid: UUID
    interval: Interval
    region: Region | None = None
    subject: Region | None = None
    agent: str | None = None
    run: UUID = field(compare=False)
    id: int = field(default=0, compare=False)

    def __post_init__(self) -> None:
        if self.interval.is_open:
            raise InvalidValue(f"event {self.uid} cannot have been forgotten while it was going on: close it first")
        if self.agent is not None:
            object.__setattr__(self, "agent", check_short_name(self.agent, what="the agent of a tombstone"))


@dataclass(frozen=True, slots=True, kw_only=True)
class RunTombstone:
    """What is left of the other events of one forgetting: how many, from when to when, and where, frame by frame.

    `at` is when the forgetting began. `interval` spans those of the events, None where there were none; `regions`
    and `subjects` are the convex hulls of theirs, one for each frame.
    """

    run: UUID
    at: datetime
    events: int
    interval: Interval | None = None
    regions: tuple[Region, ...] = ()
    subjects: tuple[Region, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "at", as_utc(self.at, what="the time of a forgetting"))
        if isinstance(self.events, bool) or not isinstance(self.events, int) or not 0 <= self.events < 2**63:
            raise InvalidValue(f"a forgetting tells of a number of events, not of {self.events!r}")
        if (self.interval is None) != (self.events == 0):
            raise InvalidValue(f"the forgetting {self.run} tells of events and their interval, or of neither")
        if self.interval is not None and self.interval.is_open:
            raise InvalidValue(f"the events of the forgetting {self.run} had ended: its interval has an end")
        for name in ("regions", "subjects"):
            places = tuple(sorted(getattr(self, name), key=lambda place: place.frame))
            if len({place.frame for place in places}) < len(places):
                raise InvalidValue(f"the {name} of the forgetting {self.run} are one hull for each frame")
            object.__setattr__(self, name, places)


@dataclass(frozen=True, slots=True, kw_only=True)
class Forgotten:
    """What forgetting some events did, or would do: counts, and the bytes that they took, roughly.

    Of the `events` that went, `tombstones` are parts of remaining ones; `dissolved` are tombstones of earlier
    runs that went because no remaining event has them as a part any more. `still_open` were not forgotten.
    `types` counts the events by type.
    """

    events: int = 0
    tombstones: int = 0
    dissolved: int = 0
    still_open: int = 0
    bytes: int = 0
    types: Mapping[str, int] = field(default_factory=dict)


# What both stores say


def other_tombstone(given: Tombstone | RunTombstone) -> str:
    """Why a tombstone is not kept where there is one of its name that says something else."""
    if isinstance(given, Tombstone):
        return f"the memory knows other extents of the forgotten event {given.uid}: the two are not of one event"
    return f"the memory knows the forgetting {given.run} otherwise: the two were exported at different times"


def still_counts(uid: UUID) -> str:
    """Why an event is refused whose uid has a tombstone."""
    return (
        f"event {uid} was forgotten and still counts as a part of another event: it cannot be committed again, "
        f"use a new uid"
    )
