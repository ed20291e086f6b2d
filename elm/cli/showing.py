"""`elm show` and `elm tree`: everything about some events, and what an event is made of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated
from uuid import UUID

import typer

from elm.cli.answers import (
    EventFormat,
    EventOutput,
    RecordFormat,
    RecordOutput,
    event_format,
    record_format,
    write_events,
)
from elm.cli.exits import ExitCode
from elm.cli.memory_options import MemoryOptions
from elm.cli.naming import event_name
from elm.cli.option_groups import takes_groups
from elm.cli.terminal import answers, say, write

if TYPE_CHECKING:
    from rich.tree import Tree

    from elm.app import Memory
    from elm.event import StoredEvent
    from elm.tombstone import Tombstone

_CHUNK = 1_000


@takes_groups
def show(
    *,
    events: Annotated[list[str], typer.Argument(metavar="ID|UID...", help="The events, by id or uid.")],
    why: Annotated[bool, typer.Option("--why", help="Show what recognized them, and from what, instead.")] = False,
    output: EventOutput = None,
    where: MemoryOptions,
) -> None:
    """Show everything about some events; exit code 4 when one is not there."""
    from elm.errors import UnknownEvent

    names = list(map(event_name, events))
    found: list[StoredEvent] = []
    with where.open() as memory:
        for name in names:
            try:
                found.append(memory.get(name))
            except UnknownEvent as error:
                say(f"elm: {error}")
        parts = _parts_below(memory, found, 1) if why else {}
    form = event_format(output)
    if why:
        from elm.cli.why import write_reasons

        write_reasons(found, parts, form)
    elif form is EventFormat.TABLE:
        _write_cards(found)
    elif found:
        write_events(found, form)
    if len(found) < len(names):
        raise typer.Exit(ExitCode.NOTHING_MATCHED)


@takes_groups
def tree(
    *,
    event: Annotated[str, typer.Argument(metavar="ID|UID", help="The event, by id or uid.")],
    depth: Annotated[
        int | None, typer.Option("--depth", min=0, metavar="N", help="At most N levels of parts. Default: all.")
    ] = None,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Show what an event is made of: its parts, their parts, and so on.

    As JSON Lines each event comes once, parts before wholes and tombstones of forgotten parts before all, so that the
    lines can be loaded.
    """
    name = event_name(event)
    with where.open() as memory:
        root = memory.get(name)
        below = _parts_below(memory, [root], depth)
        shown_in_full = below if depth is None else _parts_below(memory, [root], depth - 1)
        forgotten = {} if depth == 0 else _forgotten_among(memory, [root, *shown_in_full.values()])
    if record_format(output) is RecordFormat.JSONL:
        from elm.exporting import jsonl

        events = sorted({root.uid: root, **below}.values(), key=lambda each: each.id)
        write(jsonl([*forgotten.values(), *events]))
    else:
        answers().print(_drawn(root, {**below, **forgotten}))


def _write_cards(events: Iterable[StoredEvent]) -> None:
    from elm.cli.event_table import event_card

    console = answers()
    for number, event in enumerate(events):
        if number:
            console.print()
        console.print(event_card(event))


def _parts_below(memory: Memory, roots: Iterable[StoredEvent], depth: int | None) -> dict[UUID, StoredEvent]:
    """The direct and indirect parts by uid, fetched level by level."""
    from elm import cues

    known: dict[UUID, StoredEvent] = {}
    level, wanted = 0, [*dict.fromkeys(uid for each in roots for uid in each.parts)]
    while wanted and (depth is None or level < depth):
        fetched: list[StoredEvent] = []
        for start in range(0, len(wanted), _CHUNK):
            fetched += memory.recall(cues.uid(*wanted[start : start + _CHUNK]))
        known.update({each.uid: each for each in fetched})
        wanted = [*dict.fromkeys(uid for each in fetched for uid in each.parts if uid not in known)]
        level += 1
    return known


def _forgotten_among(memory: Memory, events: Iterable[StoredEvent]) -> dict[UUID, Tombstone]:
    """The tombstones of parts of these events, by uid."""
    parts = {uid for each in events for uid in each.parts}
    return {each.uid: each for each in memory.store.tombstones([*parts])} if parts else {}


def _drawn(root: StoredEvent, below: Mapping[UUID, StoredEvent | Tombstone]) -> Tree:
    """The partonomy; an event that is part of several others is drawn in full only where it comes first."""
    from rich.tree import Tree

    from elm.cli.event_table import event_line, tombstone_line
    from elm.event import StoredEvent

    drawing = Tree(event_line(root))
    drawn = {root.uid}
    open_branches = [(drawing, iter(root.parts))]
    while open_branches:
        branch, parts = open_branches[-1]
        part = next((below[uid] for uid in parts if uid in below), None)
        if part is None:
            open_branches.pop()
        elif not isinstance(part, StoredEvent):
            branch.add(tombstone_line(part))
        elif part.uid in drawn and part.parts:
            branch.add(event_line(part, "(shown above)"))
        else:
            drawn.add(part.uid)
            hidden = sum(uid not in below for uid in part.parts)
            twig = branch.add(event_line(part, f"({hidden:,} parts not shown)" if hidden else ""))
            open_branches.append((twig, iter(part.parts)))
    return drawing
