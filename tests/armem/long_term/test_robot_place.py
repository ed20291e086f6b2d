"""Where the robot was: its last pose, as long as that holds, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from shapely.geometry import Polygon

from armem_bridge.aron.data import Dict, String
from armem_bridge.long_term import Consolidation, LongTermMemory, PosePath, RobotPlaces
from armem_bridge.long_term.refusals import InvalidArchive
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit, CoreSegmentDefinition, MemoryServer, Snapshot
from armem_bridge.working.versions import snapshot_of
from elm.errors import InvalidValue
from elm.geometry import Region
from tests.armem.long_term.memories import behind, in_process, posed, snapshot_with
from tests.armem.working.scenes import CUP, commit, update

STATE = MemoryID(memory="RobotState", core_segment="Localization", provider_segment="Slam", entity="armar7")


def state(moment: int, x: float, y: float = 0.0, *, sent: int = -1, yaw: float = 0.0) -> Snapshot:
    """Where the robot said it was."""
    update = posed(moment, x, y, entity=STATE, sent=sent, yaw=yaw, key="global_pose")
    return snapshot_of(update, arrived=moment)


def places(**options: object) -> RobotPlaces:
    """Places by the robot's state, of which none is known yet."""
    return RobotPlaces(PosePath.at("global_pose", segment=STATE), **options)  # type: ignore[arg-type]


def test_the_last_pose_holds_for_a_while() -> None:
    known = places(footprint=0.4, max_age=100)
    assert known.region(10) is None
    known.note([state(200, 2000), state(100, 1000)])

    assert [known.region(moment) for moment in (99, 301)] == [None, None]
    assert known.region(100) == known.region(199) == Region.around(1, 0, 0.4)
    assert known.region(200) == known.region(300) == Region.around(2, 0, 0.4)


def test_corners_turn_with_the_robot() -> None:
    known = places(footprint=[(1, 0.2), (1, -0.2), (-0.5, -0.2), (-0.5, 0.2)], frame="lab")
    known.note([state(1, 1000, 2000, yaw=np.pi / 2)])
    region = known.region(1)

    assert region is not None
    assert region.frame == "lab"
    expected = Polygon([(0.8, 3), (1.2, 3), (1.2, 1.5), (0.8, 1.5)])
    assert region.polygon.symmetric_difference(expected).area < 1e-6


def test_of_two_versions_of_a_pose_the_one_that_counts() -> None:
    for order in (1, -1):
        known = places()
        known.note([state(1, 1000, sent=1), state(1, 2000, sent=2)][::order])
        assert known.region(1) == Region.around(2, 0, 0.3)


def test_what_is_no_pose_of_the_robot_is_passed_over() -> None:
    known = places()
    nowhere = snapshot_with(Dict({"global_pose": String("here")}), 5, entity=STATE)
    known.note([nowhere, state(6, float("nan")), snapshot_with(Dict({}), 7, entity=STATE)])
    known.note([snapshot_of(posed(8, 1, 1, key="global_pose"), arrived=8)])

    assert known.region(10) is None
    assert known.unreadable == 2


def test_only_so_many_poses_are_remembered() -> None:
    known = places(limit=2)
    known.note([state(moment, moment) for moment in (3, 1, 2)])

    assert [known.region(moment) is None for moment in (1, 2, 3)] == [True, False, False]


def test_wrong_settings_are_refused() -> None:
    with pytest.raises(InvalidArchive, match="poses hold for 0"):
        places(max_age=-1)
    with pytest.raises(InvalidValue, match="frame"):
        places(frame="")


@pytest.mark.parametrize(
    ("footprint", "says"),
    [
        (0, "the radius of a region must be greater than 0"),
        (float("nan"), "the radius of a region must be greater than 0"),
        ((), "three or more corners, each a finite x and y"),
        (((0, 0), (1, 1)), "three or more corners, each a finite x and y"),
        (((0, 0), (1, 1), (1,)), "three or more corners, each a finite x and y"),
        (((0, 0, 0), (1, 1, 0), (1, 0, 0)), "three or more corners, each a finite x and y"),
        (((0, 0), (1, 1), (1, float("inf"))), "each a finite x and y"),
        (((0, 0), (1, 1), (1, 0), (0, 1)), "the polygon is not valid: Self-intersection"),
        (((0, 0), (1, 1), (2, 2)), "the polygon is not valid"),
        (((0, 0), (1, 1), "x"), "three or more corners, each a finite x and y"),
    ],
)
def test_footprints_that_are_none_are_refused(footprint: object, says: str) -> None:
    with pytest.raises(InvalidArchive, match="the footprint of a robot") as refused:
        places(footprint=footprint)
    assert says in str(refused.value)


def test_snapshots_have_the_region_of_the_robot() -> None:
    known = places(max_age=10)
    memory = in_process()
    archive = LongTermMemory(memory, Consolidation(patience=0.01), location=known)
    server = MemoryServer("RobotState", [CoreSegmentDefinition(name="Localization")], archive=archive)
    with behind(archive) as objects, server:
        pose = posed(95, 1000, 0, entity=STATE, key="global_pose")
        assert server.commit(Commit(updates=[pose])).success
        commit(objects, update(100), update(200))

    region = Region.around(1, 0, 0.3)
    assert [event.region for event in memory.recall()] == [region, region, None]


def test_no_pose_is_missed_where_working_memory_keeps_none_for_long() -> None:
    """Not even the poses of commits that come faster than anybody could ask for them again."""
    known = places(max_age=0)
    archive = LongTermMemory(in_process(), Consolidation(patience=0.01), location=known)
    limits = {STATE: 1}
    core = CoreSegmentDefinition(name="Localization")
    with archive, MemoryServer("RobotState", [core], archive=archive, limits=limits) as server:
        for moment in range(200):
            server.commit(Commit(updates=[posed(moment, moment, 0, entity=STATE, key="global_pose")]))
        assert server.status().snapshots == 1
    assert [known.region(moment) for moment in range(200)] == [Region.around(n / 1000, 0, 0.3) for n in range(200)]


def test_durable_commits_do_not_wait_for_the_robot() -> None:
    known = places()
    memory = in_process()
    archive = LongTermMemory(memory, Consolidation(durable=True, patience=1000), location=known)
    with behind(archive) as server:
        known.note([state(100, 1000)])
        commit(server, update(100, entity=CUP))
        assert [event.region for event in memory.recall()] == [Region.around(1, 0, 0.3)]
        assert archive.status()["without_region"] == 0
