"""`elm armem ls`: what there is below a part of a memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armem_bridge.cli.answering import Answering, LongTerm, Server, answering
from armem_bridge.cli.naming import WantedOrAll, memory_id
from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.recalling import TABLE_LIMIT
from elm.cli.rows import RowFormat, RowOutput, row_format, write_rows
from elm.cli.terminal import say

if TYPE_CHECKING:
    from armem_bridge.memory_id import MemoryID
    from armem_bridge.working import Memory

_PARTS: Sequence[str] = ("id", "level", "versions", "first", "last")
_SNAPSHOTS: Sequence[str] = ("id", "referenced", "instances", "confidence", "sent", "arrived")


@takes_groups
def ls(
    *,
    wanted: WantedOrAll = "",
    limit: Annotated[
        int | None,
        typer.Option("--limit", min=1, metavar="N", help=f"At most N rows. Default: all; {TABLE_LIMIT} in a table."),
    ] = None,
    server: Server = None,
    output: RowOutput = None,
    where: MemoryOptions,
) -> None:
    """List what is below a part of a memory; exit code 4 when nothing is.

    Of memories, segments and entities: how many versions of snapshots were consolidated, and the first and last
    reference time. Of an entity, its snapshots.
    """
    from armem_bridge.memory_id import Level

    parent, form = memory_id(wanted), row_format(output)
    with answering(where, server) as asked:
        of_entity = parent.level >= Level.ENTITY
        rows = list(_snapshots(asked, parent, form) if of_entity else _parts(asked, parent, form))
    if limit is None and form is RowFormat.TABLE:
        limit = TABLE_LIMIT
    shown = rows[:limit]
    write_rows(_SNAPSHOTS if of_entity else _PARTS, shown, form, right=("versions", "instances", "confidence"))
    if not rows:
        say("nothing there")
        raise typer.Exit(ExitCode.NOTHING_MATCHED)
    if len(shown) < len(rows):
        say(f"first {len(shown):,} of {len(rows):,}; --limit N for more")


def _parts(asked: Answering, parent: MemoryID, form: RowFormat) -> Iterable[tuple[Any, ...]]:
    """The memories, segments or entities one level below."""
    from armem_bridge.memory_id import Level

    level = str(Level(parent.level + 1))
    if isinstance(asked, LongTerm):
        from armem_bridge.long_term.mapping import NAMES, below
        from elm.errors import MemoryMissing
        from elm.interval import to_micros
        from elm.query import ByFeature

        try:
            groups = list(asked.elm.recall(below(parent)).groups(ByFeature(name=NAMES[parent.level])))
        except MemoryMissing:
            return
        for group in sorted(groups, key=lambda group: str(group.key)):
            # A snapshot is an instant, so its end is known.
            last = group.first_begin if group.last_end is None else group.last_end
            first, end = (_time(to_micros(each), form) for each in (group.first_begin, last))
            yield str(_below(parent, str(group.key))), level, group.count, first, end
        return
    if parent.level is Level.NOTHING:
        names: Iterable[str] = asked.memories()
    else:
        from armem_bridge.cli.selecting import names_query

        names = _names(asked.query(parent.memory, names_query(parent)), parent)
    for name in names:
        yield str(_below(parent, name)), level, None, None, None


def _names(found: Memory, parent: MemoryID) -> Iterable[str]:
    cores = found.core_segments
    if not parent.core_segment:
        return cores
    core = cores.get(parent.core_segment)
    if core is None or not parent.provider_segment:
        return core.provider_segments if core is not None else ()
    provider = core.provider_segments.get(parent.provider_segment)
    return provider.entities if provider is not None else ()


def _below(parent: MemoryID, name: str) -> MemoryID:
    """The ID of what has that name one level below a memory or segment; of a memory, below nothing."""
    from armem_bridge.memory_id import MemoryID

    if not parent.memory:
        return MemoryID(memory=name)
    if not parent.core_segment:
        return parent.with_core_segment(name)
    if not parent.provider_segment:
        return parent.with_provider_segment(name)
    return parent.with_entity(name)


def _snapshots(asked: Answering, entity: MemoryID, form: RowFormat) -> Iterable[tuple[Any, ...]]:
    from armem_bridge.cli.selecting import snapshots_query

    found = asked.query(entity.memory, snapshots_query(entity, last=-1, with_data=False))
    for snapshot in found.snapshots():
        metadata = [instance.metadata for instance in snapshot.instances]
        sure = [each.confidence for each in metadata]
        arrived = max((each.arrived for each in metadata), default=-1)
        times = (_time(moment, form) for moment in (snapshot.sent, arrived))
        about = _time(snapshot.referenced, form)
        yield str(snapshot.id), about, len(metadata), max(sure, default=None), *times


def _time(moment: int, form: RowFormat) -> int | str | None:
    """A time for the eyes in a table, in microseconds since 1970 elsewhere."""
    from armem_bridge.cli.snapshot_records import shown_time

    if form is RowFormat.TABLE:
        return shown_time(moment)
    return moment if moment >= 0 else None
