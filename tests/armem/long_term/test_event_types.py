"""The types of consolidated snapshots: where they are, what they are, and what happens when that changes."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.long_term import ROOT, LongTermMemory
from armem_bridge.long_term.event_types import EventTypes, event_types, object_event_type, segment_event_type
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import AddSegment, Commit, CoreSegmentDefinition, MemoryServer
from elm import cues
from elm.app import Memory
from elm.storage.memory import MemoryStore
from elm.store import TypesAdded
from elm.taxonomy import EventType
from tests.armem.long_term.memories import QUICK, in_process
from tests.armem.working.scenes import CUP, commit, update
from tests.conftest import StoreFactory

THING = t.Object(name="Thing", members={"value": t.Int()})
CUP_TYPE = t.Object(name="::dto::Cup", extends=THING, members={"colour": t.String(maybe=True)})
SEGMENT = CUP.with_provider_segment("ObjectLocalizer").cut(CUP.with_provider_segment("ObjectLocalizer").level)


def parents(memory: Memory) -> dict[str, set[str]]:
    """The types of an elm memory with their parents."""
    return {each.name: set(each.parents) for each in memory.types()}


def count(memory: Memory, name: str) -> int:
    """How many snapshots are of a type."""
    return memory.recall(cues.is_a(name)).count()


def test_types_say_where_and_what(store_factory: StoreFactory) -> None:
    memory = Memory(store_factory())
    archive = LongTermMemory(memory, QUICK)
    definitions = [CoreSegmentDefinition(name="Instance", aron_type=THING), CoreSegmentDefinition(name="Class")]
    with archive, MemoryServer("Object", definitions, archive=archive) as server:
        archive.serve(server)
        server.add_segments(
            [AddSegment(core_segment="Instance", provider_segment="ObjectLocalizer", aron_type=CUP_TYPE)]
        )
        guessed = SEGMENT.with_provider_segment("Guess").with_entity("cup")
        commit(server, update(1), update(2, entity=guessed), update(3, entity=CUP.with_core_segment("Class")
            .with_provider_segment("x").with_entity("cup")))  # fmt: skip

    assert parents(memory) == {
        ROOT: set(),
        "armem/Object": {ROOT},
        "armem/Object/Instance": {"armem/Object"},
        "armem/Object/Class": {"armem/Object"},
        "aron/Thing": {ROOT},
        "aron/::dto::Cup": {"aron/Thing"},
        "armem/Object/Instance:::dto::Cup": {"armem/Object/Instance", "aron/::dto::Cup"},
        "armem/Object/Instance:Thing": {"armem/Object/Instance", "aron/Thing"},
    }
    assert [count(memory, name) for name in (ROOT, "armem/Object", "armem/Object/Instance")] == [3, 3, 2]
    assert [count(memory, name) for name in ("aron/Thing", "aron/::dto::Cup", "armem/Object/Class")] == [2, 1, 1]


def test_a_segment_that_changes_its_type() -> None:
    memory = in_process()
    archive = LongTermMemory(memory, QUICK)
    with archive, MemoryServer("Object", [CoreSegmentDefinition(name="Instance")], archive=archive) as server:
        archive.serve(server)
        commit(server, update(1))
        for moment, aron_type in ((2, THING), (3, CUP_TYPE)):
            wish = AddSegment(
                core_segment="Instance",
                provider_segment="ObjectLocalizer",
                aron_type=aron_type,
                clear_when_exists=True,
            )
            (made,) = server.add_segments([wish])
            assert made.success, made.error
            assert server.commit(Commit(updates=[update(moment)])).success
    types = [event.type for event in memory.recall()]
    assert types == ["armem/Object/Instance", "armem/Object/Instance:Thing", "armem/Object/Instance:::dto::Cup"]


def test_a_type_that_comes_to_extend_another_gains_a_parent() -> None:
    memory = in_process()
    types = EventTypes(memory.store)
    types.of(SEGMENT, t.Object(name="Cup", members={"value": t.Int()}))
    name = types.of(SEGMENT, t.Object(name="Cup", extends=THING))

    assert name == "armem/Object/Instance:Cup"
    assert parents(memory)["aron/Cup"] == {ROOT, "aron/Thing"}


def test_types_that_extend_each_other_are_kept_beside_each_other() -> None:
    memory = in_process()
    types = EventTypes(memory.store)
    a, b = t.Object(name="A"), t.Object(name="B")
    types.of(SEGMENT, t.Object(name="A", extends=b))
    assert types.of(SEGMENT, t.Object(name="B", extends=a)) == "armem/Object/Instance:B"
    assert types.of(SEGMENT, t.Object(name="C", extends=t.Object(name="C"))) == "armem/Object/Instance:C"

    assert types.contradictions == 2
    assert parents(memory)["aron/A"] == {ROOT, "aron/B"}
    assert parents(memory)["aron/B"] == {ROOT}
    assert parents(memory)["armem/Object/Instance:B"] == {"armem/Object/Instance", "aron/B"}


@pytest.mark.parametrize("aron_type", [None, t.Dict(accepted=t.Any()), t.Object(name=""), t.Any()])
def test_what_has_no_name_adds_nothing(aron_type: t.TypeObject | None) -> None:
    assert event_types(SEGMENT, aron_type)[-1].name == "armem/Object/Instance"


def test_types_are_added_once() -> None:
    class Counting(MemoryStore):
        calls = 0

        def add_types(self, types: Sequence[EventType]) -> TypesAdded:
            self.calls += 1
            return super().add_types(types)

    store = Counting()
    types = EventTypes(store)
    for _ in range(3):
        types.of(SEGMENT, THING)
        types.of(SEGMENT.with_provider_segment("other"), t.Object(name="Thing", members={"value": t.Int()}))
    assert store.calls == 1


def test_odd_names() -> None:
    def name(memory: str, core: str) -> str:
        return segment_event_type(MemoryID(memory=memory, core_segment=core))

    assert name("a/b", "50%:\x1f ü") == "armem/a%2Fb/50%25%3A%1F ü"
    assert segment_event_type(MemoryID(memory="a")) == "armem/a"
    long, longer = name("n" * 700, "c"), name("n" * 701, "c")
    assert long != longer
    assert len(long.encode()) < 200
    assert object_event_type("x\x1fy") == "aron/x%1Fy"
    wide = event_types(MemoryID(memory="ü" * 300, core_segment="€" * 300), t.Object(name="ß" * 300))
    assert max(len(each.name.encode()) for each in wide) <= 500
    memory = in_process()
    memory.add_types(wide)
