"""A service: the memory servers of a configuration with their long-term memory, and how clients reach them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from types import MappingProxyType, TracebackType
from typing import TYPE_CHECKING, Self, assert_never

import msgspec

from armem_bridge.config import Configuration, IceConfig, InvalidConfiguration, LongTermConfig, MemoryConfig, Mode
from armem_bridge.errors import ArmemError
from armem_bridge.forgetting.online import OnlineForgetting
from armem_bridge.forgetting_gate import ForgettingGate
from armem_bridge.long_term import ROOT, LongTermMemory, RobotPlaces, SubjectFinder
from armem_bridge.long_term.consolidation import STOP_TIMEOUT
from armem_bridge.long_term.robot_place import FOOTPRINT, MAX_AGE
from armem_bridge.long_term.subjects import RADIUS
from armem_bridge.moments import Clock, now
from armem_bridge.names import MemoryNameSystem
from armem_bridge.working import Archive, MemoryServer
from armem_bridge.working.status import ServerStatus

if TYPE_CHECKING:
    from armem_bridge.ice import Edge, EdgeStatus, MemoryClient


class ServiceClosed(ArmemError):
    """A service was asked before its start, or started again. Each is started once."""


class ServiceStatus(msgspec.Struct, frozen=True, kw_only=True):
    """What a service tells of itself."""

    memories: tuple[ServerStatus, ...]
    long_term: Mapping[str, object]
    """What long-term memory tells of itself; empty where there is none."""

    robot_poses_unreadable: int
    """So many poses of the robot's state could not be read."""

    edge: EdgeStatus | None
    """What the Ice edge tells of itself; None where there is none."""


class Service:
    """Memory servers in this process, as a configuration has them: start it, or use it as a context.

    Everything is made at the start, and stopped in the reverse order: clients are cut off first, then the
    memory servers take no more commits, and then what still waits is consolidated.
    """

    def __init__(self, config: Configuration, *, clock: Clock = now) -> None:
        self.config = config
        self.names: MemoryNameSystem[MemoryServer] = MemoryNameSystem()
        """The memories of this process by their names."""

        self._clock = clock
        self._is_started = False
        self._running = ExitStack()
        self._behind = ExitStack()
        self._servers: dict[str, MemoryServer] = {}
        self._archive: LongTermMemory | None = None
        self._places: RobotPlaces | None = None
        self._edge: Edge | None = None
        self._address = ""

    @property
    def servers(self) -> Mapping[str, MemoryServer]:
        """The memory servers by the names of their memories."""
        return MappingProxyType(self._servers)

    @property
    def archive(self) -> LongTermMemory | None:
        """Long-term memory, where there is one."""
        return self._archive

    @property
    def edge(self) -> Edge | None:
        """The Ice edge, where there is one."""
        return self._edge

    @property
    def address(self) -> str:
        """What clients set `Ice.Default.Locator` to; empty where they cannot reach this process."""
        return self._address

    def start(self) -> Self:
        """Make everything. Raises what keeps it from being made; nothing runs then.

        These are `InvalidServer` and `InvalidPriorKnowledge`, what elm says of its database, and of the Ice edge
        `IceMissing`, `SlicesMissing`, `Unreachable` and others of `armem_bridge.ice.refusals`.
        """
        if self._is_started:
            raise ServiceClosed(f"the service of {self.config.file} was started before: make a new one")
        self._is_started = True
        with ExitStack() as behind, ExitStack() as starting:
            if self.config.long_term is not None:
                self._archive = self._remember(self.config.long_term, behind)
            for memory in self.config.memories:
                server = starting.enter_context(self._server(memory))
                self._servers[server.name] = server
                if self._archive is not None:
                    self._archive.serve(server)
            if self.config.ice.mode is not Mode.NONE:
                edge, self._address = _edge(self.config.ice, list(self._servers.values()))
                self._edge = starting.enter_context(edge)
            for server in self._servers.values():
                self.names.register(server.name, server)
                starting.callback(self.names.unregister, server.name)
            self._running, self._behind = starting.pop_all(), behind.pop_all()
        return self

    def stop(self, timeout: float = STOP_TIMEOUT) -> None:
        """Stop everything, and make durable what waits; again changes nothing.

        `NotConsolidated` where for `timeout` seconds nothing of it becomes so: it is tried on until the process ends,
        and stopping again waits again.
        """
        self._running.close()
        if self._archive is not None:
            self._archive.close(timeout)
        self._behind.close()

    def status(self) -> ServiceStatus:
        """How everything is, or was at the stop. Raises `ServiceClosed` before the start."""
        if not self._is_started:
            raise ServiceClosed(f"the service of {self.config.file} was not started: call start()")
        return ServiceStatus(
            memories=tuple(server.status() for server in self._servers.values()),
            long_term=self._archive.status() if self._archive is not None else {},
            robot_poses_unreadable=self._places.unreadable if self._places is not None else 0,
            edge=self._edge.status() if self._edge is not None else None,
        )

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    # Inside

    def _remember(self, wanted: LongTermConfig, behind: ExitStack) -> LongTermMemory:
        from elm.app import connect

        memory = behind.enter_context(connect(wanted.dsn, wanted.memory))
        # Who gave a wrong address hears of it now: later on, a database may be away.
        memory.add_type(ROOT)
        state = wanted.robot_state
        if state is not None:
            self._places = RobotPlaces(
                state.pose,
                footprint=FOOTPRINT if state.footprint is None else state.footprint,
                frame=wanted.frame,
                max_age=MAX_AGE if state.max_age is None else state.max_age,
            )
        radius = RADIUS if wanted.radius is None else wanted.radius
        archive = LongTermMemory(
            memory,
            wanted.settings,
            agent=wanted.robot or None,
            location=self._places,
            subjects=SubjectFinder(wanted.poses, radius=radius, frame=wanted.frame) if wanted.poses else None,
            gate=ForgettingGate(OnlineForgetting(self.config.online)) if self.config.online else None,
            clock=self._clock,
        )
        behind.callback(archive.close)
        return archive

    def _server(self, config: MemoryConfig) -> MemoryServer:
        return memory_server(config, archive=self._archive, clock=self._clock)


