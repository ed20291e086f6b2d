"""Single calls through Ice against bare ones: an echo of the same object, and the same messages without a memory."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

from armem_bridge.ice import MemoryClient
from armem_bridge.working import Commit, MemoryServer
from simulators.armem.data_objects import KINDS, Kind
from simulators.armem.echo import Echo
from simulators.armem.preloaded import ENTRIES, batch, latest, make_server
from simulators.armem.series import in_microseconds
from simulators.bench.timing import in_turn, mean_ratio, median_ratio, seconds, steady_heap

Call = Callable[[], object]

PAIRS: Final = (("commit", "echo"), ("query", "echo"), ("commit", "bare_commit"), ("query", "bare_query"))
"""What is compared with what. Of each pair one call follows the other: so neither process is warmer than the other."""

STEPS: Final = len(PAIRS) * len(KINDS)
"""How often `measure` says that so many samples are done."""


def measure(
    client: MemoryClient, *, samples: int, first: Iterator[int], advance: Callable[[int], None]
) -> dict[str, dict[str, Any]]:
    """Of each kind of objects the times of single calls, which take turns, and the ratios that goals are about.

    Everybody has the data in hand, as ARON or as the objects that Ice sends: business objects are not in it.
    """
    with Echo(client.communicator) as echo:
        return {kind.name: _of_kind(client, echo, kind, samples, first, advance) for kind in KINDS.values()}


def _of_kind(
    client: MemoryClient, echo: Echo, kind: Kind, samples: int, first: Iterator[int], advance: Callable[[int], None]
) -> dict[str, Any]:
    data = kind.make(1).to_aron()
    # Made beforehand: what is done between the calls would push their code out of the processor's caches.
    commits = [batch(kind, [data], next(first) * ENTRIES) for _ in range(2 * (samples + 1))]
    found: dict[str, list[float]] = defaultdict(list)
    ratios: dict[str, float] = {}
    with make_server(kind) as core, steady_heap():
        calls = _remote_calls(client, echo, kind, commits)
        for ours, bare in PAIRS:
            series = _in_turn({name: calls[name] for name in (ours, bare)}, samples)
            ratios[f"{ours}_vs_{bare}"] = median_ratio(series[ours], series[bare])
            ratios[f"{ours}_vs_{bare}_means"] = mean_ratio(series[ours], series[bare])
            for name, times in series.items():
                found[name] += times
            advance(samples)
        found |= _in_turn(_local_calls(echo, core, kind, commits), samples)
    return {**ratios, **{name: in_microseconds(series) for name, series in found.items()}}


def _in_turn(calls: Mapping[str, Call], samples: int) -> dict[str, list[float]]:
    """Seconds of each call, by their names; the calls take turns."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(samples + 1):
        for name in in_turn(list(calls), turn):
            taken = seconds(calls[name])
            # At first connections are made.
            if turn:
                found[name].append(taken)
    return found


def _remote_calls(client: MemoryClient, echo: Echo, kind: Kind, commits: Sequence[Commit]) -> dict[str, Call]:
    """What goes through Ice: to the memory, and bare."""
    wire, memory = client.wire, client.memory(kind.name)
    query, following = latest(kind, 1), iter(commits)
    sent = wire.aron.write(commits[0].updates[0].instances[0])
    commit_sent, query_sent = wire.commits.write_commit(commits[0]), wire.queries.write(query)
    echo.forget()
    # What it is to answer.
    echo.memory.commit(commit_sent)
    return {
        "bare_commit": lambda: echo.memory.commit(commit_sent),
        "bare_query": lambda: echo.memory.query(query_sent),
        "echo": lambda: echo.data.echo(sent),
        "commit": lambda: memory.commit(next(following)),
        "query": lambda: memory.query(query),
    }


def _local_calls(echo: Echo, core: MemoryServer, kind: Kind, commits: Sequence[Commit]) -> dict[str, Call]:
    """What is told beside them: the memory in this process, and the least that a call through Ice costs."""
    query, following = latest(kind, 1), iter(commits)
    return {
        "ping": lambda: echo.data.ice_ping(),
        "core_commit": lambda: core.commit(next(following)),
        "core_query": lambda: core.query(query),
    }
