"""Commits: updates of entities on their way into a memory, and what became of each (section 4.4.3)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec.structs import force_setattr

from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET, InvalidMoment, as_moment
from armem_bridge.working.refusals import InvalidCommit


class EntityUpdate(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of an entity at a reference time: the new snapshot with its instances, in their order.

    It is not checked here but by the memory server, update by update, so that one that is wrong does not
    keep the others of its commit from being made.
    """

    entity: MemoryID
    """The entity; a timestamp in the ID is not looked at."""

    instances: tuple[Dict | None, ...]
    referenced: int
    """The time that the data are about, in microseconds; given as a datetime with its zone it is made that."""

    sent: int = NOT_SET
    """When the client sent it, by its own clock; negative where it does not say: then it is the time of the commit.

    Of several versions of a snapshot that one counts which was sent last. An update that is to change nothing
    when it is committed again has a sent time of its own.
    """

    confidence: float = 1.0

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            entity: MemoryID,
            instances: Sequence[Dict | None],
            referenced: int | datetime,
            sent: int | datetime = ...,
            confidence: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if isinstance(self.instances, list):
            force_setattr(self, "instances", tuple(self.instances))
        if type(self.referenced) is not int:
            force_setattr(self, "referenced", _moment(self.referenced))
        if type(self.sent) is not int:
            force_setattr(self, "sent", _moment(self.sent))


def _moment(given: Any) -> Any:
    """A time in microseconds; what is none stays as it is, for the memory server to refuse."""
    try:
        return as_moment(given, what="the time")
    except InvalidMoment:
        return given


class Commit(msgspec.Struct, frozen=True, kw_only=True):
    """Updates that are sent together."""

    updates: tuple[EntityUpdate, ...] = ()

    if TYPE_CHECKING:

        def __init__(self, *, updates: Iterable[EntityUpdate] = ...) -> None: ...

    def __post_init__(self) -> None:
        if type(self.updates) is not tuple:
            if not isinstance(self.updates, Iterable):
                raise InvalidCommit(
                    f"a commit has a list of updates, not {self.updates!r:.80}: put a single one into a list too"
                )
            force_setattr(self, "updates", tuple(self.updates))


class UpdateResult(msgspec.Struct, frozen=True, kw_only=True):
    """What became of one update."""

    success: bool
    error: str = ""
    """Why not, and what to do about it; empty on success."""

    snapshot: MemoryID | None = None
    """The ID of the snapshot, on success."""

    arrived: int
    """When the server had it, by its clock."""


class CommitResult(msgspec.Struct, frozen=True, kw_only=True):
    """What became of a commit: one result for each update, in their order."""

    results: tuple[UpdateResult, ...] = ()

    @property
    def success(self) -> bool:
        """Whether every update was made."""
        return all(result.success for result in self.results)

    @property
    def errors(self) -> tuple[str, ...]:
        """Why the others were not, in their order."""
        return tuple(result.error for result in self.results if not result.success)
