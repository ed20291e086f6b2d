"""Snapshots as lines of JSON for programs, and as cards for the eyes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from elm.cli.terminal import answers

if TYPE_CHECKING:
    from rich.table import Table

    from armem_bridge.aron import Data, NDArray
    from armem_bridge.working import Instance, Snapshot

_ELEMENTS = 16
"""So many numbers of an array are shown."""
_INDENT = "  "


def record(snapshot: Snapshot, *, only: int = -1) -> dict[str, Any]:
    """A snapshot as JSON without loss: times in microseconds since 1970, data in the JSON form of ARON.

    With `only` 0 or greater it is that instance alone, if there is one.
    """
    return {
        "id": str(snapshot.id),
        "referenced": snapshot.referenced,
        "instances": [_instance(index, each) for index, each in _chosen(snapshot, only)],
    }


def _instance(index: int, instance: Instance) -> dict[str, Any]:
    from armem_bridge.aron.textual import to_json

    known = instance.metadata
    return {
        "index": index,
        "confidence": known.confidence,
        "sent": known.sent if known.sent >= 0 else None,
        "arrived": known.arrived if known.arrived >= 0 else None,
        "data": to_json(instance.data),
    }


def _chosen(snapshot: Snapshot, only: int) -> Iterable[tuple[int, Instance]]:
    return ((index, each) for index, each in enumerate(snapshot.instances) if only in (-1, index))


def write_cards(snapshots: Iterable[Snapshot], *, only: int = -1, with_data: bool = True) -> None:
    """Write everything about snapshots, one card each."""
    console = answers()
    for number, snapshot in enumerate(snapshots):
        if number:
            console.print()
        console.print(_card(snapshot, only, with_data))


def _card(snapshot: Snapshot, only: int, with_data: bool) -> Table:
    from rich.table import Table

    from elm.cli.event_table import cell

    card = Table.grid(padding=(0, 2, 0, 0))
    card.add_column(style="bold")
    card.add_column(overflow="fold")

    def row(name: str, text: str) -> None:
        card.add_row(name, cell(text))

    row("snapshot", str(snapshot.id))
    row("about", shown_time(snapshot.referenced))
    if not snapshot.instances:
        row("instances", "none")
    for index, instance in _chosen(snapshot, only):
        known = instance.metadata
        sent, arrived = shown_time(known.sent), shown_time(known.arrived)
        row(f"instance {index}", f"confidence {known.confidence:g}, sent {sent}, arrived {arrived}")
        for line in _lines(instance.data) if with_data else ():
            row("", line)
    return card


def shown_time(moment: int) -> str:
    """A moment as UTC time; one that is none, or beyond what dates there are, as what it is."""
    from armem_bridge.moments import InvalidMoment, to_datetime
    from elm.cli import event_table

    if moment < 0:
        return "unknown"
    try:
        return event_table.moment(to_datetime(moment))
    except InvalidMoment:
        return f"{moment:,} µs"


def _lines(data: Data | None, depth: int = 0, name: str = "") -> Iterator[str]:
    """A data object as indented lines, one for each leaf."""
    from armem_bridge.aron import Dict, List

    begin = f"{_INDENT * depth}{name}: " if name else _INDENT * depth
    match data:
        case Dict(elements=elements) if elements:
            if name:
                yield begin.rstrip()
            for key, element in elements.items():
                yield from _lines(element, depth + bool(name), key)
        case List(elements=several) if several:
            yield begin.rstrip()
            for index, element in enumerate(several):
                yield from _lines(element, depth + 1, f"[{index}]")
        case _:
            yield f"{begin}{_leaf(data)}"


def _leaf(data: Data | None) -> str:
    from armem_bridge.aron import Dict, List, NDArray
    from armem_bridge.aron.conversion import to_python

    match data:
        case None:
            return "null"
        case Dict():
            return "{}"
        case List():
            return "[]"
        case NDArray():
            return _array(data)
        case _:
            return str(to_python(data))


def _array(array: NDArray) -> str:
    from armem_bridge.aron.conversion import to_python

    extents = " x ".join(map(str, array.shape[:-1]))
    shown = to_python(array)
    if shown is array or shown.size > _ELEMENTS or shown.dtype.kind not in "biuf":
        return f"{array.type} array of {extents}, {len(array.data):,} bytes"
    return str(shown.tolist())
