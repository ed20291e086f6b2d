"""The query that an ID on the command line comes to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from armem_bridge.memory_id import MemoryID
    from armem_bridge.working import Query

_S = TypeVar("_S", covariant=True)


class _Selector(Protocol[_S]):
    def all(self) -> _S: ...

    def name(self, name: str) -> _S: ...


def snapshots_query(wanted: MemoryID, *, last: int, with_data: bool) -> Query:
    """The `last` snapshots (all where that is negative) of each entity that an ID contains, or the one it names."""
    from armem_bridge.working import QueryBuilder

    builder = QueryBuilder()
    memory = builder.memories.all()
    provider = _pick(_pick(memory.core_segments, wanted.core_segment).provider_segments, wanted.provider_segment)
    snapshots = _pick(provider.entities, wanted.entity).snapshots
    if wanted.timestamp >= 0:
        snapshots.at(wanted.timestamp)
    elif last < 0:
        snapshots.all()
    else:
        snapshots.latest_n(last)
    return builder.build(with_data=with_data)


def names_query(wanted: MemoryID) -> Query:
    """The names one level below the ID of a memory or segment."""
    from armem_bridge.working import QueryBuilder

    builder = QueryBuilder()
    cores = builder.memories.all().core_segments
    if not wanted.core_segment:
        cores.all()
    elif not wanted.provider_segment:
        cores.name(wanted.core_segment).provider_segments.all()
    else:
        cores.name(wanted.core_segment).provider_segments.name(wanted.provider_segment).entities.all()
    return builder.build(with_data=False)


def _pick(selector: _Selector[_S], name: str) -> _S:
    return selector.name(name) if name else selector.all()
