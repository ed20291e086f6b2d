"""What a complex event has from its parts: its interval, their agent, and the order in which their places count."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from elm.event import StoredEvent
from elm.interval import Interval
from elm.tombstone import Tombstone

Part = TypeVar("Part", bound=StoredEvent | Tombstone)


def span(intervals: Iterable[Interval]) -> Interval:
    """From the first begin to the last end; open when one of them is (Def 7)."""
    known = list(intervals)
    ends = [interval.end for interval in known if interval.end is not None]
    begin = min(interval.begin for interval in known)
    return Interval(begin=begin, end=max(ends) if len(ends) == len(known) else None)


def common_agent(parts: Iterable[StoredEvent | Tombstone]) -> str | None:
    """The agent of all parts; None where they have several, or none."""
    agents = {part.agent for part in parts}
    return agents.pop() if len(agents) == 1 else None


def in_uid_order(parts: Iterable[Part]) -> list[Part]:
    """The parts as `derived_region` is to be given their places, so that everybody finds the same digits."""
    return sorted(parts, key=lambda part: part.uid)
