"""Versions of snapshots: the one that an update is, and which of several count."""

from __future__ import annotations

from collections.abc import Iterable

from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET
from armem_bridge.working.commit import EntityUpdate
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance, Snapshot, supersedes


def snapshot_of(update: EntityUpdate, *, arrived: int) -> Snapshot:
    """The snapshot that an admitted update is, all of its instances with the metadata of the update.

    Where the update does not say when it was sent, it counts as sent when it arrived: so of two such
    updates of one snapshot the later one counts.
    """
    place = update.entity
    metadata = Metadata(
        confidence=float(update.confidence),
        referenced=update.referenced,
        sent=update.sent if update.sent >= 0 else max(arrived, NOT_SET),
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


def take_in(found: dict[int, Snapshot], version: Snapshot) -> None:
    """Put a version among those of its entity, by reference times, where none is yet or it counts rather than that."""
    moment = version.id.timestamp
    known = found.get(moment)
    if known is None or supersedes(version, known):
        found[moment] = version


def what_counts(versions: Iterable[Snapshot]) -> list[Snapshot]:
    """Of the versions of an entity's snapshots those that count, one for each reference time, ascending."""
    found: dict[int, Snapshot] = {}
    for version in versions:
        take_in(found, version)
    return [found[moment] for moment in sorted(found)]


def last_of(snapshots: list[Snapshot], count: int) -> list[Snapshot]:
    """The last `count` of these, all where that is negative."""
    return snapshots[max(len(snapshots) - count, 0) :] if count >= 0 else snapshots
