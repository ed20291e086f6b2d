"""Poses in data: found by paths, in either unit, in whichever form ArmarX has, or counted where they are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from armem_bridge.aron.arrays import from_numpy
from armem_bridge.aron.data import Data, Dict, Double, Float, Int, List, NDArray, String
from armem_bridge.long_term import PosePath, SubjectFinder
from armem_bridge.long_term.data_paths import DataPath
from armem_bridge.long_term.poses import NoPose, Unit, read_pose
from armem_bridge.long_term.refusals import InvalidArchive
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.snapshot import Snapshot
from elm.errors import InvalidValue
from elm.geometry import Region
from tests.armem.long_term.memories import as_dict, matrix, snapshot_with
from tests.armem.working.scenes import CUP


def framed(frame: str, data: Data, *, part: str = "pose", agent: str = "armar7") -> Dict:
    """A framed pose as ArmarX has it."""
    return Dict({"header": Dict({"frame": String(frame), "agent": String(agent)}), part: data})


def found(path: str, data: dict[str, Any]) -> list[Data]:
    """What stands at a path."""
    return list(DataPath(path).find(as_dict(data)))


def test_paths() -> None:
    data = {
        "pose": 1,
        "a.b": {"c]": 2},
        "objects": [{"at": 3}, {}, {"at": None}, {"at": 4}],
        "by": {"x": [5], "y": [6]},
    }
    assert found("pose", data) == [Int(1)]
    assert found("a\\.b.c\\]", data) == [Int(2)]
    assert found("objects[*].at", data) == [Int(3), Int(4)]
    assert found("objects[3].at", data) == [Int(4)]
    assert found("by[*][0]", data) == [Int(5), Int(6)]
    assert found("", data) == [as_dict(data)]
    assert found("pose.x", data) == found("pose[0]", data) == found("objects[9]", data) == found("none", data) == []
    assert list(DataPath("pose").find(None)) == []


@pytest.mark.parametrize("path", [".pose", "a..b", "a.", "a[", "a[x]", "a[-1]", "a]b", "a[0]b", "\\"])
def test_what_is_no_path_is_refused(path: str) -> None:
    with pytest.raises(InvalidArchive, match="is no path into data"):
        DataPath(path)


@pytest.mark.parametrize(
    "data",
    [
        from_numpy(matrix(300, -2000)),
        from_numpy(matrix(300, -2000, kind="float64")),
        NDArray((4, 4, 4), "float", matrix(300, -2000).tobytes()),
        from_numpy(np.array([300, -2000, 0], dtype="float32")),
        from_numpy(np.array([[300], [-2000], [0]], dtype="float32")),
        from_numpy(np.array([[300, -2000, 0]], dtype="float64")),
        from_numpy(np.array([300, -2000], dtype="int32")),
        List([Float(300), Int(-2000), Double(0)]),
        Dict({"x": Float(300), "y": Float(-2000), "z": Float(0)}),
        Dict({"x": Float(300), "y": Float(-2000)}),
        framed("Global", from_numpy(matrix(300, -2000))),
        framed("Global", from_numpy(np.array([300, -2000, 0], dtype="float32")), part="position"),
    ],
)
def test_poses_in_all_their_forms(data: Data) -> None:
    assert read_pose(data, Unit.MILLIMETRES).position == (0.3, -2.0, 0.0)
    assert read_pose(data, Unit.METRES).position == (300.0, -2000.0, 0.0)
    assert read_pose(data, Unit.METRES).is_global


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (from_numpy(matrix(1, 2).T.copy()), "rows and columns swapped"),
        (from_numpy(matrix(float("nan"), 2)), "NaN or infinite"),
        (from_numpy(np.eye(3)), "3 x 3 is neither"),
        (from_numpy(np.zeros((4, 1))), "4 x 1 is neither"),
        (from_numpy(np.zeros((2, 2))), "2 x 2 is neither"),
        (from_numpy(np.zeros((4, 4), dtype=bool)), "made of numbers"),
        (NDArray((4, 4, 3), "mystery", bytes(48)), "cannot be read"),
        (NDArray((), "float32", b""), "neither"),
        (List([String("x"), Int(1), Int(2)]), "a coordinate is a number, not String"),
        (List([]), "neither"),
        (Dict({"x": Int(1)}), "a Dict is neither"),
        (String("here"), "a String is neither"),
        (Dict({"header": Dict({}), "pose": from_numpy(np.eye(4))}), "names no frame"),
        (Dict({"header": Dict({"frame": String("Global")})}), "a header and a pose"),
    ],
)
def test_what_is_no_pose(data: Data, says: str) -> None:
    with pytest.raises(NoPose, match=says):
        read_pose(data, Unit.MILLIMETRES)


def test_the_subject_is_a_disc_around_the_pose() -> None:
    finder = SubjectFinder([PosePath.at("pose")], radius=0.1, frame="kitchen")
    snapshot = snapshot_with(Dict({"pose": from_numpy(matrix(300, -2000))}))

    assert finder.subject(snapshot) == Region.around(0.3, -2.0, 0.1, frame="kitchen")
    assert finder.status() == {"poses": 1, "untransformed_poses": 0, "unreadable_poses": 0}


def test_units_go_with_paths_and_paths_with_segments() -> None:
    grasp = MemoryID(memory="Grasp", core_segment="Candidate", provider_segment="p", entity="e")
    paths = [PosePath.at("pose", segment=CUP.cut(CUP.level)), PosePath.at("pose", unit="m", segment=grasp)]
    finder = SubjectFinder(paths)
    data = Dict({"pose": from_numpy(matrix(1, 2))})

    assert finder.subject(snapshot_with(data)) == Region.around(0.001, 0.002, 0.05)
    assert finder.subject(snapshot_with(data, entity=grasp)) == Region.around(1, 2, 0.05)
    assert finder.subject(snapshot_with(data, entity=CUP.with_entity("mug"))) is None
    with pytest.raises(InvalidArchive, match="the unit of the pose 'pose' is one of mm, m, not 'cm'"):
        PosePath.at("pose", unit="cm")


def test_several_poses_have_one_hull() -> None:
    finder = SubjectFinder([PosePath.at("objects[*].globalPose")], radius=0.1)
    objects = List([Dict({"globalPose": from_numpy(matrix(x, 0))}) for x in (0, 1000, 3000)] + [Dict({})])
    subject = finder.subject(snapshot_with(Dict({"objects": objects})))

    assert subject == Region.hull([(0, 0), (1, 0), (3, 0)], footprint=0.1)


def test_all_instances_are_looked_at() -> None:
    one = snapshot_with(Dict({"pose": from_numpy(matrix(0, 0))}))
    two = snapshot_with(Dict({"pose": from_numpy(matrix(1000, 0))}))
    both = Snapshot(id=one.id, instances=one.instances + two.instances)

    assert SubjectFinder([PosePath.at("pose")]).subject(both) == Region.hull([(0, 0), (1, 0)], footprint=0.05)


class Hand:
    """Knows where the hand of one robot is: turned by a quarter, at (5, 5)."""

    def to_global(self, frame: str, agent: str, moment: int) -> Any:
        return matrix(5, 5, np.pi / 2, "float64") if (frame, agent, moment) == ("Hand R", "armar7", 10) else None


def test_framed_poses_are_transformed_or_left_without_region_and_counted() -> None:
    finder = SubjectFinder([PosePath.at("pose")], transform=Hand())
    pose = from_numpy(matrix(1000, 0))

    subject = finder.subject(snapshot_with(Dict({"pose": framed("Hand R", pose)})))
    assert subject is not None
    assert np.allclose(subject.polygon.centroid.coords[0], (5, 6))
    for frame, agent in (("Hand R", "armar6"), ("Foot", "armar7"), ("", "")):
        assert finder.subject(snapshot_with(Dict({"pose": framed(frame, pose, agent=agent)}))) is None
    assert finder.status() == {"poses": 1, "untransformed_poses": 3, "unreadable_poses": 0}
    without = SubjectFinder([PosePath.at("pose")])
    assert without.subject(snapshot_with(Dict({"pose": framed("Hand R", pose)}))) is None
    assert without.status()["untransformed_poses"] == 1


def test_what_is_no_pose_is_counted_and_what_is_missing_is_not() -> None:
    finder = SubjectFinder([PosePath.at("pose")])
    far = from_numpy(matrix(1e15, 0, kind="float64"))
    for data in (
        Dict({"pose": String("here")}),
        Dict({"pose": from_numpy(matrix(float("inf"), 0))}),
        Dict({"pose": far}),
    ):
        assert finder.subject(snapshot_with(data)) is None
    for nothing in (Dict({"pose": None}), Dict({}), None):
        assert finder.subject(snapshot_with(nothing)) is None
    assert finder.status()["unreadable_poses"] == 3
    with pytest.raises(InvalidValue, match="the radius of a region"):
        SubjectFinder([], radius=0)
    with pytest.raises(InvalidValue, match="the frame of a region"):
        SubjectFinder([], frame="")
