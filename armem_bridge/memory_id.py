"""Memory IDs: the name of everything in a memory, from the memory itself down to one instance (section 4.4.1)."""

from __future__ import annotations

import re
from enum import IntEnum
from typing import Any, Final, Self
from urllib.parse import unquote_to_bytes

import msgspec
from msgspec.structs import force_setattr

from armem_bridge.aron.data import Data, Dict, Int, String
from armem_bridge.aron.links import date_time, dict_of, moment_of, scalar_of
from armem_bridge.errors import ArmemError
from armem_bridge.moments import GREATEST, INVALID, NOT_SET

NO_INDEX: Final = -1
"""No instance index. Every negative number means this."""

INDEX_LIMIT: Final = 2**31 - 1
"""The greatest index of an instance."""

_ESCAPE = re.compile(r"%(?![0-9A-Fa-f]{2})")
_DIGITS = re.compile(r"[0-9]+")


_LINK: Final = (
    ("memoryName", "memory", String),
    ("coreSegmentName", "core_segment", String),
    ("providerSegmentName", "provider_segment", String),
    ("entityName", "entity", String),
    ("instanceIndex", "instance", Int),
)
"""Members of a link in data, the parts of the ID that they are, and their kinds: all but the timestamp."""


class InvalidMemoryID(ArmemError, ValueError):
    """A memory ID cannot be what it is given as. Correct the part that the message names."""


class Level(IntEnum):
    """How far down an ID leads; each level has one part more than the one above it."""

    NOTHING = 0
    MEMORY = 1
    CORE_SEGMENT = 2
    PROVIDER_SEGMENT = 3
    ENTITY = 4
    SNAPSHOT = 5
    INSTANCE = 6

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")


