"""One integrated record of what happened, where, when, as seen by whom: as committed, as reported, as stored."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Self
from uuid import UUID

import msgspec
from uuid_utils.compat import uuid7

from elm.arguments import as_uid, as_uids
from elm.errors import CycleRefused, InvalidValue
from elm.features import Feature, FeatureValue, by_canonical, identity
from elm.geometry import Region
from elm.interval import Interval
from elm.text import check_short_name

PAYLOAD_LIMIT = 512 * 1024 * 1024
"""Longest payload in bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Payload:
    """Bytes that came with an event, never interpreted by the store (Def 3's b); empty bytes are a payload too."""

    data: bytes
    media_type: str = "application/octet-stream"

    def __post_init__(self) -> None:
        if not isinstance(self.data, bytes | bytearray | memoryview):
            raise InvalidValue(f"a payload is bytes, not {type(self.data).__name__}: encode it first")
        data = bytes(self.data)
        if len(data) > PAYLOAD_LIMIT:
            raise InvalidValue(
                f"a payload of {len(data):,} bytes is over the limit of {PAYLOAD_LIMIT:,}: "
                f"keep it in a file and store the file's name"
            )
        media_type = check_short_name(self.media_type, what="the media type of a payload")
        object.__setattr__(self, "data", data)
        object.__setattr__(self, "media_type", media_type)

    def __repr__(self) -> str:
        return f"Payload({self.media_type!r}, {len(self.data):,} bytes)"


class _Described:
    """What an event and a stored one tell of themselves alike."""

    __slots__ = ()

    features: tuple[Feature, ...]
    parts: tuple[UUID, ...]

    @property
    def is_complex(self) -> bool:
        """Whether the event has sub-events (Def 6)."""
        return bool(self.parts)

    def values(self, name: str) -> tuple[FeatureValue, ...]:
        """All values of the feature `name`, in the order given at birth."""
        return tuple(value for known, value in self.features if known == name)

    def value(self, name: str) -> FeatureValue | None:
        """The first value of the feature `name`, or None."""
        return next(iter(self.values(name)), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Event(_Described):
    """An event to commit (Def 3): atomic, or complex when it has parts.

    `interval` is needed unless there are parts: the extents of a complex event derive from its parts
    (Defs 7 and 10), and given ones must agree with that. `region` is where the observer was, `subject`
    where the thing is that the event is about; None means unknown. `features` is a set of (name, value)
    pairs, given as pairs or as a mapping. `parts` are uids of the direct sub-events, in an order that is
    kept though they compare as a set. A `uid` makes committing idempotent; by default it is a new UUIDv7. Uids may be
    given as text.
    """

    type: str
    interval: Interval | None = None
    region: Region | None = None
    subject: Region | None = None
    features: tuple[Feature, ...] = ()
    agent: str | None = None
    payload: Payload | None = None
    parts: tuple[UUID, ...] = ()
    uid: UUID = field(default_factory=uuid7)
    canonical_features: tuple[str, ...] = field(init=False, repr=False)
    """The canonical texts of the features, sorted: what hashes and indexes are made of."""

    if TYPE_CHECKING:
        # What may be given is wider than what is kept: checkers read this, dataclass writes the real one.
        def __init__(
            self,
            *,
            type: str,  # noqa: A002 - the field's name in every format
            interval: Interval | None = ...,
            region: Region | None = ...,
            subject: Region | None = ...,
            features: Mapping[str, FeatureValue] | Iterable[tuple[str, FeatureValue]] = ...,
            agent: str | None = ...,
            payload: Payload | None = ...,
            parts: Iterable[UUID | str] = ...,
            uid: UUID | str = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "type", check_short_name(self.type, what="the type of an event"))
        for name, kind in (
            ("interval", Interval),
            ("region", Region),
            ("subject", Region),
            ("payload", Payload),
        ):
            value = getattr(self, name)
            if value is not None and not isinstance(value, kind):
                raise InvalidValue(f"the {name} of an event is an elm.{_MADE[kind]}, not {value!r:.80}")
        if self.agent is not None:
            object.__setattr__(self, "agent", check_short_name(self.agent, what="the agent of an event"))
        if not isinstance(self.uid, UUID):
            object.__setattr__(self, "uid", as_uid(self.uid, what="the uid of an event"))
        parts = as_uids(self.parts, what="the parts of an event")
        if len(set(parts)) != len(parts):
            raise InvalidValue(f"event {self.uid} names a part twice: name each once")
        if self.uid in parts:
            raise CycleRefused(f"event {self.uid} cannot be its own part")
        if self.interval is None and not parts:
            raise InvalidValue(f"event {self.uid} of type {self.type!r} needs an interval, for it has no parts")
        object.__setattr__(self, "parts", parts)
        features = by_canonical(self.features)
        object.__setattr__(self, "features", tuple(features.values()))
        object.__setattr__(self, "canonical_features", tuple(sorted(features)))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Event):
            return NotImplemented
        names = [each.name for each in fields(Event)]
        return _key(self, names) == _key(other, names)

    def __hash__(self) -> int:
        return hash(self.uid)


