"""The query tree: what to select at each level of a memory, from memories down to snapshots (section 4.4.3)."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import TYPE_CHECKING, TypeVar, get_args

import msgspec
from msgspec.structs import force_setattr

from armem_bridge.moments import GREATEST, INVALID, NOT_SET
from armem_bridge.working.patterns import name_matcher
from armem_bridge.working.refusals import InvalidQuery

_Node = TypeVar("_Node")


# Which names, at the levels that have them


class AllNames(msgspec.Struct, frozen=True, kw_only=True, tag="all"):
    """Everything at this level."""


class SingleName(msgspec.Struct, frozen=True, kw_only=True, tag="single"):
    """What has this name."""

    name: str

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise InvalidQuery(f"a query selects by a name, which is text, not by {self.name!r:.80}")


class RegexNames(msgspec.Struct, frozen=True, kw_only=True, tag="regex"):
    """What has a name that matches as a whole; `armem_bridge.working.patterns` says what is allowed."""

    pattern: str

    def __post_init__(self) -> None:
        name_matcher(self.pattern)


Names = AllNames | SingleName | RegexNames
"""How names are selected."""


# Which snapshots of an entity


class AllSnapshots(msgspec.Struct, frozen=True, kw_only=True, tag="all"):
    """The whole history."""


class SingleSnapshot(msgspec.Struct, frozen=True, kw_only=True, tag="single"):
    """The snapshot with exactly this reference time; without a time the latest."""

    timestamp: int = NOT_SET

    def __post_init__(self) -> None:
        _check_time(self.timestamp, "the timestamp of a query for a single snapshot")


class LatestSnapshots(msgspec.Struct, frozen=True, kw_only=True, tag="latest"):
    """The snapshots with the greatest reference times."""

    count: int = 1

    def __post_init__(self) -> None:
        _check_integer(self.count, "the number of latest snapshots")
        if self.count < 0:
            raise InvalidQuery(f"the number of latest snapshots is 0 or more, not {self.count}")


class IndexRange(msgspec.Struct, frozen=True, kw_only=True, tag="index_range"):
    """The snapshots from one position to another, both included: 0 is the earliest, -1 the latest.

    Positions beyond either end only cut the range short.
    """

    first: int = 0
    last: int = -1

    def __post_init__(self) -> None:
        _check_integer(self.first, "the first position of an index range")
        _check_integer(self.last, "the last position of an index range")


class BeforeTime(msgspec.Struct, frozen=True, kw_only=True, tag="before"):
    """The last snapshots strictly before a time: at most `max_entries`, or all where that is negative."""

    timestamp: int
    max_entries: int = 1

    def __post_init__(self) -> None:
        _check_set(self.timestamp, "the timestamp of a query for snapshots before it")
        _check_integer(self.max_entries, "the number of entries before a time")


class AtOrBefore(msgspec.Struct, frozen=True, kw_only=True, tag="at_or_before"):
    """The snapshot that was the latest at a time: the one with that reference time, or else the last before it."""

    timestamp: int

    def __post_init__(self) -> None:
        _check_set(self.timestamp, "the timestamp of a query for the snapshot at or before it")


class TimeRange(msgspec.Struct, frozen=True, kw_only=True, tag="time_range"):
    """The snapshots from one reference time to another, both included; a time not set leaves that side open."""

    min_timestamp: int = NOT_SET
    max_timestamp: int = NOT_SET

    def __post_init__(self) -> None:
        _check_time(self.min_timestamp, "the begin of a time range")
        _check_time(self.max_timestamp, "the end of a time range")


class Approximate(msgspec.Struct, frozen=True, kw_only=True, tag="approximate"):
    """The snapshots around a time: the one with that reference time, or else its neighbours on both sides.

    A neighbour counts if it is at most `eps` microseconds away; a negative `eps` takes any.
    """

    timestamp: int
    eps: int = NOT_SET

    def __post_init__(self) -> None:
        _check_set(self.timestamp, "the timestamp of an approximate query")
        _check_time(self.eps, "the tolerance of an approximate query")


SnapshotQuery = (
    AllSnapshots | SingleSnapshot | LatestSnapshots | IndexRange | BeforeTime | AtOrBefore | TimeRange | Approximate
)
"""How snapshots of an entity are selected."""


# The levels


class EntityQuery(msgspec.Struct, frozen=True, kw_only=True):
    """Entities by their names, and of each the snapshots that any of `snapshots` selects."""

    names: Names
    snapshots: tuple[SnapshotQuery, ...] = ()

    if TYPE_CHECKING:

        def __init__(self, *, names: Names, snapshots: Iterable[SnapshotQuery] = ...) -> None: ...

    def __post_init__(self) -> None:
        _check_names(self.names)
        force_setattr(self, "snapshots", _nodes(self.snapshots, get_args(SnapshotQuery), "snapshots"))


class ProviderSegmentQuery(msgspec.Struct, frozen=True, kw_only=True):
    """Provider segments by their names, and of each the entities that any of `entities` selects."""

    names: Names
    entities: tuple[EntityQuery, ...] = ()

    if TYPE_CHECKING:

        def __init__(self, *, names: Names, entities: Iterable[EntityQuery] = ...) -> None: ...

    def __post_init__(self) -> None:
        _check_names(self.names)
        force_setattr(self, "entities", _nodes(self.entities, (EntityQuery,), "entities"))


class CoreSegmentQuery(msgspec.Struct, frozen=True, kw_only=True):
    """Core segments by their names, and of each the provider segments that any of `provider_segments` selects."""

    names: Names
    provider_segments: tuple[ProviderSegmentQuery, ...] = ()

    if TYPE_CHECKING:

        def __init__(self, *, names: Names, provider_segments: Iterable[ProviderSegmentQuery] = ...) -> None: ...

    def __post_init__(self) -> None:
        _check_names(self.names)
        nodes = _nodes(self.provider_segments, (ProviderSegmentQuery,), "provider segments")
        force_setattr(self, "provider_segments", nodes)


class MemoryQuery(msgspec.Struct, frozen=True, kw_only=True):
    """Memories by their names, and of each the core segments that any of `core_segments` selects."""

    names: Names
    core_segments: tuple[CoreSegmentQuery, ...] = ()

    if TYPE_CHECKING:

        def __init__(self, *, names: Names, core_segments: Iterable[CoreSegmentQuery] = ...) -> None: ...

    def __post_init__(self) -> None:
        _check_names(self.names)
        force_setattr(self, "core_segments", _nodes(self.core_segments, (CoreSegmentQuery,), "core segments"))


class QueryTarget(StrEnum):
    """Which memory answers."""

    WM = "wm"
    """Working memory alone."""

    LTM = "ltm"
    """Long-term memory alone."""

    BOTH = "both"
    """Both as if they were one."""


class Query(msgspec.Struct, frozen=True, kw_only=True):
    """A whole query: several selections at one level give their union, in one result.

    A memory server answers for the memory that it is; a selection of other names it finds empty. Without
    data the result is the same tree, with null in every instance.
    """

    memories: tuple[MemoryQuery, ...] = ()
    target: QueryTarget = QueryTarget.WM
    with_data: bool = True

    if TYPE_CHECKING:

        def __init__(
            self, *, memories: Iterable[MemoryQuery] = ..., target: QueryTarget = ..., with_data: bool = ...
        ) -> None: ...

    def __post_init__(self) -> None:
        force_setattr(self, "memories", _nodes(self.memories, (MemoryQuery,), "memories"))
        if type(self.target) is not QueryTarget:
            force_setattr(self, "target", _target(self.target))


def check_query(query: Query) -> None:
    """Raise `InvalidQuery` for what is no query, such as a builder of one."""
    if not isinstance(query, Query):
        raise InvalidQuery(
            f"a memory is asked with a Query, not with a {type(query).__name__}: a QueryBuilder makes one with build()"
        )


def _target(given: str) -> QueryTarget:
    try:
        return QueryTarget(given)
    except ValueError as error:
        raise InvalidQuery(f"the target of a query is one of {', '.join(QueryTarget)}, not {given!r:.80}") from error


def _nodes(given: Iterable[_Node], kinds: tuple[type, ...], level: str) -> tuple[_Node, ...]:
    """The queries of one level as a tuple, when the server knows every one's class."""
    nodes = given if type(given) is tuple else tuple(given)
    for node in nodes:
        if type(node) not in kinds:
            raise InvalidQuery(
                f"a query for {level} of the class {type(node).__name__} is unknown here: "
                f"take one of {', '.join(kind.__name__ for kind in kinds)}"
            )
    return nodes


def _check_names(names: object) -> None:
    if type(names) not in (AllNames, SingleName, RegexNames):
        raise InvalidQuery(f"names are selected by AllNames, SingleName or RegexNames, not by a {type(names).__name__}")


def _check_integer(value: object, what: str) -> None:
    if type(value) is not int:
        raise InvalidQuery(f"{what} is an integer, not {value!r:.80}")


def _check_time(moment: object, what: str) -> None:
    if type(moment) is not int or not INVALID <= moment <= GREATEST:
        raise InvalidQuery(f"{what} is microseconds in 64 bits, not {moment!r:.80}")


def _check_set(moment: object, what: str) -> None:
    _check_time(moment, what)
    if moment < 0:  # type: ignore[operator]
        raise InvalidQuery(f"{what} is not set: give microseconds since 1970")
