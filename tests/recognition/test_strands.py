"""Strands that share a log: what one does, or does not, never shows in the results of another."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from threading import Event as Signal
from typing import Any
from uuid import uuid4

import pytest

from elm import cues
from elm.app import Memory
from elm.cues.algebra import Cue
from elm.errors import InvalidValue
from elm.event import Event, StoredEvent
from elm.interval import Interval
from elm.log import LogKind
from elm.query import Query
from elm.recognition import RecognitionManager, Timing, replay
from elm.recognition.bench import SELF_FEEDING
from elm.recognizers import Emission, Fed, Pattern, Recognizer, Session, absent, step
from elm.recognizers.elements import Element
from elm.storage.memory import MemoryStore
from elm.taxonomy import EventType
from tests.clock import at
from tests.recognition.scenes import Stateless

SECOND = timedelta(seconds=1)
AT_ONCE = Timing(lateness=timedelta(0))


@pytest.fixture
def memory() -> Memory:
    opened = Memory(MemoryStore())
    opened.add_types([EventType(name=name) for name in ("A", "B", "T")])
    return opened


def put(memory: Memory, kind: str, seconds: float, agent: str = "r") -> None:
    memory.commit(Event(type=kind, interval=Interval.at(at(seconds)), agent=agent))


def found(memory: Memory, kind: str) -> list[StoredEvent]:
    return list(memory.store.find(Query(cue=cues.exactly(kind))))


def session(name: str, cue: Cue, **more: Any) -> Session:
    return Session(name=name, version=1, type=f"Of.{name}", cue=cue, gap=5 * SECOND, **more)


def until(holds: Callable[[], bool]) -> None:
    end = time.monotonic() + 10
    while not holds():
        assert time.monotonic() < end, "it did not come about in time"
        time.sleep(0.01)


@dataclass(kw_only=True)
class Watched(Stateless):
    """Emits what it is fed, or raises while it is told to; remembers the moments."""

    name: str = "watched"
    version: int = 1
    across_agents: bool = True
    is_down: bool = False
    moments: list[int] = field(default_factory=list)
    interest: Cue = field(default_factory=lambda: cues.exactly("A"))
    outputs: tuple[EventType, ...] = (EventType(name="Seen"),)
    definition: Any = None

    def start(self, around: object) -> Watched:
        return self

    def resume(self, around: object, snapshot: Any, held: Mapping[str, Fed]) -> Watched:
        return self

    def feed(self, fed: Fed) -> Sequence[Emission]:
        if self.is_down:
            raise RuntimeError("down")
        self.moments.append(fed.moment)
        return [Emission(type="Seen", parts=(("x", fed.event),))]


def test_a_strand_that_begins_later_does_not_share_its_ignorance(memory: Memory) -> None:
    old, new = session("zz", cues.is_a("A")), session("aa", cues.is_a("A"))
    for seconds in (0, 1, 2, 100):
        put(memory, "A", seconds)
    RecognitionManager(memory.store, [old]).catch_up()
    manager = RecognitionManager(memory.store, [new, old], since=memory.log.head())
    manager.catch_up()
    put(memory, "A", 50)
    put(memory, "A", 200)
    memory.punctuate(at(300), agent="r")
    manager.catch_up()
    told = replay(memory.store, [old])
    assert (told.new, told.missing, told.late) == ((), (), 1)
    assert {each.name: each.late for each in manager.status()} == {"aa": 0, "zz": 1}


def test_what_waited_for_a_strand_that_failed_is_fed_once_when_it_is_back(memory: Memory) -> None:
    watched = Watched()
    manager = RecognitionManager(memory.store, [session("y", cues.is_a("B")), watched], timing=AT_ONCE)
    manager.start()
    for seconds, agent in ((0, "r"), (0, "s"), (1, "r"), (1, "s"), (5, "r"), (10, "r"), (11, "r")):
        put(memory, "A", seconds, agent)
    until(lambda: memory.log.head() > 7 and all(each.lag == 0 for each in manager.status()))
    watched.is_down = True
    memory.punctuate(at(6), agent="s")
    until(lambda: any(each.is_failing for each in manager.status()))
    for agent in ("s", "r"):
        memory.punctuate(at(20), agent=agent)
    watched.is_down = False
    until(lambda: len(found(memory, "Seen")) == 7)
    manager.stop()
    assert watched.moments == sorted(watched.moments)
    assert len(watched.moments) == 7
    told = replay(memory.store, [Watched()], timing=AT_ONCE)
    assert (told.new, told.missing) == ((), ())


def test_a_restart_keeps_the_moments_of_an_event_that_has_two(memory: Memory) -> None:
    for agent in ("r", "s"):
        put(memory, "A", 0, agent)
    memory.punctuate(at(50), agent="r")
    memory.punctuate(at(2), agent="s")
    foreign = Session(name="foreign", version=1, type="T", cue=cues.is_a("A"), gap=SECOND)
    RecognitionManager(memory.store, [foreign], consumer="one", timing=AT_ONCE).catch_up()
    elements: list[Element] = [step("t", cues.is_a("T")), absent(cues.is_a("B"), 20 * SECOND)]
    alone = Pattern(name="alone", version=1, type="Alone", elements=elements, within=100 * SECOND)
    across = session("across", cues.is_a("T") | cues.is_a("Alone"), across_agents=True)
    both: list[Recognizer] = [alone, across]
    memory.punctuate(at(51), agent="r")
    memory.punctuate(at(3), agent="s")
    RecognitionManager(memory.store, both, consumer="two", timing=AT_ONCE).catch_up()
    put(memory, "B", 65, "r")
    for agent in ("r", "s"):
        memory.punctuate(at(200), agent=agent)
    RecognitionManager(memory.store, both, consumer="two", timing=AT_ONCE).catch_up()
    told = replay(memory.store, both, timing=AT_ONCE)
    assert (told.new, told.missing) == ((), ())


def test_a_ring_through_two_consumers_is_refused(memory: Memory) -> None:
    memory.add_types([EventType(name=name) for name in "XYZ"])

    def odd(name: str, wants: str, gives: str) -> Watched:
        outputs = (EventType(name=gives),)
        return Watched(name=name, interest=cues.exactly(wants), outputs=outputs, across_agents=False)

    RecognitionManager(memory.store, [odd("a", "X", "Y"), odd("c", "Z", "X")], consumer="one").catch_up()
    with pytest.raises(InvalidValue, match="would feed each other"):
        RecognitionManager(memory.store, [odd("b", "Y", "Z")], consumer="two").catch_up()


def test_self_feeding_through_time_ends(memory: Memory) -> None:
    endless = Session(name="endless", version=1, type="Endless", cue=cues.everything(), gap=timedelta(milliseconds=100))
    put(memory, "A", 0)
    memory.punctuate(at(3600), agent="r")
    manager = RecognitionManager(memory.store, [endless])
    manager.catch_up()
    assert sorted(each.value("elm.depth") or 0 for each in found(memory, "Endless")) == [*range(1, SELF_FEEDING + 1)]
    assert manager.status()[0].cut == 1


def test_an_agent_that_fell_silent_does_not_hold_up_the_others_for_ever(memory: Memory) -> None:
    across = Session(
        name="x", version=1, type="X", cue=cues.is_a("A"), gap=timedelta(milliseconds=50), across_agents=True
    )
    timing = Timing(lateness=timedelta(0), idle=timedelta(milliseconds=500))
    now = datetime.now(UTC)
    with RecognitionManager(memory.store, [across], timing=timing):
        memory.commit(Event(type="A", interval=Interval.at(now - timedelta(hours=1)), agent="slow"))
        memory.commit(Event(type="A", interval=Interval.at(now), agent="r"))
        until(lambda: len(found(memory, "X")) == 2)
        head = memory.log.head()
        time.sleep(0.7)
        assert memory.log.head() <= head + 2, "ticks go on though nothing waits"
    told = replay(memory.store, [across], timing=timing)
    assert (told.new, told.missing) == ((), ())


def test_on_simulated_time_nothing_is_certain_by_the_time_of_the_wall(memory: Memory) -> None:
    put(memory, "A", 0)
    other = RecognitionManager(memory.store, [session("other", cues.is_a("A"))], consumer="other", timing=AT_ONCE)
    other.start()
    until(lambda: any(each.kind is LogKind.TICK for each in memory.log.read(0, 100)))
    other.stop()
    simulated = Pattern(name="p", version=1, type="P", elements=[step("a", cues.is_a("A"))], within=SECOND)
    RecognitionManager(
        memory.store, [simulated], timing=Timing(lateness=timedelta(0), simulated=True), consumer="simulated"
    ).catch_up()
    assert found(memory, "P") == []


def test_an_event_of_the_first_year_stops_nobody(memory: Memory) -> None:
    begin = datetime(1, 1, 1, tzinfo=UTC)
    memory.commit(Event(type="A", interval=Interval.at(begin), agent="r"))
    manager = RecognitionManager(memory.store, [session("s", cues.is_a("A"))])
    manager.catch_up()
    assert manager.status()[0].lag == 0


@pytest.mark.parametrize("error", [OSError("\udcff"), SystemExit(3), RuntimeError("x" * 10_000)])
def test_whatever_is_raised_stops_its_strand_alone(memory: Memory, error: BaseException) -> None:
    class Raising(Watched):
        def feed(self, fed: Fed) -> Sequence[Emission]:
            raise error

    put(memory, "A", 0)
    memory.punctuate(at(60), agent="r")
    manager = RecognitionManager(memory.store, [Raising(), session("s", cues.is_a("A"))])
    manager.catch_up()
    assert {each.name: each.is_failing for each in manager.status()} == {"watched": True, "s": False}
    assert len(found(memory, "Of.s")) == 1


@pytest.mark.parametrize("given", [[], [7], [Session], "s", session("s", cues.everything())])
def test_only_recognizers_recognize(memory: Memory, given: Any) -> None:
    with pytest.raises(InvalidValue, match="recognizer"):
        RecognitionManager(memory.store, given)
    with pytest.raises(InvalidValue, match="recognizer"):
        replay(memory.store, given)


@pytest.mark.parametrize("given", [[], [1]])
def test_only_recognizers_look_at_the_log_once(memory: Memory, given: Any) -> None:
    with pytest.raises(InvalidValue, match="recognizer"):
        memory.recognize(given)


def test_a_rewound_consumer_begins_anew_while_it_is_at_work(memory: Memory) -> None:
    manager = RecognitionManager(memory.store, [session("s", cues.is_a("A"))], timing=AT_ONCE)
    put(memory, "A", 0)
    memory.punctuate(at(60), agent="r")
    manager.start()
    until(lambda: len(found(memory, "Of.s")) == 1)
    (consumer,) = memory.log.consumers()
    memory.log.rewind(consumer.name, 0)
    put(memory, "A", 100)
    memory.punctuate(at(200), agent="r")
    until(lambda: len(found(memory, "Of.s")) == 2)
    manager.stop()


@dataclass(kw_only=True)
class Told(Watched):
    """Does with an event what a function says."""

    does: Callable[[StoredEvent], Sequence[Emission]]

    def feed(self, fed: Fed) -> Sequence[Emission]:
        return self.does(fed.event)


def test_a_slow_strand_that_fails_while_the_others_are_busy_loses_nothing(memory: Memory) -> None:
    calls: list[StoredEvent] = []
    others_are_busy = Signal()

    def slow(event: StoredEvent) -> Sequence[Emission]:
        calls.append(event)
        if len(calls) == 1:
            time.sleep(1.1)
        if len(calls) == 2:
            others_are_busy.wait(10)
            unknown = StoredEvent(
                id=0, uid=uuid4(), type="A", interval=event.interval, recorded_at=event.recorded_at, agent="r"
            )
            return [Emission(type="Seen", parts=(("x", unknown),))]
        return [Emission(type="Seen", parts=(("x", event),))]

    def busy(event: StoredEvent) -> Sequence[Emission]:
        others_are_busy.set()
        time.sleep(0.35)
        return ()

    put(memory, "A", 0)
    memory.punctuate(at(1), agent="r")
    first = Told(name="slow", does=slow, across_agents=False)
    second = Told(name="busy", does=busy, across_agents=False, interest=cues.exactly("B"), outputs=())
    manager = RecognitionManager(memory.store, [first, second])
    manager.start()
    until(lambda: len(found(memory, "Seen")) == 1)
    put(memory, "A", 10)
    memory.punctuate(at(20), agent="r")
    until(lambda: len(calls) == 2)
    put(memory, "B", 21)
    memory.punctuate(at(30), agent="r")
    until(lambda: len(found(memory, "Seen")) == 2)
    manager.stop()
    assert {each.name: each.failures for each in manager.status()} == {"slow": 1, "busy": 0}
