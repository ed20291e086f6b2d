"""The profiles: all servers of table A.2, with the types of table A.1, ready to be served."""

from __future__ import annotations

import numpy as np
import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict, String
from armem_bridge.long_term.data_paths import DataPath
from armem_bridge.long_term.poses import Unit, read_pose
from armem_bridge.profiles import PROFILES, Profile, SegmentProfile
from armem_bridge.working import Commit, EntityUpdate, MemoryServer

TABLE_A2 = [
    "RobotStateMemory",
    "ObjectMemory",
    "VisionMemory",
    "SkillsMemory",
    "GraspMemory",
    "SystemStateMemory",
    "HumanMemory",
    "IndexMemory",
    "MotionPrimitiveMemory",
    "NavigationMemory",
    "SymbolicSceneMemory",
    "AudioMemory",
    "ControlMemory",
    "SpeechMemory",
    "ManipulationMemory",
    "PlanningMemory",
    "ViewSelectionMemory",
    "DemonstrationMemory",
]
TYPED = [segment for profile in PROFILES.values() for segment in profile.core_segments if segment.type_name]


def test_all_servers_of_the_table_are_there() -> None:
    assert list(PROFILES) == TABLE_A2
    assert [profile.memory for profile in PROFILES.values()][:3] == ["RobotState", "Object", "Vision"]


@pytest.mark.parametrize("profile", PROFILES.values(), ids=TABLE_A2)
def test_a_server_can_be_made_of_each(profile: Profile) -> None:
    names = [segment.name for segment in profile.core_segments]
    with MemoryServer(profile.memory, [segment.definition() for segment in profile.core_segments]) as server:
        assert server.status().core_segments == len(names) == len(set(names)) >= 1
    assert profile.description


@pytest.mark.parametrize("segment", TYPED, ids=lambda segment: segment.type_name)
def test_types_are_those_of_table_a1_and_of_objects(segment: SegmentProfile) -> None:
    found = segment.aron_type
    assert isinstance(found, t.Object)
    own = found.members[segment.member] if segment.member else found
    assert own == ALIASES[segment.type_name]
    assert isinstance(ALIASES[segment.type_name], t.Object) == (not segment.member)


@pytest.mark.parametrize("segment", [each for each in TYPED if each.poses], ids=lambda segment: segment.type_name)
def test_poses_are_where_the_types_have_them(segment: SegmentProfile) -> None:
    for path in segment.poses:
        example = _example(segment.aron_type)
        (found,) = DataPath(path).find(example)
        assert read_pose(found, Unit.MILLIMETRES).position == (1.0, 2.0, 3.0)


def test_a_typed_segment_takes_an_image_and_refuses_a_text() -> None:
    profile = PROFILES["VisionMemory"]
    with MemoryServer(profile.memory, [segment.definition() for segment in profile.core_segments]) as server:
        camera = server.id.with_core_segment("ImageRGB").with_provider_segment("Camera").with_entity("left")
        image = to_aron({"image": np.zeros((4, 3, 3), np.uint8)})
        text = Dict({"image": String("a picture of a cup")})
        assert isinstance(image, Dict)
        updates = [EntityUpdate(entity=camera, instances=(each,), referenced=1) for each in (image, text)]
        assert [each.success for each in server.commit(Commit(updates=updates)).results] == [True, False]


def _example(kind: t.TypeObject | None) -> Dict | None:
    """Data with the pose (1, 2, 3) in metres wherever a type has a position or a pose."""
    value = _value(kind)
    data = to_aron(value)
    return data if isinstance(data, Dict) else None


def _value(kind: t.TypeObject | None) -> object:
    match kind:
        case t.Object(name="FrameID"):
            return {"frame": "Global", "agent": ""}
        case t.Object():
            return {name: _value(member) for name, member in kind.members.items()}
        case t.Dict():
            return {"one": _value(kind.accepted)}
        case t.NDArray(shape=(4, 4)):
            matrix = np.eye(4, dtype=np.float32)
            matrix[:3, 3] = (1000, 2000, 3000)
            return matrix
        case t.NDArray(shape=(3,)):
            return np.array([1000, 2000, 3000], np.float32)
        case _:
            return None
