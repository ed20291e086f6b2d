"""A bare Ice server, the yardstick for the bridge's: echoes ARON objects, and answers like a memory that has none."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from armem_bridge.ice import load_slices
from armem_bridge.ice.communicators import make_communicator, servant_of
from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire import Wire
from armem_bridge.moments import NOT_SET
from armem_bridge.working import Commit, EntityUpdate, Instance, Memory, Metadata, Snapshot
from armem_bridge.working.commit import UpdateResult
from armem_bridge.working.tree import CoreSegment, Entity, ProviderSegment
from simulators.armem.processes import ROOT, Process

SLICES: Final = ROOT / "tests" / "armem" / "ice" / "slices"
"""The stand-ins for ArmarX's slice files, which measurements on one machine do as well with."""

ECHO: Final = SLICES / "echo" / "Echo.ice"
"""The interface of the echo."""

FOURTH: Final = SLICES / "gen4"
"""The generation that is measured unless it is said otherwise."""


def load_echo(slices: Path = FOURTH) -> tuple[Vocabulary, Any]:
    """The interface of a memory, and the module of the echo's."""
    words = load_slices([slices])
    options = [f"-I{slice_directory()}", f"-I{slices}", "--underscore", "--all"]
    load_ice().loadSlice("", [*options, str(ECHO)])
    return words, sys.modules["elmecho"]


class Echo:
    """An echo server in a process of its own, and the proxies of what it serves.

    `data` echoes an ARON Dict. `memory` is a memory interface with nothing behind: it makes every commit,
    and answers every query with the snapshot of the first commit it got since `forget`, as a memory would.
    """

    def __init__(self, communicator: Any, slices: Path = FOURTH) -> None:
        words, echo = load_echo(slices)
        with ExitStack() as starting:
            process = starting.enter_context(Process("simulators.armem.echo", str(slices)))
            data, memory = map(communicator.stringToProxy, process.line().split("\t"))
            self.data = echo.EchoServerPrx.uncheckedCast(data)
            self.memory = words.server.MemoryInterfacePrx.uncheckedCast(memory)
            self._running = starting.pop_all()

    def forget(self) -> None:
        """Have the next commit be the first one."""
        self.memory.addSegments([])

    def close(self) -> None:
        """End the process."""
        self._running.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _BareMemory:
    """Answers as a memory does, with messages of the same size, made once."""

    def __init__(self, words: Vocabulary) -> None:
        self._wire = Wire(words)
        self._made: Any = None
        self._found: Any = None
        self.servant = servant_of(
            words.server.MemoryInterface, commit=self._commit, query=self._query, addSegments=self._forget
        )

    def _commit(self, wire: Any, _: Any) -> Any:
        if self._made is None:
            self._prepare(Commit(updates=map(self._wire.commits.read_update, wire.updates)))
        return self._made

    def _query(self, _: Any, __: Any) -> Any:
        return self._found

    def _forget(self, _: Any, __: Any) -> list[Any]:
        self._made = None
        return []

    def _prepare(self, commit: Commit) -> None:
        snapshots = [_snapshot(update) for update in commit.updates]
        results = [UpdateResult(success=True, snapshot=snapshot.id, arrived=1) for snapshot in snapshots]
        self._made = self._wire.commits.write_result(results)
        self._found = self._wire.results.write(_tree(snapshots[0]))


def _snapshot(update: EntityUpdate) -> Snapshot:
    metadata = Metadata(referenced=update.referenced, sent=update.sent, arrived=1, confidence=update.confidence)
    instances = tuple(Instance(data=data, metadata=metadata) for data in update.instances)
    return Snapshot(id=update.entity.with_timestamp(update.referenced), instances=instances)


def _tree(snapshot: Snapshot) -> Memory:
    """A memory with one snapshot."""
    own = snapshot.id
    _, core, provider, entity = own.names
    found = Entity(id=own.with_timestamp(NOT_SET), history={own.timestamp: snapshot})
    segment = ProviderSegment(id=own.with_core_segment(core).with_provider_segment(provider), entities={entity: found})
    whole = CoreSegment(id=own.with_core_segment(core), provider_segments={provider: segment})
    return Memory(id=own.with_core_segment(""), core_segments={core: whole})


def serve(slices: Path) -> None:
    """Serve on loopback until stdin ends; the first line of stdout says where."""
    words, echo = load_echo(slices)
    with make_communicator() as communicator:
        adapter = communicator.createObjectAdapterWithEndpoints("echo", "tcp -h 127.0.0.1")
        proxies = (
            adapter.addWithUUID(servant_of(echo.EchoServer, echo=lambda data, _: data)),
            adapter.addWithUUID(_BareMemory(words).servant),
        )
        adapter.activate()
        print("\t".join(map(str, proxies)), flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
