"""What is measured: memories of one entity with 1,000 snapshots, of which every new one drops the oldest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import (
    Commit,
    CoreSegmentDefinition,
    EntityUpdate,
    MemoryServer,
    Query,
    QueryBuilder,
    QueryTarget,
)
from armem_bridge.working.builder import SnapshotsSelector
from armem_bridge.working.limits import HistoryLimits
from armem_bridge.working.versions import snapshot_of
from armem_bridge.working.working_memory import WorkingMemory
from simulators.armem.data_objects import Kind

ENTRIES: Final = 1_000
"""Snapshots in a memory, before a batch and after it."""

BEGIN: Final = 1_700_000_000_000_000
"""The reference time of the first snapshot."""

SEGMENT: Final = "Data"
"""The core segment of every memory here."""

_MODELS: Final = 10
"""So many different objects are in the past, each of them many times: the memory shares them."""


def entity(kind: Kind) -> MemoryID:
    """The entity that all snapshots of a kind are of. Each kind has a memory of its own, which has its name."""
    return MemoryID(memory=kind.name, core_segment=SEGMENT, provider_segment="Producer", entity="thing")


def batch(kind: Kind, data: Sequence[Dict], first: int) -> Commit:
    """A commit of one update for each of `data`; `first` is how many entries there were before in all."""
    named = entity(kind)
    return Commit(
        updates=[
            EntityUpdate(entity=named, instances=(each,), referenced=BEGIN + first + index)
            for index, each in enumerate(data)
        ]
    )


def latest(kind: Kind, count: int) -> Query:
    """A query for the last `count` entries."""
    builder = QueryBuilder()
    _snapshots(builder, kind).latest_n(count)
    return builder.build()


def at(kind: Kind, moment: int, target: QueryTarget) -> Query:
    """A query for the entry of a reference time."""
    builder = QueryBuilder()
    _snapshots(builder, kind).at(moment)
    return builder.build(target=target)


def _snapshots(builder: QueryBuilder, kind: Kind) -> SnapshotsSelector:
    memory, core, provider, name = entity(kind).names
    segment = builder.memories.name(memory).core_segments.name(core).provider_segments.name(provider)
    return segment.entities.name(name).snapshots


def make_server(kind: Kind) -> MemoryServer:
    """A memory server with the past; its segment has the type of the data."""
    server = MemoryServer(
        kind.name,
        [CoreSegmentDefinition(name=SEGMENT, aron_type=kind.type_object)],
        limits={entity(kind): ENTRIES},
    )
    server.commit(_past(kind))
    return server


def make_working_memory(kind: Kind) -> WorkingMemory:
    """The same without a server around it, for what only searches and inserts."""
    memory = WorkingMemory(
        kind.name,
        [CoreSegmentDefinition(name=SEGMENT, aron_type=kind.type_object)],
        HistoryLimits({entity(kind): ENTRIES}),
    )
    with memory.lock:
        for update in _past(kind).updates:
            memory.put(snapshot_of(update, arrived=update.referenced))
    return memory


def _past(kind: Kind) -> Commit:
    models = [kind.make(number).to_aron() for number in range(_MODELS)]
    return batch(kind, [models[number % _MODELS] for number in range(ENTRIES)], 0)
