"""Segments: what a memory server defines, and what providers add to it (section 4.4.1)."""

from __future__ import annotations

import msgspec

from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID


class CoreSegmentDefinition(msgspec.Struct, frozen=True, kw_only=True):
    """A core segment that a memory server has: its name, and the type of all data in it, if they have one."""

    name: str
    aron_type: TypeObject | None = None


class AddSegment(msgspec.Struct, frozen=True, kw_only=True):
    """A provider's wish for a segment of its own.

    Its type, if any, extends the core segment's. With `clear_when_exists` the snapshots that are in a
    segment of that name leave working memory, which is the only way for a client to have them leave.
    """

    core_segment: str
    provider_segment: str
    aron_type: TypeObject | None = None
    clear_when_exists: bool = False


class SegmentResult(msgspec.Struct, frozen=True, kw_only=True):
    """What became of the wish for a segment."""

    success: bool
    error: str = ""
    """Why not, and what to do about it; empty on success."""

    segment: MemoryID | None = None
    """The ID of the provider segment, on success."""
