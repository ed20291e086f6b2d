"""A client of memory servers in other processes, in the bridge's own values."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from threading import Lock
from types import TracebackType
from typing import Any, Self, TypeVar

from armem_bridge.ice.communicators import make_communicator, servant_of
from armem_bridge.ice.edge import NAME_SYSTEM, topic_of
from armem_bridge.ice.grid import Grid
from armem_bridge.ice.installation import load_ice
from armem_bridge.ice.making import maker
from armem_bridge.ice.parting import part
from armem_bridge.ice.refusals import RemoteFailure, Unreachable
from armem_bridge.ice.vocabulary import Vocabulary
from armem_bridge.ice.wire import Wire
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import NOT_SET, now
from armem_bridge.names import UnknownMemory
from armem_bridge.working.admission import check_commit, check_wishes
from armem_bridge.working.commit import Commit, CommitResult, UpdateResult
from armem_bridge.working.evaluation import selects
from armem_bridge.working.notifications import Listener, check_listener
from armem_bridge.working.query import Query, check_query
from armem_bridge.working.segments import AddSegment, SegmentResult
from armem_bridge.working.tree import Memory

_EVERYTHING = MemoryID()
_Given = TypeVar("_Given")
_Result = TypeVar("_Result")
_logger = logging.getLogger(__name__)


class RemoteMemory:
    """A memory in another process: commit and query as of a `MemoryServer`.

    `reading` and `writing` are its proxies, for those who have objects of the slice files at hand.
    """

    def __init__(self, name: str, reading: Any, writing: Any, wire: Wire) -> None:
        self.name = name
        self.reading, self.writing = reading, writing
        self._wire = wire
        ice = load_ice()
        self._not_understood = (ice.UnknownLocalException, ice.MarshalException)

    def add_segments(self, wishes: Sequence[AddSegment]) -> tuple[SegmentResult, ...]:
        """Add provider segments; one result for each wish, in their order.

        A wish that cannot be sent is refused by itself: types of segments do not travel.
        """
        check_wishes(wishes)
        commits = self._wire.commits
        refused = _refused(wishes, commits.why_no_wish)
        sendable = [wish for place, wish in enumerate(wishes) if place not in refused]
        made = commits.read_segment_results(self._ask(self.writing.addSegments, commits.write_segments(sendable)))
        failed = {place: SegmentResult(success=False, error=why) for place, why in refused.items()}
        return tuple(self._in_order(failed, made, len(wishes)))

    def commit(self, commit: Commit) -> CommitResult:
        """Make the updates of a commit; one result for each, in their order.

        An update that cannot be sent is refused by itself, and never arrives. Those that do not say when they
        were sent are sent now.
        """
        check_commit(commit)
        commits, updates = self._wire.commits, commit.updates
        refused = _refused(updates, commits.why_unsendable)
        if refused:
            commit = Commit(updates=[update for place, update in enumerate(updates) if place not in refused])
        made = commits.read_result(self._ask(self.writing.commit, commits.write_commit(commit, sent=now())))
        if not refused:
            return made
        failed = {place: UpdateResult(success=False, error=why, arrived=NOT_SET) for place, why in refused.items()}
        return CommitResult(results=tuple(self._in_order(failed, made.results, len(updates))))

    def query(self, query: Query) -> Memory:
        """What the memory has of what a query asks for; of what it asks other memories for, nothing.

        Raises `InvalidQuery` for what is none, `RemoteFailure` where the memory refuses it, `NotExpressible`.
        """
        check_query(query)
        mine = [each for each in query.memories if selects(each.names, self.name)]
        asked = Query(memories=mine, target=query.target, with_data=query.with_data)
        return self._wire.results.read(self._ask(self.reading.query, self._wire.queries.write(asked)))

    def _in_order(self, refused: Mapping[int, _Result], made: Sequence[_Result], count: int) -> list[_Result]:
        """What became of all, in the order in which they were given."""
        if len(refused) + len(made) != count:
            raise RemoteFailure(
                f"the memory {self.name!r:.80} answers with {len(made)} results where {count - len(refused)} were "
                f"asked for: look at what it has of them, for which are which cannot be told"
            )
        others = iter(made)
        return [refused[place] if place in refused else next(others) for place in range(count)]

    def _ask(self, operation: Callable[[Any], Any], wire: Any) -> Any:
        try:
            return operation(wire)
        except self._not_understood as error:
            raise RemoteFailure(
                f"the memory {self.name!r:.80} and this client do not understand each other "
                f"({getattr(error, 'unknown', '') or type(error).__name__}): they have loaded slice files of different "
                f"generations, or the data nest too deep. Load the files that the server has"
            ) from error


def _refused(given: Sequence[_Given], why: Callable[[_Given], str]) -> dict[int, str]:
    """The places of those that cannot be sent, with the reasons."""
    return {place: reason for place, each in enumerate(given) if (reason := why(each))}


class MemoryClient:
    """Memories of a robot, or of a process of `Standalone`, by their names.

    `locator` is its `Ice.Default.Locator`; `listening_at` is where a robot's IceStorm reaches this process.
    Exceptions of Ice pass through: that a server is gone is theirs to tell. `wire` has the conversions.
    """

    def __init__(
        self,
        words: Vocabulary,
        locator: str,
        *,
        listening_at: str = "tcp -h 127.0.0.1",
        properties: Mapping[str, str] | None = None,
    ) -> None:
        self.wire = Wire(words)
        self._words = words
        self._listening_at = listening_at
        self._lock = Lock()
        self._adapter: Any = None
        self._subscriptions: list[tuple[Any, Any]] = []
        self._wait_input = maker(words.member(words.mns_data, "WaitForServerInput"), "name")
        self.communicator = make_communicator({"Ice.Default.Locator": locator, **(properties or {})})
        self._grid = Grid(self.communicator)
        try:
            prx = words.member(words.mns, "MemoryNameSystemInterfacePrx")
            found = self._grid.find(NAME_SYSTEM, prx)
            if found is None:
                raise Unreachable(f"the registry at {locator} knows no {NAME_SYSTEM}: start it, and try again")
            self.names: Any = found
        except BaseException:
            self.communicator.destroy()
            raise

    def registered(self) -> Mapping[str, RemoteMemory]:
        """All memories that the name system knows now."""
        answer = self.names.getAllRegisteredServers()
        if not answer.success:
            raise RemoteFailure(f"the name system does not say what it knows: {answer.errorMessage}")
        return {name: self._memory(name, each) for name, each in sorted(answer.servers.items())}

    def memory(self, name: str) -> RemoteMemory:
        """The memory of that name. Raises `UnknownMemory` if there is none now."""
        known = self.registered()
        if name not in known:
            raise UnknownMemory(
                f"no memory server is registered as {name!r:.80} (there are: {', '.join(known) or 'none'}): "
                f"start it, or wait for it"
            )
        return known[name]

    def wait(self, name: str, timeout: float | None = None) -> RemoteMemory:
        """The memory of that name as soon as it is there; `UnknownMemory` if it is not after `timeout` seconds."""
        ice = load_ice()
        # At the twoway call the thread of Ice would wait, and with it whoever wants to interrupt it.
        future = self.names.waitForServerAsync(self._wait_input(name=name))
        try:
            answer = future.result(timeout)
        except ice.TimeoutException:
            future.cancel()
            raise UnknownMemory(
                f"no memory server was registered as {name!r:.80} within {timeout} s: start it, or wait longer"
            ) from None
        if not answer.success:
            raise RemoteFailure(f"the name system does not wait for {name!r:.80}: {answer.errorMessage}")
        return self._memory(name, answer.server)

    def listen(self, memory: str, listener: Listener, subscribed: MemoryID = _EVERYTHING) -> None:
        """Call `listener` with the IDs of updated snapshots that `subscribed` contains, in a thread of Ice.

        Where it raises, that is logged, and it is called again the next time. Raises `InvalidSubscription`
        for an ID that is none.
        """
        check_listener(listener, subscribed)
        read = self.wire.identifiers.read_id

        def updated(wires: Sequence[Any], current: Any) -> None:
            found = tuple(each for each in map(read, wires) if subscribed.contains(each))
            if not found:
                return
            try:
                listener(found)
            except Exception:
                # Nobody who publishes may be told of it, and the next message is for the listener all the same.
                _logger.exception("a listener to %s in the memory %s raised", subscribed, memory)

        interface = self._words.member(self._words.client, "MemoryListenerInterface")
        topic = self._grid.topic(topic_of(memory))
        proxy = self._open_adapter().addWithUUID(servant_of(interface, memoryUpdated=updated)).ice_oneway()
        topic.subscribeAndGetPublisher({}, proxy)
        self._subscriptions.append((topic, proxy))

    def close(self) -> None:
        """End all subscriptions and connections."""
        try:
            part(
                (f"unsubscribing from {topic}", partial(topic.unsubscribe, proxy))
                for topic, proxy in self._subscriptions
            )
        finally:
            self.communicator.destroy()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _memory(self, name: str, interfaces: Any) -> RemoteMemory:
        return RemoteMemory(name, interfaces.reading, interfaces.writing, self.wire)

    def _open_adapter(self) -> Any:
        with self._lock:
            if self._adapter is None:
                self._adapter = self.communicator.createObjectAdapterWithEndpoints("listeners", self._listening_at)
                self._adapter.activate()
            return self._adapter
