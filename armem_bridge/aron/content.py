"""The identity of a data object: a hash over its content, the same wherever and in whatever order it was made.

SHA-256 over the msgpack form of `aron.binary` without its envelope, the names of every dict in the order of
their UTF-8 bytes. Two data objects that are equal have one hash, with one exception that keeps bits apart
which the codecs keep apart: 0.0 and -0.0 compare equal and hash differently. All NaN are one. Int(1),
Long(1) and Double(1.0) are three contents. Uids are made of this hash: it may never change.
"""

from __future__ import annotations

import hashlib

import msgspec

from armem_bridge.aron.data import Data, check_data

_canonical = msgspec.msgpack.Encoder(order="deterministic")


def content_hash(data: Data | None) -> bytes:
    """32 bytes that depend on nothing but the content; null has a hash too."""
    return hashlib.sha256(_canonical.encode(check_data(data, what="what to hash"))).digest()
