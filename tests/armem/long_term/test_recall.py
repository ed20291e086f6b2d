"""elm cues over ArmarX memory: where and when things were, as snapshots with their IDs."""

from __future__ import annotations

import pytest

from armem_bridge.long_term import LongTermMemory, PosePath, SubjectFinder, recall_snapshots, snapshots_cue
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import to_datetime
from elm import cues
from elm.app import Memory
from elm.event import Event
from elm.geometry import Region
from elm.interval import Interval
from tests.armem.long_term.memories import QUICK, behind, posed
from tests.armem.working.scenes import CUP, commit
from tests.conftest import StoreFactory

MUG = CUP.with_entity("mug")
TABLE = Region.box(1, -1, 3, 1)


@pytest.fixture
def memory(store_factory: StoreFactory) -> Memory:
    """A cup that is carried past a table, and a mug on it; the cup at 20 was seen wrong at first."""
    memory = Memory(store_factory())
    archive = LongTermMemory(memory, QUICK, subjects=SubjectFinder([PosePath.at("pose")]))
    with behind(archive) as server:
        commit(server, *(posed(moment, 100 * moment, 0, sent=moment) for moment in range(10, 50, 10)))
        commit(server, posed(20, 9000, 0, sent=1), posed(30, 9000, 0, sent=99))
        commit(server, posed(25, 2000, 0, entity=MUG, sent=25))
    return memory


def test_where_and_when(memory: Memory) -> None:
    on_the_table = cues.subject("intersects", TABLE)
    meanwhile = cues.time("during", to_datetime(15), to_datetime(45))

    found = list(recall_snapshots(memory, on_the_table & meanwhile, entity="blue-cup"))
    assert [each.id for each in found] == [CUP.with_timestamp(20)]
    assert [each.referenced for each in recall_snapshots(memory, on_the_table, entity="blue-cup")] == [10, 20]
    assert [each.id for each in recall_snapshots(memory, on_the_table & meanwhile)] == [
        CUP.with_timestamp(20),
        MUG.with_timestamp(25),
    ]
    elsewhere = recall_snapshots(memory, ~on_the_table, entity="blue-cup", order="-begin")
    assert [each.referenced for each in elsewhere] == [40, 30]


def test_versions(memory: Memory) -> None:
    def moments(**options: object) -> list[int]:
        return [each.referenced for each in recall_snapshots(memory, **options)]  # type: ignore[arg-type]

    assert moments(entity=CUP) == [10, 20, 30, 40]
    assert moments(entity=CUP, all_versions=True) == [10, 20, 20, 30, 30, 40]
    far = cues.subject("intersects", Region.around(9, 0, 1))
    assert [each.referenced for each in recall_snapshots(memory, far)] == [30]
    assert [each.referenced for each in recall_snapshots(memory, far, all_versions=True)] == [20, 30]
    assert moments(entity=CUP, limit=3) == [10, 20, 30]
    assert moments(entity=CUP, limit=3, all_versions=True) == [10, 20, 20]


def test_what_of(memory: Memory) -> None:
    def count(entity: str | MemoryID | None) -> int:
        return sum(1 for _ in recall_snapshots(memory, entity=entity))

    assert count(None) == count(MemoryID(memory="Object")) == 5
    assert count(MemoryID(memory="Object", core_segment="Instance", provider_segment="ObjectLocalizer")) == 5
    assert count("mug") == count(MUG) == count(MemoryID(entity="mug")) == 1
    assert count("jug") == count(MemoryID(memory="Grasp")) == count(MemoryID(memory="Object", core_segment="x")) == 0
    assert count(CUP.with_timestamp(20)) == 1
    assert count(CUP.with_timestamp(21)) == 0


def test_other_events_and_cues_of_all_kinds(memory: Memory) -> None:
    memory.add_type("Party")
    party = Event(type="Party", interval=Interval(begin=to_datetime(15), end=to_datetime(45)), region=TABLE)
    memory.commit(party)

    assert sum(1 for _ in recall_snapshots(memory)) == 5
    sent = cues.feature("armem.sent", ">=", 40)
    assert [each.referenced for each in recall_snapshots(memory, sent)] == [30, 40]
    assert sum(1 for _ in recall_snapshots(memory, cues.is_a("armem/Object"))) == 5
    found = memory.recall(snapshots_cue(entity="mug", cue=cues.time("intersects", party.interval)))
    assert [event.value("armem.id") for event in found] == [str(MUG)]
