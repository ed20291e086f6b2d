"""The words of pgstac's searches: CQL2 as JSON, and how features, payloads and times are written in items."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from hashlib import md5
from typing import Any

from simulators.opponents.sides.spelling import token

Item = dict[str, Any]
"""A JSON object: an item, or an expression."""

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def cql(operator: str, *arguments: Any) -> Item:
    """An operator with its arguments."""
    return {"op": operator, "args": list(arguments)}


def named(name: str) -> Item:
    """A property of an item, by name."""
    return {"property": name}


def ids(uids: Sequence[str]) -> Item:
    """The items with these ids."""
    return cql("in", named("id"), list(uids))


def when(relation: str, asked: Any) -> Item:
    """By comparisons with both ends, which the index on them serves; CQL2's `t_during` leaves shared ends out."""
    begin, end = {"timestamp": timestamp(asked["begin"])}, {"timestamp": timestamp(asked["end"])}
    begins, ends = named("datetime"), named("end_datetime")
    match relation:
        case "equal":
            return cql("and", cql("=", begins, begin), cql("=", ends, end))
        case "subset":
            return cql("and", cql(">=", begins, begin), cql("<=", begins, end), cql("<=", ends, end))
        case "superset":
            return cql("and", cql("<=", begins, begin), cql(">=", ends, end))
        case _:
            return cql("and", cql("<=", begins, end), cql(">=", ends, begin))


def tokens(features: Sequence[Sequence[Any]]) -> list[str]:
    """Features as a sorted set of texts; numbers are equal by value, and no number is a bool."""
    return sorted({token(name, value) for name, value in features})


def digest(payload: bytes) -> str:
    """What a payload is indexed by."""
    return md5(payload, usedforsecurity=False).hexdigest()


def timestamp(micros: int) -> str:
    """A time in microseconds since 1970 as text."""
    return (_EPOCH + timedelta(microseconds=micros)).isoformat(timespec="microseconds").replace("+00:00", "Z")
