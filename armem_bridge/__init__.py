"""ArmarX-style robot memory on top of elm: memory servers that are committed to and queried, and what they keep.

`armem_bridge.ice`, the edge for ArmarX's own clients, needs Ice and is imported only where it is asked for.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from armem_bridge.config import Configuration, read_config
    from armem_bridge.errors import ArmemError
    from armem_bridge.long_term import LongTermMemory, recall_snapshots, snapshots_cue
    from armem_bridge.memory_id import MemoryID
    from armem_bridge.names import MemoryNameSystem
    from armem_bridge.profiles import PROFILES
    from armem_bridge.service import Service
    from armem_bridge.working import (
        AddSegment,
        Commit,
        CommitResult,
        CoreSegmentDefinition,
        EntityUpdate,
        Instance,
        Memory,
        MemoryServer,
        Query,
        QueryBuilder,
        QueryTarget,
        Snapshot,
    )

__all__ = [
    "PROFILES",
    "AddSegment",
    "ArmemError",
    "Commit",
    "CommitResult",
    "Configuration",
    "CoreSegmentDefinition",
    "EntityUpdate",
    "Instance",
    "LongTermMemory",
    "Memory",
    "MemoryID",
    "MemoryNameSystem",
    "MemoryServer",
    "Query",
    "QueryBuilder",
    "QueryTarget",
    "Service",
    "Snapshot",
    "read_config",
    "recall_snapshots",
    "snapshots_cue",
]

# Names are imported when first used: the command line loads this package to list what it adds.
_HOME = {
    "PROFILES": "armem_bridge.profiles",
    "AddSegment": "armem_bridge.working",
    "ArmemError": "armem_bridge.errors",
    "Commit": "armem_bridge.working",
    "CommitResult": "armem_bridge.working",
    "Configuration": "armem_bridge.config",
    "CoreSegmentDefinition": "armem_bridge.working",
    "EntityUpdate": "armem_bridge.working",
    "Instance": "armem_bridge.working",
    "LongTermMemory": "armem_bridge.long_term",
    "Memory": "armem_bridge.working",
    "MemoryID": "armem_bridge.memory_id",
    "MemoryNameSystem": "armem_bridge.names",
    "MemoryServer": "armem_bridge.working",
    "Query": "armem_bridge.working",
    "QueryBuilder": "armem_bridge.working",
    "QueryTarget": "armem_bridge.working",
    "Service": "armem_bridge.service",
    "Snapshot": "armem_bridge.working",
    "read_config": "armem_bridge.config",
    "recall_snapshots": "armem_bridge.long_term",
    "snapshots_cue": "armem_bridge.long_term",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'armem_bridge' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
