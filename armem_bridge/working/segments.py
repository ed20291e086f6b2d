"""Segments: what a memory server defines, and what providers add to it (section 4.4.1)."""

from __future__ import annotations

import msgspec

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.type_objects import TypeObject
from armem_bridge.memory_id import MemoryID


class CoreSegmentDefinition(msgspec.Struct, frozen=True, kw_only=True):
    """A core segment that a memory server has: its name, and the type of all data in it, if they have one."""

    name: str
    aron_type: TypeObject | None = None


def why_no_segment_type(aron_type: TypeObject | None) -> str:
    """Why nothing could be committed to a segment of a type, as the end of a sentence; empty when something could."""
    if aron_type is None or isinstance(aron_type, t.Object | t.Dict | t.Any):
        return ""
    what = type(aron_type).__name__ if isinstance(aron_type, t.KINDS) else f"{aron_type!r:.80}"
    return f"has the type {what}, and instances are Dicts: give it an Object, a Dict or none"


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
