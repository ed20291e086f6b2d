"""Events and types as JSON Lines, in the exchange format of docs/formats.md, for load, export and other languages."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import msgspec

from elm.errors import InvalidValue
from elm.event import Event, Payload, StoredEvent
from elm.features import as_features
from elm.fields import Fields, base64_text, parse_uid, shown, time_text
from elm.geometry import Region
from elm.interval import Interval, parse_time
from elm.taxonomy import EventType
from elm.tombstone import RunTombstone, Tombstone

FORGOTTEN = "forgotten"
"""The one key of a line that is a tombstone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadEvent:
    """An event as it stood in a file, with what only results carry: when it was recorded, and fields passed over."""

    event: Event
    recorded_at: datetime | None = None
    ignored: tuple[str, ...] = ()


def parse_json(line: str | bytes, *, what: str) -> Any:
    """The JSON value of one line."""
    try:
        return msgspec.json.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InvalidValue(f"{what} is not JSON: {error}") from error
    except RecursionError as error:
        raise InvalidValue(f"{what} nests too deep") from error


def to_line(value: dict[str, Any]) -> str:
    """One line of JSON, without the line break."""
    return msgspec.json.encode(value).decode()


def event_from_json(given: Any) -> ReadEvent:
    """The event a JSON object stands for; `id` and `wholes` of a result are passed over and named."""
    fields = Fields(given, what="an event")
    type_name = fields.text("type")
    uid = fields.optional("uid")
    interval = fields.optional("interval")
    payload = fields.optional("payload")
    parts = fields.uids("parts") if fields.optional("parts") is not None else ()
    recorded_at = fields.optional("recorded_at")
    known: dict[str, Any] = {} if uid is None else {"uid": parse_uid(uid, what="'uid' of an event")}
    event = Event(
        type=type_name,
        interval=None if interval is None else _interval(interval),
        region=_region(fields.optional("region"), what="region"),
        subject=_region(fields.optional("subject"), what="subject"),
        features=as_features(_pairs(fields.optional("features"))),
        agent=fields.optional("agent"),
        payload=None if payload is None else _payload(payload),
        parts=parts,
        **known,
    )
    ignored = tuple(key for key in ("id", "wholes") if fields.optional(key) is not None)
    fields.finish()
    return ReadEvent(
        event=event,
        recorded_at=None if recorded_at is None else parse_time(recorded_at, what="'recorded_at' of an event"),
        ignored=ignored,
    )


def event_to_json(event: Event | StoredEvent) -> dict[str, Any]:
    """The JSON object of an event; of a stored one with `id`, `recorded_at` and `wholes`."""
    interval, payload = event.interval, event.payload
    shown: dict[str, Any] = {
        "uid": str(event.uid),
        "type": event.type,
        "interval": None
        if interval is None
        else [time_text(interval.begin), None if interval.end is None else time_text(interval.end)],
        "region": None if event.region is None else region_to_json(event.region),
        "subject": None if event.subject is None else region_to_json(event.subject),
        "features": [list(feature) for feature in event.features],
        "agent": event.agent,
        "payload": None if payload is None else {"media_type": payload.media_type, "base64": base64_text(payload.data)},
        "parts": [str(part) for part in event.parts],
    }
    if isinstance(event, StoredEvent):
        shown["id"] = event.id
        shown["recorded_at"] = time_text(event.recorded_at)
        shown["wholes"] = [str(whole) for whole in event.wholes]
    return shown


def is_tombstone(given: Any) -> bool:
    """Whether a JSON value is the line of a tombstone rather than of an event."""
    return isinstance(given, dict) and FORGOTTEN in given


