"""Working memory: memory servers, what is committed to them, what is asked of them, and what they answer."""

from __future__ import annotations

from armem_bridge.working.archive import Archive, Evicted, NotKept
from armem_bridge.working.builder import QueryBuilder
from armem_bridge.working.commit import Commit, CommitResult, EntityUpdate, UpdateResult
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.query import Query, QueryTarget
from armem_bridge.working.segments import AddSegment, CoreSegmentDefinition, SegmentResult
from armem_bridge.working.server import MemoryServer
from armem_bridge.working.snapshot import Instance, Snapshot
from armem_bridge.working.tree import CoreSegment, Entity, Memory, ProviderSegment

__all__ = [
    "AddSegment",
    "Archive",
    "Commit",
    "CommitResult",
    "CoreSegment",
    "CoreSegmentDefinition",
    "Entity",
    "EntityUpdate",
    "Evicted",
    "Instance",
    "Memory",
    "MemoryServer",
    "Metadata",
    "NotKept",
    "ProviderSegment",
    "Query",
    "QueryBuilder",
    "QueryTarget",
    "SegmentResult",
    "Snapshot",
    "UpdateResult",
]
