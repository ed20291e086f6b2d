"""The bridge's binary form of ARON data objects: msgpack, lossless, with a version that readers check.

One msgpack array `["aron", major, minor, data]`, where `data` is nil or an array of a kind and its fields:

    ["s", text] ["b", bool] ["i", int] ["l", int] ["f", float] ["d", float]
    ["[", [data ...]] ["{", {name: data ...}] ["n", [extents ..., bytes per element], type, bytes]

Nothing here depends on ArmarX's own serializations, which its slice files define.
"""

from __future__ import annotations

from typing import Final

import msgspec

from armem_bridge.aron.data import Data, check_data
from armem_bridge.aron.versions import MAJOR, MINOR, check_version
from armem_bridge.errors import TooLarge, Undecodable

SIZE_LIMIT: Final = 512 * 1024 * 1024
"""How many bytes an encoded object may have unless the caller says otherwise."""

WHAT: Final = "an ARON object in binary form"


class _Envelope(msgspec.Struct, array_like=True, frozen=True, tag_field="format", tag="aron"):
    major: int
    minor: int
    data: Data | None


_encoder = msgspec.msgpack.Encoder()
_decoder: msgspec.msgpack.Decoder[Data | None] = msgspec.msgpack.Decoder(Data | None)
_head_decoder = msgspec.msgpack.Decoder(tuple[str, int, int, msgspec.Raw])

_PREFIX: Final = msgspec.msgpack.encode(["aron", MAJOR, MINOR, None])[:-1]


def encode(data: Data | None, *, limit: int = SIZE_LIMIT) -> bytes:
    """The data object as bytes; `decode` gives it back equal in everything, the order of names included.

    Raises `TooLarge` when there are more than `limit` bytes.
    """
    encoded = _encoder.encode(_Envelope(MAJOR, MINOR, check_data(data, what="what to encode")))
    if len(encoded) > limit:
        raise TooLarge(
            f"{WHAT} has {len(encoded):,} bytes, over the limit of {limit:,}: "
            f"raise the limit, or keep large arrays elsewhere"
        )
    return encoded


def decode(encoded: bytes | bytearray | memoryview, *, limit: int = SIZE_LIMIT) -> Data | None:
    """The data object that `encode` wrote.

    Raises `UnknownCodecVersion` for another major version, `Undecodable` for anything that is no such
    object (broken, cut, nested too deep, out of range), `TooLarge` for more than `limit` bytes.
    """
    if len(encoded) > limit:
        raise TooLarge(f"{WHAT} has {len(encoded):,} bytes, over the limit of {limit:,}: raise the limit to read it")
    try:
        if encoded[: len(_PREFIX)] == _PREFIX:
            return _decoder.decode(memoryview(encoded)[len(_PREFIX) :])
        return _decoder.decode(_body(encoded))
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise undecodable(error, what=WHAT) from error


def _body(encoded: bytes | bytearray | memoryview) -> msgspec.Raw:
    """The part with the data, of an object that another version wrote or another program."""
    name, major, minor, body = _head_decoder.decode(encoded)
    if name != "aron":
        raise Undecodable(f"{WHAT} begins with {name!r:.40} instead of 'aron': it is something else")
    check_version(major, minor, what=WHAT)
    return body


def undecodable(error: Exception, *, what: str) -> Undecodable:
    """What a decoder's refusal means, in one line of readable length."""
    if isinstance(error, RecursionError):
        return Undecodable(f"{what} nests too deep to be read")
    return Undecodable(f"{what} cannot be read: {str(error)[:300]}")
