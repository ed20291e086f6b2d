"""The payload of a consolidated snapshot: its instances with their metadata, in binary form and lossless.

One msgpack array `["armem", major, [[confidence, sent, referenced, data] ...]]`, where `referenced` is nil
unless it differs from the reference time of the snapshot, and `data` are bytes as `aron.binary` writes them.
The time of arrival is not in it, for it is no part of the content.
"""

from __future__ import annotations

from typing import Final

import msgspec

from armem_bridge.aron.binary import decode, encode
from armem_bridge.aron.data import Dict
from armem_bridge.aron.versions import MAJOR
from armem_bridge.errors import UnknownCodecVersion
from armem_bridge.long_term.refusals import NoSnapshot
from armem_bridge.moments import GREATEST
from armem_bridge.working.metadata import Metadata
from armem_bridge.working.snapshot import Instance

KIND: Final = "application/vnd.elm.armem-snapshot"
"""What the media type of every such payload begins with."""

MEDIA_TYPE: Final = f"{KIND}; version={MAJOR}"
"""The media type, with the major version of the ARON codec."""


class _Instance(msgspec.Struct, array_like=True, frozen=True):
    confidence: float
    sent: int
    referenced: int | None
    data: bytes


class _Envelope(msgspec.Struct, array_like=True, frozen=True, tag_field="format", tag="armem"):
    major: int
    instances: tuple[_Instance, ...]


_encoder = msgspec.msgpack.Encoder()
_decoder = msgspec.msgpack.Decoder(_Envelope)


def is_snapshot(media_type: str) -> bool:
    """Whether a payload of this media type holds instances, in whichever version."""
    return media_type.partition(";")[0].strip() == KIND


def pack(instances: tuple[Instance, ...], *, timestamp: int) -> bytes:
    """The instances of a snapshot of that reference time as bytes; `unpack` gives them back."""
    packed = tuple([_packed(instance, timestamp) for instance in instances])
    return _encoder.encode(_Envelope(MAJOR, packed))


def _packed(instance: Instance, timestamp: int) -> _Instance:
    known = instance.metadata
    referenced = None if known.referenced == timestamp else known.referenced
    return _Instance(known.confidence, known.sent, referenced, encode(instance.data, limit=GREATEST))


def unpack(data: bytes, media_type: str, *, timestamp: int, arrived: int) -> tuple[Instance, ...]:
    """The instances that `pack` wrote, all of them with the given time of arrival.

    Raises `UnknownCodecVersion` for another major version, `NoSnapshot` for anything that is no such payload.
    """
    if media_type != MEDIA_TYPE:
        if is_snapshot(media_type):
            raise UnknownCodecVersion(
                f"a snapshot has the media type {media_type!r}, and this elm reads {MEDIA_TYPE!r}: "
                f"upgrade elm to read it"
            )
        raise NoSnapshot(f"a payload of media type {media_type!r} holds no instances: those have {MEDIA_TYPE!r}")
    try:
        envelope = _decoder.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise NoSnapshot(f"the payload of a snapshot cannot be read: {str(error)[:300]}") from error
    return tuple([_unpacked(each, timestamp, arrived) for each in envelope.instances])


def _unpacked(packed: _Instance, timestamp: int, arrived: int) -> Instance:
    data = decode(packed.data, limit=GREATEST)
    if data is not None and type(data) is not Dict:
        raise NoSnapshot(f"an instance of a snapshot is a {type(data).__name__}, not a Dict or null: it is damaged")
    referenced = timestamp if packed.referenced is None else packed.referenced
    return Instance(
        data=data,
        metadata=Metadata(confidence=packed.confidence, referenced=referenced, sent=packed.sent, arrived=arrived),
    )
