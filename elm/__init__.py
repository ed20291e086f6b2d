"""elm, the episodic memory for robots: what happened, where, when, as seen by whom, recalled by any fragment."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from elm import cues
    from elm.app import Memory, connect
    from elm.errors import ElmError
    from elm.event import Event, PartialEvent, Payload, StoredEvent
    from elm.geometry import Region
    from elm.interval import Interval
    from elm.query import ByFeature, Nearest
    from elm.taxonomy import EventType

__all__ = [
    "ByFeature",
    "ElmError",
    "Event",
    "EventType",
    "Interval",
    "Memory",
    "Nearest",
    "PartialEvent",
    "Payload",
    "Region",
    "StoredEvent",
    "connect",
    "cues",
]

# Names are imported when first used: `import elm` stays fast, and the command line with it.
_HOME = {
    "ByFeature": "elm.query",
    "ElmError": "elm.errors",
    "Event": "elm.event",
    "EventType": "elm.taxonomy",
    "Interval": "elm.interval",
    "Memory": "elm.app",
    "Nearest": "elm.query",
    "PartialEvent": "elm.event",
    "Payload": "elm.event",
    "Region": "elm.geometry",
    "StoredEvent": "elm.event",
    "connect": "elm.app",
}


def __getattr__(name: str) -> Any:
    if name == "cues":
        return import_module("elm.cues")
    if name not in _HOME:
        raise AttributeError(f"module 'elm' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)
