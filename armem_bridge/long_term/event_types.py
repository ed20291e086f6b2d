"""The elm types of consolidated snapshots: from where they are in a memory, and from what type their segment has.

The hierarchy grows as snapshots come. `ArmemSnapshot` is the root of all; below it are `armem/<memory>` and
below that `armem/<memory>/<core segment>`, the type of snapshots whose segment has no type. An Object type
of ARON becomes `aron/<its name>`, below the one that it extends or else below the root. Snapshots of a
segment with such a type are of `armem/<memory>/<core segment>:<its name>`, which is a kind of both. So
one cue asks for a memory, for a segment, or for all that has a type or extends it, wherever that is.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.server import MemoryServer
from elm.errors import CycleRefused
from elm.store import Store
from elm.taxonomy import EventType

ROOT: Final = "ArmemSnapshot"
"""What every consolidated snapshot is."""

NAME_BYTES: Final = 120
"""The longest a memory, segment or Object type may be named before its name in a type is cut and gets a hash."""

SegmentTypes = Callable[[MemoryID], t.TypeObject | None]
"""What type the data of a provider segment have to realize, by its ID."""

_ESCAPED = re.compile("[\x1f%/:]")


def segment_event_type(segment: MemoryID) -> str:
    """The type of the snapshots below a memory or a core segment."""
    return "/".join(["armem", *map(_plain, (segment.memory, segment.core_segment)[: 2 if segment.core_segment else 1])])


def object_event_type(name: str) -> str:
    """The type of the snapshots whose data are of an Object type, or of one that extends it."""
    return f"aron/{_short(name.replace(chr(0x1F), '%1F'), name)}"


def event_types(segment: MemoryID, aron_type: t.TypeObject | None) -> list[EventType]:
    """The type of the snapshots in a provider segment that has this type, the last one, behind all those above it."""
    memory, core = segment_event_type(segment.with_core_segment("")), segment_event_type(segment)
    above = [
        EventType(name=ROOT),
        EventType(name=memory, parents=(ROOT,)),
        EventType(name=core, parents=(memory,)),
    ]
    if not isinstance(aron_type, t.Object) or not aron_type.name:
        return above
    chain: list[EventType] = []
    kind: t.Object | None = aron_type
    while kind is not None:
        parent = ROOT if kind.extends is None or not kind.extends.name else object_event_type(kind.extends.name)
        chain.append(EventType(name=object_event_type(kind.name), parents=(parent,)))
        kind = kind.extends if kind.extends is not None and kind.extends.name else None
    own = EventType(name=f"{core}:{chain[0].name.removeprefix('aron/')}", parents=(core, chain[0].name))
    return [*above, *reversed(chain), own]


class EventTypes:
    """Adds types to an elm memory when they are first used, and remembers which are there."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._known: dict[tuple[str, str, t.TypeObject | None], str] = {}
        self.contradictions = 0
        """So many segment types say that two types extend each other: elm keeps what it was told first."""

    def of(self, segment: MemoryID, aron_type: t.TypeObject | None) -> str:
        """The type of a snapshot in a provider segment of this type, which the memory then has.

        A segment whose type changes gets another type for what comes from then on; when a type of a known
        name comes to extend another one, it gains that as a parent and keeps the old one.
        """
        key = (segment.memory, segment.core_segment, aron_type)
        name = self._known.get(key)
        if name is None:
            types = event_types(segment, aron_type)
            try:
                self._store.add_types(types)
            except CycleRefused:
                self.contradictions += 1
                roots = [EventType(name=each.name, parents=(ROOT,)) for each in types[3:-1]]
                self._store.add_types([*types[:3], *roots, types[-1]])
            name = self._known[key] = types[-1].name
        return name


def types_of(server: MemoryServer) -> SegmentTypes:
    """The types of the segments of a memory server: a provider segment without one has its core segment's."""

    def find(segment: MemoryID) -> t.TypeObject | None:
        core = server.id.with_core_segment(segment.core_segment)
        own = server.segment_type(core.with_provider_segment(segment.provider_segment))
        return server.segment_type(core) if own is None else own

    return find


def _plain(name: str) -> str:
    return _short(_ESCAPED.sub(lambda found: f"%{ord(found[0]):02X}", name), name)


def _short(shown: str, name: str) -> str:
    if len(shown.encode()) <= NAME_BYTES:
        return shown
    cut = shown.encode()[: NAME_BYTES - 33].decode(errors="ignore")
    return f"{cut}~{hashlib.sha256(name.encode()).hexdigest()[:32]}"
