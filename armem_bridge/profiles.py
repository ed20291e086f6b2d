"""The memory servers of table A.2 as profiles: what core segments each has, and of which types.

The table names the servers and says in words what they store. The names of the core segments are taken from
these words, but for `Instance` and `Class` of the object memory, which figure 4.7 and listing 4.9 have. Their types
are those of table A.1 where it has one for what they hold; the others take any data. What the table says is
stored as an image or a point cloud, which is an array and no object, is a member of one here.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import msgspec

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.working.segments import CoreSegmentDefinition


class SegmentProfile(msgspec.Struct, frozen=True, kw_only=True):
    """A core segment of a profile."""

    name: str
    type_name: str = ""
    """Its type by the name of table A.1; empty where it takes any data."""

    member: str = ""
    """Where the type is that of an array: the member of the object that has it."""

    poses: tuple[str, ...] = ()
    """Where in the data of this type it stands where the thing is that they are about, in millimetres."""

    @property
    def aron_type(self) -> t.TypeObject | None:
        """The type object."""
        if not self.type_name:
            return None
        found = ALIASES[self.type_name]
        return t.Object(name=self.type_name, members={self.member: found}) if self.member else found

    def definition(self) -> CoreSegmentDefinition:
        """The core segment as a memory server defines it."""
        return CoreSegmentDefinition(name=self.name, aron_type=self.aron_type)


class Profile(msgspec.Struct, frozen=True, kw_only=True):
    """A memory server of table A.2."""

    name: str
    """The name of the server, as in the table."""

    description: str
    """What it stores, in a few words of the table."""

    core_segments: tuple[SegmentProfile, ...]

    @property
    def memory(self) -> str:
        """The name of its memory: the server's without "Memory", so that `ObjectMemory` has the memory `Object`."""
        return self.name.removesuffix("Memory")


def _segment(name: str, type_name: str = "", *poses: str, member: str = "") -> SegmentProfile:
    return SegmentProfile(name=name, type_name=type_name, member=member, poses=poses)


def _profile(name: str, description: str, *core_segments: SegmentProfile) -> Profile:
    return Profile(name=name, description=description, core_segments=core_segments)


_ALL = (
    _profile(
        "RobotStateMemory",
        "all known robots and their states: descriptions, proprioception, localization, motor commands",
        _segment("Description", "RobotDescription"),
        _segment("State", "RobotState", "globalPose"),
        _segment("Proprioception", "Proprioception"),
        _segment("Localization"),
        _segment("Command"),
    ),
    _profile(
        "ObjectMemory",
        "object classes and instances, their models, the environment and its semantic annotations",
        _segment("Class", "ObjectClass"),
        _segment("Instance", "ObjectInstance", "globalPose", "framedPose"),
        _segment("Model"),
        _segment("Environment"),
        _segment("Annotation"),
    ),
    _profile(
        "VisionMemory",
        "what the sensors see: colour images, depth images, point clouds, laser scans",
        _segment("ImageRGB", "ImageRGB", member="image"),
        _segment("ImageDepth", "ImageDepth", member="image"),
        _segment("PointCloud"),
        _segment("LaserScan", "LaserScan"),
    ),
    _profile(
        "SkillsMemory",
        "skills: descriptions, parameterizations, executions and their results",
        _segment("Description", "SkillDescription"),
        _segment("Parameterization", "SkillParameterization"),
        _segment("ExecutionRequest", "SkillExecutionRequest"),
        _segment("ExecutionResult", "SkillExecutionResult"),
    ),
    _profile(
        "GraspMemory",
        "known grasps of objects, and grasp candidates made on the fly",
        _segment("KnownGrasp", "KnownGraspSet"),
        _segment("Candidate", "GraspCandidate", "pose"),
    ),
    _profile(
        "SystemStateMemory",
        "the load of processors and memory, and active processes",
        _segment("Processor"),
        _segment("MainMemory"),
        _segment("Process"),
    ),
    _profile(
        "HumanMemory",
        "humans in the scene: who they are, recognition results, tracked poses",
        _segment("Human", "Human"),
        _segment("Recognition"),
        _segment("Pose", "HumanPose", "keypoints[*].global"),
    ),
    _profile(
        "IndexMemory",
        "indices and lookup tables computed beforehand for other memories",
        _segment("Index"),
    ),
    _profile(
        "MotionPrimitiveMemory",
        "symbols and parameters of low-level motions that are used again",
        _segment("Primitive"),
        _segment("TaskSpace", "TaskSpaceTrajectory"),
        _segment("JointSpace", "JointSpaceTrajectory"),
    ),
    _profile(
        "NavigationMemory",
        "known locations, rooms and buildings, navigation graphs, costmaps",
        _segment("Location"),
        _segment("Layout"),
        _segment("Graph"),
        _segment("Costmap"),
    ),
    _profile(
        "SymbolicSceneMemory",
        "the scene in symbols: affordances, types of locations, spatial relations",
        _segment("Scene", "SymbolicSceneDescription"),
        _segment("Affordance", "Affordance", "pose"),
        _segment("LocationType"),
    ),
    _profile(
        "AudioMemory",
        "audio input in chunks of time",
        _segment("Chunk"),
    ),
    _profile(
        "ControlMemory",
        "parameters, setpoints and actual values of controllers",
        _segment("Parameterization"),
        _segment("Setpoint"),
        _segment("Actual"),
    ),
    _profile(
        "SpeechMemory",
        "speech that was recognized, and what the robot said",
        _segment("Recognized"),
        _segment("Generated"),
    ),
    _profile(
        "ManipulationMemory",
        "strategies for grasping, placing, pushing and tool use, and past attempts",
        _segment("Strategy"),
        _segment("Attempt"),
    ),
    _profile(
        "PlanningMemory",
        "symbolic planning, typically in PDDL",
        _segment("Domain"),
        _segment("Problem"),
        _segment("Plan"),
    ),
    _profile(
        "ViewSelectionMemory",
        "view targets and camera strategies",
        _segment("Target"),
        _segment("Strategy"),
    ),
    _profile(
        "DemonstrationMemory",
        "demonstrations of actions by humans",
        _segment("Demonstration"),
    ),
)

PROFILES: Final[Mapping[str, Profile]] = MappingProxyType({profile.name: profile for profile in _ALL})
"""The profiles by the names of their servers, in the order of table A.2."""
