"""ARON, the ArmarX Object Notation: data objects, type objects, what connects them, and their codecs."""

from __future__ import annotations

from armem_bridge.aron.content import content_hash
from armem_bridge.aron.data import Bool, Data, Dict, Double, Float, Int, List, Long, NDArray, String

__all__ = [
    "Bool",
    "Data",
    "Dict",
    "Double",
    "Float",
    "Int",
    "List",
    "Long",
    "NDArray",
    "String",
    "content_hash",
]
