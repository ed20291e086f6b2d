"""The minute that the demo remembers: a robot in a kitchen, a cup that is carried from the table to the sink."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, Final

import numpy as np
from msgspec.structs import replace

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import from_datetime
from armem_bridge.profiles import PROFILES
from armem_bridge.working import Commit, EntityUpdate
from elm.geometry import Region

ROBOT: Final = "armar7"
BEGIN: Final = datetime(2026, 1, 1, 10, 0, tzinfo=UTC)
SECONDS: Final = 60
LATE: Final = 17
"""What was seen in this second is sent after all the rest."""

OBJECTS: Final = MemoryID(memory="Object")
CUP: Final = MemoryID(memory="Object", core_segment="Instance", provider_segment="ObjectLocalizer", entity="blue-cup")
MUG: Final = CUP.with_entity("mug")
STATE: Final = MemoryID(memory="RobotState", core_segment="State", provider_segment="Navigation", entity=ROBOT)

TABLE: Final = Region.box(1.5, 0.5, 3.5, 2.0)
SINK: Final = Region.box(5.0, 2.5, 6.5, 3.5)

_ON_TABLE, _IN_SINK, _MUG = (2.0, 1.0), (5.8, 3.0), (3.0, 1.5)
_ON_THE_WAY = 2_000
"""Microseconds between seeing and sending, and between sending and arriving."""
_LIFTED, _PUT_DOWN = 20, 35
"""The seconds at which somebody takes the cup, and puts it down again."""


def moment(second: float) -> int:
    """That second of the minute, in microseconds since 1970."""
    return from_datetime(BEGIN) + round(second * 1e6)


def commits() -> Iterator[Commit]:
    """One commit a second: where the robot is, and what its localizer sees. That of second 17 is sent at the end."""
    for second in [*(each for each in range(SECONDS) if each != LATE), LATE]:
        sent = moment(SECONDS if second == LATE else second) + _ON_THE_WAY
        updates = [robot_at(second), seen(CUP, cup_at(second), second), seen(MUG, _MUG, second)]
        yield Commit(updates=[replace(each, sent=sent) for each in updates])


def robot_at(second: float) -> EntityUpdate:
    """The robot drives along beside the table and on to the sink."""
    return _update(STATE, "RobotState", {"globalPose": pose(1.0 + second / 15, 0.0)}, second)


def seen(entity: MemoryID, place: tuple[float, float], second: float) -> EntityUpdate:
    """What the localizer says of an object at a place."""
    name = {"dataset": "Kitchen", "className": entity.entity, "instanceName": "0"}
    data = {"id": name, "globalPose": pose(*place), "creator": entity.provider_segment}
    return _update(entity, "ObjectInstance", data, second)


def cup_at(second: float) -> tuple[float, float]:
    """Where the cup is: on the table, carried along, in the sink."""
    share = min(max((second - _LIFTED) / (_PUT_DOWN - _LIFTED), 0.0), 1.0)
    (x0, y0), (x1, y1) = _ON_TABLE, _IN_SINK
    return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


def pose(x: float, y: float) -> np.ndarray[Any, np.dtype[np.float32]]:
    """A pose in the map, in millimetres as ArmarX has them, of a place in metres."""
    matrix = np.eye(4, dtype=np.float32)
    matrix[:3, 3] = (1000 * x, 1000 * y, 900)
    return matrix


def _update(entity: MemoryID, type_name: str, data: dict[str, Any], second: float) -> EntityUpdate:
    (found,) = (each for profile in PROFILES.values() for each in profile.core_segments if each.type_name == type_name)
    instance = to_aron(data, found.aron_type)
    assert isinstance(instance, Dict)  # noqa: S101 - what a mapping becomes
    at = moment(second)
    return EntityUpdate(entity=entity, instances=(instance,), referenced=at, sent=at, confidence=0.9)


class KitchenClock:
    """The clock of the memory servers: what was sent arrives a moment later, in the time of that minute."""

    def __init__(self) -> None:
        self._now = moment(0)

    def __call__(self) -> int:
        """What time it is: when the last commit arrived."""
        return self._now

    def receive(self, commit: Commit) -> Commit:
        """The commit arrives."""
        self._now = max(update.sent for update in commit.updates) + _ON_THE_WAY
        return commit
