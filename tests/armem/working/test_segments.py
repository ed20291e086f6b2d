"""Provider segments: added by clients, typed as an extension of their core segment, cleared on request."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Thread

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import (
    AddSegment,
    Commit,
    CoreSegmentDefinition,
    EntityUpdate,
    MemoryServer,
    QueryBuilder,
    SegmentResult,
    Snapshot,
)
from armem_bridge.working.query import AllSnapshots
from armem_bridge.working.refusals import InvalidCommit, ServerClosed
from tests.armem.working.archives import ListArchive
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import CUP, commit, contents, moments, object_memory, update

BASE = t.Object(name="Base", members={"value": t.Int()})
EXTENDING = t.Object(name="Extending", extends=BASE, members={"colour": t.String()})
OTHER = t.Object(name="Other", members={"value": t.String()})


def typed(archive: ListArchive | None = None) -> MemoryServer:
    """A memory with one typed core segment and one without type."""
    cores = [CoreSegmentDefinition(name="Instance", aron_type=BASE), CoreSegmentDefinition(name="Free")]
    return MemoryServer("Object", cores, archive=archive)


def add(server: MemoryServer, core: str, provider: str, aron_type: t.TypeObject | None = None) -> SegmentResult:
    """Add one segment."""
    (result,) = server.add_segments([AddSegment(core_segment=core, provider_segment=provider, aron_type=aron_type)])
    return result


def element(value: object) -> EntityUpdate:
    """An update with this data."""
    found = to_aron(value)
    assert isinstance(found, Dict)
    return EntityUpdate(entity=CUP, instances=(found,), referenced=1)


def test_segments_are_added_one_by_one() -> None:
    server = typed()
    results = server.add_segments(
        [
            AddSegment(core_segment="Instance", provider_segment="a/b"),
            AddSegment(core_segment="Grasp", provider_segment="P"),
            AddSegment(core_segment="Free", provider_segment="P", aron_type=OTHER),
        ]
    )

    assert [result.success for result in results] == [True, False, True]
    assert str(results[0].segment) == "Object/Instance/a%2Fb"
    assert "no core segment 'Grasp'" in results[1].error
    assert results[1].segment is None
    builder = QueryBuilder()
    builder.core_segments.all().provider_segments.all()
    assert contents(server.query(builder.build())) == {"Free": {"P": {}}, "Instance": {"a/b": {}}}
    assert server.status().provider_segments == 2


def test_adding_again_is_no_fault() -> None:
    server = typed()
    for _ in range(2):
        assert add(server, "Instance", "ObjectLocalizer", EXTENDING).success
    assert add(server, "Instance", "ObjectLocalizer").success, "without a type the segment keeps the one it has"
    commit(server, element({"value": 1, "colour": "blue"}))
    assert add(server, "Instance", "ObjectLocalizer", EXTENDING).success

    assert not server.commit(Commit(updates=[element({"value": 1, "colour": 2})])).success


def test_the_type_extends_that_of_the_core_segment() -> None:
    server = typed()

    assert "does not extend the core segment's: value is String, not Int" in add(server, "Instance", "P", OTHER).error
    assert add(server, "Instance", "P", EXTENDING).success
    assert add(server, "Free", "P", OTHER).success
    assert "has no name" in add(server, "Instance", "").error
    assert "NUL" in add(server, "Instance", "a\0b").error
    assert server.status().provider_segments == 2


def test_commits_make_segments_that_have_the_core_segments_type() -> None:
    server = typed()
    commit(server, element({"value": 1}))

    assert not server.commit(Commit(updates=[element({"value": "one"})])).success
    found = server.query(about_the_cup()).core_segments["Instance"]
    assert (found.aron_type, found.provider_segments["ObjectLocalizer"].aron_type) == (BASE, None)


def test_a_segment_with_entities_keeps_its_type() -> None:
    server = typed()
    commit(server, element({"value": 1}))

    assert "has entities and another type" in add(server, "Instance", "ObjectLocalizer", EXTENDING).error
    wish = AddSegment(
        core_segment="Instance", provider_segment="ObjectLocalizer", aron_type=EXTENDING, clear_when_exists=True
    )
    assert server.add_segments([wish])[0].success
    assert not server.commit(Commit(updates=[element({"value": 1, "colour": 2})])).success
    commit(server, element({"value": 1, "colour": "blue"}))


def test_clearing_takes_snapshots_out_of_working_memory_only() -> None:
    archive = ListArchive()
    server = object_memory(archive=archive)
    simox = MemoryID(memory="Object", core_segment="Instance", provider_segment="Simox", entity="mug")
    commit(server, update(1), update(2), update(3, entity=CUP.with_entity("mug")), update(4, entity=simox))
    wish = AddSegment(core_segment="Instance", provider_segment="ObjectLocalizer", clear_when_exists=True)
    assert server.add_segments([wish, wish])[1].success

    assert contents(server.query(about_the_cup(AllSnapshots()))) == {"Instance": {"ObjectLocalizer": {}}}
    assert [each.snapshot.referenced for each in archive.evicted] == [1, 2, 3]
    assert (server.status().snapshots, server.status().entities, server.status().evicted) == (1, 1, 3)
    assert len(archive.kept) == 4
    commit(server, update(9))
    assert moments(server.query(about_the_cup(AllSnapshots()))) == [9]


class Meanwhile(ListArchive):
    """While it consolidates, another client wants a segment of a type; the commit does not wait for that."""

    server: MemoryServer

    def __init__(self) -> None:
        super().__init__()
        self.results: list[SegmentResult] = []
        self._client = Thread(target=self._add)

    def consolidate(self, snapshots: Sequence[Snapshot]) -> None:
        super().consolidate(snapshots)
        self._client.start()
        self._client.join(0.3)

    def wait(self) -> None:
        """Wait until the other client has its answer."""
        self._client.join(30)
        assert not self._client.is_alive()

    def _add(self) -> None:
        self.results.append(add(self.server, "Free", "P", BASE))


def test_a_type_that_comes_during_a_commit_waits_for_its_end() -> None:
    archive = Meanwhile()
    server = archive.server = typed(archive)
    entity = MemoryID(memory="Object", core_segment="Free", provider_segment="P", entity="e")
    updates = [update(1, 5, entity=entity), update(2, "five", entity=entity), update(-1, entity=entity)]
    result = server.commit(Commit(updates=updates))
    archive.wait()

    acknowledged = [each.snapshot for each in result.results if each.success]
    assert acknowledged == [each.id for each in archive.kept] == [entity.with_timestamp(1), entity.with_timestamp(2)]
    assert "has entities and another type" in archive.results[0].error
    assert server.status().snapshots == 2


def test_a_closed_server_adds_nothing() -> None:
    server = typed()
    server.close()

    with pytest.raises(ServerClosed):
        add(server, "Instance", "P")


WISH = AddSegment(core_segment="Class", provider_segment="P")


def test_a_wish_is_in_a_list() -> None:
    for wrong in (WISH, [WISH, "Instance"], "Instance", 3):
        with pytest.raises(InvalidCommit, match="a list of AddSegment"):
            object_memory().add_segments(wrong)  # type: ignore[arg-type]


def test_a_segment_that_nothing_could_be_committed_to_is_not_added() -> None:
    (result,) = object_memory().add_segments(
        [AddSegment(core_segment="Class", provider_segment="P", aron_type=t.Int())]
    )

    assert not result.success
    assert "has the type Int, and instances are Dicts" in result.error
