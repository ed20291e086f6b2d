"""From updates to snapshots: one update of an entity is one version of a snapshot."""

from __future__ import annotations

from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET
from armem_bridge.working.commit import EntityUpdate
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance, Snapshot


def snapshot_of(update: EntityUpdate, *, arrived: int) -> Snapshot:
    """The snapshot that an admitted update is, all of its instances with the metadata of the update."""
    place = update.entity
    metadata = Metadata(
        confidence=float(update.confidence),
        referenced=update.referenced,
        sent=max(update.sent, NOT_SET),
        arrived=arrived,
    )
    return Snapshot(
        id=MemoryID(
            memory=place.memory,
            core_segment=place.core_segment,
            provider_segment=place.provider_segment,
            entity=place.entity,
            timestamp=update.referenced,
        ),
        instances=tuple([Instance(data=data, metadata=metadata) for data in update.instances]),
    )
