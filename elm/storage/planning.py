"""How statements are planned: the settings of connections that write, that recall, and that look at a few rows."""

from __future__ import annotations

from enum import Enum
from types import MappingProxyType

SESSION = {
    "TimeZone": "UTC",
    "jit": "off",
    "random_page_cost": "1.1",
    # The locks that writers take are only right where each statement sees what was committed before it.
    "default_transaction_isolation": "read committed",
    "work_mem": "64MB",
}
# The write statements are always the same plan; finding it anew would cost more than running it.
WRITING = {"plan_cache_mode": "force_generic_plan"}
# A recall's best plan depends on the cue's values, and starting parallel workers costs more than they save.
# What is read by a cursor is read to its end.
RECALLING = {
    "plan_cache_mode": "force_custom_plan",
    "max_parallel_workers_per_gather": "0",
    "cursor_tuple_fraction": "1",
}
# But for events asked for one by one there is one good plan, and to make it anew costs more than to run it.
ONCE = {**RECALLING, "plan_cache_mode": "force_generic_plan"}
# Who looks for a few rows by an index is not to read the table from its beginning, because many are expected to match.
BY_ANY_INDEX = {**RECALLING, "enable_seqscan": "off"}
# Lists of what has a feature are intersected whole. If two that are long have little in common, no other index is to be
# walked from end to end in search of it, because by their lengths much was expected.
BY_LISTS = {**BY_ANY_INDEX, "enable_indexscan": "off"}
# What reads a few entries of an index and stops reads them one by one, never all of them ahead or the table instead.
BY_INDEX = {**ONCE, "enable_seqscan": "off", "enable_bitmapscan": "off"}


class Planning(Enum):
    """How the statements of a connection to recall with are planned: the settings for that."""

    ANEW = MappingProxyType(RECALLING)
    """Each for its values."""
    BY_ANY_INDEX = MappingProxyType(BY_ANY_INDEX)
    """Each for its values, and rows are found by indexes."""
    BY_LISTS = MappingProxyType(BY_LISTS)
    """Each for its values, and rows are found by all that several indexes have, not one by one."""
    ONCE = MappingProxyType(ONCE)
    """A prepared one once, whatever its values."""
    BY_INDEX = MappingProxyType(BY_INDEX)
    """Likewise, and rows are found one by one along indexes."""

    @property
    def prepare(self) -> bool | None:
        """What the driver is told: to prepare what is planned once, and anything else as it sees fit."""
        return True if self in (Planning.ONCE, Planning.BY_INDEX) else None
