"""Commits, insertions, queries and searches of batches, timed part by part: figure 5.2."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from time import perf_counter
from typing import Any, Final, Protocol

from armem_bridge.working import Commit, CommitResult, Memory, Query
from armem_bridge.working.evaluation import evaluate
from armem_bridge.working.versions import snapshot_of
from armem_bridge.working.working_memory import WorkingMemory
from elm.errors import StoreFailure
from simulators.armem.data_objects import Kind
from simulators.armem.preloaded import ENTRIES, batch, latest, make_server, make_working_memory
from simulators.armem.series import in_microseconds
from simulators.bench.timing import in_turn, steady_heap

BATCHES: Final = (1, 20, 50, 100)
"""How many entries are sent and asked for at once."""


class Side(Protocol):
    """A memory that is committed to and queried: in this process, or behind Ice."""

    def commit(self, commit: Commit) -> CommitResult:
        """Make the updates."""

    def query(self, query: Query) -> Memory:
        """What there is."""


def measure(
    kind: Kind, size: int, *, samples: int, remote: Side | None, first: Iterator[int], advance: Callable[[int], None]
) -> dict[str, Any]:
    """The times of a kind of objects in batches of `size`: `core`, and `ice` where there is a memory `remote`.

    In each sample each side commits the batch and asks for it again, the sides in turn. `first` counts the
    entries that were ever committed.
    """
    sides: dict[str, Side] = {"core": make_server(kind)}
    if remote is not None:
        sides["ice"] = remote
    things = [kind.make(number) for number in range(size)]
    bare = make_working_memory(kind)
    found: dict[str, dict[str, list[float]]] = {name: defaultdict(list) for name in ("bare", *sides)}
    _check(kind, things, sides, next(first) * ENTRIES)
    with steady_heap():
        for turn in range(samples):
            begin = next(first) * ENTRIES
            for name in in_turn(list(sides), turn):
                _note(found[name], _round_trip(sides[name], kind, things, begin))
            _note(found["bare"], _in_memory(bare, kind, things, begin))
            advance(1)
    told = {name: {part: in_microseconds(series) for part, series in parts.items()} for name, parts in found.items()}
    told["core"] |= told.pop("bare")
    return told


def _check(kind: Kind, things: Sequence[Any], sides: Mapping[str, Side], first: int) -> None:
    """Refuse to measure a side that does not give back what it was given; also what happens only once happens here."""
    data = [thing.to_aron() for thing in things]
    for name, side in sides.items():
        result = side.commit(batch(kind, data, first))
        found = side.query(latest(kind, len(things)))
        read = [kind.business_class.from_aron(instance.data) for _, instance in found.instances()]
        if not result.success or read != list(things):
            raise StoreFailure(
                f"the memory of side {name!r} gave back {len(read)} of {len(things)} objects as they were"
            )


def _round_trip(side: Side, kind: Kind, things: Sequence[Any], first: int) -> dict[str, float]:
    """Business objects to the memory and back: the time of each part, and of both ways as a whole."""
    read = kind.business_class.from_aron
    wanted = latest(kind, len(things))
    begin = perf_counter()
    data = [thing.to_aron() for thing in things]
    converted = perf_counter()
    result = side.commit(batch(kind, data, first))
    committed = perf_counter()
    found = side.query(wanted)
    received = perf_counter()
    back = [read(instance.data) for _, instance in found.instances()]
    end = perf_counter()
    if not result.success or len(back) != len(things):
        raise StoreFailure(f"{len(back)} of {len(things)} objects came back: {result.errors}")
    return {
        "to_aron": converted - begin,
        "commit": committed - begin,
        "commit_alone": committed - converted,
        "from_aron": end - received,
        "query": end - committed,
        "query_alone": received - committed,
    }


def _in_memory(memory: WorkingMemory, kind: Kind, things: Sequence[Any], first: int) -> dict[str, float]:
    """The insertion of received data into the memory, and the search for them, with nothing around it."""
    commit = batch(kind, [thing.to_aron() for thing in things], first)
    snapshots = [snapshot_of(update, arrived=update.referenced) for update in commit.updates]
    wanted = latest(kind, len(things))
    begin = perf_counter()
    with memory.lock:
        for snapshot in snapshots:
            memory.put(snapshot)
    stored = perf_counter()
    found = evaluate(wanted, memory, kind.name)
    end = perf_counter()
    if sum(1 for _ in found.snapshots()) != len(things):
        raise StoreFailure(f"the search did not find the {len(things)} snapshots that were inserted before it")
    return {"store": stored - begin, "lookup": end - stored}


def _note(series: dict[str, list[float]], times: Mapping[str, float]) -> None:
    for name, taken in times.items():
        series[name].append(taken)
