"""History limits: how many snapshots working memory keeps of an entity, set where one likes (section 4.5.1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from armem_bridge.memory_id import Level, MemoryID
from armem_bridge.working.refusals import InvalidServer

UNLIMITED: Final = -1
"""As a limit: no limit here, whatever one is set further up."""


class HistoryLimits:
    """The greatest number of snapshots of each entity, by the ID of an entity, a segment or the memory.

    The limit set closest to the entity holds for it; without any its history is not limited. Over the
    limit the snapshot with the oldest reference time goes first, so one that comes late into a full
    history leaves at once.
    """

    def __init__(self, limits: Mapping[MemoryID, int]) -> None:
        for where, limit in limits.items():
            if not isinstance(where, MemoryID):
                raise InvalidServer(
                    f"a history limit is set by a MemoryID, not by {where!r:.80}: make text one with MemoryID.parse"
                )
            if where != where.entity_id or where.has_gap:
                raise InvalidServer(f"a history limit is set for an entity, a segment or a memory, not for {where}")
            if type(limit) is not int or not (limit >= 1 or limit == UNLIMITED):
                raise InvalidServer(f"the history limit of {where} is 1 or more, or -1 for none, not {limit!r:.80}")
        self._limits = dict(limits)

    def of(self, entity: MemoryID) -> int | None:
        """The limit of an entity, None for none."""
        if not self._limits:
            return None
        for level in reversed(Level):
            limit = self._limits.get(entity.cut(level))
            if limit is not None:
                return None if limit == UNLIMITED else limit
        return None
