"""What a configuration says, as values: memories, long-term memory, forgetting, and how clients reach them."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Final

import msgspec

from armem_bridge.forgetting.mechanisms import Offline, Online
from armem_bridge.long_term.poses import PosePath
from armem_bridge.long_term.settings import Consolidation
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.segments import CoreSegmentDefinition

PORT: Final = 4061
"""Where clients of ArmarX look for the registry unless they are told otherwise."""


class Mode(StrEnum):
    """How clients reach the memories."""

    NONE = "none"
    """They do not: the memories are for the program that makes them."""

    STANDALONE = "standalone"
    """Through Ice, with a registry, name system and topics of the process's own."""

    JOIN = "join"
    """Through Ice, as memories of a robot that has all these."""


class MemoryConfig(msgspec.Struct, frozen=True, kw_only=True):
    """One memory server."""

    name: str
    core_segments: tuple[CoreSegmentDefinition, ...]
    limits: Mapping[MemoryID, int]
    """History limits, by the ID of the memory, a segment or an entity."""

    prior_knowledge: tuple[Path, ...]
    delay_threshold: int
    """Updates that take longer to arrive are warned of, in microseconds."""

    update_bytes: int


class RobotStateConfig(msgspec.Struct, frozen=True, kw_only=True):
    """Which data of working memory say where the robot is, and how large it is there."""

    pose: PosePath
    footprint: float | tuple[tuple[float, float], ...] | None
    """A radius in metres, or the corners about its origin; None for that of `long_term.robot_place`."""

    max_age: int | None
    """How many microseconds a pose holds; None for what `long_term.robot_place` says."""


class LongTermConfig(msgspec.Struct, frozen=True, kw_only=True):
    """The elm memory that everything is consolidated into."""

    memory: str
    dsn: str | None
    robot: str
    frame: str
    settings: Consolidation
    """When, how durably, and how much may wait."""

    poses: tuple[PosePath, ...]
    """Where in the data of which segments it stands where the thing is that they are about."""

    radius: float | None
    """Of the disc around such a pose, in metres; None for that of `long_term.subjects`."""

    robot_state: RobotStateConfig | None


class IceConfig(msgspec.Struct, frozen=True, kw_only=True):
    """How ArmarX clients reach the memories."""

    mode: Mode
    slices: tuple[Path, ...]
    host: str
    port: int
    endpoint: str
    locator: str
    own_name_system: bool
    properties: Mapping[str, str]


class Configuration(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that a configuration file says."""

    file: Path
    memories: tuple[MemoryConfig, ...]
    long_term: LongTermConfig | None
    online: tuple[Online, ...]
    """The mechanisms between working and long-term memory."""

    offline: tuple[Offline, ...]
    """The mechanisms in long-term memory."""

    keep_newest: bool
    """Whether the newest snapshot of each entity stays, whatever the offline mechanisms say."""

    ice: IceConfig
