"""Points in time and links to memory in ARON data, as ArmarX's clients write them, and what they have where not set.

A point in time is `{timeSinceEpoch: {microSeconds}, clockType, hostname}`; of clock and host nothing is read. A link
is `{memoryName, coreSegmentName, providerSegmentName, entityName, timestamp, instanceIndex}`.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any, Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.data import Data, Dict, Int, Long, String
from armem_bridge.errors import NotRealized
from armem_bridge.moments import INVALID, from_datetime, to_datetime

SINCE_EPOCH: Final = "timeSinceEpoch"
MICROSECONDS: Final = "microSeconds"
INDEX: Final = "instanceIndex"

_NO_INDEX: Final = -1
_REALTIME: Final = 0
"""The clock that counts from 1970, among ArmarX's types of clocks."""


def date_time(moment: int) -> Dict:
    """A moment as data have it, by the real clock and of no host; where it is not set what ArmarX has for none."""
    since = Dict({MICROSECONDS: Long(moment if moment >= 0 else INVALID)})
    return Dict({SINCE_EPOCH: since, "clockType": Int(_REALTIME), "hostname": String("")})


def date_time_of(moment: datetime) -> Dict:
    """A datetime as data have it. Raises `InvalidMoment` where it has no zone or is before 1970."""
    return date_time(from_datetime(moment))


def moment_of(data: Data | None) -> int:
    """The microseconds of a point in time; negative where it is not set. Raises `NotRealized` for what is none."""
    since = dict_of(dict_of(data, "a point in time").get(SINCE_EPOCH), f"{SINCE_EPOCH} of a point in time")
    moment: int = scalar_of(since.get(MICROSECONDS), Long, f"{MICROSECONDS} of a point in time")
    return moment


def date_time_from(data: Data | None) -> datetime:
    """The UTC datetime of a point in time. Raises `NotRealized`, `InvalidMoment` where it is not set."""
    return to_datetime(moment_of(data))


def dict_of(data: Data | None, what: str) -> Mapping[str, Data | None]:
    """The elements of a Dict. Raises `NotRealized`, naming `what`, for anything else."""
    if not isinstance(data, Dict):
        raise NotRealized(f"{what} is a Dict, not {_shown(data)}")
    return data.elements


def scalar_of(data: Data | None, kind: type[String | Int | Long], what: str) -> Any:
    """The value of a data object of one kind. Raises `NotRealized`, naming `what`, for anything else."""
    if not isinstance(data, kind):
        raise NotRealized(f"{what} is a {kind.__name__}, not {_shown(data)}")
    return data.value


def unset_member(owner: t.Object, key: str) -> int | None:
    """What ArmarX has in a member of its points in time and links where that is not set; None for all other members.

    Of a point in time it is the number of microseconds in the member.
    """
    member = owner.members[key]
    if key == SINCE_EPOCH and isinstance(member, t.Object) and not member.maybe:
        return INVALID if member.all_members.get(MICROSECONDS) == t.Long() else None
    if key == INDEX and member == t.Int() and {"memoryName", "timestamp"} <= owner.all_members.keys():
        return _NO_INDEX
    return None


def _shown(data: Data | None) -> str:
    return "null" if data is None else f"a {type(data).__name__}"
