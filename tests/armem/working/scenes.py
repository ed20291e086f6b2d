"""What the tests of working memory share: a memory of objects, updates in short, and what can be compared."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit, CoreSegmentDefinition, EntityUpdate, Memory, MemoryServer, Snapshot
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance

CORES = ("Class", "Instance", "a/b ü")
"""The core segments of the memory."""

MEMORY = MemoryID(memory="Object")
CUP = MemoryID(memory="Object", core_segment="Instance", provider_segment="ObjectLocalizer", entity="blue-cup")

NOW = 1_000_000_000
"""What the clock of the servers says, where nobody sets it."""


def object_memory(**options: Any) -> MemoryServer:
    """A memory server with untyped core segments, whose clock stands still."""
    return MemoryServer(
        "Object", [CoreSegmentDefinition(name=name) for name in CORES], **{"clock": lambda: NOW} | options
    )


def data(value: object) -> Dict:
    """A data object with one value."""
    found = to_aron({"value": value})
    assert isinstance(found, Dict)
    return found


def update(
    moment: int, value: object = 0, *, entity: MemoryID = CUP, sent: int = -1, confidence: float = 1.0
) -> EntityUpdate:
    """An update with one instance."""
    return EntityUpdate(entity=entity, instances=(data(value),), referenced=moment, sent=sent, confidence=confidence)


def commit(server: MemoryServer, *updates: EntityUpdate) -> None:
    """Commit updates that are all fine."""
    result = server.commit(Commit(updates=updates))
    assert result.success, result.errors


def snapshot(moment: int, value: object = 0, *, entity: MemoryID = CUP, sent: int = -1, arrived: int = NOW) -> Snapshot:
    """The snapshot that an update makes of itself."""
    metadata = Metadata(referenced=moment, sent=sent, arrived=arrived)
    return Snapshot(id=entity.with_timestamp(moment), instances=(Instance(data=data(value), metadata=metadata),))


def moments(memory: Memory, entity: MemoryID = CUP) -> list[int]:
    """The reference times of an entity in a result, in its order."""
    found = memory.entity(entity)
    assert found is not None
    return list(found.history)


def contents(memory: Memory) -> dict[str, dict[str, dict[str, list[Snapshot]]]]:
    """A result as plain dicts of lists."""
    return {
        core: {
            provider: {name: list(entity.history.values()) for name, entity in segment.entities.items()}
            for provider, segment in each.provider_segments.items()
        }
        for core, each in memory.core_segments.items()
    }


def timeless(snapshots: Iterable[Snapshot]) -> list[tuple[MemoryID, Sequence[object]]]:
    """Snapshots without the times at which they arrived."""
    return [
        (
            each.id,
            [
                (instance.data, instance.metadata.confidence, instance.metadata.referenced, instance.metadata.sent)
                for instance in each.instances
            ],
        )
        for each in snapshots
    ]
