"""The manager: who works when, what becomes of recognizers that fail, and what the status says of it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from threading import Event as Signal
from typing import Any
from uuid import UUID, uuid4

import pytest

from elm import cues
from elm.cues.algebra import Cue
from elm.errors import ConsumerBusy, DefinitionChanged, InvalidValue, UnknownType
from elm.event import Event, StoredEvent
from elm.interval import Interval
from elm.log import LoggedStore, LogKind, Tick
from elm.query import Query
from elm.recognition import RecognitionManager, Timing, latecomers, replay
from elm.recognition.bench import SELF_FEEDING
from elm.recognition.status import RecognizerStatus
from elm.recognizers import Emission, Fed, Pattern, Recognizer, absent, step
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at
from tests.recognition.scenes import Stateless

SECOND = timedelta(seconds=1)


@dataclass(frozen=True, kw_only=True)
class Odd:
    """A recognizer that does with every event of one type what a function says."""

    name: str = "odd"
    version: int = 1
    across_agents: bool = False
    does: Any = None
    wants: str = "A"
    gives: str = "Odd"

    @property
    def interest(self) -> Cue:
        return cues.is_a(self.wants)

    @property
    def outputs(self) -> tuple[EventType, ...]:
        return (EventType(name=self.gives),)

    @property
    def definition(self) -> Any:
        return [self.name, self.wants]

    def start(self, around: object) -> OddProcess:
        return OddProcess(self.does)

    def resume(self, around: object, snapshot: Any, held: Mapping[str, Fed]) -> OddProcess:
        return OddProcess(self.does)


class OddProcess(Stateless):
    """Without state."""

    def __init__(self, does: Any) -> None:
        self._does = does

    def feed(self, fed: Fed) -> Sequence[Emission]:
        return self._does(fed.event)  # type: ignore[no-any-return]


PAIR: Recognizer = Pattern(
    name="pair", version=1, type="Pair", elements=[step("a", cues.is_a("A")), step("b", cues.is_a("B"))], within=SECOND
)


@pytest.fixture
def memory(store: LoggedStore) -> LoggedStore:
    store.add_types([EventType(name="A"), EventType(name="B")])
    return store


def tell(store: LoggedStore, kinds: str, *, begin: float = 0) -> list[Event]:
    """Commit one instant of each kind, a tenth of a second apart, and promise that no more comes before the next."""
    events = [
        Event(type=kind, interval=Interval.at(at(begin + number / 10)), agent="r") for number, kind in enumerate(kinds)
    ]
    store.commit_all([Arrival(event=event) for event in events])
    store.log.write([Tick(agent="r", deadline=at(begin + len(kinds) / 10), kind=LogKind.PUNCTUATION)])
    return events


def found(store: LoggedStore, kind: str) -> list[StoredEvent]:
    return list(store.find(Query(cue=cues.exactly(kind))))


def failing(event: StoredEvent) -> Sequence[Emission]:
    raise RuntimeError("the camera is upside down")


def unknown_part(event: StoredEvent) -> Sequence[Emission]:
    other = StoredEvent(id=0, uid=uuid4(), type="A", interval=event.interval, recorded_at=event.recorded_at, agent="r")
    return [Emission(type="Odd", parts=(("x", other),))]


def undeclared_type(event: StoredEvent) -> Sequence[Emission]:
    return [Emission(type="B", parts=(("x", event),))]


def without_parts(event: StoredEvent) -> Sequence[Emission]:
    return [Emission(type="Odd", parts=())]


NONSENSE = {
    "raises": failing,
    "unknown part": unknown_part,
    "undeclared type": undeclared_type,
    "no parts": without_parts,
    "no emission": lambda event: [event],
    "no sequence": lambda event: 7,
    "nothing": lambda event: None,
    "text": lambda event: "found it",
}


@pytest.mark.parametrize("does", NONSENSE.values(), ids=NONSENSE)
def test_a_recognizer_that_fails_stops_itself_alone(memory: LoggedStore, does: Any) -> None:
    tell(memory, "AB")
    manager = RecognitionManager(memory, [Odd(does=does), PAIR])
    manager.catch_up()
    odd, pair = manager.status()
    assert (odd.name, odd.is_failing, odd.failures, odd.position) == ("odd", True, 1, 0)
    assert odd.error
    assert (pair.is_failing, pair.lag, pair.found) == (False, 0, 1)
    assert len(found(memory, "Pair")) == 1
    assert found(memory, "Odd") == []


@dataclass(frozen=True, kw_only=True)
class OddAt(Odd):
    """One whose process raises when one of its methods is called, or never comes to an end."""

    method: str = "deadline"

    def start(self, around: object) -> OddProcess:
        process = OddProcess(lambda event: ())

        def raises() -> Any:
            raise RuntimeError("lost its mind")

        answers = {"soon": ("deadline", lambda: 0), "set": ("snapshot", lambda: {object()})}
        name, answer = answers.get(self.method, (self.method, raises))
        setattr(process, name, answer)
        return process


@pytest.mark.parametrize("method", ["deadline", "snapshot", "held", "counts", "soon", "set"])
def test_whatever_of_a_process_fails_stops_itself_alone(memory: LoggedStore, method: str) -> None:
    tell(memory, "AB")
    manager = RecognitionManager(memory, [OddAt(method=method), PAIR])
    manager.catch_up()
    odd, pair = manager.status()
    assert (odd.name, odd.is_failing, odd.failures, odd.position) == ("odd", True, 1, 0)
    assert (pair.is_failing, pair.lag, pair.found) == (False, 0, 1)


def test_a_failing_recognizer_is_tried_again_and_misses_nothing(memory: LoggedStore) -> None:
    tell(memory, "AABA")
    healed = False

    def heals(event: StoredEvent) -> Sequence[Emission]:
        if not healed:
            raise OSError("the disk is full")
        return [Emission(type="Odd", parts=(("x", event),))]

    manager = RecognitionManager(memory, [Odd(does=heals), PAIR])
    manager.start()
    _until(lambda: any(each.failures >= 2 for each in manager.status()))
    assert manager.status()[0].error == "odd: OSError: the disk is full"
    healed = True
    _until(lambda: len(found(memory, "Odd")) == 3 and manager.status()[0].lag == 0)
    manager.stop()
    status = manager.status()[0]
    assert (status.is_failing, status.lag) == (False, 0)
    assert len(found(memory, "Pair")) == 1


def test_a_failing_recognizer_takes_those_with_it_that_it_feeds(memory: LoggedStore) -> None:
    tell(memory, "AB")
    fed = Pattern(name="fed", version=1, type="Fed", elements=[step("odd", cues.is_a("Odd"))], within=SECOND)
    manager = RecognitionManager(memory, [Odd(does=failing), PAIR, fed])
    manager.catch_up()
    assert {each.name: each.is_failing for each in manager.status()} == {"odd": True, "fed": True, "pair": False}


def test_a_recognizer_that_feeds_itself_is_bounded_and_reported(memory: LoggedStore) -> None:
    tell(memory, "AB")
    again = Odd(name="again", wants="Odd", does=lambda event: [Emission(type="Odd", parts=(("x", event),))])
    first = Odd(does=lambda event: [Emission(type="Odd", parts=(("x", event),))])
    manager = RecognitionManager(memory, [first, again])
    manager.catch_up()
    status = {each.name: each for each in manager.status()}
    assert len(found(memory, "Odd")) == SELF_FEEDING
    assert (status["again"].cut, status["again"].is_failing, status["again"].lag) == (1, False, 0)


def test_a_slow_recognizer_does_not_hold_up_the_others_for_long(memory: LoggedStore) -> None:
    def slow(event: StoredEvent) -> Sequence[Emission]:
        time.sleep(1.2)
        return [Emission(type="Odd", parts=(("x", event),))]

    manager = RecognitionManager(memory, [Odd(does=slow), PAIR])
    manager.start()
    tell(memory, "AB")
    _until(lambda: len(found(memory, "Odd")) == 1)
    tell(memory, "AABAAA", begin=10)
    before = time.monotonic()
    _until(lambda: len(found(memory, "Pair")) == 2)
    assert time.monotonic() - before < 1.1
    assert len(found(memory, "Odd")) < 6
    manager.stop()
    odd, pair = manager.status()
    assert odd.slowest >= 1.2
    assert (pair.found, pair.is_failing) == (2, False)


def test_results_of_the_slow_one_are_complete_in_the_end(memory: LoggedStore) -> None:
    def slow(event: StoredEvent) -> Sequence[Emission]:
        time.sleep(1.01)
        return [Emission(type="Odd", parts=(("x", event),))]

    tell(memory, "ABA")
    manager = RecognitionManager(memory, [Odd(does=slow), PAIR], batch=1)
    manager.catch_up()
    assert len(found(memory, "Odd")) == 2
    assert [each.lag for each in manager.status()] == [0, 0]


def test_two_managers_of_one_consumer_exclude_each_other(memory: LoggedStore) -> None:
    first = RecognitionManager(memory, [PAIR])
    first.start()
    _until(lambda: bool(first.status()))
    with pytest.raises(ConsumerBusy):
        RecognitionManager(memory, [PAIR]).catch_up()
    RecognitionManager(memory, [PAIR], consumer="another").catch_up()
    first.stop()
    RecognitionManager(memory, [PAIR]).catch_up()


def test_leaving_a_manager_looks_after_each_round_only(memory: LoggedStore) -> None:
    looks: list[float] = []

    class Watched(RecognitionManager):
        def status(self) -> list[RecognizerStatus]:
            looks.append(time.monotonic())
            return super().status()

    def slow(event: StoredEvent) -> Sequence[Emission]:
        time.sleep(0.5)
        return ()

    tell(memory, "A")
    with Watched(memory, [Odd(does=slow)]) as manager:
        pass
    assert [(each.lag, each.fed) for each in manager.status()] == [(0, 1)]
    assert len(looks) <= 10


def test_leaving_a_manager_does_not_wait_for_a_thread_that_broke(memory: LoggedStore) -> None:
    def interrupted(event: StoredEvent) -> Sequence[Emission]:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), RecognitionManager(memory, [Odd(does=interrupted)]):
        tell(memory, "A")


def test_starting_under_a_name_at_which_another_works_is_refused(
    memory: LoggedStore, caplog: pytest.LogCaptureFixture
) -> None:
    tell(memory, "AB")
    manager = RecognitionManager(memory, [PAIR])
    with memory.log.exclusive("recognition"):
        with pytest.raises(ConsumerBusy, match="'recognition'"):
            manager.start()
        with pytest.raises(ConsumerBusy), manager:
            pass
    assert caplog.records == []
    manager.stop()
    with manager:
        pass
    assert len(found(memory, "Pair")) == 1


# Events that come too late


def late_warnings(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [record.getMessage() for record in caplog.records if "too late" in record.getMessage()]


def test_events_that_come_too_late_are_warned_of_once_in_a_while(
    memory: LoggedStore, caplog: pytest.LogCaptureFixture
) -> None:
    """Of all recognizers in one line, whose numbers add up though only some of the lines are written."""
    other = replace(PAIR, name="other", type="Other")  # type: ignore[type-var]
    manager = RecognitionManager(memory, [PAIR, other], batch=1)
    tell(memory, "AB", begin=3600)
    manager.catch_up()
    assert late_warnings(caplog) == []
    tell(memory, "ABAB")
    manager.catch_up()
    (said,) = late_warnings(caplog)
    assert said.startswith("recognition 'recognition': events come too late and are not fed: 1 to 'other', 1 to 'pair'")
    assert "of agent 'r'" in said
    assert "3,600.2 s" in said
    assert "lateness" in said
    assert "replay" in said
    assert [each.late for each in manager.status()] == [4, 4]


def test_what_was_warned_of_is_not_warned_of_again(memory: LoggedStore, caplog: pytest.LogCaptureFixture) -> None:
    """Neither when another process goes on, nor when a strand is fed again what it had been fed before."""
    tell(memory, "AB", begin=3600)
    tell(memory, "AB")
    RecognitionManager(memory, [PAIR]).catch_up()
    assert len(late_warnings(caplog)) == 1
    tell(memory, "A", begin=7200)
    RecognitionManager(memory, [PAIR]).catch_up()
    assert len(late_warnings(caplog)) == 1


def test_lines_about_late_events_are_some_time_apart(
    memory: LoggedStore, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(latecomers, "TELL_EVERY", 0.0)
    tell(memory, "AB", begin=3600)
    tell(memory, "ABA")
    RecognitionManager(memory, [PAIR], batch=1).catch_up()
    assert ["not fed: 1 to 'pair'" in said for said in late_warnings(caplog)] == [True] * 3


def test_a_changed_definition_needs_a_new_version(memory: LoggedStore) -> None:
    tell(memory, "AB")
    RecognitionManager(memory, [PAIR]).catch_up()
    assert isinstance(PAIR, Pattern)
    other = replace(PAIR, within=2 * SECOND)
    with pytest.raises(DefinitionChanged, match="'pair' of version 1"):
        RecognitionManager(memory, [other]).catch_up()
    RecognitionManager(memory, [replace(other, version=2)]).catch_up()
    assert {each.value("elm.version") for each in found(memory, "Pair")} == {1, 2}


def test_recognizers_that_would_feed_each_other_share_a_consumer(memory: LoggedStore) -> None:
    one = Odd(name="one", wants="A", gives="One", does=lambda event: ())
    memory.add_types([EventType(name="Two")])
    back = Odd(name="back", wants="One", gives="A", does=lambda event: ())
    RecognitionManager(memory, [one], consumer="first").catch_up()
    with pytest.raises(InvalidValue, match="would feed each other"):
        RecognitionManager(memory, [back], consumer="second").catch_up()
    RecognitionManager(memory, [one, back], consumer="first").catch_up()


def test_results_of_another_consumer_are_fed(memory: LoggedStore) -> None:
    tell(memory, "ABAB")
    RecognitionManager(memory, [PAIR], consumer="first").catch_up()
    tell(memory, "", begin=1)
    twice = Pattern(
        name="twice", version=1, type="Twice", elements=[step("p", cues.is_a("Pair")).times(2)], within=SECOND
    )
    manager = RecognitionManager(memory, [twice], consumer="second")
    manager.catch_up()
    assert len(found(memory, "Twice")) == 1
    assert manager.status()[0].late == 0


def test_two_recognizers_of_one_name_are_refused(memory: LoggedStore) -> None:
    assert isinstance(PAIR, Pattern)
    with pytest.raises(InvalidValue, match="several recognizers are named 'pair'"):
        RecognitionManager(memory, [PAIR, replace(PAIR, version=2)]).catch_up()


def test_what_happens_is_found_at_once(memory: LoggedStore) -> None:
    manager = RecognitionManager(memory, [PAIR], timing=Timing(lateness=timedelta(0)))
    manager.start()
    for _ in range(5):
        before = len(found(memory, "Pair"))
        for kind in "AB":
            memory.commit(Arrival(event=Event(type=kind, interval=Interval.at(datetime.now(UTC)))))
        _until(lambda: len(found(memory, "Pair")) > before, seconds=2)  # noqa: B023
    manager.stop()
    check = replay(memory, [PAIR], timing=manager.timing)
    assert (check.new, check.missing) == ((), ())


def test_absence_fires_when_time_is_over_though_nothing_comes(memory: LoggedStore) -> None:
    alone = Pattern(
        name="alone",
        version=1,
        type="Alone",
        elements=[step("a", cues.is_a("A")), absent(cues.is_a("B"), timedelta(milliseconds=300))],
        within=SECOND,
    )
    manager = RecognitionManager(memory, [alone], timing=Timing(lateness=timedelta(milliseconds=100)))
    manager.start()
    began = datetime.now(UTC)
    memory.commit(Arrival(event=Event(type="A", interval=Interval.at(began), agent="r")))
    _until(lambda: len(found(memory, "Alone")) == 1)
    assert datetime.now(UTC) - began >= timedelta(milliseconds=400)
    manager.stop()
    (event,) = found(memory, "Alone")
    assert event.interval == Interval(begin=began, end=began + timedelta(milliseconds=300))
    assert event.agent == "r"
    check = replay(memory, [alone], timing=manager.timing)
    assert (check.new, check.missing) == ((), ())


def test_an_event_is_fed_when_it_has_ended(memory: LoggedStore) -> None:
    going_on = Event(type="A", interval=Interval(begin=at(0), end=None), agent="r")
    memory.commit(Arrival(event=going_on))
    manager = RecognitionManager(memory, [PAIR])
    tell(memory, "B", begin=0.1)
    manager.catch_up()
    memory.close_event(going_on.uid, at(0.5))
    tell(memory, "B", begin=0.8)
    manager.catch_up()
    (pair,) = found(memory, "Pair")
    assert pair.parts[0] == going_on.uid
    check = replay(memory, [PAIR])
    assert (check.new, check.missing) == ((), ())


def test_steps_are_told_apart_in_the_uid(memory: LoggedStore) -> None:
    """a a b as a+ a b and as a a+ b has the same parts: two results all the same."""
    tell(memory, "AAAB")
    both = Pattern(
        name="both",
        version=1,
        type="Both",
        elements=[
            step("one", cues.is_a("A")).times(1, 2).skip_till_any(),
            step("two", cues.is_a("A")).times(1, 2).skip_till_any(),
            step("b", cues.is_a("B")),
        ],
        within=SECOND,
        after_match="all",
    )
    RecognitionManager(memory, [both]).catch_up()
    parts: dict[tuple[UUID, ...], int] = {}
    for event in found(memory, "Both"):
        parts[event.parts] = parts.get(event.parts, 0) + 1
    assert max(parts.values()) == 2


def test_a_recognizer_of_an_unknown_type_is_named(memory: LoggedStore) -> None:
    lost = Pattern(name="lost", version=1, type="Lost", elements=[step("a", cues.is_a("Nowhere"))], within=SECOND)
    for work in (RecognitionManager(memory, [PAIR, lost]).catch_up, lambda: replay(memory, [PAIR, lost])):
        with pytest.raises(UnknownType, match=r"recognizer 'lost' looks for .*'Nowhere'"):
            work()


def test_a_replay_does_not_mix_definitions_of_one_version(memory: LoggedStore) -> None:
    tell(memory, "AB")
    RecognitionManager(memory, [PAIR]).catch_up()
    assert isinstance(PAIR, Pattern)
    other = replace(PAIR, within=2 * SECOND)
    with pytest.raises(DefinitionChanged):
        replay(memory, [other])
    assert len(replay(memory, [other], commit=False).missing) == 1


def test_catching_up_can_be_stopped(memory: LoggedStore) -> None:
    tell(memory, "AB")
    stop = Signal()
    stop.set()
    manager = RecognitionManager(memory, [PAIR])
    assert manager.catch_up(stop) == 0
    assert manager.catch_up() == 4


def _until(holds: Any, seconds: float = 10) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not come about in time"
        time.sleep(0.01)
