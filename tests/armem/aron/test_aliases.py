"""Table A.1: every name that it prints is a type object, of the extents and elements that it states."""

from __future__ import annotations

import numpy as np
import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES, BY_PLAIN_NAME, plain_name
from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Data, Dict, Int, NDArray, String
from armem_bridge.aron.realization import Level, realizes

TABLE = [
    "Vector2f",
    "Vector3f",
    "Position",
    "Vector2d",
    "Vector3d",
    "Matrix2f",
    "Matrix3f",
    "Matrix4f",
    "Pose",
    "Matrix2d",
    "Matrix3d",
    "Matrix4d",
    "Quaternionf",
    "Orientation",
    "Quaterniond",
    "FrameID",
    "FramedPosition",
    "FramedPose",
    "FramedOrientation",
    "LaserScanHeader",
    "LaserScan",
    "ColorRGBA",
    "ColorHSV",
    "ImageRGB",
    "Image",
    "ImageDepth",
    "PointXYZ",
    "PointXYZRGB",
    "PointXYZRGBA",
    "PointCloudXYZ",
    "PointCloudXYZRGB",
    "ClockType",
    "Duration",
    "Frequency",
    "DateTime",
    "TaskSpaceElement",
    "JointSpaceElement",
    "TaskSpaceTrajectory",
    "JointSpaceTrajectory",
    "BoundingBox",
    "OrientedBox",
    "ObjectClass",
    "ObjectInstance",
    "KnownGrasp",
    "KnownGraspSet",
    "GraspCandidate",
    "JointInfo",
    "PlatformInfo",
    "Proprioception",
    "RobotDescription",
    "RobotState",
    "SkillDescription",
    "SkillParameterization",
    "SkillExecutionRequest",
    "SkillExecutionResult",
    "Human",
    "HumanPose",
    "Affordance",
    "SymbolicSceneDescription",
    "PackagePath",
]


@pytest.mark.parametrize("name", TABLE)
def test_every_name_of_the_table_is_a_type(name: str) -> None:
    type_object = ALIASES[name]
    assert isinstance(type_object, t.KINDS)
    assert not type_object.maybe
    if isinstance(type_object, t.Object):
        assert type_object.name == name
        assert type_object.all_members


def test_the_other_names_of_the_table() -> None:
    assert ALIASES["Position"] == ALIASES["Vector3f"]
    assert ALIASES["Pose"] == ALIASES["Matrix4f"]
    assert ALIASES["Orientation"] == ALIASES["Quaternionf"]
    assert ALIASES["Image"] == ALIASES["ImageRGB"]


def test_the_elements_and_extents_are_those_of_the_table() -> None:
    expected = {"f": "float32", "d": "float64"}
    for name, type_object in ALIASES.items():
        if name[:-2] in ("Vector", "Matrix"):
            size = int(name[-2])
            shape = (size,) if name.startswith("Vector") else (size, size)
            assert type_object == t.NDArray(shape=shape, element=expected[name[-1]])
    assert ALIASES["Quaternionf"] == t.NDArray(shape=(4,), element="float32")
    assert ALIASES["Quaterniond"] == t.NDArray(shape=(4,), element="float64")


@pytest.mark.parametrize(
    ("name", "data", "level"),
    [
        ("ImageRGB", NDArray((64, 48, 3, 1), "uint8", bytes(64 * 48 * 3)), Level.FULL),
        ("ImageRGB", NDArray((48, 64, 3), "16", bytes(64 * 48 * 3)), Level.FULL),
        ("ImageRGB", NDArray((64, 48, 1, 4), "float32", bytes(64 * 48 * 4)), Level.NO),
        ("ImageDepth", NDArray((64, 48, 1, 4), "float32", bytes(64 * 48 * 4)), Level.FULL),
        ("ImageDepth", NDArray((48, 64, 4), "float", bytes(64 * 48 * 4)), Level.FULL),
        ("ImageDepth", NDArray((64, 48, 3, 1), "uint8", bytes(64 * 48 * 3)), Level.NO),
        ("Vector3f", to_aron(np.zeros((3, 1), np.float32)), Level.FULL),
        ("Vector3f", to_aron(np.zeros(3, np.float64)), Level.NO),
        ("Vector3f", to_aron(np.zeros(2, np.float32)), Level.NO),
        ("Vector3d", to_aron(np.zeros(3, np.float64)), Level.FULL),
        ("Pose", to_aron(np.eye(4, dtype=np.float32)), Level.FULL),
        ("Pose", to_aron(np.eye(3, dtype=np.float32)), Level.NO),
        ("PointCloudXYZRGBA", NDArray((5, 32), "pcl::PointXYZRGBA", bytes(160)), Level.FULL),
        ("PointCloudXYZRGBA", NDArray((5, 2, 32), "pcl::PointXYZRGBA", bytes(320)), Level.FULL),
        ("PointCloudXYZ", NDArray((5, 32), "pcl::PointXYZRGBA", bytes(160)), Level.NO),
        ("PointXYZRGBA", NDArray((1, 32), "pcl::PointXYZRGBA", bytes(32)), Level.FULL),
        ("PointXYZRGBA", NDArray((2, 32), "pcl::PointXYZRGBA", bytes(64)), Level.NO),
        ("ClockType", Int(3), Level.FULL),
        ("ClockType", Int(4), Level.NO),
        ("PackagePath", Dict({"package": String("p"), "path": String("a/b")}), Level.FULL),
    ],
)
def test_what_realizes_them(name: str, data: Data, level: Level) -> None:
    assert realizes(data, ALIASES[name]).level is level


def test_a_time_is_what_the_clients_write() -> None:
    time = {"clockType": 0, "hostname": "robot", "timeSinceEpoch": {"microSeconds": np.int64(1)}}
    memory = {
        "memoryName": "Object",
        "coreSegmentName": "Instance",
        "providerSegmentName": "p",
        "entityName": "cup",
        "timestamp": time,
        "instanceIndex": -1,
    }
    assert realizes(to_aron(time), ALIASES["DateTime"]).level is Level.FULL
    assert realizes(to_aron(memory), ALIASES["MemoryID"]).level is Level.FULL


def test_no_two_names_are_spelled_alike() -> None:
    assert len(BY_PLAIN_NAME) == len(ALIASES)
    assert plain_name("Framed_Pose") == plain_name("framed-pose") == plain_name("FramedPose") == "framedpose"
