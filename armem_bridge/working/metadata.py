"""What a memory knows about a piece of data beside the data: how sure its source was, and three times."""

from __future__ import annotations

import msgspec

from armem_bridge.moments import NOT_SET


class Metadata(msgspec.Struct, frozen=True, kw_only=True):
    """The metadata of one instance; all instances of an update have the same.

    `referenced` is the time that the data are about and `sent` the time at which the client sent them, by
    its clock; `arrived` is when the memory server had them, by its own. Where the client did not say when it
    sent them, that is `sent` too. Negative times are not set.
    """

    confidence: float = 1.0
    referenced: int = NOT_SET
    sent: int = NOT_SET
    arrived: int = NOT_SET
