"""`elm types`: adding event types and showing their hierarchy."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from elm.cli.answers import RecordFormat, RecordOutput, record_format, write_records
from elm.cli.memory_options import MemoryOptions
from elm.cli.option_groups import takes_groups
from elm.cli.sources import opened
from elm.cli.terminal import answers, progress, say

if TYPE_CHECKING:
    from rich.tree import Tree

    from elm.store import TypesAdded
    from elm.taxonomy import EventType

TREE_LIMIT = 100
"""Types in a tree on a terminal unless asked otherwise."""

types = typer.Typer(help="Add event types, and show their hierarchy.", no_args_is_help=True)


@types.command()
@takes_groups
def load(
    *,
    file: Annotated[str | None, typer.Argument(metavar="FILE|-", help="JSON Lines of types; - for stdin.")] = None,
    wordnet: Annotated[
        Path | None,
        typer.Option("--wordnet", metavar="FILE", exists=True, dir_okay=False, help="A table of WordNet's synsets."),
    ] = None,
    where: MemoryOptions,
) -> None:
    """Load event types from a file: all of it, or nothing when something in it is wrong."""
    if (file is None) == (wordnet is None):
        raise typer.BadParameter("name one file: of types, or with --wordnet of synsets", param_hint="FILE")
    with progress("reading types", total=None, unit=""):
        read = _read(file, wordnet)
    with where.open() as memory, progress(f"adding {len(read):,} types", total=None, unit=""):
        added = memory.add_types(read)
    _report(added)


@types.command()
@takes_groups
def add(
    *,
    name: Annotated[str, typer.Argument(metavar="NAME", help="The event type.")],
    parents: Annotated[list[str] | None, typer.Argument(metavar="[PARENT]...", help="What it is a kind of.")] = None,
    where: MemoryOptions,
) -> None:
    """Add an event type, or parents to one that is there."""
    with where.open() as memory:
        added = memory.add_type(name, *(parents or ()))
    _report(added)


@types.command()
@takes_groups
def tree(
    *,
    root: Annotated[str | None, typer.Argument(metavar="[ROOT]", help="Show this type and its sub-types only.")] = None,
    limit: Annotated[
        int | None,
        typer.Option("--limit", min=1, metavar="N", help=f"At most N types. Default: all; {TREE_LIMIT} in a table."),
    ] = None,
    output: RecordOutput = None,
    where: MemoryOptions,
) -> None:
    """Show the hierarchy of event types; as JSON Lines it can be loaded, parents first."""
    from elm.exchange import type_to_json

    with where.open() as memory:
        shown = list(memory.types())
    if root is not None:
        shown = _below(shown, root)
    if record_format(output) is RecordFormat.JSONL:
        write_records(type_to_json(each) for each in shown[:limit])
        return
    limit = limit or TREE_LIMIT
    for drawing in _drawn(shown, limit):
        answers().print(drawing)
    if len(shown) > limit:
        say(f"first {limit:,} of {len(shown):,} types; --limit N for more")


def _read(file: str | None, wordnet: Path | None) -> list[EventType]:
    from elm.loading import read_types
    from elm.wordnet import read_wordnet

    if wordnet is not None:
        return read_wordnet(wordnet)
    assert file is not None  # noqa: S101 - one of the two is given
    with opened(file, hint="FILE") as lines:
        return read_types(lines)


def _report(added: TypesAdded) -> None:
    say(f"added {added.types:,} types and {added.links:,} is-a links ({added.closure:,} rows of their closure)")


def _below(types: Iterable[EventType], root: str) -> list[EventType]:
    """The sub-hierarchy of `root`, without the parents that lie outside it."""
    from elm.errors import UnknownType
    from elm.taxonomy import EventType, Taxonomy

    taxonomy = Taxonomy(types)
    if root not in taxonomy:
        raise UnknownType(f"there is no event type {root!r}: `elm types tree` shows those there are")
    inside = taxonomy.descendants(root)
    return [
        EventType(name=each.name, parents=tuple(parent for parent in each.parents if parent in inside))
        for each in taxonomy
        if each.name in inside
    ]


def _drawn(types: list[EventType], limit: int) -> Iterator[Tree]:
    """A tree for each root; a type with several parents is drawn in full only where it comes first."""
    from rich.tree import Tree

    from elm.cli.event_table import cell

    children: dict[str, list[str]] = {each.name: [] for each in types}
    for each in types:
        for parent in each.parents:
            children[parent].append(each.name)
    drawn: set[str] = set()
    for top in (each.name for each in types if not each.parents):
        if len(drawn) >= limit:
            return
        drawing = Tree(cell(top))
        drawn.add(top)
        open_branches = [(drawing, iter(children[top]))]
        while open_branches and len(drawn) < limit:
            branch, names = open_branches[-1]
            name = next(names, None)
            if name is None:
                open_branches.pop()
            elif name in drawn:
                branch.add(cell(f"{name} (shown above)" if children[name] else name))
            else:
                drawn.add(name)
                open_branches.append((branch.add(cell(name)), iter(children[name])))
        yield drawing
