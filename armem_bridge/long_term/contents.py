"""What an elm memory has of ArmarX memories: their names, and the entities that something was consolidated of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from armem_bridge.long_term.mapping import MEMORY, below
from armem_bridge.long_term.source import LongTermSource
from armem_bridge.memory_id import MemoryID
from elm.app import Memory
from elm.errors import MemoryMissing
from elm.query import ByFeature


def memory_names(elm: Memory) -> Sequence[str]:
    """The names of the memories that something was consolidated of."""
    try:
        groups = elm.recall(below(MemoryID())).groups(ByFeature(name=MEMORY))
        return sorted(group.key for group in groups if isinstance(group.key, str) and group.key)
    except MemoryMissing:
        # It comes to be when something is written to it.
        return ()


def entities(elm: Memory, wanted: MemoryID) -> Iterator[MemoryID]:
    """The entities that an ID contains, in order; an entity that it names need not be there."""
    source = LongTermSource(elm)

    def below_of(parent: MemoryID, name: str) -> Sequence[str]:
        return (name,) if name else source.names(parent)

    for name in (wanted.memory,) if wanted.memory else memory_names(elm):
        memory = MemoryID(memory=name)
        for core in below_of(memory, wanted.core_segment):
            core_id = memory.with_core_segment(core)
            for provider in below_of(core_id, wanted.provider_segment):
                provider_id = core_id.with_provider_segment(provider)
                for entity in below_of(provider_id, wanted.entity):
                    yield provider_id.with_entity(entity)