class MemoryID(msgspec.Struct, frozen=True, kw_only=True, order=True):
    """The ID of a memory, core segment, provider segment, entity, snapshot or instance.

    Names are any text but NUL and halves of surrogate pairs, the empty text meaning "not set". `timestamp`
    is the reference time of a snapshot in microseconds, `instance` the position of an instance in it; all
    negative numbers mean "not set" and are kept as -1. IDs are ordered part by part, names by code points,
    a part not set before all others.

    An ID may leave out a part above one that is set, for clients can send that; its level is then that of
    the parts before the gap, and so is its text.
    """

    memory: str = ""
    core_segment: str = ""
    provider_segment: str = ""
    entity: str = ""
    timestamp: int = NOT_SET
    instance: int = NO_INDEX

    def __post_init__(self) -> None:
        for name in (self.memory, self.core_segment, self.provider_segment, self.entity):
            if type(name) is not str or not name.isascii() or "\0" in name:
                self._check_names()
                break
        timestamp, instance = self.timestamp, self.instance
        if type(timestamp) is not int or not INVALID <= timestamp <= GREATEST:
            raise InvalidMemoryID(f"the timestamp of a memory ID is an integer of 64 bits, not {timestamp!r:.80}")
        if type(instance) is not int or instance > INDEX_LIMIT:
            raise InvalidMemoryID(f"the instance index of a memory ID is an integer of 32 bits, not {instance!r:.80}")
        if timestamp < NOT_SET:
            force_setattr(self, "timestamp", NOT_SET)
        if instance < NO_INDEX:
            force_setattr(self, "instance", NO_INDEX)

    def _check_names(self) -> None:
        for level, name in zip(Level, ("", *self.names), strict=False):
            if not isinstance(name, str):
                raise InvalidMemoryID(f"the {level} of a memory ID is text, not a {type(name).__name__}: {name!r:.80}")
            if "\0" in name:
                raise InvalidMemoryID(f"the {level} name {name!r:.80} contains the character NUL: leave it out")
            try:
                name.encode()
            except UnicodeEncodeError as error:
                raise InvalidMemoryID(
                    f"the {level} name {name!r:.80} contains half of a surrogate pair, which is no character"
                ) from error

    @property
    def names(self) -> tuple[str, str, str, str]:
        """Memory, core segment, provider segment and entity."""
        return (self.memory, self.core_segment, self.provider_segment, self.entity)

    @property
    def level(self) -> Level:
        """The last level before the first part that is not set."""
        return Level(len(self._parts()))

    @property
    def has_gap(self) -> bool:
        """Whether some part is set below one that is not."""
        return self != self.cut(self.level)

    def _parts(self) -> tuple[str | int, ...]:
        """The parts before the first one that is not set."""
        parts: list[str | int] = []
        for name in self.names:
            if not name:
                return tuple(parts)
            parts.append(name)
        for number in (self.timestamp, self.instance):
            if number < 0:
                break
            parts.append(number)
        return tuple(parts)

    def cut(self, level: Level) -> MemoryID:
        """This ID down to a level, with nothing set below it."""
        return MemoryID(
            memory=self.memory if level >= Level.MEMORY else "",
            core_segment=self.core_segment if level >= Level.CORE_SEGMENT else "",
            provider_segment=self.provider_segment if level >= Level.PROVIDER_SEGMENT else "",
            entity=self.entity if level >= Level.ENTITY else "",
            timestamp=self.timestamp if level >= Level.SNAPSHOT else NOT_SET,
            instance=self.instance if level >= Level.INSTANCE else NO_INDEX,
        )

    @property
    def entity_id(self) -> MemoryID:
        """The ID of the entity that this one belongs to, where it says so."""
        return self.cut(Level.ENTITY)

    def with_core_segment(self, name: str) -> MemoryID:
        """The ID of a core segment of this memory."""
        return MemoryID(memory=self.memory, core_segment=name)

    def with_provider_segment(self, name: str) -> MemoryID:
        """The ID of a provider segment of this core segment."""
        return MemoryID(memory=self.memory, core_segment=self.core_segment, provider_segment=name)

    def with_entity(self, name: str) -> MemoryID:
        """The ID of an entity of this provider segment."""
        return MemoryID(
            memory=self.memory, core_segment=self.core_segment, provider_segment=self.provider_segment, entity=name
        )

    def with_timestamp(self, timestamp: int) -> MemoryID:
        """The ID of a snapshot of this entity."""
        memory, core, provider, entity = self.names
        return MemoryID(memory=memory, core_segment=core, provider_segment=provider, entity=entity, timestamp=timestamp)

    def with_instance(self, instance: int) -> MemoryID:
        """The ID of an instance of this snapshot."""
        memory, core, provider, entity = self.names
        return MemoryID(
            memory=memory,
            core_segment=core,
            provider_segment=provider,
            entity=entity,
            timestamp=self.timestamp,
            instance=instance,
        )

    def contains(self, other: MemoryID) -> bool:
        """Whether `other` is this ID or lies below it: each part that is set here is the same there."""
        return (
            all(not mine or mine == others for mine, others in zip(self.names, other.names, strict=True))
            and (self.timestamp < 0 or self.timestamp == other.timestamp)
            and (self.instance < 0 or self.instance == other.instance)
        )

    def __str__(self) -> str:
        """`memory/core/provider/entity/<µs>/<index>` up to the first part not set; / is %2F, and % is %25."""
        return "/".join(
            part.replace("%", "%25").replace("/", "%2F") if isinstance(part, str) else str(part)
            for part in self._parts()
        )

    def to_aron(self) -> Dict:
        """This ID as data link to it (the type `MemoryID` of `aron.aliases`); what is not set as ArmarX has it."""
        return Dict(
            {
                "memoryName": String(self.memory),
                "coreSegmentName": String(self.core_segment),
                "providerSegmentName": String(self.provider_segment),
                "entityName": String(self.entity),
                "timestamp": date_time(self.timestamp),
                "instanceIndex": Int(self.instance),
            }
        )

    @classmethod
    def from_aron(cls, data: Data | None) -> Self:
        """The ID that a link in data names; members that the data lack are not set, others are passed over.

        Raises `NotRealized` for what is no link, `InvalidMemoryID` for names and numbers that none has.
        """
        members: dict[str, Any] = {}
        link = dict_of(data, "a link to memory")
        for key, name, kind in _LINK:
            if key in link:
                members[name] = scalar_of(link[key], kind, f"{key} of a link to memory")
        if "timestamp" in link:
            members["timestamp"] = max(moment_of(link["timestamp"]), NOT_SET)
        return cls(**members)

    @classmethod
    def parse(cls, text: str) -> Self:
        """The ID that a text names; `parse(str(id)) == id` for IDs without gap.

        Any character may be percent-encoded, as UTF-8. Raises `InvalidMemoryID` for empty parts, more than
        six of them, numbers that are none, and percent signs that encode nothing.
        """
        parts = text.split("/") if text else []
        if len(parts) > Level.INSTANCE:
            raise InvalidMemoryID(
                f"{text!r:.200} has {len(parts)} parts, and a memory ID at most six: write a / inside of a name as %2F"
            )
        names = [_name(part, Level(number + 1), text) for number, part in enumerate(parts[:4])]
        numbers = [_number(part, Level(number + 5), text) for number, part in enumerate(parts[4:])]
        memory, core_segment, provider_segment, entity = (*names, "", "", "", "")[:4]
        timestamp, instance = (*numbers, *(NOT_SET, NO_INDEX)[len(numbers) :])
        return cls(
            memory=memory,
            core_segment=core_segment,
            provider_segment=provider_segment,
            entity=entity,
            timestamp=timestamp,
            instance=instance,
        )


def _name(part: str, level: Level, text: str) -> str:
    if not part:
        raise InvalidMemoryID(f"the {level} in {text!r:.200} is empty: name it, or cut the ID before it")
    if _ESCAPE.search(part):
        raise InvalidMemoryID(
            f"the {level} {part!r:.80} has a % that no two hexadecimal digits follow: write % itself as %25"
        )
    try:
        return unquote_to_bytes(part).decode()
    except UnicodeError as error:
        raise InvalidMemoryID(f"the {level} {part!r:.80} does not encode text in UTF-8") from error


def _number(part: str, level: Level, text: str) -> int:
    if not _DIGITS.fullmatch(part) or len(part) > 19:
        what = "microseconds since 1970" if level is Level.SNAPSHOT else "the position in the snapshot"
        raise InvalidMemoryID(f"the {level} in {text!r:.200} is a number, {what}, not {part!r:.80}")
    return int(part)
