"""What is committed becomes durable: at once or soon, once each, whatever the database does meanwhile."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from threading import Thread

import pytest

from armem_bridge.aron import type_objects as t
from armem_bridge.long_term import Consolidation, LongTermMemory, When
from armem_bridge.long_term.refusals import ArchiveClosed, BacklogFull, InvalidArchive, NotConsolidated
from armem_bridge.long_term.source import LAST, LongTermSource
from armem_bridge.long_term.writing import SetAside
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import GREATEST
from armem_bridge.working import AddSegment, Commit, CommitResult, Evicted
from armem_bridge.working.access_statistics import UNUSED, Usage
from armem_bridge.working.history import Source
from armem_bridge.working.query import AllSnapshots
from elm import cues
from elm.app import Memory
from elm.errors import DatabaseUnfit, DatabaseUnreachable, InvalidValue, StoreFailure
from elm.geometry import Region
from elm.storage.memory import MemoryStore
from elm.store import Arrival, BatchReport
from tests.armem.long_term.memories import QUICK, FailingStore, behind, in_process
from tests.armem.long_term.test_source import HeldStore
from tests.armem.working.oracle import about_the_cup
from tests.armem.working.scenes import CUP, MEMORY, commit, moments, object_memory, snapshot, update
from tests.conftest import StoreFactory

MUG = CUP.with_entity("mug")
DURABLE = Consolidation(durable=True, wait=0.1, least_pause=0.001)
EVICTED = Consolidation(when=When.ON_EVICTION, wait=0.1, least_pause=0.001, at_stop=False)


def kept(memory: Memory, entity: MemoryID = CUP) -> list[int]:
    """The reference times of the cup in elm."""
    return [each.referenced for each in LongTermSource(memory).history(entity).all()]


def test_commits_are_durable_when_flushed(store_factory: StoreFactory) -> None:
    memory = Memory(store_factory())
    archive = LongTermMemory(memory, QUICK, agent="armar7")
    with behind(archive) as server:
        commit(server, update(20), update(10))
        commit(server, update(20))
        assert archive.flush(timeout=30)
        assert kept(memory) == [10, 20]
        status = server.status().archive
    assert (status["backlog"], status["consolidated"], status["repeated"], status["set_aside"]) == (0, 2, 1, 0)
    assert memory.recall(cues.agent("armar7")).count() == 2


def test_closing_makes_durable_what_waits() -> None:
    store = HeldStore()
    archive = LongTermMemory(Memory(store), QUICK)
    with behind(archive) as server:
        for moment in range(50):
            commit(server, update(moment))
        assert archive.status()["backlog"] == 50
        assert not archive.flush(timeout=0.01)
        store.go.set()
    assert kept(archive.memory) == list(range(50))
    archive.close()
    with pytest.raises(ArchiveClosed, match="was closed: make a new one"):
        archive.consolidate([snapshot(1)])


def test_durable_commits_are_in_elm_when_they_are_acknowledged(store_factory: StoreFactory) -> None:
    memory = Memory(store_factory())
    with behind(LongTermMemory(memory, Consolidation(durable=True))) as server:
        for moment in (10, 20, 20):
            commit(server, update(moment), update(moment, entity=MUG))
            assert kept(memory)[-1] == kept(memory, MUG)[-1] == moment
    assert memory.recall().count() == 4


def test_durable_commits_are_kept_whole_or_refused() -> None:
    store = FailingStore()
    memory = Memory(store)
    with behind(LongTermMemory(memory, DURABLE)) as server:
        store.poison = {"mug": InvalidValue("never")}
        result = server.commit(Commit(updates=[update(10), update(10, entity=MUG)]))
        assert not any(each.success for each in result.results)
        assert "InvalidValue: never" in result.errors[0]
        store.poison = {}
        store.errors = [DatabaseUnreachable("the plug was pulled")] * 1000
        result = server.commit(Commit(updates=[update(10)]))
        assert "could not be made durable within 0.1 s: the plug was pulled" in result.errors[0]
        store.errors = [DatabaseUnreachable("for a moment")] * 3
        commit(server, update(10))
    assert kept(memory) == [10]


def test_what_was_written_before_the_connection_broke_is_there_once() -> None:
    for settings in (DURABLE, QUICK):
        store = FailingStore()
        store.after = True
        store.errors = [DatabaseUnreachable("gone before it answered")] * 2
        archive = LongTermMemory(Memory(store), settings)
        with behind(archive) as server:
            commit(server, update(10), update(20))
        assert kept(archive.memory) == [10, 20]
        assert archive.memory.recall().count() == 2
        assert archive.status()["failures"] == 2


def test_the_database_may_be_away_for_a_while(caplog: pytest.LogCaptureFixture) -> None:
    store = FailingStore()
    store.errors = [DatabaseUnreachable("no route"), DatabaseUnfit("no room"), StoreFailure("cancelled")]
    archive = LongTermMemory(Memory(store), QUICK)
    with caplog.at_level(logging.WARNING), behind(archive) as server:
        commit(server, update(10))
        assert archive.flush(timeout=30)
        commit(server, update(20))
    assert kept(archive.memory) == [10, 20]
    status = archive.status()
    assert (status["failures"], status["failing_seconds"], status["set_aside"]) == (3, 0.0, 0)
    assert status["without_region"] == status["consolidated"] == 2
    assert status["last_error"] == "DatabaseUnreachable: no route"
    said = [each.getMessage() for each in caplog.records]
    assert said == [
        "consolidation into 'elm' fails, and is tried again: cancelled",
        "consolidation into 'elm' works again",
    ]


def test_a_full_backlog_holds_commits_back_and_then_refuses_them() -> None:
    store = FailingStore()
    store.errors = [DatabaseUnreachable("no route")] * 100_000
    archive = LongTermMemory(Memory(store), Consolidation(backlog=3, wait=0.05, least_pause=0.001, most_pause=0.01))
    with behind(archive) as server:
        for moment in (1, 2, 3):
            commit(server, update(moment))
        result = server.commit(Commit(updates=[update(4)]))
        assert not result.success
        assert "3 snapshots with" in result.errors[0]
        assert "DatabaseUnreachable: no route" in result.errors[0]
        assert server.get(CUP.with_timestamp(4)) is None
        status = archive.status()
        assert (status["backlog"], status["backlog_limit"]) == (3, 3)
        assert status["failing_seconds"] != 0.0
        with pytest.raises(NotConsolidated, match="3 snapshots are not durable"):
            archive.close(timeout=0.05)
        store.errors.clear()
        archive.close(timeout=30)
    assert kept(archive.memory) == [1, 2, 3]


def test_who_waits_for_room_gets_it() -> None:
    store = HeldStore()
    archive = LongTermMemory(Memory(store), Consolidation(backlog=1, wait=30))
    with behind(archive) as server:
        commit(server, update(1))
        second = Thread(target=commit, args=(server, update(2)))
        second.start()
        time.sleep(0.05)
        assert second.is_alive()
        store.go.set()
        second.join(timeout=30)
        assert not second.is_alive()
    assert kept(archive.memory) == [1, 2]


def test_the_bytes_that_wait_are_bounded_and_a_single_commit_always_fits() -> None:
    store = HeldStore()
    archive = LongTermMemory(Memory(store), Consolidation(backlog=2, backlog_bytes=10, wait=0.01))
    with behind(archive) as server:
        commit(server, *(update(moment, "x" * 100) for moment in (1, 2, 3)))
        with pytest.raises(BacklogFull, match="raise the limits"):
            archive.consolidate([snapshot(4)])
        store.go.set()
    assert kept(archive.memory) == [1, 2, 3]


def test_what_elm_cannot_keep_is_set_aside_and_the_rest_is_kept(caplog: pytest.LogCaptureFixture) -> None:
    told: list[SetAside] = []
    store = FailingStore()
    store.poison = {"mug": InvalidValue("never")}
    archive = LongTermMemory(Memory(store), QUICK, on_set_aside=told.append)
    with behind(archive) as server:
        commit(server, update(10), update(15, entity=MUG), update(20))
        assert archive.flush(timeout=30)
        assert server.get(MUG.with_timestamp(15)) is not None
    assert kept(archive.memory) == [10, 20]
    (aside,) = archive.set_aside
    assert told == [aside]
    assert aside.snapshot.id == MUG.with_timestamp(15)
    assert aside.reason == "InvalidValue: never"
    status = archive.status()
    assert status["set_aside"] == 1
    assert status["last_set_aside"] == [str(aside)]
    assert "cannot be consolidated" in caplog.text


def test_what_the_database_stumbles_over_does_not_hold_up_the_others() -> None:
    store = FailingStore()
    store.poison = {"mug": StoreFailure("no"), "jug": ZeroDivisionError("a bug")}
    archive = LongTermMemory(Memory(store), QUICK)
    with behind(archive) as server:
        several = [update(moment, entity=CUP.with_entity(name)) for moment in range(5) for name in ("a", "mug", "b")]
        commit(server, *several, update(7, entity=CUP.with_entity("jug")))
        assert archive.flush(timeout=30)
    assert kept(archive.memory, CUP.with_entity("a")) == kept(archive.memory, CUP.with_entity("b")) == [0, 1, 2, 3, 4]
    reasons = sorted(each.reason for each in archive.set_aside)
    assert reasons == ["StoreFailure: no"] * 5 + ["ZeroDivisionError: a bug"]


def test_what_is_told_of_snapshots_set_aside_may_fail() -> None:
    def tell(_: object) -> None:
        raise ValueError("not now")

    store = FailingStore()
    store.poison = {"mug": InvalidValue("never")}
    archive = LongTermMemory(Memory(store), QUICK, on_set_aside=tell)
    with behind(archive) as server:
        commit(server, update(5, entity=MUG), update(10))
    assert kept(archive.memory) == [10]
    assert archive.status()["set_aside"] == 1


@pytest.mark.parametrize("settings", [QUICK, DURABLE, EVICTED])
def test_times_that_elm_does_not_have_are_refused_by_themselves(settings: Consolidation) -> None:
    archive = LongTermMemory(in_process(), settings)
    with behind(archive) as server:
        result = server.commit(Commit(updates=[update(GREATEST), update(-1), update(LAST), update(LAST + 1)]))
        assert [each.success for each in result.results] == [False, False, True, False]
        assert "beyond the year 9999" in result.errors[0]
        assert "no valid referenced time" in result.errors[1]
        assert moments(server.query(about_the_cup(AllSnapshots()))) == [LAST]
    assert archive.set_aside == ()


def test_what_is_acknowledged_while_long_term_memory_closes_is_kept() -> None:
    class Closing:
        """Where the robot was, asked of somebody who closes everything on the way."""

        def region(self, moment: int) -> Region | None:
            return None

        def note(self, snapshots: object) -> None:
            archive.close()

    archive = LongTermMemory(in_process(), QUICK, location=Closing())
    server = object_memory(archive=archive)
    result = server.commit(Commit(updates=[update(10)]))
    assert not result.success
    assert "ArchiveClosed: long-term memory was closed meanwhile" in result.errors[0]
    assert server.status().snapshots == archive.memory.recall().count() == 0
    server.close()


def test_commits_that_go_on_when_the_server_closes_are_kept() -> None:
    store = HeldStore()
    archive = LongTermMemory(Memory(store), Consolidation(backlog=1, wait=30.0, patience=0.0))
    server = object_memory(archive=archive)
    commit(server, update(10))
    results: list[CommitResult] = []
    # The backlog is full, so this one waits for room, and closing waits for it.
    committing = Thread(target=lambda: results.append(server.commit(Commit(updates=[update(20)]))))
    committing.start()
    closing = Thread(target=server.close)
    while not server._door._inside:
        time.sleep(0.001)
    closing.start()
    closing.join(timeout=0.1)
    assert closing.is_alive()
    store.go.set()
    closing.join(timeout=30)
    committing.join(timeout=30)
    archive.close()
    assert [each.success for each in results] == [True]
    assert kept(archive.memory) == [10, 20]


def test_a_snapshot_that_is_there_with_another_type_is_the_same() -> None:
    for settings in (QUICK, DURABLE):
        memory = in_process()
        for aron_type in (None, t.Object(name="Cup", members={"value": t.Int()})):
            archive = LongTermMemory(memory, settings)
            with behind(archive) as server:
                server.add_segments(
                    [AddSegment(core_segment="Instance", provider_segment="ObjectLocalizer", aron_type=aron_type)]
                )
                commit(server, update(10), update(11, entity=MUG))
                if aron_type is not None:
                    commit(server, update(12))
        assert kept(memory) == [10, 12]
        assert memory.recall().count() == 3
        assert archive.set_aside == ()


def test_several_threads_commit() -> None:
    archive = LongTermMemory(in_process(), QUICK)
    with behind(archive) as server:

        def work(number: int) -> None:
            for moment in range(100):
                commit(server, update(moment, entity=CUP.with_entity(f"e{number}")))

        threads = [Thread(target=work, args=(number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert archive.memory.recall().count() == 400
    assert LongTermSource(archive.memory).names(CUP.with_entity("")) == ["e0", "e1", "e2", "e3"]


# What is evicted


class Odd:
    """Keeps snapshots with an odd reference time, and remembers what it was asked and could know."""

    def __init__(self) -> None:
        self.asked: list[tuple[int, Usage, int]] = []
        self.known: list[list[int]] = []

    def lets_through(self, evicted: Evicted, now: int, known: Source) -> bool:
        snapshot = evicted.snapshot
        self.asked.append((snapshot.referenced, evicted.usage, now))
        self.known.append([each.referenced for each in known.history(snapshot.id.entity_id).latest(3)])
        return snapshot.referenced % 2 == 1


def test_what_leaves_working_memory_passes_a_gate() -> None:
    memory, gate = in_process(), Odd()
    archive = LongTermMemory(memory, EVICTED, gate=gate, clock=lambda: 77)
    with behind(archive, limits={MEMORY: 2}) as server:
        commit(server, update(1))
        server.query(about_the_cup(AllSnapshots()))
        commit(server, *(update(moment) for moment in (2, 3, 4, 5)))
        assert archive.flush(timeout=30)
        assert kept(memory) == [1, 3]
        assert archive.status()["forgotten"] == 1
    assert gate.asked == [(1, Usage(count=1, last=1_000_000_000), 77), (2, UNUSED, 77), (3, UNUSED, 77)]
    assert gate.known == [[], [1], [1]]


def test_without_a_gate_all_that_leaves_is_kept_and_nothing_else() -> None:
    archive = LongTermMemory(in_process(), EVICTED)
    with behind(archive, limits={MEMORY: 2}) as server:
        commit(server, *(update(moment) for moment in (1, 2, 3, 4, 5)))
        assert moments(server.query(about_the_cup(AllSnapshots()))) == [4, 5]
    assert kept(archive.memory) == [1, 2, 3]


def test_a_gate_is_not_asked_about_versions_that_do_not_count() -> None:
    memory, gate = in_process(), Odd()
    archive = LongTermMemory(memory, EVICTED, gate=gate)
    with behind(archive, limits={MEMORY: 1}) as server:
        commit(server, update(1, "a", sent=2), update(1, "b", sent=3), update(1, "c", sent=1), update(3))
        assert archive.flush(timeout=30)
        assert archive.status()["forgotten"] == 2
    assert [moment for moment, *_ in gate.asked] == [1]
    assert [each.sent for each in LongTermSource(memory).history(CUP).all()] == [3]
    assert memory.recall().count() == 1


@pytest.mark.parametrize("gated", [False, True])
def test_what_is_still_in_working_memory_leaves_when_all_is_closed(gated: bool) -> None:
    memory = in_process()
    archive = LongTermMemory(memory, replace(EVICTED, at_stop=True), gate=Odd() if gated else None)
    with behind(archive, limits={MEMORY: 2}) as server:
        commit(server, *(update(moment) for moment in (1, 2, 3, 4, 5)), update(7, entity=MUG))
    assert kept(memory) == ([1, 3, 5] if gated else [1, 2, 3, 4, 5])
    assert kept(memory, MUG) == [7]
    archive.close()
    assert memory.recall().count() == (4 if gated else 6)


def test_prior_knowledge_does_not_leave_when_all_is_closed(tmp_path: Path) -> None:
    known = tmp_path / "known.json"
    known.write_text('{"core_segment": "Class", "provider_segment": "P", "entities": {"e": [{"instances": [{}]}]}}')
    memory = in_process()
    with behind(LongTermMemory(memory, replace(EVICTED, at_stop=True)), prior_knowledge=[known]) as server:
        commit(server, update(1))
        assert server.status().snapshots == 2
    assert memory.recall().count() == 1


def test_closing_waits_as_long_as_something_becomes_durable() -> None:
    class Slow(MemoryStore):
        def load(self, arrivals: Sequence[Arrival]) -> BatchReport:
            time.sleep(0.15)
            return super().load(arrivals)

    archive = LongTermMemory(Memory(Slow()), replace(EVICTED, at_stop=True, batch=1))
    with object_memory(archive=archive) as server:
        archive.serve(server)
        commit(server, *(update(moment) for moment in range(6)))
    archive.close(timeout=0.5)
    assert kept(archive.memory) == list(range(6))


def test_a_gate_knows_what_long_term_memory_has() -> None:
    memory = in_process()
    with behind(LongTermMemory(memory, QUICK)) as server:
        commit(server, *(update(moment) for moment in range(20)), update(3, entity=MUG))
    gate = Odd()
    archive = LongTermMemory(memory, EVICTED, gate=gate, clock=lambda: 77)
    with behind(archive, limits={MEMORY: 1}) as server:
        commit(server, update(30), update(31), update(32))
    assert gate.known == [[17, 18, 19], [17, 18, 19]]
    assert [(moment, now) for moment, _, now in gate.asked] == [(30, 77), (31, 77)]


def test_the_gate_is_asked_once_however_often_the_database_fails() -> None:
    store, gate = FailingStore(), Odd()
    store.errors = [DatabaseUnreachable("no route")] * 3
    archive = LongTermMemory(Memory(store), EVICTED, gate=gate)
    with behind(archive, limits={MEMORY: 1}) as server:
        commit(server, update(1), update(2), update(3))
    assert [moment for moment, *_ in gate.asked] == [1, 2]
    assert kept(archive.memory) == [1]


def test_nothing_is_forgotten_because_a_gate_fails(caplog: pytest.LogCaptureFixture) -> None:
    class Broken(Odd):
        def lets_through(self, evicted: Evicted, now: int, known: Source) -> bool:
            raise ZeroDivisionError("a bug")

    archive = LongTermMemory(in_process(), EVICTED, gate=Broken())
    with behind(archive, limits={MEMORY: 1}) as server:
        commit(server, update(1), update(2))
    assert kept(archive.memory) == [1]
    assert archive.status()["last_error"] == "ZeroDivisionError: a bug"
    assert "which is consolidated" in caplog.text


def test_nothing_is_lost_because_a_place_cannot_be_found() -> None:
    class Lost:
        def region(self, moment: int) -> Region | None:
            raise ZeroDivisionError("a bug")

    archive = LongTermMemory(in_process(), QUICK, location=Lost())
    with behind(archive) as server:
        commit(server, update(1))
    assert kept(archive.memory) == [1]
    assert archive.status()["place_failures"] == archive.status()["without_region"] == 1


def test_a_name_that_is_no_agent_is_refused_at_once() -> None:
    with pytest.raises(InvalidValue, match="the agent of a long-term memory, which is the robot, is empty"):
        LongTermMemory(in_process(), agent="")


def test_commits_wait_for_room_for_what_is_evicted() -> None:
    store = HeldStore()
    archive = LongTermMemory(Memory(store), replace(EVICTED, backlog=2, wait=0.01))
    with behind(archive, limits={MEMORY: 1}) as server:
        commit(server, update(1), update(2), update(3))
        result: CommitResult = server.commit(Commit(updates=[update(4)]))
        assert "takes no more for now" in result.errors[0]
        store.go.set()
        assert archive.flush(timeout=30)
        commit(server, update(4))
    assert kept(archive.memory) == [1, 2, 3]


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"when": "sometimes"}, "consolidated on_commit or on_eviction, not 'sometimes'"),
        ({"when": "on_eviction", "durable": True}, "only durable with when='on_commit'"),
        ({"at_stop": False}, "goes with when='on_eviction'"),
        ({"when": "on_eviction", "at_stop": "drop"}, "at_stop of consolidation is true or false, not 'drop'"),
        ({"backlog": 0}, "backlog of consolidation is 1 or more, not 0"),
        ({"batch": True}, "batch of consolidation is 1 or more, not True"),
        ({"wait": -1}, "wait of consolidation is 0 s or more, not -1"),
        ({"patience": float("nan")}, "patience of consolidation is 0 s or more, not nan"),
    ],
)
def test_wrong_settings_are_refused(settings: dict[str, object], says: str) -> None:
    with pytest.raises(InvalidArchive, match=says):
        Consolidation(**settings)  # type: ignore[arg-type]
