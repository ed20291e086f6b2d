"""`elm armem get`: snapshots with their data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from armem_bridge.cli.answering import Answering, Server, answering
from armem_bridge.cli.naming import Wanted, memory_id
from armem_bridge.cli.snapshot_records import record, write_cards
from elm.cli.answers import RecordFormat, RecordOutput, record_format, write_records
from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import say

if TYPE_CHECKING:
    from armem_bridge.memory_id import MemoryID
    from armem_bridge.working import Snapshot


@takes_groups
def get(
    *,
    wanted: Wanted,
    last: Annotated[
        int, typer.Option("--last", min=1, metavar="N", help="The N last snapshots of each entity, oldest first.")
    ] = 1,
    history: Annotated[bool, typer.Option("--history", help="All snapshots of each entity.")] = False,
    without_data: Annotated[bool, typer.Option("--without-data", help="Leave the data out.")] = False,
    server: Server = None,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Show snapshots with their data: the one that an ID names, or the last of each entity below it.

    Exit code 4 when there are none. JSON Lines have the data in the JSON form of ARON, which loses nothing, and times
    in microseconds since 1970.
    """
    named, form = memory_id(wanted), record_format(output)
    with answering(where, server) as asked:
        found = _snapshots(asked, named, -1 if history else last, not without_data)
    if form is RecordFormat.JSONL:
        write_records(record(snapshot, only=named.instance) for snapshot in found)
    else:
        write_cards(found, only=named.instance, with_data=not without_data)
    if not found:
        say("nothing there")
        raise typer.Exit(ExitCode.NOTHING_MATCHED)


def _snapshots(asked: Answering, named: MemoryID, last: int, with_data: bool) -> list[Snapshot]:
    from armem_bridge.cli.selecting import snapshots_query

    memories = [named.memory] if named.memory else asked.memories()
    query = snapshots_query(named, last=last, with_data=with_data)
    found = [snapshot for memory in memories for snapshot in asked.query(memory, query).snapshots()]
    if named.instance >= 0:
        return [snapshot for snapshot in found if named.instance < len(snapshot.instances)]
    return found