def memory_server(config: MemoryConfig, *, archive: Archive | None = None, clock: Clock = now) -> MemoryServer:
    """The memory server that a configuration describes, its prior knowledge read.

    Raises `InvalidServer` and `InvalidPriorKnowledge`.
    """
    return MemoryServer(
        config.name,
        config.core_segments,
        archive=archive,
        limits=config.limits,
        prior_knowledge=config.prior_knowledge,
        clock=clock,
        delay_threshold=config.delay_threshold,
        update_bytes=config.update_bytes,
    )


def _edge(config: IceConfig, servers: list[MemoryServer]) -> tuple[Edge, str]:
    """The Ice edge of a configuration that has one, and the locator of its clients."""
    from armem_bridge.ice import Joined, Standalone, load_slices

    words = load_slices(config.slices)
    if config.mode is Mode.STANDALONE:
        alone = Standalone(words, servers, host=config.host, port=config.port, properties=config.properties)
        return alone, alone.locator
    joined = Joined(
        words,
        servers,
        locator=config.locator,
        endpoint=config.endpoint,
        own_name_system=config.own_name_system,
        properties=config.properties,
    )
    return joined, config.locator


def connect_client(config: Configuration) -> MemoryClient:
    """A client of the process that serves a configuration. Raises `InvalidConfiguration`, or what Ice has to say."""
    ice = config.ice
    match ice.mode:
        case Mode.NONE:
            raise InvalidConfiguration(
                f'{config.file}: ice.mode: nobody can be asked: set mode = "standalone" or "join" in [ice]'
            )
        case Mode.STANDALONE:
            if not ice.port:
                raise InvalidConfiguration(
                    f"{config.file}: ice.port: a server at any free port cannot be found: give the port"
                )
            locator = f"IceGrid/Locator:tcp -h {ice.host} -p {ice.port}"
        case Mode.JOIN:
            locator = ice.locator
        case _:
            assert_never(ice.mode)
    from armem_bridge.ice import MemoryClient, load_slices

    return MemoryClient(load_slices(ice.slices), locator, properties=ice.properties)
