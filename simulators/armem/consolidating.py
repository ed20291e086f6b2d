"""Long-term memory: how many snapshots a second become durable in elm, and how long finding one there takes."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any, Final

import elm
from armem_bridge.aron.data import Dict
from armem_bridge.long_term import Consolidation, LongTermMemory
from armem_bridge.working import Archive, Commit, CoreSegmentDefinition, MemoryServer, QueryTarget
from elm.errors import StoreFailure
from simulators.armem.data_objects import KINDS, Kind
from simulators.armem.preloaded import BEGIN, SEGMENT, at, batch
from simulators.armem.series import in_microseconds
from simulators.bench.scratch import scratch_memory
from simulators.bench.timing import in_turn, steady_heap

TOGETHER: Final = 20
"""Updates in a commit."""

PATIENCE: Final = 300.0
"""Seconds in which everything is durable; longer is a failure."""

STEPS: Final = 3 * len(KINDS)
"""How often `measure` says that it is one step further."""


def measure(dsn: str, *, snapshots: int, queries: int, advance: Callable[[int], None]) -> dict[str, Any]:
    """Of each kind of objects: rates of write-through consolidation, and times of queries and durable commits."""
    return {kind.name: _of_kind(dsn, kind, snapshots, queries, advance) for kind in KINDS.values()}


def _of_kind(dsn: str, kind: Kind, snapshots: int, queries: int, advance: Callable[[int], None]) -> dict[str, Any]:
    models = [kind.make(number).to_aron() for number in range(TOGETHER)]
    commits = [batch(kind, models, first) for first in range(0, snapshots, TOGETHER)]
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory:
        with LongTermMemory(memory, Consolidation(wait=PATIENCE)) as archive, _server(kind, archive) as server:
            archive.serve(server)
            with steady_heap():
                acknowledged, durable = _fill(server, archive, commits)
            advance(1)
            if memory.recall().count() != snapshots:
                raise StoreFailure(
                    f"{snapshots:,} snapshots were consolidated, and {memory.recall().count():,} are there"
                )
            with steady_heap():
                asked = _ask(server, kind, snapshots, queries)
            advance(1)
        with (
            LongTermMemory(memory, Consolidation(wait=PATIENCE, durable=True)) as archive,
            _server(kind, archive) as server,
        ):
            archive.serve(server)
            with steady_heap():
                times = _commit_durably(server, kind, models[0], snapshots, queries)
            advance(1)
    return {
        "snapshots": snapshots,
        "snapshots_per_second": snapshots / durable,
        "acknowledged_per_second": snapshots / acknowledged,
        **{name: in_microseconds(series) for name, series in asked.items()},
        "durable_commit": in_microseconds(times),
    }


def _server(kind: Kind, archive: Archive) -> MemoryServer:
    return MemoryServer(kind.name, [CoreSegmentDefinition(name=SEGMENT, aron_type=kind.type_object)], archive=archive)


def _fill(server: MemoryServer, archive: LongTermMemory, commits: list[Commit]) -> tuple[float, float]:
    """Seconds until all commits were acknowledged, and until all of them were durable."""
    begin = perf_counter()
    for commit in commits:
        result = server.commit(commit)
        if not result.success:
            raise StoreFailure(f"an update was refused: {result.errors[0]}")
    acknowledged = perf_counter() - begin
    if not archive.flush(PATIENCE):
        raise StoreFailure(f"not everything was durable after {PATIENCE:g} s: {archive.status()['last_error']}")
    return acknowledged, perf_counter() - begin


def _ask(server: MemoryServer, kind: Kind, snapshots: int, queries: int) -> dict[str, list[float]]:
    """One snapshot of the many, from either memory and from both; the targets take turns."""
    targets = {"query_ltm": QueryTarget.LTM, "query_wm": QueryTarget.WM, "query_both": QueryTarget.BOTH}
    found: dict[str, list[float]] = {name: [] for name in targets}
    for turn in range(queries + 1):
        moment = BEGIN + turn * snapshots // (queries + 1)
        for name in in_turn(list(targets), turn):
            query = at(kind, moment, targets[name])
            begin = perf_counter()
            answer = server.query(query)
            taken = perf_counter() - begin
            if (count := sum(1 for _ in answer.snapshots())) != 1:
                raise StoreFailure(f"{name} found {count} snapshots of the one at {moment}")
            # In the first turn the source of the archive learns which entities there are.
            if turn:
                found[name].append(taken)
    return found


def _commit_durably(server: MemoryServer, kind: Kind, data: Dict, first: int, count: int) -> list[float]:
    """Seconds that commits of one snapshot take which are acknowledged when elm has it on the disk."""
    times = []
    for number in range(count + 1):
        commit = batch(kind, [data], first + number)
        begin = perf_counter()
        result = server.commit(commit)
        times.append(perf_counter() - begin)
        if not result.success:
            raise StoreFailure(f"an update was refused: {result.errors[0]}")
    return times[1:]
