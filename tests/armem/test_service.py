"""Services: memory servers, names and long-term memory put together as a configuration says, in this process."""

from __future__ import annotations

import threading
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from time import monotonic, sleep

import numpy as np
import pytest

from armem_bridge.aron.conversion import to_aron
from armem_bridge.aron.data import Dict
from armem_bridge.config import InvalidConfiguration, read_config
from armem_bridge.forgetting import Frequency, Retention
from armem_bridge.forgetting.forgetter import Forgetter
from armem_bridge.long_term import LongTermMemory, recall_snapshots
from armem_bridge.long_term.contents import entities, memory_names
from armem_bridge.long_term.refusals import NotConsolidated
from armem_bridge.long_term_forgetting import LongTermForgetting, plan_forgetting
from armem_bridge.memory_id import MemoryID
from armem_bridge.moments import to_datetime
from armem_bridge.names import UnknownMemory
from armem_bridge.profiles import PROFILES
from armem_bridge.service import Service, ServiceClosed, connect_client
from armem_bridge.working import Commit, EntityUpdate, MemoryServer, QueryBuilder, QueryTarget
from armem_bridge.working.refusals import InvalidPriorKnowledge, ServerClosed
from elm import cues
from elm.app import Memory, connect
from elm.event import Event
from elm.geometry import Region
from elm.recognition import Timing
from elm.recognizers import Pattern, step
from tests.armem.long_term.memories import in_process
from tests.armem.long_term.test_source import HeldStore
from tests.servers import Server

BEGIN = 1_767_261_600_000_000
CUP = MemoryID(memory="Object", core_segment="Instance", provider_segment="Localizer", entity="cup")
ROBOT = MemoryID(memory="RobotState", core_segment="State", provider_segment="Navigation", entity="armar7")

SERVING = """
[[memories]]
profile = "ObjectMemory"
history = 2

[[memories]]
profile = "RobotStateMemory"
history_limits = {"State" = 1}

[long_term]
dsn = "memory://"
robot = "armar7"
robot_state = {segment = "RobotState/State", pose = "globalPose", footprint = 0.25}
"""

ALONE = '[[memories]]\nname = "Object"\ncore_segments = [{name = "Instance", history = 1}]\n'

WITHOUT_A_FILE = """
[[memories]]
name = "A"
core_segments = [{name = "B"}]
prior_knowledge = ["no.json"]
"""

Starting = Callable[[str], Service]


@pytest.fixture
def starting(tmp_path: Path) -> Starting:
    """Makes services of texts; the clock stands still at the begin."""

    def make(text: str) -> Service:
        file = tmp_path / "memory.toml"
        file.write_text(text, encoding="utf-8")
        return Service(read_config(file), clock=lambda: BEGIN)

    return make


def placed(entity: MemoryID, second: int, x: float, y: float) -> EntityUpdate:
    """An update whose data have a pose at (x, y) in metres."""
    matrix = np.eye(4, dtype=np.float32)
    matrix[:2, 3] = 1000 * x, 1000 * y
    data = to_aron({"globalPose": matrix})
    assert isinstance(data, Dict)
    return EntityUpdate(entity=entity, instances=(data,), referenced=BEGIN + second * 1_000_000)


