"""Names in long-term memory are remembered, and right all the same: after writing, forgetting and others' writing."""

from __future__ import annotations

from collections.abc import Iterator

from armem_bridge.long_term import Consolidation, LongTermMemory, arrival_of
from armem_bridge.long_term.catalogue import Catalogue
from armem_bridge.long_term.contents import entities, memory_names
from armem_bridge.long_term.mapping import below, snapshot_uid
from armem_bridge.long_term.source import LongTermSource
from armem_bridge.memory_id import Level, MemoryID
from armem_bridge.moments import to_datetime
from armem_bridge.working import Snapshot
from elm.app import Memory
from elm.cues.algebra import Cue
from elm.event import Event
from elm.interval import Interval
from elm.query import ByFeature, Group, Grouping
from elm.storage.memory import MemoryStore
from elm.tombstone import RunTombstone
from tests.armem.long_term.memories import QUICK, behind
from tests.armem.working.scenes import CUP, commit, snapshot, update
from tests.conftest import StoreFactory

MUG = CUP.with_entity("mug")
SEGMENT = CUP.cut(CUP.level).with_entity("")


class Counting(MemoryStore):
    """A store that counts how often all events are grouped."""

    groupings = 0
    run_tombstones_read = 0

    def groups(self, cue: Cue, by: Grouping | ByFeature) -> list[Group]:
        self.groupings += 1
        return super().groups(cue, by)

    def run_tombstones(self) -> Iterator[RunTombstone]:
        self.run_tombstones_read += 1
        return super().run_tombstones()


def keep(memory: Memory, *given: Snapshot) -> None:
    """Write snapshots as another process would."""
    memory.add_type("Seen")
    assert memory.store.load([arrival_of(each, event_type="Seen") for each in given]).refused == ()


def test_names_are_looked_up_once_and_again_after_a_forgetting() -> None:
    store = Counting()
    memory = Memory(store)
    keep(memory, snapshot(1))
    catalogue = Catalogue(memory)
    assert catalogue.entities() == [CUP]
    catalogue.add([MUG])
    keep(memory, snapshot(2, entity=MUG))
    assert sorted(catalogue.entities()) == [CUP, MUG]
    assert store.groupings == 1

    memory.forget(below(CUP))
    assert catalogue.entities() == [MUG]
    assert store.groupings == 2
    memory.forget(below(MUG))
    assert catalogue.entities() == []
    assert store.run_tombstones_read == 0, "they have the hulls of all that was forgotten"


def test_what_is_refused_has_no_name() -> None:
    memory = Memory(MemoryStore())
    forgotten = snapshot(2, entity=MUG, sent=1)
    keep(memory, forgotten)
    memory.commit(Event(type="Seen", parts=(snapshot_uid(forgotten),)))
    archive = LongTermMemory(memory, QUICK)
    with behind(archive) as server:
        source = archive.source("Object")
        assert source is not None
        assert source.names(SEGMENT) == ["mug"]
        memory.forget(below(MUG))
        assert source.names(SEGMENT) == []
        # Its tombstone is still there, for it was a part: it was forgotten, and stays so.
        commit(server, update(2, entity=MUG, sent=1), update(3))
        assert archive.flush(timeout=30)

        assert [str(each.snapshot.id) for each in archive.set_aside] == [f"{MUG}/2"]
        assert source.names(SEGMENT) == ["blue-cup"]


def test_what_others_write_is_found_after_a_while() -> None:
    moment = 0.0
    memory = Memory(MemoryStore())
    catalogue = Catalogue(memory, max_age=10, clock=lambda: moment)
    assert catalogue.entities() == []
    keep(memory, snapshot(1))
    assert catalogue.entities() == []
    moment = 10.0
    assert catalogue.entities() == [CUP]


def test_what_is_written_during_a_look_is_not_lost() -> None:
    class Slow(MemoryStore):
        def groups(self, cue: Cue, by: Grouping | ByFeature) -> list[Group]:
            found = super().groups(cue, by)
            catalogue.add([MUG])
            return found

    memory = Memory(Slow())
    keep(memory, snapshot(1))
    catalogue = Catalogue(memory)
    assert sorted(catalogue.entities()) == [CUP, MUG]


def test_what_events_of_others_say_of_ids_is_no_name() -> None:
    memory = Memory(MemoryStore())
    memory.add_type("Note")
    said: list[str | int] = ["%zz", "Object/Instance", "", 7, "a/b/c/d/e"]
    for number, text in enumerate(said):
        named: list[tuple[str, str | int]] = [("armem.id", text), ("armem.memory", ""), ("armem.core_segment", "")]
        memory.commit(Event(type="Note", interval=Interval.at(to_datetime(number)), features=named))
    keep(memory, snapshot(10))

    assert Catalogue(memory).entities() == [CUP]
    assert memory_names(memory) == ["Object"]
    assert LongTermSource(memory).names(CUP.cut(Level.MEMORY)) == ["Instance"]
    assert list(entities(memory, MemoryID())) == [CUP]


def test_names_in_every_store(store_factory: StoreFactory) -> None:
    memory = Memory(store_factory())
    for settings in (QUICK, Consolidation(durable=True)):
        archive = LongTermMemory(memory, settings)
        source = archive.source("Object")
        assert source is not None
        with behind(archive) as server:
            source.names(SEGMENT)
            commit(server, update(1), update(2, entity=MUG), update(3, entity=CUP.with_provider_segment("x/y")
                .with_entity("a%b")))  # fmt: skip
            archive.flush(timeout=30)
            assert source.names(SEGMENT) == ["blue-cup", "mug"]
            assert source.names(MemoryID(memory="Object", core_segment="Instance")) == ["ObjectLocalizer", "x/y"]
            assert source.names(MemoryID(memory="Object")) == ["Instance"]
            assert source.names(MemoryID(memory="Grasp")) == []
            memory.forget(below(MUG))
            assert source.names(SEGMENT) == ["blue-cup"]
            assert source.knows(CUP)
            assert not source.knows(MUG)
