"""The compound types of table A.1 as a library: type objects by name.

The published table describes most types in words. Where the members' names and kinds are known from
ArmarX's clients (times, ids of memory) they are those; the other objects have the members that the table
names, under names of our own. Data with more or fewer members realize them partially, and definitions of
the user's own (`aron.definitions`) take precedence.
"""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.geometry import GEOMETRY
from armem_bridge.aron.aliases.naming import NAMING
from armem_bridge.aron.aliases.objects import OBJECTS
from armem_bridge.aron.aliases.robots import ROBOTS
from armem_bridge.aron.aliases.scenes import SCENES
from armem_bridge.aron.aliases.sensing import SENSING
from armem_bridge.aron.aliases.timing import TIMING

ALIASES: Final[dict[str, t.TypeObject]] = {**GEOMETRY, **TIMING, **SENSING, **NAMING, **ROBOTS, **OBJECTS, **SCENES}
"""The types by the names of table A.1, with what those refer to (ObjectID, MemoryID)."""


def plain_name(name: str) -> str:
    """A name as type definitions spell it in many ways: `FramedPose`, `framed_pose` and `framed-pose` are one."""
    return name.replace("_", "").replace("-", "").lower()


BY_PLAIN_NAME: Final = {plain_name(name): type_object for name, type_object in ALIASES.items()}
