"""Snapshots: what was known of an entity at one reference time, and which of two versions of one counts."""

from __future__ import annotations

import hashlib
import struct

import msgspec

from armem_bridge.aron.binary import encode
from armem_bridge.aron.content import content_hash
from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import GREATEST, NOT_SET
from armem_bridge.working.metadata import Metadata

_DOUBLE = struct.Struct("<d")


class Instance(msgspec.Struct, frozen=True, kw_only=True):
    """One data object of a snapshot: several grasps of one object, the images of a stereo camera."""

    data: Dict | None
    """What is known; None where it was asked for without data, or where the client sent null."""

    metadata: Metadata


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """An entity at one reference time, which is the timestamp of its ID. It may have no instances at all.

    Snapshots are values: what a query gives is what the memory holds, shared and never copied.
    """

    id: MemoryID
    instances: tuple[Instance, ...] = ()

    @property
    def referenced(self) -> int:
        """The reference time."""
        return self.id.timestamp

    @property
    def sent(self) -> int:
        """When it was sent; not set for a snapshot without instances, which have the metadata."""
        return max([NOT_SET, *(instance.metadata.sent for instance in self.instances)])

    def without_data(self) -> Snapshot:
        """The same with null data in every instance."""
        return Snapshot(
            id=self.id,
            instances=tuple(Instance(data=None, metadata=instance.metadata) for instance in self.instances),
        )

    def instance_id(self, index: int) -> MemoryID:
        """The ID of the instance at a position."""
        return self.id.with_instance(index)


def snapshot_hash(snapshot: Snapshot) -> bytes:
    """32 bytes over the data and the confidence of all instances: two versions of a snapshot differ in it."""
    digest = hashlib.sha256()
    for instance in snapshot.instances:
        digest.update(content_hash(instance.data))
        digest.update(_DOUBLE.pack(instance.metadata.confidence + 0.0))
    return digest.digest()


def supersedes(one: Snapshot, other: Snapshot) -> bool:
    """Whether version `one` of a snapshot counts rather than version `other` of it; of equal ones neither does.

    Of several versions that one counts which was sent last; of those sent at the same time, or all at no
    known time, the one with the greater hash. So it does not matter in which order they arrive. A snapshot
    without instances has no time of sending, and gives way to any that has one.
    """
    if one is other:
        return False
    mine, others = one.sent, other.sent
    if mine != others:
        return mine > others
    return not _same(one, other) and snapshot_hash(one) > snapshot_hash(other)


def _same(one: Snapshot, other: Snapshot) -> bool:
    """Whether two versions are surely the same, found out faster than by two hashes: most that meet are."""
    return len(one.instances) == len(other.instances) and all(
        mine.metadata.confidence == others.metadata.confidence
        and encode(mine.data, limit=GREATEST) == encode(others.data, limit=GREATEST)
        for mine, others in zip(one.instances, other.instances, strict=True)
    )
