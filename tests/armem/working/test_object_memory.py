"""The object memory of the thesis (figure 4.7), filled by two providers, queried through the builder (listing 4.9)."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.conversion import to_aron, to_python
from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import InvalidMoment
from armem_bridge.working import (
    AddSegment,
    Commit,
    CoreSegmentDefinition,
    EntityUpdate,
    MemoryServer,
    Query,
    QueryBuilder,
    QueryTarget,
)
from armem_bridge.working.query import AllNames, LatestSnapshots, RegexNames, SingleName, SingleSnapshot
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import contents, moments

INSTANCE = t.Object(
    name="ObjectInstance", members={"name": t.String(), "pose": t.NDArray(shape=(4, 4), element="float32")}
)
WITH_COLOUR = t.Object(name="LocalizedInstance", extends=INSTANCE, members={"colour": t.String(maybe=True)})
BEGIN = 1_767_261_600_000_000


def pose(x: float) -> np.ndarray[tuple[int, int], np.dtype[np.float32]]:
    """A pose in millimetres, as ArmarX has them."""
    matrix = np.eye(4, dtype=np.float32)
    matrix[0, 3] = x
    return matrix


@pytest.fixture
def server() -> MemoryServer:
    """The object memory of figure 4.7: object instances and classes, two localizers, two cups."""
    server = MemoryServer(
        "Object",
        [CoreSegmentDefinition(name="Instance", aron_type=INSTANCE), CoreSegmentDefinition(name="Class")],
    )
    added = server.add_segments(
        [
            AddSegment(core_segment="Instance", provider_segment="ObjectLocalizer", aron_type=WITH_COLOUR),
            AddSegment(core_segment="Instance", provider_segment="Simox"),
        ]
    )
    assert [result.success for result in added] == [True, True]
    for step in range(3):
        updates = []
        for provider, name in (("ObjectLocalizer", "blue-cup"), ("ObjectLocalizer", "mug"), ("Simox", "blue-cup")):
            data = to_aron({"name": name, "pose": pose(100.0 * step)}, INSTANCE)
            assert isinstance(data, Dict)
            entity = server.id.with_core_segment("Instance").with_provider_segment(provider).with_entity(name)
            updates.append(EntityUpdate(entity=entity, instances=(data, data), referenced=BEGIN + step * 1_000_000))
        assert server.commit(Commit(updates=updates)).success
    return server


def test_listing_4_9(server: MemoryServer) -> None:
    builder = QueryBuilder()
    (
        builder.memories.name("Object")
        .core_segments.name("Instance")
        .provider_segments.name("ObjectLocalizer")
        .entities.name("blue-cup")
        .snapshots.all()
    )
    query = builder.build()
    found = server.query(query)

    assert contents(found).keys() == {"Instance"}
    assert contents(found)["Instance"].keys() == {"ObjectLocalizer"}
    assert contents(found)["Instance"]["ObjectLocalizer"].keys() == {"blue-cup"}
    cup = server.id.with_core_segment("Instance").with_provider_segment("ObjectLocalizer").with_entity("blue-cup")
    assert moments(found, cup) == [BEGIN, BEGIN + 1_000_000, BEGIN + 2_000_000]
    last = to_python(list(found.instances())[-1][1].data)
    assert last["name"] == "blue-cup"
    np.testing.assert_array_equal(last["pose"], pose(200.0))
    assert [str(each) for each, _ in found.instances()][-2:] == [f"{cup}/{BEGIN + 2_000_000}/{n}" for n in (0, 1)]
    assert found.core_segments["Instance"].aron_type == INSTANCE
    assert found.core_segments["Instance"].provider_segments["ObjectLocalizer"].aron_type == WITH_COLOUR


def test_what_the_builder_builds() -> None:
    builder = QueryBuilder()
    cup = (
        builder.memories.name("Object")
        .core_segments.name("Instance")
        .provider_segments.name("ObjectLocalizer")
        .entities.name("blue-cup")
    )
    cup.snapshots.latest()
    cup.snapshots.at(7)

    assert builder.build() == about_the_cup(LatestSnapshots(count=1), SingleSnapshot(timestamp=7))
    assert builder.build(target=QueryTarget.BOTH, with_data=False).target is QueryTarget.BOTH
    assert not builder.build(with_data=False).with_data


def test_one_branch_after_the_other(server: MemoryServer) -> None:
    builder = QueryBuilder()
    instance = builder.core_segments.name("Instance")
    instance.provider_segments.regex("Object.*").entities.all().snapshots.latest()
    instance.provider_segments.name("Simox").entities.regex("blue-.*").snapshots.index_range(0, 0)
    builder.core_segments.name("Class")
    found = server.query(builder.build())

    assert {str(each.id) for each in found.snapshots()} == {
        f"Object/Instance/ObjectLocalizer/blue-cup/{BEGIN + 2_000_000}",
        f"Object/Instance/ObjectLocalizer/mug/{BEGIN + 2_000_000}",
        f"Object/Instance/Simox/blue-cup/{BEGIN}",
    }
    assert found.core_segments.keys() == {"Instance", "Class"}


def test_times_are_datetimes_too(server: MemoryServer) -> None:
    def at(second: float) -> datetime:
        return datetime.fromtimestamp(BEGIN / 1e6 + second, UTC)

    def select(how: str, *times: object, **more: object) -> list[int]:
        builder = QueryBuilder()
        cup = builder.core_segments.name("Instance").provider_segments.name("Simox").entities.name("blue-cup")
        getattr(cup.snapshots, how)(*times, **more)
        (entity,) = server.query(builder.build()).entities()
        return [(moment - BEGIN) // 1_000_000 for moment in entity.history]

    assert select("at", at(1)) == [1]
    assert select("before", at(2)) == [1]
    assert select("before", at(2), max_entries=-1) == [0, 1]
    assert select("at_or_before", at(1.5)) == [1]
    assert select("time_range", at(0.5), at(2)) == [1, 2]
    assert select("time_range", end=at(1)) == [0, 1]
    assert select("approximate", at(0.4), eps=500_000) == [0]
    assert select("latest_n", 2) == [1, 2]
    with pytest.raises(InvalidMoment, match="zone"):
        select("at", datetime(2026, 1, 1))  # noqa: DTZ001 - that is what is refused


def test_an_id_selects_what_it_contains(server: MemoryServer) -> None:
    def find(wanted: MemoryID) -> int:
        builder = QueryBuilder()
        builder.select(wanted)
        return len(list(server.query(builder.build()).snapshots()))

    localizer = server.id.with_core_segment("Instance").with_provider_segment("ObjectLocalizer")
    assert [find(each) for each in (MemoryID(), server.id, localizer, localizer.with_entity("mug"))] == [9, 9, 6, 3]
    assert find(localizer.with_entity("mug").with_timestamp(BEGIN)) == 1
    assert find(MemoryID(memory="Object", entity="blue-cup")) == 6
    assert find(MemoryID(memory="Grasp")) == 0


def test_levels_that_nothing_is_said_about_are_found_empty(server: MemoryServer) -> None:
    builder = QueryBuilder()
    builder.core_segments.all().provider_segments.all()

    assert contents(server.query(builder.build())) == {
        "Class": {},
        "Instance": {"ObjectLocalizer": {}, "Simox": {}},
    }
    assert builder.build() != Query()
    assert QueryBuilder().build() == Query()


def test_names_are_selected_in_three_ways() -> None:
    builder = QueryBuilder()
    for select in (builder.memories.all, lambda: builder.memories.name("a"), lambda: builder.memories.regex("a|b")):
        select()

    assert [each.names for each in builder.build().memories] == [
        AllNames(),
        SingleName(name="a"),
        RegexNames(pattern="a|b"),
    ]