def tombstone_from_json(given: Any) -> Tombstone | RunTombstone:
    """The tombstone a JSON object stands for: of an event where it has a uid, else of the rest of a forgetting."""
    line = Fields(given, what="a tombstone")
    fields = Fields(line.take(FORGOTTEN), what="a tombstone")
    line.finish()
    run, interval = parse_uid(fields.take("run"), what="'run' of a tombstone"), fields.take("interval")
    found: Tombstone | RunTombstone
    if fields.optional("uid") is not None:
        found = Tombstone(
            uid=parse_uid(fields.take("uid"), what="'uid' of a tombstone"),
            interval=_interval(interval),
            region=_region(fields.optional("region"), what="region"),
            subject=_region(fields.optional("subject"), what="subject"),
            agent=fields.optional("agent"),
            run=run,
        )
    else:
        found = RunTombstone(
            run=run,
            at=parse_time(fields.take("at"), what="'at' of a tombstone"),
            events=fields.take("events"),
            interval=None if interval is None else _interval(interval),
            regions=_hulls(fields.items("regions"), what="regions"),
            subjects=_hulls(fields.items("subjects"), what="subjects"),
        )
    fields.finish()
    return found


def tombstone_to_json(tombstone: Tombstone | RunTombstone) -> dict[str, Any]:
    """The JSON object of a tombstone."""
    interval = tombstone.interval
    ends = None if interval is None else (interval.begin, interval.end)
    span = None if ends is None else [None if end is None else time_text(end) for end in ends]
    if isinstance(tombstone, Tombstone):
        told: dict[str, Any] = {
            "uid": str(tombstone.uid),
            "interval": span,
            "region": None if tombstone.region is None else region_to_json(tombstone.region),
            "subject": None if tombstone.subject is None else region_to_json(tombstone.subject),
            "agent": tombstone.agent,
            "run": str(tombstone.run),
        }
    else:
        told = {
            "run": str(tombstone.run),
            "at": time_text(tombstone.at),
            "events": tombstone.events,
            "interval": span,
            "regions": [region_to_json(region) for region in tombstone.regions],
            "subjects": [region_to_json(region) for region in tombstone.subjects],
        }
    return {FORGOTTEN: told}


def region_to_json(region: Region) -> dict[str, Any]:
    """The JSON object of a region."""
    return {"frame": region.frame, "polygon": region.geojson}


def type_from_json(given: Any) -> EventType:
    """The type a JSON object stands for."""
    fields = Fields(given, what="a type")
    name = fields.text("type")
    parents = fields.texts("parents") if fields.optional("parents") is not None else []
    fields.finish()
    return EventType(name=name, parents=tuple(parents))


def type_to_json(event_type: EventType) -> dict[str, Any]:
    """The JSON object of a type."""
    return {"type": event_type.name, "parents": list(event_type.parents)}


def _interval(given: Any) -> Interval:
    if not isinstance(given, list) or len(given) != 2:
        raise InvalidValue(f"'interval' of an event is a pair [BEGIN, END], not {shown(given)}")
    begin, end = given
    return Interval(
        begin=parse_time(begin, what="the begin of an interval"),
        end=None if end is None else parse_time(end, what="the end of an interval"),
    )


def _region(given: Any, *, what: str) -> Region | None:
    if given is None:
        return None
    fields = Fields(given, what=f"{what!r} of an event")
    region = Region.from_geojson(fields.take("polygon"), frame=fields.text("frame"))
    fields.finish()
    return region


def _hulls(given: list[Any], *, what: str) -> tuple[Region, ...]:
    found = [_region(each, what=what) for each in given]
    return tuple(each for each in found if each is not None)


def _pairs(given: Any) -> list[tuple[str, Any]]:
    if given is None:
        return []
    if not isinstance(given, list) or not all(isinstance(pair, list) for pair in given):
        raise InvalidValue(f"'features' of an event is an array of pairs [NAME, VALUE], not {shown(given)}")
    return given


def _payload(given: Any) -> Payload:
    fields = Fields(given, what="'payload' of an event")
    payload = Payload(data=fields.base64("base64"), media_type=fields.text("media_type"))
    fields.finish()
    return payload