def seconds_of(server: MemoryServer, target: QueryTarget) -> list[int]:
    builder = QueryBuilder()
    builder.select(CUP)
    found = server.query(builder.build(target=target))
    return [(snapshot.referenced - BEGIN) // 1_000_000 for snapshot in found.snapshots()]


def commit(service: Service, *updates: EntityUpdate) -> None:
    for update in updates:
        result = service.names.resolve(update.entity.memory).commit(Commit(updates=[update]))
        assert result.success, result.errors


def test_working_and_long_term_memory_of_a_configuration(starting: Starting) -> None:
    with starting(SERVING) as service:
        assert list(service.servers) == ["Object", "RobotState"]
        assert list(service.names.registered()) == ["Object", "RobotState"]
        commit(service, *(placed(CUP, second, 1.0, second) for second in range(5)))

        objects = service.names.resolve("Object")
        assert seconds_of(objects, QueryTarget.WM) == [3, 4]
        assert seconds_of(objects, QueryTarget.LTM) == [0, 1, 2, 3, 4]
        assert seconds_of(objects, QueryTarget.BOTH) == [0, 1, 2, 3, 4]
        assert service.address == ""

        status = service.status()
        assert [(each.name, each.updates, each.snapshots) for each in status.memories] == [
            ("Object", 5, 2),
            ("RobotState", 0, 0),
        ]
        assert status.edge is None
    assert service.status().long_term["consolidated"] == 5
    assert service.status().long_term["backlog"] == 0


def test_events_have_the_place_of_the_robot_and_that_of_the_thing(starting: Starting) -> None:
    with starting(SERVING) as service:
        archive = service.archive
        assert archive is not None
        commit(service, placed(ROBOT, 0, 4.0, 5.0), placed(CUP, 0, 1.0, 2.0), placed(ROBOT, 1, 9.0, 9.0))
        eventually(lambda: archive.status()["consolidated"] == 3)
        seen = archive.memory.recall(cues.feature("armem.entity", "=", "cup")).first()

        assert seen is not None
        assert seen.agent == "armar7"
        assert seen.type == "armem/Object/Instance:ObjectInstance"
        assert seen.region is not None
        assert seen.region.polygon.bounds == pytest.approx((3.75, 4.75, 4.25, 5.25))
        assert seen.subject is not None
        assert seen.subject.polygon.bounds == pytest.approx((0.95, 1.95, 1.05, 2.05))
        found = list(recall_snapshots(archive.memory, cues.subject("subset", Region.box(0, 0, 3, 3)), entity="cup"))
        assert [snapshot.id for snapshot in found] == [CUP.with_timestamp(BEGIN)]


def test_online_forgetting_stands_between(starting: Starting) -> None:
    text = (
        SERVING.replace("robot = ", 'when = "on_eviction"\nrobot = ')
        + "[forgetting.online]\nfrequency = {wait = 2.0}\n"
    )
    with starting(text) as service:
        commit(service, *(placed(CUP, second, 1.0, second) for second in range(9)))
        objects = service.names.resolve("Object")
        assert service.archive is not None
        service.archive.flush(timeout=10)
        assert seconds_of(objects, QueryTarget.WM) == [7, 8]
        assert seconds_of(objects, QueryTarget.LTM) == [0, 2, 4, 6]
        assert service.status().long_term["forgotten"] == 3
    # What was left at the stop passes the same mechanisms: 8 is kept, 7 is not.
    stopped = service.status().long_term
    assert (stopped["consolidated"], stopped["forgotten"]) == (5, 4)


def test_stopping_can_be_tried_again_when_the_database_is_back(
    starting: Starting, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = HeldStore()
    monkeypatch.setattr("elm.app.connect", lambda *_: Memory(store))
    service = starting(SERVING).start()
    commit(service, placed(CUP, 0, 1.0, 1.0))
    with pytest.raises(NotConsolidated, match="1 snapshots are not durable"):
        service.stop(timeout=0.05)
    store.go.set()
    service.stop()
    assert service.status().long_term["consolidated"] == 1
    assert service.status().long_term["backlog"] == 0


def test_what_was_consolidated_is_there_after_a_restart(starting: Starting, postgres_server: Server) -> None:
    with postgres_server.database() as dsn:
        text = SERVING.replace("memory://", dsn)
        with starting(text) as service:
            commit(service, *(placed(CUP, second, 1.0, second) for second in range(4)))
            stopped = service
        with pytest.raises(ServerClosed):
            stopped.servers["Object"].commit(Commit(updates=[]))
        with starting(text) as service:
            assert seconds_of(service.servers["Object"], QueryTarget.WM) == []
            assert seconds_of(service.servers["Object"], QueryTarget.BOTH) == [0, 1, 2, 3]
        with connect(dsn) as memory:
            assert memory_names(memory) == ["Object"]
            assert list(entities(memory, MemoryID(memory="Object"))) == [CUP]
            assert list(entities(memory, CUP.with_entity("mug"))) == [CUP.with_entity("mug")]

            plan = plan_forgetting(memory, [Frequency(wait=2.0)], now=BEGIN)
            port = LongTermForgetting(memory)
            assert Forgetter(port).apply(plan).forgotten == len(plan.going) == 2
            assert port.events == 2
            left = list(recall_snapshots(memory, entity=CUP))
            assert [(each.referenced - BEGIN) // 1_000_000 for each in left] == [1, 3]
            assert port.forget(plan.snapshots) == 0, "what is gone is no error"


def eventually(holds: Callable[[], bool]) -> None:
    deadline = monotonic() + 15
    while not holds():
        assert monotonic() < deadline, "it did not come about within 15 s"
        sleep(0.01)


def test_forgetting_takes_every_version_and_leaves_other_snapshots_alone() -> None:
    updates = [placed(CUP, 0, 1.0, 1.0), placed(CUP, 0, 2.0, 2.0), placed(CUP, 5, 3.0, 3.0)]
    segments = [segment.definition() for segment in PROFILES["ObjectMemory"].core_segments]
    memory = in_process()
    with LongTermMemory(memory) as archive, MemoryServer("Object", segments, archive=archive) as server:
        assert server.commit(Commit(updates=updates)).success
    assert memory.statistics().events == 3

    port = LongTermForgetting(memory)
    assert port.forget([CUP.with_timestamp(BEGIN), CUP.with_timestamp(BEGIN + 1)]) == 1
    assert (port.events, port.held) == (2, 0)
    assert [each.referenced for each in recall_snapshots(memory)] == [BEGIN + 5_000_000]


def test_forgetting_leaves_the_events_of_others_alone() -> None:
    """Also those that name an entity, at the time of a snapshot that goes."""
    segments = [segment.definition() for segment in PROFILES["ObjectMemory"].core_segments]
    memory = in_process()
    with LongTermMemory(memory) as archive, MemoryServer("Object", segments, archive=archive) as server:
        assert server.commit(Commit(updates=[placed(CUP, second, 1.0, 1.0) for second in range(3)])).success
    memory.add_type("Grasp")
    seen = next(iter(memory.recall(limit=1)))
    memory.commit(Event(type="Grasp", interval=seen.interval, features=[*seen.features, ("hand", "left")]))

    plan = plan_forgetting(memory, [Retention(count=1)], now=BEGIN)
    port = LongTermForgetting(memory)
    assert Forgetter(port).apply(plan).forgotten == port.events == 2
    assert next(iter(memory.recall())).type == "Grasp"
    assert memory.recall().count() == 2


def test_what_recognizers_hold_is_not_forgotten_yet() -> None:
    segments = [segment.definition() for segment in PROFILES["ObjectMemory"].core_segments]
    memory = in_process()
    with LongTermMemory(memory) as archive, MemoryServer("Object", segments, archive=archive) as server:
        assert server.commit(Commit(updates=[placed(CUP, second, 1.0, 1.0) for second in range(3)])).success
    at = to_datetime(BEGIN + 1_000_000)
    seen_first = Pattern(
        name="seen-first",
        version=1,
        type="SeenTwice",
        elements=[step("one", cues.time("equal", at, at)), step("other", cues.exactly("SeenTwice"))],
        within=timedelta(days=400),
    )
    memory.add_type("SeenTwice")
    memory.recognition([seen_first], timing=Timing(simulated=True)).catch_up()
    port = LongTermForgetting(memory)
    # The middle one is the begin of a match, and the last one has yet to be fed.
    assert port.forget([CUP.with_timestamp(BEGIN + second * 1_000_000) for second in range(3)]) == 1
    assert (port.events, port.held) == (1, 2)


def test_a_start_that_fails_leaves_nothing_behind(starting: Starting) -> None:
    threads = set(threading.enumerate())
    service = starting(SERVING + WITHOUT_A_FILE)
    with pytest.raises(InvalidPriorKnowledge, match=r"no\.json cannot be read"):
        service.start()
    assert not service.names.registered()
    assert [thread for thread in threading.enumerate() if thread not in threads and thread.is_alive()] == []


def test_a_service_is_started_once(starting: Starting) -> None:
    service = starting(SERVING)
    with pytest.raises(ServiceClosed, match="was not started"):
        service.status()
    service.stop()
    with service:
        with pytest.raises(ServiceClosed, match="was started before"):
            service.start()
        assert service.names.resolve("Object") is service.servers["Object"]
    with pytest.raises(UnknownMemory):
        service.names.resolve("Object")
    service.stop()


def test_without_long_term_memory(starting: Starting) -> None:
    with starting(ALONE) as service:
        commit(service, placed(CUP, 0, 0.0, 0.0), placed(CUP, 1, 0.0, 0.0))
        assert seconds_of(service.servers["Object"], QueryTarget.BOTH) == [1]
        assert (service.archive, service.status().long_term) == (None, {})


def test_a_client_needs_an_address(starting: Starting) -> None:
    with pytest.raises(InvalidConfiguration, match=r"ice\.mode: nobody can be asked"):
        connect_client(starting(SERVING).config)
    with pytest.raises(InvalidConfiguration, match=r"ice\.port: .*give the port"):
        connect_client(starting(SERVING + '[ice]\nmode = "standalone"\nslices = ["."]\nport = 0\n').config)
