"""The tables of a configuration file as they stand in it: every key, its kind and its default."""

from __future__ import annotations

from typing import Literal

import msgspec

from armem_bridge.config.values import PORT, Mode
from armem_bridge.long_term.settings import When
from armem_bridge.working.server import DELAY_THRESHOLD, UPDATE_BYTES
from elm.geometry import DEFAULT_FRAME


class Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What all tables share: unknown keys are refused."""


class TypeTable(Table, frozen=True):
    """An ARON type of ArmarX's XML: `type = {file = "Cup.xml", name = "example::dto::Cup"}`."""

    file: str
    name: str = ""
    """May be missing where the file and what it includes define a single type."""

    include: list[str] = []
    """Directories in which to look for included files, beside that of the file."""


class PoseTable(Table, frozen=True):
    """Where in the data it stands where something is: `{path = "objects[*].pose", unit = "m"}`."""

    path: str
    unit: str = "mm"


class CoreSegmentTable(Table, frozen=True):
    """`[[memories.core_segments]]`."""

    name: str
    type: str | TypeTable = ""
    history: int | None = None
    poses: list[str | PoseTable] | None = None


class MemoryTable(Table, frozen=True):
    """`[[memories]]`."""

    name: str = ""
    profile: str = ""
    typed: bool = True
    history: int | None = None
    history_limits: dict[str, int] = {}
    core_segments: list[CoreSegmentTable] = []
    prior_knowledge: list[str] = []
    delay_warning: float = DELAY_THRESHOLD / 1_000_000
    update_bytes: int = UPDATE_BYTES


class RobotStateTable(Table, frozen=True):
    """`[long_term.robot_state]`: which data say where the robot is."""

    segment: str
    pose: str
    unit: str = "mm"
    footprint: float | list[tuple[float, float]] | None = None
    max_age: float | None = None


class LongTermTable(Table, frozen=True):
    """`[long_term]`."""

    memory: str = "elm"
    dsn: str | None = None
    robot: str = ""
    frame: str = DEFAULT_FRAME
    radius: float | None = None
    when: When = When.ON_COMMIT
    at_stop: bool = True
    durable: bool = False
    backlog: int | None = None
    backlog_bytes: int | None = None
    wait: float | None = None
    patience: float | None = None
    robot_state: RobotStateTable | None = None


class IceTable(Table, frozen=True):
    """`[ice]`."""

    mode: Mode
    slices: list[str] = []
    host: str = "127.0.0.1"
    port: int = PORT
    endpoint: str = "tcp"
    locator: str = ""
    own_name_system: bool = False
    properties: dict[str, str] = {}


class TimeDecayTable(Table, frozen=True):
    """`time_decay = {activation = "exponential", tau = 3600.0, minimum = 0.2}`."""

    minimum: float
    activation: Literal["exponential", "ebbinghaus"] = "exponential"
    tau: float | None = None
    k: float | None = None
    c: float | None = None
    minute: float | None = None


class FrequencyTable(Table, frozen=True):
    """`frequency = {wait = 0.5}`."""

    wait: float


class SimilarityTable(Table, frozen=True):
    """`similarity = {distance = "mse", minimum = 0.01, count = 3}`."""

    distance: str
    minimum: float
    count: int | None = None


class LatentSimilarityTable(SimilarityTable, frozen=True):
    """`[forgetting.offline] similarity`: the same, with an encoder if wanted."""

    encoder: Literal["none", "pca", "random_projection"] = "none"
    size: int | None = None
    seed: int | None = None


class RetentionTable(Table, frozen=True):
    """`retention = {count = 10000, age = 2592000.0}`."""

    count: int | None = None
    bytes: int | None = None
    age: float | None = None
    total_count: int | None = None
    total_bytes: int | None = None


class OnlineTable(Table, frozen=True):
    """`[forgetting.online]`."""

    time_decay: TimeDecayTable | None = None
    frequency: FrequencyTable | None = None
    similarity: SimilarityTable | None = None


class OfflineTable(Table, frozen=True):
    """`[forgetting.offline]`."""

    time_decay: TimeDecayTable | None = None
    frequency: FrequencyTable | None = None
    similarity: LatentSimilarityTable | None = None
    retention: RetentionTable | None = None
    keep_newest: bool = True


class ForgettingTable(Table, frozen=True):
    """`[forgetting]`."""

    online: OnlineTable = OnlineTable()
    offline: OfflineTable = OfflineTable()


class FileTable(Table, frozen=True):
    """The whole file: what stands at `the top of the file`."""

    memories: list[MemoryTable] = []
    long_term: LongTermTable | None = None
    forgetting: ForgettingTable = ForgettingTable()
    ice: IceTable | None = None
