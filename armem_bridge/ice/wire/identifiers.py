"""Memory IDs and times on the wire, in both directions."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, Final

from armem_bridge.ice.making import blank
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import INVALID, NOT_SET

NAMES_KEPT: Final = 512
"""So many IDs of segments and entities are kept ready, in each direction."""


class IdentifierWire:
    """Memory IDs and times to and from those of the loaded slice files.

    Of a time only the microseconds are read: clients write what they like for clock and host. All that are
    written have the clock and host that the slice files begin with, so that equal times are equal keys.
    """

    def __init__(self, words: Vocabulary) -> None:
        self._new_id = blank(
            words.member(words.data, "MemoryID"),
            *("memoryName", "coreSegmentName", "providerSegmentName", "entityName", "timestamp", "instanceIndex"),
        )
        self._new_time = blank(words.member(words.time, "DateTime"), "timeSinceEpoch")
        self._new_duration = blank(words.member(words.time, "Duration"), "microSeconds")
        self._not_set = self._write(INVALID)
        # The same entities and segments are named again and again, and nobody changes an ID.
        self.write_container = lru_cache(NAMES_KEPT)(self.write_parts)
        self._read_container = lru_cache(NAMES_KEPT)(_container)

    def read_time(self, wire: Any) -> int:
        """Microseconds since 1970; negative where the time is not set."""
        micros: int = wire.timeSinceEpoch.microSeconds
        return micros

    def read_duration(self, wire: Any) -> int:
        """Microseconds."""
        micros: int = wire.microSeconds
        return micros

    def write_time(self, moment: int) -> Any:
        """The time of a moment; what ArmarX has for none where it is not set."""
        if moment < 0:
            return self._not_set
        return self._write(moment)

    def write_duration(self, micros: int) -> Any:
        """So many microseconds."""
        made = self._new_duration()
        made.microSeconds = micros
        return made

    def _write(self, moment: int) -> Any:
        duration = self._new_duration()
        duration.microSeconds = moment
        made = self._new_time()
        made.timeSinceEpoch = duration
        return made

    def read_id(self, wire: Any) -> MemoryID:
        """The ID. Raises `InvalidMemoryID` for names that are none."""
        moment, instance = wire.timestamp.timeSinceEpoch.microSeconds, wire.instanceIndex
        names = (wire.memoryName, wire.coreSegmentName, wire.providerSegmentName, wire.entityName)
        if moment < 0 and instance < 0:
            return self._read_container(*names)
        memory, core, provider, entity = names
        return MemoryID(
            memory=memory,
            core_segment=core,
            provider_segment=provider,
            entity=entity,
            timestamp=moment,
            instance=instance,
        )

    def write_id(self, name: MemoryID) -> Any:
        """The ID as the slice files have it."""
        moment = name.timestamp
        if moment < 0 and name.instance < 0:
            return self.write_container(name.memory, name.core_segment, name.provider_segment, name.entity)
        time = self.write_time(moment)
        return self.write_parts(name.memory, name.core_segment, name.provider_segment, name.entity, time, name.instance)

    def write_parts(
        self, memory: str, core: str = "", provider: str = "", entity: str = "", time: Any = None, instance: int = -1
    ) -> Any:
        """An ID from its parts, the time as the slice files have it."""
        made = self._new_id()
        made.memoryName = memory
        made.coreSegmentName = core
        made.providerSegmentName = provider
        made.entityName = entity
        made.timestamp = self._not_set if time is None else time
        made.instanceIndex = instance
        return made


def _container(memory: str, core: str, provider: str, entity: str) -> MemoryID:
    return MemoryID(memory=memory, core_segment=core, provider_segment=provider, entity=entity)


def not_set(moment: int) -> int:
    """A moment as the bridge has it: all that are not set are one."""
    return moment if moment >= 0 else NOT_SET
