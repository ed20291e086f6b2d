"""Table A.1's skills, humans, affordances and symbolic scenes as type objects."""

from __future__ import annotations

from typing import Final

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases.geometry import FRAMED_POSE, POSITION
from armem_bridge.aron.aliases.naming import MEMORY_ID
from armem_bridge.aron.aliases.timing import DATE_TIME, DURATION

SKILL_DESCRIPTION: Final = t.Object(
    name="SkillDescription",
    members={
        "name": t.String(),
        "description": t.String(),
        "parameters": t.Any(maybe=True),
        "provider": t.String(),
        "result": t.Any(maybe=True),
        "timeout": DURATION,
        "events": t.List(accepted=t.String()),
    },
)
SKILL_PARAMETERIZATION: Final = t.Object(
    name="SkillParameterization", members={"skill": t.String(), "parameters": t.Dict(accepted=t.Any(maybe=True))}
)
SKILL_EXECUTION_REQUEST: Final = t.Object(
    name="SkillExecutionRequest",
    members={"executor": t.String(), "requested": DATE_TIME, "parameterization": SKILL_PARAMETERIZATION},
)
SKILL_EXECUTION_RESULT: Final = t.Object(
    name="SkillExecutionResult",
    members={
        "skill": t.String(),
        "succeeded": t.Bool(),
        "output": t.Any(maybe=True),
        "statuses": t.List(accepted=t.String()),
    },
)

HUMAN: Final = t.Object(
    name="Human",
    members={
        "id": t.String(),
        "name": t.String(),
        "faceFeatures": t.NDArray(maybe=True),
        "profile": t.Dict(accepted=t.Any(maybe=True)),
    },
)
HUMAN_KEYPOINT: Final = t.Object(
    name="HumanKeypoint",
    members={"label": t.String(), "confidence": t.Float(), "local": POSITION, "global": t.as_maybe(POSITION)},
)
HUMAN_POSE: Final = t.Object(
    name="HumanPose",
    members={
        "keypoints": t.Dict(accepted=HUMAN_KEYPOINT),
        "recognizer": t.String(),
        "humanId": t.String(maybe=True),
        "timestamp": DATE_TIME,
    },
)

AFFORDANCE: Final = t.Object(
    name="Affordance", members={"pose": FRAMED_POSE, "description": t.String(), "label": t.String()}
)
SYMBOLIC_RELATION: Final = t.Object(
    name="SymbolicRelation", members={"relation": t.String(), "arguments": t.List(accepted=t.String())}
)
SYMBOLIC_SCENE_DESCRIPTION: Final = t.Object(
    name="SymbolicSceneDescription",
    members={
        "timestamp": DATE_TIME,
        "symbols": t.Dict(accepted=MEMORY_ID),
        "relations": t.List(accepted=SYMBOLIC_RELATION),
    },
)
"""What holds between symbols, and which parts of memory they stand for."""

SCENES: Final[dict[str, t.TypeObject]] = {
    "SkillDescription": SKILL_DESCRIPTION,
    "SkillParameterization": SKILL_PARAMETERIZATION,
    "SkillExecutionRequest": SKILL_EXECUTION_REQUEST,
    "SkillExecutionResult": SKILL_EXECUTION_RESULT,
    "Human": HUMAN,
    "HumanPose": HUMAN_POSE,
    "Affordance": AFFORDANCE,
    "SymbolicSceneDescription": SYMBOLIC_SCENE_DESCRIPTION,
}
