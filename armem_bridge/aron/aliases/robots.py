"""Table A.1's trajectories and what a robot knows of its own body as type objects."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.geometry import POSE, VECTOR_3F
from armem_bridge.aron.aliases.naming import MEMORY_ID, PACKAGE_PATH
from armem_bridge.aron.aliases.timing import DATE_TIME

TASK_SPACE_ELEMENT: Final = t.Object(name="TaskSpaceElement", members={"timestep": t.Float(), "pose": POSE})
JOINT_SPACE_ELEMENT: Final = t.Object(
    name="JointSpaceElement", members={"timestep": t.Float(), "jointAngles": t.List(accepted=t.Float())}
)
TASK_SPACE_TRAJECTORY: Final = t.Object(
    name="TaskSpaceTrajectory", members={"steps": t.List(accepted=TASK_SPACE_ELEMENT)}
)
JOINT_SPACE_TRAJECTORY: Final = t.Object(
    name="JointSpaceTrajectory", members={"steps": t.List(accepted=JOINT_SPACE_ELEMENT)}
)

JOINT_INFO: Final = t.Object(
    name="JointInfo",
    members={
        "position": t.Float(),
        "velocity": t.Float(),
        "torque": t.Float(),
        "effort": t.Float(),
        "temperature": t.Float(),
    },
)
"""Feedback of one joint; what a joint cannot measure is left out, which realizes the type partially."""

PLATFORM_INFO: Final = t.Object(
    name="PlatformInfo", members={"linearVelocity": VECTOR_3F, "angularVelocity": VECTOR_3F, "acceleration": VECTOR_3F}
)
PROPRIOCEPTION: Final = t.Object(
    name="Proprioception", members={"joints": t.Dict(accepted=JOINT_INFO), "platform": PLATFORM_INFO}
)
ROBOT_DESCRIPTION: Final = t.Object(
    name="RobotDescription",
    members={
        "name": t.String(),
        "xml": PACKAGE_PATH,
        "joints": t.List(accepted=t.String()),
        "parents": t.Dict(accepted=t.String()),
    },
)
"""What a robot is built of: its joints, and of each part the one that it hangs on."""

ROBOT_STATE: Final = t.Object(
    name="RobotState",
    members={
        "timestamp": DATE_TIME,
        "globalPose": POSE,
        "proprioception": PROPRIOCEPTION,
        "description": MEMORY_ID,
    },
)

ROBOTS: Final[dict[str, t.TypeObject]] = {
    "TaskSpaceElement": TASK_SPACE_ELEMENT,
    "JointSpaceElement": JOINT_SPACE_ELEMENT,
    "TaskSpaceTrajectory": TASK_SPACE_TRAJECTORY,
    "JointSpaceTrajectory": JOINT_SPACE_TRAJECTORY,
    "JointInfo": JOINT_INFO,
    "PlatformInfo": PLATFORM_INFO,
    "Proprioception": PROPRIOCEPTION,
    "RobotDescription": ROBOT_DESCRIPTION,
    "RobotState": ROBOT_STATE,
}
