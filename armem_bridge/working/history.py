"""The ports that queries are answered through: the snapshots of an entity in order of time, and where they are.

Working memory, long-term memory and their union stand behind these two, so that a query means the same
whoever answers it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.snapshot import Snapshot


class History(Protocol):
    """The snapshots of one entity, at most one for each reference time; whatever is returned ascends by it.

    A negative `count` means all there are. Moments are microseconds, 0 or greater.
    """

    def all(self) -> Sequence[Snapshot]:
        """Every snapshot."""

    def latest(self, count: int) -> Sequence[Snapshot]:
        """The `count` snapshots with the greatest reference times."""

    def before(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` last snapshots strictly before `moment`."""

    def after(self, moment: int, count: int) -> Sequence[Snapshot]:
        """The `count` first snapshots strictly after `moment`, which may be -1."""

    def between(self, begin: int, end: int) -> Sequence[Snapshot]:
        """The snapshots from `begin` to `end`, both included."""

    def at(self, moment: int) -> Snapshot | None:
        """The snapshot with exactly this reference time."""

    def index_range(self, first: int, last: int) -> Sequence[Snapshot]:
        """The snapshots from position `first` to `last`, both included: `index_slice` says what they are."""


class Source(Protocol):
    """What a memory has, level by level; `armem_bridge.working.evaluation` asks it what a query needs."""

    def names(self, parent: MemoryID) -> Sequence[str]:
        """The names one level below a memory, core segment or provider segment, in their order; none if unknown."""

    def knows(self, name: MemoryID) -> bool:
        """Whether there is such a core segment, provider segment or entity."""

    def segment_type(self, segment: MemoryID) -> TypeObject | None:
        """The type of a core or provider segment, where it has one of its own."""

    def history(self, entity: MemoryID) -> History:
        """The snapshots of an entity: of several versions of one that which counts (`snapshot.supersedes`)."""


def index_slice(first: int, last: int, count: int) -> slice:
    """The slice of `count` snapshots that an index range means.

    Position 0 is the earliest, -1 the latest, as in Python; both ends are included, and positions beyond
    either end only cut the range short.
    """
    begin = first if first >= 0 else max(count + first, 0)
    end = last if last >= 0 else count + last
    return slice(begin, max(end + 1, 0))


def read_index_range(history: History, first: int, last: int) -> Sequence[Snapshot]:
    """An index range of a history that can be read from both ends: what one end tells is not read from the other."""
    if first < 0 and last < 0:
        candidates = history.latest(-first)
    elif first >= 0 and last >= 0:
        candidates = history.after(-1, last + 1)
    else:
        candidates = history.all()
    return candidates[index_slice(first, last, len(candidates))]
