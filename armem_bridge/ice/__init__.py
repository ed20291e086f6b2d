"""The Ice edge: memories for clients that speak ArmarX's own protocol; needs Ice, which is an extra (GPL)."""

from __future__ import annotations

from armem_bridge.ice.client import MemoryClient, RemoteMemory
from armem_bridge.ice.edge import Edge, EdgeStatus
from armem_bridge.ice.generation import Generation
from armem_bridge.ice.join import Joined
from armem_bridge.ice.slices import load_slices
from armem_bridge.ice.standalone import Standalone

__all__ = [
    "Edge",
    "EdgeStatus",
    "Generation",
    "Joined",
    "MemoryClient",
    "RemoteMemory",
    "Standalone",
    "load_slices",
]
