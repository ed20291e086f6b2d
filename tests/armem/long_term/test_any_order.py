"""A recorded session gives one memory, working and long-term, in whatever order its commits arrive."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from random import Random

from hypothesis import given, settings
from hypothesis import strategies as st

from armem_bridge.long_term import Consolidation, LongTermMemory, PosePath, RobotPlaces, SubjectFinder
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit, CoreSegmentDefinition, EntityUpdate, MemoryServer, QueryBuilder, QueryTarget
from elm.app import Memory
from elm.event import StoredEvent
from tests.armem.long_term.memories import behind, in_process, posed
from tests.armem.long_term.test_source import as_update
from tests.armem.working.oracle import memories
from tests.armem.working.scenes import CUP, timeless
from tests.conftest import StoreFactory

STATE = MemoryID(memory="RobotState", core_segment="Localization", provider_segment="Slam", entity="armar7")


def everything(memory: Memory) -> list[object]:
    """All that an elm memory has, but for the times at which it learned of it, and the numbers it gave."""
    events = sorted(memory.recall(), key=lambda event: event.uid)
    return [*map(_shown, events), sorted((each.name, sorted(each.parents)) for each in memory.types())]


def _shown(event: StoredEvent) -> object:
    named = ("uid", "type", "interval", "region", "subject", "features", "agent", "payload")
    return [getattr(event, name) for name in named]


def play(memory: Memory, commits: Sequence[Sequence[EntityUpdate]]) -> object:
    """What there is after these commits: in working memory, of both in one, and in elm."""
    clock = count(1_000)
    with behind(LongTermMemory(memory), clock=lambda: next(clock)) as server:
        for updates in commits:
            assert server.commit(Commit(updates=updates)).success
        found = []
        for target in (QueryTarget.WM, QueryTarget.BOTH):
            builder = QueryBuilder()
            builder.select(server.id)
            found.append(timeless(server.query(builder.build(target=target)).snapshots()))
    return found, everything(memory)


@given(memories, st.integers(1, 3), st.randoms())
def test_in_any_order(versions: list[object], size: int, random: Random) -> None:
    assert_one_memory([as_update(each) for each in versions], size, random, in_process)  # type: ignore[arg-type]


@settings(max_examples=3)
@given(memories.filter(bool), st.integers(1, 3), st.randoms())
def test_in_any_order_in_every_store(
    store_factory: StoreFactory, versions: list[object], size: int, random: Random
) -> None:
    updates = [as_update(each) for each in versions]  # type: ignore[arg-type]
    assert_one_memory(updates, size, random, lambda: Memory(store_factory()))


def assert_one_memory(updates: list[EntityUpdate], size: int, random: Random, open_memory: object) -> None:
    """The same updates in another order, and some of them twice, give the same memory."""
    shuffled = [*updates, *updates[:2]]
    random.shuffle(shuffled)
    outcomes = [
        play(open_memory(), [given[at : at + size] for at in range(0, len(given), size)])  # type: ignore[operator]
        for given in (updates, shuffled)
    ]
    assert outcomes[0] == outcomes[1]


@settings(max_examples=20)
@given(st.permutations(range(12)))
def test_the_place_of_the_robot_may_come_later(order: list[int]) -> None:
    """Snapshots wait for the poses of the robot, as long as patience lasts."""
    places = RobotPlaces(PosePath.at("pose", segment=STATE), footprint=0.25, max_age=50)
    subjects = SubjectFinder([PosePath.at("pose", segment=CUP)])
    memory = in_process()
    archive = LongTermMemory(memory, Consolidation(patience=60), location=places, subjects=subjects)
    updates = [posed(10 * at, 100 * at, 0, entity=STATE) for at in range(6)]
    updates += [posed(10 * at + 5, 1000, 100 * at) for at in range(6)]
    state = MemoryServer("RobotState", [CoreSegmentDefinition(name="Localization")], archive=archive)
    with behind(archive) as server, state:
        for at in order:
            to = state if updates[at].entity.memory == "RobotState" else server
            assert to.commit(Commit(updates=[updates[at]])).success

    found = {event.interval.micros[0]: event for event in memory.recall()}
    assert len(found) == 12
    for moment, event in found.items():
        assert event.region is not None
        centre = event.region.polygon.centroid
        assert (round(centre.x, 6), round(centre.y, 6)) == (round(moment // 10 * 0.1, 6), 0)
    assert {round(event.subject.polygon.centroid.y, 6) for event in found.values() if event.subject} == {
        0, 0.1, 0.2, 0.3, 0.4, 0.5
    }  # fmt: skip
