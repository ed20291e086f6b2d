"""Single calls through Ice against bare ones: an echo of the same object, and the same messages without a memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from armem_bridge.ice import MemoryClient
from armem_bridge.working import Commit, MemoryServer
from simulators.armem.data_objects import KINDS, Kind
from simulators.armem.echo import Echo
from simulators.armem.preloaded import ENTRIES, batch, latest, make_server
from simulators.armem.series import in_microseconds
from simulators.bench.timing import in_turn, mean_ratio, median_ratio, seconds, steady_heap

Call = Callable[[], object]


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
    commits = [batch(kind, [data], next(first) * ENTRIES) for _ in range(samples + 1)]
    with make_server(kind) as core, steady_heap():
        found = {
            **_in_turn(_remote_calls(client, echo, kind, commits), samples, advance),
            **_in_turn(_local_calls(echo, core, kind, commits), samples, lambda _: None),
        }
    return {
        "commit_vs_echo": median_ratio(found["commit"], found["echo"]),
        "query_vs_echo": median_ratio(found["query"], found["echo"]),
        "commit_vs_echo_means": mean_ratio(found["commit"], found["echo"]),
        "query_vs_echo_means": mean_ratio(found["query"], found["echo"]),
        "commit_vs_bare_messages": median_ratio(found["commit"], found["bare_commit"]),
        "query_vs_bare_messages": median_ratio(found["query"], found["bare_query"]),
        **{name: in_microseconds(series) for name, series in found.items()},
    }


def _in_turn(calls: Mapping[str, Call], samples: int, advance: Callable[[int], None]) -> dict[str, list[float]]:
    """Seconds of each call, by their names; the calls take turns."""
    found: dict[str, list[float]] = {name: [] for name in calls}
    for turn in range(samples + 1):
        for name in in_turn(list(calls), turn):
            taken = seconds(calls[name])
            # At first connections are made, and the bare memory learns what to answer.
            if turn:
                found[name].append(taken)
        advance(1 if turn else 0)
    return found


def _remote_calls(client: MemoryClient, echo: Echo, kind: Kind, commits: Sequence[Commit]) -> dict[str, Call]:
    """What goes through Ice: bare, and to the memory. The first one of the bare calls is a commit."""
    wire, memory = client.wire, client.memory(kind.name)
    query, following = latest(kind, 1), iter(commits)
    sent = wire.aron.write(commits[0].updates[0].instances[0])
    commit_sent, query_sent = wire.commits.write_commit(commits[0]), wire.queries.write(query)
    echo.forget()
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
