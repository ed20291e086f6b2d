"""What a memory server tells of itself, for whoever looks after it."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from armem_bridge.working.notifications import ListenerStatus


class ServerStatus(msgspec.Struct, frozen=True, kw_only=True):
    """A memory server at one moment; what is counted is counted since it started."""

    name: str
    core_segments: int
    provider_segments: int
    entities: int
    snapshots: int
    """What working memory holds now."""

    commits: int
    updates: int
    """So many updates were made."""

    refused: int
    """So many updates were refused."""

    evicted: int
    """So many snapshots left working memory, versions that do not count included."""

    queries: int
    delayed: int
    """So many updates took longer from being sent to arriving than the threshold, by the two clocks."""

    greatest_delay: int
    """The longest that one took, in microseconds; 0 if none came late."""

    archive_failures: int
    """So often the archive failed to take what left working memory."""

    listeners: tuple[ListenerStatus, ...]
    archive: Mapping[str, object]
    """What the archive tells of itself; empty without one."""
