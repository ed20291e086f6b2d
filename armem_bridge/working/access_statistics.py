"""Access statistics: how often and when last the snapshots in working memory were asked for (section 4.5.1)."""

from __future__ import annotations

import msgspec

from armem_bridge.moments import NOT_SET


class Usage(msgspec.Struct, frozen=True, kw_only=True):
    """How a snapshot was used while it was in working memory: it is used whenever a query returns it."""

    count: int = 0
    """So many queries returned it."""

    last: int = NOT_SET
    """When the last one did, by the server's clock; not set as long as none did."""

    def again(self, moment: int) -> Usage:
        """The same after one more use; a clock that was set back does not make it older."""
        return Usage(count=self.count + 1, last=max(self.last, moment))


UNUSED = Usage()
