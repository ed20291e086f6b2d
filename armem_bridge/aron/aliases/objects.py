"""Table A.1's classes and instances of objects, and how they can be grasped, as type objects."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.geometry import FRAMED_POSE, ORIENTED_BOX, POSE
from armem_bridge.aron.aliases.naming import MEMORY_ID, OBJECT_ID, PACKAGE_PATH

OBJECT_CLASS: Final = t.Object(
    name="ObjectClass",
    members={
        "id": OBJECT_ID,
        "names": t.List(accepted=t.String()),
        "parent": t.String(maybe=True),
        "mesh": t.as_maybe(PACKAGE_PATH),
        "boundingBox": t.as_maybe(ORIENTED_BOX),
        "features": t.Dict(accepted=t.Any(maybe=True)),
        "joints": t.List(accepted=t.String()),
    },
)

OBJECT_INSTANCE: Final = t.Object(
    name="ObjectInstance",
    members={
        "id": OBJECT_ID,
        "objectClass": MEMORY_ID,
        "globalPose": t.as_maybe(POSE),
        "framedPose": t.as_maybe(FRAMED_POSE),
        "creator": t.String(),
    },
)
"""An object at a place; where it is, is said globally, in a frame, or both."""

KNOWN_GRASP: Final = t.Object(
    name="KnownGrasp",
    members={
        "id": t.String(),
        "pose": FRAMED_POSE,
        "prepose": t.as_maybe(FRAMED_POSE),
        "hand": t.String(),
        "quality": t.Float(),
    },
)

KNOWN_GRASP_SET: Final = t.Object(
    name="KnownGraspSet", members={"object": OBJECT_ID, "grasps": t.List(accepted=KNOWN_GRASP)}
)

GRASP_CANDIDATE: Final = t.Object(
    name="GraspCandidate",
    members={
        "provider": t.String(),
        "object": OBJECT_ID,
        "pose": FRAMED_POSE,
        "hand": t.String(),
        "quality": t.Float(),
        "plan": t.Any(maybe=True),
    },
)

OBJECTS: Final[dict[str, t.TypeObject]] = {
    "ObjectClass": OBJECT_CLASS,
    "ObjectInstance": OBJECT_INSTANCE,
    "KnownGrasp": KNOWN_GRASP,
    "KnownGraspSet": KNOWN_GRASP_SET,
    "GraspCandidate": GRASP_CANDIDATE,
}
