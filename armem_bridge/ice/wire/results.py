"""Results of queries on the wire, in both directions: the same tree, with what was found."""

from __future__ import annotations

from typing import Any

from armem_bridge.ice.making import blank, first_member
from armem_bridge.ice.refusals import RemoteFailure
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire.aron import AronWire
from armem_bridge.ice.wire.identifiers import IdentifierWire, not_set
from armem_bridge.moments import NOT_SET
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance, Snapshot
from armem_bridge.working.tree import CoreSegment, Entity, Memory, ProviderSegment


class ResultWire:
    """Results of queries to and from those of the loaded slice files.

    Histories are written in order of time, which clients rely on. Types of segments are not written: the
    members of ArmarX's type objects are not known, and no released client reads them.
    """

    def __init__(self, words: Vocabulary, aron: AronWire, identifiers: IdentifierWire) -> None:
        self._aron, self._ids = aron, identifiers
        data = words.data
        self._new_result = blank(words.member(words.query, "Result"), "success", "errorMessage", "memory")
        self._new_memory = blank(words.member(data, "Memory"), "id", "coreSegments")
        self._new_core = blank(words.member(data, "CoreSegment"), "id", "providerSegments")
        self._new_provider = blank(words.member(data, "ProviderSegment"), "id", "entities")
        self._new_entity = blank(words.member(data, "Entity"), "id", "history")
        self._new_snapshot = blank(words.member(data, "EntitySnapshot"), "id", "instances")
        self._new_instance = blank(words.member(data, "EntityInstance"), "id", "data", "metadata")
        metadata = words.metadata
        self._referenced = first_member(metadata, "referencedTime", "timeReferenced", "timeCreated")
        self._sent = first_member(metadata, "sentTime", "timeSent")
        self._arrived = first_member(metadata, "arrivedTime", "timeArrived")
        self._new_metadata = blank(metadata, "confidence")

    # Writing

    def write(self, memory: Memory) -> Any:
        """A successful result."""
        name = memory.id.memory
        found = self._new_memory()
        found.id = self._ids.write_container(name)
        found.coreSegments = {key: self._write_core(core, name) for key, core in memory.core_segments.items()}
        made = self._new_result()
        made.success, made.errorMessage, made.memory = True, "", found
        return made

    def write_failure(self, memory: str, why: str) -> Any:
        """A failed result; clients want a memory in it all the same."""
        empty = self._new_memory()
        empty.id, empty.coreSegments = self._ids.write_container(memory), {}
        made = self._new_result()
        made.success, made.errorMessage, made.memory = False, why, empty
        return made

    def _write_core(self, core: CoreSegment, memory: str) -> Any:
        name = core.id.core_segment
        made = self._new_core()
        made.id = self._ids.write_container(memory, name)
        made.providerSegments = {
            key: self._write_provider(provider, memory, name) for key, provider in core.provider_segments.items()
        }
        return made

    def _write_provider(self, provider: ProviderSegment, memory: str, core: str) -> Any:
        name = provider.id.provider_segment
        made = self._new_provider()
        made.id = self._ids.write_container(memory, core, name)
        made.entities = {
            key: self._write_entity(entity, memory, core, name) for key, entity in provider.entities.items()
        }
        return made

    def _write_entity(self, entity: Entity, memory: str, core: str, provider: str) -> Any:
        ids = self._ids
        name = entity.id.entity
        history = {}
        for moment, snapshot in entity.history.items():
            time = ids.write_time(moment)
            wire = history[time] = self._new_snapshot()
            wire.id = ids.write_parts(memory, core, provider, name, time)
            wire.instances = instances = []
            for index, instance in enumerate(snapshot.instances):
                each = self._new_instance()
                each.id = ids.write_parts(memory, core, provider, name, time, index)
                each.data = self._aron.write(instance.data)
                each.metadata = self._write_metadata(instance.metadata, moment, time)
                instances.append(each)
        made = self._new_entity()
        made.id = ids.write_container(memory, core, provider, name)
        made.history = history
        return made

    def _write_metadata(self, metadata: Metadata, moment: int, time: Any) -> Any:
        write = self._ids.write_time
        made = self._new_metadata()
        made.confidence = metadata.confidence
        if self._referenced is not None:
            setattr(made, self._referenced, time if metadata.referenced == moment else write(metadata.referenced))
        if self._sent is not None:
            setattr(made, self._sent, write(metadata.sent))
        if self._arrived is not None:
            setattr(made, self._arrived, write(metadata.arrived))
        return made

    # Reading

    def read(self, wire: Any) -> Memory:
        """What was found. Raises `RemoteFailure` with the server's message where it failed."""
        if not wire.success:
            raise RemoteFailure(f"the memory server refuses the query: {wire.errorMessage or 'it does not say why'}")
        memory = wire.memory
        cores = {name: self._read_core(core) for name, core in memory.coreSegments.items()}
        return Memory(id=self._ids.read_id(memory.id), core_segments=cores)

    def _read_core(self, wire: Any) -> CoreSegment:
        providers = {name: self._read_provider(provider) for name, provider in wire.providerSegments.items()}
        return CoreSegment(id=self._ids.read_id(wire.id), provider_segments=providers)

    def _read_provider(self, wire: Any) -> ProviderSegment:
        entities = {name: self._read_entity(entity) for name, entity in wire.entities.items()}
        return ProviderSegment(id=self._ids.read_id(wire.id), entities=entities)

    def _read_entity(self, wire: Any) -> Entity:
        time = self._ids.read_time
        history = {time(key): snapshot for key, snapshot in wire.history.items()}
        return Entity(
            id=self._ids.read_id(wire.id),
            history={moment: self._read_snapshot(history[moment]) for moment in sorted(history)},
        )

    def _read_snapshot(self, wire: Any) -> Snapshot:
        return Snapshot(
            id=self._ids.read_id(wire.id),
            instances=tuple(
                [
                    Instance(data=self._aron.read(each.data), metadata=self._read_metadata(each.metadata))
                    for each in wire.instances
                ]
            ),
        )

    def _read_metadata(self, wire: Any) -> Metadata:
        if wire is None:
            return Metadata()
        return Metadata(
            confidence=wire.confidence,
            referenced=self._read_member(wire, self._referenced),
            sent=self._read_member(wire, self._sent),
            arrived=self._read_member(wire, self._arrived),
        )

    def _read_member(self, wire: Any, name: str | None) -> int:
        return not_set(getattr(wire, name).timeSinceEpoch.microSeconds) if name is not None else NOT_SET
