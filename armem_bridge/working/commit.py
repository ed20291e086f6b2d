"""Commits: updates of entities on their way into a memory, and what became of each (section 4.4.3)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import msgspec
from msgspec.structs import force_setattr

from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET


class EntityUpdate(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of an entity at a reference time: the new snapshot with its instances, in their order.

    It is not checked here but by the memory server, update by update, so that one that is wrong does not
    keep the others of its commit from being made.
    """

    entity: MemoryID
    """The entity; a timestamp in the ID is not looked at."""

    instances: tuple[Dict | None, ...]
    referenced: int
    """The time that the data are about, in microseconds."""

    sent: int = NOT_SET
    """When the client sent it, by its own clock; negative where it does not say."""

    confidence: float = 1.0


class Commit(msgspec.Struct, frozen=True, kw_only=True):
    """Updates that are sent together."""

    updates: tuple[EntityUpdate, ...] = ()

    if TYPE_CHECKING:

        def __init__(self, *, updates: Iterable[EntityUpdate] = ...) -> None: ...

    def __post_init__(self) -> None:
        if type(self.updates) is not tuple:
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