_MADE: Mapping[type, str] = MappingProxyType(
    {
        Interval: "Interval(begin=..., end=...)",
        Region: "Region(polygon=...)",
        Payload: "Payload(data=...)",
    }
)
"""How the components are made that are values of their own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PartialEvent:
    """What an event source reports before its place is known (section V-C of the paper): type and time at least."""

    type: str
    interval: Interval
    features: tuple[Feature, ...] = ()
    agent: str | None = None
    payload: Payload | None = None
    subject: Region | None = None
    uid: UUID = field(default_factory=uuid7)

    def __post_init__(self) -> None:
        event = self.complete(region=None)
        object.__setattr__(self, "features", event.features)
        object.__setattr__(self, "uid", event.uid)

    def complete(self, *, region: Region | None) -> Event:
        """The event, with the place that a location monitor found; None when it stays unknown."""
        return Event(
            type=self.type,
            interval=self.interval,
            region=region,
            subject=self.subject,
            features=self.features,
            agent=self.agent,
            payload=self.payload,
            uid=self.uid,
        )


class StoredEvent(_Described):
    """An event as a memory holds it, with what the memory added; immutable.

    Attributes of `Event`, and `id` (integer, in order of commit), `recorded_at` (when the memory learned
    of it), `wholes` (uids of the direct super-events when it was read). `interval` is always there, for
    complex events as it derives. Fields are decoded from the row they came in when first looked at.
    """

    FIELDS: ClassVar = (
        "id",
        "uid",
        "type",
        "interval",
        "region",
        "subject",
        "features",
        "agent",
        "payload",
        "parts",
        "wholes",
        "recorded_at",
    )
    __slots__ = (*FIELDS, "_decode", "_row")

    id: int
    uid: UUID
    type: str
    interval: Interval
    region: Region | None
    subject: Region | None
    features: tuple[Feature, ...]
    agent: str | None
    payload: Payload | None
    parts: tuple[UUID, ...]
    wholes: tuple[UUID, ...]
    recorded_at: datetime

    def __init__(
        self,
        *,
        id: int,  # noqa: A002 - the column's name in every format
        uid: UUID,
        type: str,  # noqa: A002
        interval: Interval,
        recorded_at: datetime,
        region: Region | None = None,
        subject: Region | None = None,
        features: tuple[Feature, ...] = (),
        agent: str | None = None,
        payload: Payload | None = None,
        parts: tuple[UUID, ...] = (),
        wholes: tuple[UUID, ...] = (),
    ) -> None:
        given = locals()
        for name in self.FIELDS:
            object.__setattr__(self, name, given[name])

    @classmethod
    def of_row(cls, row: Sequence[Any], decode: Mapping[str, Callable[[Sequence[Any]], Any]]) -> Self:
        """An event whose fields `decode` finds in `row`, each when first looked at."""
        event = cls.__new__(cls)
        _set_row(event, row)
        _set_decode(event, decode)
        return event

    def __getattr__(self, name: str) -> Any:
        # Python comes here only for a slot that is still empty.
        if name not in self.FIELDS:
            raise AttributeError(f"a StoredEvent has no attribute {name!r}")
        value = self._decode[name](self._row)
        object.__setattr__(self, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a StoredEvent is immutable: {name!r} cannot be set")

    def as_event(self) -> Event:
        """The event as it stands now, fit to be committed to another memory.

        It says nothing of when this memory learned of it: commit it with `recorded_at=stored.recorded_at` to keep
        that, as a load of stored events does by itself.
        """
        return Event(
            type=self.type,
            interval=self.interval,
            region=self.region,
            subject=self.subject,
            features=self.features,
            agent=self.agent,
            payload=self.payload,
            parts=self.parts,
            uid=self.uid,
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, StoredEvent):
            return NotImplemented
        return _key(self, self.FIELDS) == _key(other, self.FIELDS)

    def __hash__(self) -> int:
        return hash(self.uid)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restore, ({name: getattr(self, name) for name in self.FIELDS},)

    def __repr__(self) -> str:
        return f"StoredEvent({self.id}, {self.type!r}, {self.interval}, uid={self.uid})"


def _key(event: Event | StoredEvent, names: Iterable[str]) -> list[object]:
    """What an event is compared by: Python's == would hold the feature values 1 and True for the same."""
    return [[*map(identity, event.features)] if name == "features" else getattr(event, name) for name in names]


_set_row = StoredEvent.__dict__["_row"].__set__
_set_decode = StoredEvent.__dict__["_decode"].__set__


def _restore(fields: dict[str, Any]) -> StoredEvent:
    return StoredEvent(**fields)


def content_hash(event: Event) -> bytes:
    """SHA-256 of an event's canonical form, by which a repeated commit is told from another event.

    Features and parts count as sets, a polygon by its outline, an open end as null, and the extents of a
    complex event not at all, for they derive; the uid is not content.
    """
    if event.parts or event.interval is None:
        extents = None
    else:
        begin, end = event.interval.micros
        is_open = event.interval.end is None
        extents = (begin, None if is_open else end, _place(event.region), _place(event.subject))
    canonical_form = (
        event.type,
        extents,
        event.canonical_features,
        event.agent,
        None if event.payload is None else (event.payload.media_type, event.payload.data),
        sorted(part.bytes for part in event.parts),
    )
    return hashlib.sha256(msgspec.msgpack.encode(canonical_form)).digest()


def hashed_uid(data: bytes) -> UUID:
    """A UUID of version 8 (RFC 9562) made of the SHA-256 of `data`: the same wherever and whenever it is made."""
    number = int.from_bytes(hashlib.sha256(data).digest()[:16], "big")
    number = number & ~(0xF << 76) | 0x8 << 76
    return UUID(int=number & ~(0x3 << 62) | 0x2 << 62)


def _place(region: Region | None) -> tuple[str, bytes] | None:
    return None if region is None else (region.frame, region.outline)
