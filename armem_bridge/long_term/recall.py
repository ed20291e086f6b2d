"""elm cues over ArmarX memory: snapshots found by space, time, type and features, whatever memory they are of."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count, islice
from typing import Final

from armem_bridge.long_term.mapping import ENTITY, below, is_snapshot, snapshot_of
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import to_datetime
from armem_bridge.working.snapshot import Snapshot
from armem_bridge.working.versions import what_counts
from elm.app import Memory
from elm.cues import any_of, features, time
from elm.cues.algebra import Cue
from elm.event import StoredEvent
from elm.interval import Interval
from elm.query import Cursor, Nearest, Order
from elm.recollector import PAGE, OrderName, Recollection

_TOGETHER: Final = 50
"""Of so many snapshots at once it is asked whether other versions of them count."""


def snapshots_cue(*, entity: str | MemoryID | None = None, cue: Cue | None = None) -> Cue:
    """The cue for consolidated snapshots: of an entity by its name in whatever segment, or of all that an ID contains.

    `cue` is any further condition; it is about the events that docs/formats.md describes.
    """
    if entity is None:
        wanted = below(MemoryID())
    elif isinstance(entity, MemoryID):
        wanted = below(entity)
        if entity.timestamp >= 0:
            wanted = wanted & time("equal", Interval.at(to_datetime(entity.timestamp)))
    else:
        wanted = features("superset", {ENTITY: entity})
    return wanted if cue is None else wanted & cue


def recall_snapshots(
    memory: Memory,
    cue: Cue | None = None,
    *,
    entity: str | MemoryID | None = None,
    order: OrderName = Order.BEGIN,
    limit: int | None = None,
    all_versions: bool = False,
) -> Iterator[Snapshot]:
    """The consolidated snapshots in an elm memory that match a cue, with their IDs, as they are read.

    Only versions that count are found unless `all_versions` are asked for: that an earlier version of a
    snapshot matches does not help one that counts and does not. What still waits to be consolidated is
    not found: `flush` the archive before, where that matters. `limit` counts what is found.
    """
    wanted = snapshots_cue(entity=entity, cue=cue)
    if all_versions:
        events = iter(memory.recall(wanted, order=order, limit=limit))
    elif limit is None or isinstance(order, Nearest):
        events = iter(memory.recall(wanted, order=order))
    else:
        events = _paged(memory.recall(wanted, order=order), limit + 1)
    found = (snapshot_of(event) for event in events if is_snapshot(event))
    return islice(found if all_versions else _counting(memory, found), limit)


def _paged(recollection: Recollection, size: int) -> Iterator[StoredEvent]:
    """The events, few at a time at first: nobody knows how many of them are versions that count."""
    after: Cursor | None = None
    while True:
        page = recollection.page(min(size, PAGE), after=after)
        yield from page.events
        if page.cursor is None:
            return
        after, size = page.cursor, 2 * size


def _counting(memory: Memory, found: Iterator[Snapshot]) -> Iterator[Snapshot]:
    """Of these versions of snapshots those that count, in view of all versions that the memory has."""
    together = count(1)
    while chunk := list(islice(found, min(8 * next(together), _TOGETHER))):
        moments = {snapshot.id for snapshot in chunk}
        same = any_of(*(below(each) & time("equal", Interval.at(to_datetime(each.timestamp))) for each in moments))
        entities: dict[MemoryID, list[Snapshot]] = {}
        others = (snapshot_of(event) for event in memory.recall(same) if is_snapshot(event))
        for snapshot in (*chunk, *others):
            entities.setdefault(snapshot.id.entity_id, []).append(snapshot)
        # Of equal versions the first one counts, which is the one that was found.
        best = {id(each) for versions in entities.values() for each in what_counts(versions)}
        yield from (snapshot for snapshot in chunk if id(snapshot) in best)
