"""Snapshots as elm events and back: each version of a snapshot is one event (docs/formats.md, "ArmarX snapshots")."""

from __future__ import annotations

from typing import Final
from uuid import UUID

import msgspec

from armem_bridge.aron.content import content_hash
from armem_bridge.long_term import payload
from armem_bridge.long_term.refusals import NoSnapshot
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import is_set, to_datetime
from armem_bridge.working.snapshot import Snapshot
from elm.cues import feature_names, features
from elm.cues.algebra import Cue
from elm.event import Event, Payload, StoredEvent, hashed_uid
from elm.features import Feature
from elm.geometry import Region
from elm.interval import Interval, to_micros
from elm.store import Arrival

ID: Final = "armem.id"
"""The entity: the text of its whole ID."""
MEMORY: Final = "armem.memory"
CORE_SEGMENT: Final = "armem.core_segment"
PROVIDER_SEGMENT: Final = "armem.provider_segment"
ENTITY: Final = "armem.entity"
INSTANCES: Final = "armem.instances"
"""How many instances there are."""
CONFIDENCE: Final = "armem.confidence"
"""The confidence of the instances, from 0 to 1 as a rule; each value once."""
SENT: Final = "armem.sent"
"""When the instances were sent, in microseconds since 1970; left out where the client did not say."""

NAMES: Final = (MEMORY, CORE_SEGMENT, PROVIDER_SEGMENT, ENTITY)
"""The features that hold the four names of an ID, from the memory down."""

_UID_FORM: Final = "armem-snapshot-1"


def snapshot_uid(snapshot: Snapshot) -> UUID:
    """The uid of a version of a snapshot: a UUID of version 8 that is the same wherever and whenever it is made.

    It is made of a SHA-256 over the fields of the ID (not its text) and over what is known of each instance:
    the hash of its data, its confidence, when it was sent and what time it is about. When it arrived is no
    part of it, so the same commit, sent again, is the same event.
    """
    place = snapshot.id
    instances = [
        (content_hash(each.data), each.metadata.confidence + 0.0, each.metadata.sent, each.metadata.referenced)
        for each in snapshot.instances
    ]
    return hashed_uid(msgspec.msgpack.encode((_UID_FORM, *place.names, place.timestamp, instances)))


def arrival_of(
    snapshot: Snapshot,
    *,
    event_type: str,
    region: Region | None = None,
    subject: Region | None = None,
    agent: str | None = None,
) -> Arrival:
    """A version of a snapshot on its way into elm: an instant at its reference time, recorded when it arrived.

    Raises an `ElmError` for what elm cannot hold, such as a reference time beyond the year 9999.
    """
    instant = Interval.at(to_datetime(snapshot.referenced, what=f"the reference time of {snapshot.id}"))
    arrived = max((instance.metadata.arrived for instance in snapshot.instances), default=-1)
    packed = payload.pack(snapshot.instances, timestamp=snapshot.referenced)
    event = Event(
        type=event_type,
        interval=instant,
        region=region,
        subject=subject,
        features=_features(snapshot),
        agent=agent,
        payload=Payload(data=packed, media_type=payload.MEDIA_TYPE),
        uid=snapshot_uid(snapshot),
    )
    recorded = to_datetime(arrived, what=f"the time of arrival of {snapshot.id}") if is_set(arrived) else None
    return Arrival(event=event, recorded_at=recorded)


def _features(snapshot: Snapshot) -> list[Feature]:
    metadata = [instance.metadata for instance in snapshot.instances]
    found: list[Feature] = [(ID, str(snapshot.id.entity_id)), *zip(NAMES, snapshot.id.names, strict=True)]
    found.append((INSTANCES, len(metadata)))
    found += [(CONFIDENCE, each.confidence) for each in metadata]
    found += [(SENT, each.sent) for each in metadata if is_set(each.sent)]
    return found


def is_snapshot(event: StoredEvent) -> bool:
    """Whether an event is a consolidated snapshot, in whichever version of the payload."""
    return event.payload is not None and payload.is_snapshot(event.payload.media_type)


def snapshot_of(event: StoredEvent) -> Snapshot:
    """The snapshot that an event was made of.

    All instances have the time of arrival at which the event was recorded. Raises `NoSnapshot` where the
    event is none, `UnknownCodecVersion` where a later elm wrote it.
    """
    if event.payload is None:
        raise NoSnapshot(f"event {event.uid} of type {event.type!r} has no payload, so it is no snapshot")
    names = [event.value(name) for name in NAMES]
    if not all(isinstance(name, str) and name for name in names):
        raise NoSnapshot(f"event {event.uid} of type {event.type!r} lacks one of the features {', '.join(NAMES)}")
    memory, core, provider, entity = map(str, names)
    moment = to_micros(event.interval.begin)
    try:
        instances = payload.unpack(
            event.payload.data, event.payload.media_type, timestamp=moment, arrived=to_micros(event.recorded_at)
        )
    except NoSnapshot as error:
        raise NoSnapshot(f"event {event.uid} of type {event.type!r}: {error}") from error
    place = MemoryID(memory=memory, core_segment=core, provider_segment=provider, entity=entity, timestamp=moment)
    return Snapshot(id=place, instances=instances)


def below(place: MemoryID) -> Cue:
    """The snapshots that an ID contains, by the parts that are set in it; its timestamp is not looked at."""
    if all(place.names):
        return features("superset", {ID: str(place.entity_id)})
    named = [(name, value) for name, value in zip(NAMES, place.names, strict=True) if value]
    return features("superset", named) if named else feature_names("superset", [ID])
