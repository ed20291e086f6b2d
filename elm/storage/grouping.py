"""Rows of sums as groups: their keys as values, those that are one value together, in order."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any

import msgspec

from elm.features import identity, kind_of
from elm.query import ByFeature, Group, Grouping
from elm.storage.names import NameCache
from elm.storage.rows import moment


def merged(rows: Sequence[Sequence[Any]], by: Grouping | ByFeature, names: NameCache) -> list[Group]:
    """The groups of the rows of `recall_statements.groups`, sorted; values that are one number are one key."""
    groups: dict[Any, Group] = {}
    for *raw, number, micros, first, last, is_open in rows:
        key = _key(raw, by, names)
        shown = key if key is None or not isinstance(by, ByFeature) else identity(("", key))
        group = Group(
            key=key,
            count=number,
            duration=timedelta(microseconds=int(micros)),
            first_begin=moment(first),
            last_end=None if is_open else moment(last),
        )
        known = groups.get(shown)
        groups[shown] = group if known is None else _together(known, group)
    return sorted(groups.values(), key=lambda group: _place(group.key))


def _key(raw: Sequence[Any], by: Grouping | ByFeature, names: NameCache) -> Any:
    if any(part is None for part in raw):
        return None
    match by:
        case Grouping.TYPE:
            return names.types[raw[0]]
        case Grouping.FRAME:
            return names.frames[raw[0]]
        case Grouping.AGENT:
            return raw[0]
        case Grouping.DAY | Grouping.HOUR:
            return moment(raw[0])
        case ByFeature():
            kind, text = raw
            return text if kind == "string" else msgspec.json.decode(text)


def _together(one: Group, other: Group) -> Group:
    ends = (one.last_end, other.last_end)
    return Group(
        key=one.key,
        count=one.count + other.count,
        duration=one.duration + other.duration,
        first_begin=min(one.first_begin, other.first_begin),
        last_end=None if None in ends else max(end for end in ends if end is not None),
    )


def _place(key: Any) -> tuple[bool, str, Any]:
    """Where a key stands: None last; of feature values bools before numbers before strings."""
    if key is None:
        return True, "", 0
    return False, "" if isinstance(key, datetime) else kind_of(key), key
