"""The containers of a memory: core segments, provider segments, entities and their snapshots, by their names."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.snapshot import Instance, Snapshot


class Entity(msgspec.Struct, frozen=True, kw_only=True):
    """A concept or a thing that changes over time: its snapshots by reference time, ascending."""

    id: MemoryID
    history: dict[int, Snapshot] = {}

    @property
    def latest(self) -> Snapshot | None:
        """The snapshot with the greatest reference time that is here."""
        return next(reversed(self.history.values()), None)

    def snapshots(self) -> Iterator[Snapshot]:
        """All snapshots, ascending by reference time."""
        return iter(self.history.values())


class ProviderSegment(msgspec.Struct, frozen=True, kw_only=True):
    """The name space of one provider in a core segment; its type, if any, extends the core segment's."""

    id: MemoryID
    aron_type: TypeObject | None = None
    entities: dict[str, Entity] = {}

    def snapshots(self) -> Iterator[Snapshot]:
        """All snapshots, entity by entity."""
        for entity in self.entities.values():
            yield from entity.snapshots()


class CoreSegment(msgspec.Struct, frozen=True, kw_only=True):
    """The data of one modality in a memory, which the memory server defines; they may have one type."""

    id: MemoryID
    aron_type: TypeObject | None = None
    provider_segments: dict[str, ProviderSegment] = {}

    def snapshots(self) -> Iterator[Snapshot]:
        """All snapshots, entity by entity."""
        for provider in self.provider_segments.values():
            yield from provider.snapshots()


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """A memory, or the part of one that a query asked for: only what was asked for is there."""

    id: MemoryID
    core_segments: dict[str, CoreSegment] = {}

    def entities(self) -> Iterator[Entity]:
        """All entities, segment by segment."""
        for core in self.core_segments.values():
            for provider in core.provider_segments.values():
                yield from provider.entities.values()

    def snapshots(self) -> Iterator[Snapshot]:
        """All snapshots, entity by entity, those of one entity ascending by reference time."""
        for core in self.core_segments.values():
            yield from core.snapshots()

    def instances(self) -> Iterator[tuple[MemoryID, Instance]]:
        """All instances with their IDs."""
        for snapshot in self.snapshots():
            for index, instance in enumerate(snapshot.instances):
                yield snapshot.instance_id(index), instance

    def entity(self, entity: MemoryID) -> Entity | None:
        """The entity of an ID, where it is here."""
        core = self.core_segments.get(entity.core_segment)
        provider = core.provider_segments.get(entity.provider_segment) if core is not None else None
        return provider.entities.get(entity.entity) if provider is not None else None
