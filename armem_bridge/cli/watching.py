"""`elm armem watch`: snapshots as they come."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer

from armem_bridge.cli.answering import Server, connected
from armem_bridge.cli.naming import WantedOrAll, memory_id
from armem_bridge.cli.snapshot_records import record, shown_time
from elm.cli.answers import RecordFormat, RecordOutput, record_format, write_records
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import say, visible

if TYPE_CHECKING:
    from collections.abc import Sequence

    from armem_bridge.memory_id import MemoryID
    from armem_bridge.working import Snapshot

GLANCE = 5.0
"""Seconds of silence after which it is looked whether the server is still there."""


@takes_groups
def watch(
    *,
    wanted: WantedOrAll = "",
    since: Annotated[
        int | None,
        typer.Option(
            "--since", min=0, metavar="POSITION", help="Begin behind this position of elm's log. Default: now."
        ),
    ] = None,
    limit: Annotated[int | None, typer.Option("--limit", min=1, metavar="N", help="End after N snapshots.")] = None,
    timeout: Annotated[
        float | None, typer.Option("--timeout", min=0, metavar="SECONDS", help="End when none comes for so long.")
    ] = None,
    without_data: Annotated[bool, typer.Option("--without-data", help="Leave the data out.")] = False,
    server: Server = None,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Show snapshots as they are consolidated, until Ctrl-C; with --server as they are committed.

    The table is a line each, without data. JSON Lines are those of `get`.
    """
    named, form = memory_id(wanted), record_format(output)
    if server is not None and since is not None:
        raise typer.BadParameter("a running server has no log: leave out --since or --server", param_hint="--since")
    coming = _consolidated(where, named, since, timeout) if server is None else _committed(server, named, timeout)
    for snapshot in islice(coming, limit):
        shown = snapshot.without_data() if without_data else snapshot
        if form is RecordFormat.JSONL:
            write_records([record(shown, only=named.instance)])
        else:
            typer.echo(visible(_line(shown)))
        sys.stdout.flush()


def _consolidated(
    where: MemoryOptions, named: MemoryID, since: int | None, timeout: float | None
) -> Iterator[Snapshot]:
    """Snapshots as elm's log has them, without any server."""
    from armem_bridge.long_term.mapping import is_snapshot, snapshot_of
    from armem_bridge.long_term.recall import snapshots_cue

    with where.open() as memory:
        coming = memory.subscribe(snapshots_cue(entity=named), since=since, timeout=timeout)
        say(f"watching {str(named) or 'everything'} in the elm memory {memory.name!r}")
        for event in coming:
            if is_snapshot(event):
                yield snapshot_of(event)


def _committed(server: Path, named: MemoryID, timeout: float | None) -> Iterator[Snapshot]:
    """Snapshots that a running server tells of, asked for when it does: of two that come quickly the later one."""
    from armem_bridge.cli.selecting import snapshots_query

    heard: SimpleQueue[Sequence[MemoryID]] = SimpleQueue()
    with connected(server) as client:
        memories = [client.memory(named.memory).name] if named.memory else list(client.registered())
        for memory in memories:
            client.listen(memory, heard.put, named)
        say(f"watching {str(named) or 'everything'} in {', '.join(memories)}")
        quiet_since = monotonic()
        while True:
            left = GLANCE if timeout is None else quiet_since + timeout - monotonic()
            try:
                updated = heard.get(timeout=max(min(left, GLANCE), 0.0))
            except Empty:
                if left <= 0:
                    return
                # A server that broke down says nothing: this is where one learns of it.
                client.registered()
                continue
            quiet_since = monotonic()
            for each in updated:
                query = snapshots_query(each, last=1, with_data=True)
                yield from client.memory(each.memory).query(query).snapshots()


def _line(snapshot: Snapshot) -> str:
    number = len(snapshot.instances)
    return f"{shown_time(snapshot.referenced):26}  {snapshot.id}  {number} instance{'' if number == 1 else 's'}"
