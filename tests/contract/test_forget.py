"""Forgetting: what is left answers as if the rest had never been, and wholes stay what they were."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Any
from uuid import UUID, uuid4

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.cues.algebra import Cue
from elm.cues.match import match
from elm.cues.relations import Kin
from elm.errors import ForgottenEvent, InvalidValue, UnknownEvent
from elm.event import Event, Payload, StoredEvent
from elm.forgetting import ForgettingReport, forget
from elm.geometry import Region
from elm.log import LoggedStore, LogKind
from elm.query import Order, Query
from elm.store import Arrival, Store
from elm.subscription import subscribe
from elm.taxonomy import EventType
from elm.tombstone import Forgotten, RunTombstone, Tombstone
from tests.clock import at, span
from tests.conftest import StoreFactory
from tests.contract.telling import everything, few_memories, found, story, tell
from tests.model import ids_of, same_events
from tests.strategies import TYPE_NAMES, UIDS, Story, combined_cues, single_cues, stories

P, Q, R, S, T, U = (UUID(int=number) for number in range(1, 7))
NOBODY = UUID(int=99)
HERE, THERE = Region.box(0, 0, 4, 4), Region.box(6, 0, 10, 4)


def one(uid: UUID, begin: float = 0, end: float | None = 1, **fields: Any) -> Event:
    """An atomic event."""
    return Event(type="Event", uid=uid, interval=span(begin, end), **fields)


def whole(uid: UUID, *parts: UUID) -> Event:
    """A complex event."""
    return Event(type="Event", uid=uid, parts=parts)


def told(store: Store, *events: Event) -> None:
    """Tell a store these events."""
    tell(store, story(*events))


class Remaining:
    """What a store must hold after forgetting: the other events, without wholes that went; tombstones are leaves."""

    def __init__(self, before: Sequence[StoredEvent], gone: Set[UUID], types: Iterable[EventType]) -> None:
        self._parents = {each.name: each.parents for each in types}
        self.events = {
            event.uid: StoredEvent(
                **{name: getattr(event, name) for name in StoredEvent.FIELDS}
                | {"wholes": tuple(uid for uid in event.wholes if uid not in gone)}
            )
            for event in before
            if event.uid not in gone
        }
        named = {part for event in self.events.values() for part in event.parts}
        self.tombstones = named - self.events.keys()

    def is_a(self, name: str, ancestor: str) -> bool:
        return name == ancestor or any(self.is_a(parent, ancestor) for parent in self._parents[name])

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        event = self.events.get(uid)
        if event is None:
            return set()
        direct = set(event.parts if kin is Kin.PARTS else event.wholes)
        if not transitive:
            return direct
        return direct.union(*(self.kin(relative, kin, transitive=True) for relative in direct))

    def scan(self, cue: Cue) -> list[StoredEvent]:
        every = sorted(self.events.values(), key=lambda event: (event.interval.begin, event.id))
        return [event for event in every if match(cue, event, self)]


def report(**counts: Any) -> dict[str, Any]:
    """The numbers of a report, where they are not 0."""
    names = ("events", "tombstones", "dissolved", "still_open", "held", "unknown")
    return {name: counts.get(name, 0) for name in names}


def numbers(done: ForgettingReport) -> dict[str, Any]:
    return {name: getattr(done, name) for name in report()}


# What is left


@few_memories
@given(
    stories(),
    st.lists(st.sets(st.sampled_from(UIDS), max_size=5), min_size=1, max_size=3),
    st.lists(combined_cues(TYPE_NAMES), min_size=8, max_size=12),
    st.integers(1, 4),
)
def test_what_is_left_answers_as_a_full_scan_of_it(
    store_factory: StoreFactory, memory: Story, rounds: list[set[UUID]], asked: list[Cue], batch: int
) -> None:
    store = store_factory()
    tell(store, memory)
    before = everything(store)
    head = store.log.head()
    gone: set[UUID] = set()
    for uids in rounds:
        held = {event.uid: event for event in everything(store)}
        going = {uid for uid in uids if uid in held and not held[uid].interval.is_open}
        known = {each.uid for each in store.tombstones()}
        gone |= going
        left = Remaining(before, gone, memory.types)
        expected = report(
            events=len(going),
            tombstones=len(going & left.tombstones),
            dissolved=len(known - left.tombstones),
            still_open=len((uids & held.keys()) - going),
            unknown=len(uids - held.keys()),
        )
        dry = forget(store, uids, dry_run=True)
        assert same_events(everything(store), list(held.values()))
        done = forget(store, uids, batch=batch)
        assert numbers(dry) == numbers(done) == expected
        assert (dry.bytes, dry.types) == (done.bytes, done.types)
        assert done.types == Counter(held[uid].type for uid in going)
        assert same_events(everything(store), sorted(left.events.values(), key=lambda event: event.id))
        assert {each.uid for each in store.tombstones()} == left.tombstones
    _extents_are_those_of_the_events(store, before)
    statistics = store.statistics()
    assert (statistics.forgotten, statistics.tombstones) == (len(gone), len(left.tombstones))
    assert statistics.events == len(left.events)
    for cue in [*asked, *(cues.parts("superset", [uid]) for uid in left.tombstones)]:
        assert found(store, cue) == ids_of(left.scan(cue))
    _log_is_as_long_as_before(store, head, gone)
    assert not forget(store, gone).events


def _extents_are_those_of_the_events(store: Store, before: Sequence[StoredEvent]) -> None:
    were = {event.uid: event for event in before}
    for each in store.tombstones():
        was = were[each.uid]
        assert (each.interval, each.region, each.subject, each.agent) == (
            *(was.interval, was.region, was.subject, was.agent),
        )
        assert each.id == was.id


def _log_is_as_long_as_before(store: LoggedStore, head: int, gone: Set[UUID]) -> None:
    assert store.log.head() == head
    entries = store.log.read(0, head + 1)
    assert [entry.position for entry in entries] == [*range(1, head + 1)]
    assert sum(entry.is_forgotten for entry in entries) == len(gone)


@few_memories
@given(stories(), st.sets(st.sampled_from(UIDS)), st.lists(single_cues(TYPE_NAMES), min_size=3, max_size=6))
def test_forgetting_by_cue_takes_what_matches_and_has_ended(
    store_factory: StoreFactory, memory: Story, first: set[UUID], asked: list[Cue]
) -> None:
    store = store_factory()
    tell(store, memory)
    forget(store, first)
    for cue in asked:
        matching = list(store.find(Query(cue=cue)))
        done = forget(store, cue)
        assert done.events == sum(not event.interval.is_open for event in matching)
        assert done.still_open == sum(event.interval.is_open for event in matching)
        left = {event.uid for event in everything(store)}
        assert not left & {event.uid for event in matching if not event.interval.is_open}


def test_an_event_without_a_whole_leaves_only_its_run(store: LoggedStore) -> None:
    told(
        store,
        one(P, 1, 2, region=HERE, features={"a": 1}, payload=Payload(data=bytes(5_000))),
        one(Q, 4, 9, region=THERE, subject=HERE),
        one(R, 0, 0, region=Region.box(0, 0, 1, 1, frame="odom")),
        one(S, 0, 20),
    )
    done = forget(store, cues.uid(P, Q, R))

    assert numbers(done) == report(events=3)
    assert done.bytes > 0
    assert done.types == {"Event": 3}
    assert list(store.tombstones()) == []
    (run,) = store.run_tombstones()
    assert (run.run, run.events, run.interval) == (done.run, 3, span(0, 9))
    assert run.regions == (Region.box(0, 0, 10, 4), Region.box(0, 0, 1, 1, frame="odom"))
    assert run.subjects == (HERE,)
    assert [event.uid for event in everything(store)] == [S]
    assert store.statistics().frames == 0


def test_a_part_leaves_a_tombstone_and_its_whole_stays_as_it_was(store: LoggedStore) -> None:
    told(store, one(P, 1, 2, region=HERE, agent="a"), one(Q, 4, 9, region=THERE, subject=HERE, agent="a"))
    store.commit(Arrival(event=whole(R, P, Q)))
    (before,) = store.find(Query(cue=cues.uid(R)))
    done = forget(store, [Q])

    assert numbers(done) == report(events=1, tombstones=1)
    assert [(each.uid, each.interval, each.region, each.subject, each.agent) for each in store.tombstones()] == [
        (Q, span(4, 9), THERE, HERE, "a")
    ]
    assert [each.run for each in store.tombstones([Q, P, NOBODY])] == [done.run]
    (run,) = store.run_tombstones()
    assert (run.events, run.interval, run.regions) == (0, None, ())
    (after,) = store.find(Query(cue=cues.uid(R)))
    assert after == before
    assert store.count(cues.parts("equal", [P, Q])) == store.count(cues.parts("superset", [Q])) == 1
    assert store.count(cues.parts("subset", [P]) & cues.uid(R)) == 0
    assert store.count(cues.uid(Q)) == store.count(cues.wholes("intersects", [R]) & cues.uid(Q)) == 0


def test_a_whole_that_is_forgotten_frees_its_parts(store: LoggedStore) -> None:
    told(store, one(P), one(Q))
    for event in (whole(R, P), whole(S, R, Q), whole(T, S)):
        store.commit(Arrival(event=event))
    forget(store, [S])

    left = {event.uid: event for event in everything(store)}
    assert [left[uid].wholes for uid in (P, Q, R)] == [(R,), (), ()]
    assert left[T].parts == (S,)
    assert store.count(cues.parts("equal", [S], transitive=True)) == 1
    assert store.count(cues.parts("intersects", [P], transitive=True)) == 1
    assert store.count(cues.wholes("intersects", [T], transitive=True)) == 0
    assert store.count(cues.wholes("superset", [S])) == 0


def test_a_tombstone_goes_with_its_last_whole(store: LoggedStore) -> None:
    told(store, one(P, 0, 1, region=HERE), one(Q, 2, 3))
    for event in (whole(R, P, Q), whole(S, P)):
        store.commit(Arrival(event=event))
    assert numbers(forget(store, [P])) == report(events=1, tombstones=1)
    assert numbers(forget(store, [R])) == report(events=1)
    assert [each.uid for each in store.tombstones()] == [P]
    last = forget(store, [S])

    assert numbers(last) == report(events=1, dissolved=1)
    assert list(store.tombstones()) == []
    runs = {run.run: run for run in store.run_tombstones()}
    assert last.run is not None
    assert (runs[last.run].events, runs[last.run].interval, runs[last.run].regions) == (2, span(0, 1), (HERE,))
    assert sum(run.events for run in runs.values()) == store.statistics().forgotten == 3
    assert store.commit(Arrival(event=one(P, 5, 6))).new


@pytest.mark.parametrize("batch", [1, 2, 10])
def test_what_is_left_does_not_depend_on_the_batches(store: LoggedStore, batch: int) -> None:
    told(store, one(P), one(Q), one(R))
    for event in (whole(S, P, Q), whole(T, S, R), whole(U, R)):
        store.commit(Arrival(event=event))
    dealt: list[int] = []
    done = forget(store, [P, Q, S, T], batch=batch, progress=dealt.append)

    assert numbers(done) == report(events=4)
    assert dealt[-1] == 4
    assert len(dealt) == -(-4 // batch)
    assert list(store.tombstones()) == []
    (run,) = store.run_tombstones()
    assert (run.run, run.events) == (done.run, 4)
    assert {event.uid: event.wholes for event in everything(store)} == {R: (U,), U: ()}


def test_forgetting_half_and_then_all_ends_as_forgetting_all(store: LoggedStore) -> None:
    told(store, one(P), one(Q))
    store.commit(Arrival(event=whole(R, P, Q)))
    (number,) = [event.id for event in everything(store) if event.uid == P]
    store.forget([number], run=uuid4(), at=at(0))
    assert [each.uid for each in store.tombstones()] == [P]

    assert forget(store, cues.everything()).events == 2
    assert list(store.tombstones()) == everything(store) == []
    assert store.statistics().forgotten == 3


def test_what_is_still_going_on_is_not_forgotten(store: LoggedStore) -> None:
    told(store, one(P, 0, None), one(Q))
    store.commit(Arrival(event=whole(R, P, Q)))

    assert numbers(forget(store, cues.everything())) == report(events=1, tombstones=1, still_open=2)
    assert store.close_event(P, at(7)).wholes == (R,)
    (closed,) = store.find(Query(cue=cues.uid(R)))
    assert closed.interval == span(0, 7)
    assert numbers(forget(store, cues.everything())) == report(events=2, dissolved=1)


def test_closing_counts_the_tombstones_of_parts(store: LoggedStore) -> None:
    told(store, one(P, 2, None), one(Q, 0, 9))
    store.commit(Arrival(event=whole(R, P, Q)))
    forget(store, [Q])
    store.close_event(P, at(5))

    (closed,) = store.find(Query(cue=cues.uid(R)))
    assert closed.interval == span(0, 9)
    with pytest.raises(ForgottenEvent, match=str(Q)):
        store.close_event(Q, at(9))


def test_unknown_uids_are_counted_and_nothing_is_nothing(store: LoggedStore) -> None:
    told(store, one(P))
    nothing = forget(store, [])
    assert numbers(nothing) == report()
    assert nothing.run is None
    assert numbers(forget(store, [NOBODY, NOBODY])) == report(unknown=1)
    assert numbers(forget(store, [P, P])) == report(events=1)
    assert numbers(forget(store, [P])) == report(unknown=1)
    assert store.forget([12_345], run=uuid4(), at=at(0)) == Forgotten() == store.would_forget([12_345])
    assert len(list(store.run_tombstones())) == 1


def test_a_uid_may_be_given_as_text(store: LoggedStore) -> None:
    told(store, one(P))
    assert numbers(forget(store, [str(P)])) == report(events=1)


@pytest.mark.parametrize("what", ["everything", 7, [7], [str(P)[:-1]], None])
def test_what_to_forget_is_a_cue_or_uids(store: LoggedStore, what: Any) -> None:
    told(store, one(P))
    with pytest.raises(InvalidValue, match="uid"):
        forget(store, what)
    with pytest.raises(InvalidValue, match="batch"):
        forget(store, [P], batch=0)
    assert len(everything(store)) == 1


# Committing again


def _commit(store: Store, *events: Event) -> None:
    for event in events:
        store.commit(Arrival(event=event))


def _commit_all(store: Store, *events: Event) -> None:
    store.commit_all([Arrival(event=event) for event in events])


def _commit_many(store: Store, *events: Event) -> None:
    others = [one(uuid4()) for _ in range(20)]
    store.commit_all([Arrival(event=event) for event in (*others, *events)])


WAYS: Mapping[str, Any] = {"commit": _commit, "commit_all": _commit_all, "many": _commit_many}


@pytest.mark.parametrize("way", WAYS)
def test_a_uid_that_still_counts_as_a_part_is_refused(store: LoggedStore, way: str) -> None:
    parts = one(P), one(Q)
    told(store, *parts)
    _commit(store, whole(R, P), whole(S, R, Q))
    forget(store, [P, Q, R])

    for event in (parts[1], one(Q, 5, 6), whole(R, P), whole(R, S)):
        held = everything(store)
        with pytest.raises(ForgottenEvent, match=str(event.uid)):
            WAYS[way](store, event)
        assert same_events(everything(store), held)
    loaded = store.load([Arrival(event=each) for each in (parts[1], one(T), whole(R, T))])
    assert (loaded.new, [refusal.index for refusal in loaded.refused]) == (1, [0, 2])
    for refusal, uid in zip(loaded.refused, (Q, R), strict=True):
        assert f"event {uid} was forgotten" in refusal.reason
    # P has no whole any more: it may come again.
    WAYS[way](store, parts[0])
    assert store.exists(cues.uid(P))


@pytest.mark.parametrize("way", [*WAYS, "load"])
def test_a_tombstone_still_counts_as_a_part_of_new_wholes(store: LoggedStore, way: str) -> None:
    told(store, one(P, 1, 2, region=HERE, agent="a"), one(Q, 4, 9, region=THERE, agent="a"))
    _commit(store, whole(R, P, Q))
    forget(store, [Q])
    over, top = whole(S, P, Q), whole(T, S, Q)
    if way == "load":
        assert store.load([Arrival(event=over), Arrival(event=top)]).new == 2
    else:
        WAYS[way](store, over, top)

    made = {event.uid: event for event in everything(store)}
    for uid in (S, T):
        assert made[uid].interval == span(1, 9)
        assert made[uid].region == Region.box(0, 0, 10, 4)
        assert made[uid].agent == "a"
    assert store.count(cues.parts("intersects", [Q])) == 3
    assert store.count(cues.parts("equal", [S, P, Q], transitive=True)) == 1
    # The same again changes nothing, as it was given and as it is now.
    for event in (over, top, made[S].as_event(), whole(R, P, Q), whole(R, Q, P)):
        assert not store.commit(Arrival(event=event)).new
        assert not store.commit_all([Arrival(event=event)])[0].new
        assert store.load([Arrival(event=event)]).existing == 1
    forget(store, [R, S])
    assert [each.uid for each in store.tombstones()] == [Q, S]
    forget(store, [T])
    assert list(store.tombstones()) == []


def test_a_part_that_is_gone_without_a_trace_is_unknown(store: LoggedStore) -> None:
    told(store, one(P), one(Q))
    forget(store, [P])
    with pytest.raises(UnknownEvent, match=str(P)):
        _commit(store, whole(R, P, Q))
    _commit(store, one(P, 3, 4), whole(R, P, Q))
    assert [event.uid for event in everything(store)] == [Q, P, R]


def test_ids_are_not_given_twice(store: LoggedStore) -> None:
    told(store, one(P), one(Q))
    before = ids_of(everything(store))
    forget(store, cues.everything())
    _commit(store, one(R))
    (number,) = ids_of(everything(store))
    assert number > max(before)


# The log


def test_entries_of_what_was_forgotten_keep_their_places(store: LoggedStore) -> None:
    told(store, one(P, agent="a"), one(Q, 0, None, agent="b"))
    store.close_event(Q, at(3))
    _commit(store, whole(R, P))
    forget(store, [P, Q])

    assert store.log.head() == 4
    kinds = [LogKind.COMMIT, LogKind.OPEN, LogKind.CLOSE, LogKind.COMMIT]
    entries = store.log.read(0, 10)
    assert [(entry.position, entry.kind, entry.agent) for entry in entries[:3]] == [
        (1, kinds[0], "a"),
        (2, kinds[1], "b"),
        (3, kinds[2], "b"),
    ]
    assert [entry.is_forgotten for entry in entries] == [True, True, True, False]


def test_subscriptions_pass_over_what_was_forgotten_and_count_it(store: LoggedStore) -> None:
    told(store, one(P), one(Q), one(R))
    forget(store, [P, R])

    assert [event.uid for event in subscribe(store, since=0, name="reader", timeout=0)] == [Q]
    known = store.log.consumer("reader")
    assert known is not None
    assert (known.position, known.report) == (3, {"forgotten": 2})
    _commit(store, one(S))
    assert [event.uid for event in subscribe(store, name="reader", timeout=0)] == [S]
    known = store.log.consumer("reader")
    assert known is not None
    assert known.report == {"forgotten": 2}


def test_an_answer_is_that_of_its_moment(store: LoggedStore) -> None:
    told(store, one(P), one(Q))
    _commit(store, whole(R, P, Q), whole(S, R))
    answer = store.find(Query(cue=cues.parts("superset", [P], transitive=True), order=Order.ID))
    first = next(answer)
    forget(store, cues.everything())
    assert [first.uid, *(event.uid for event in answer)] == [R, S]


# Tombstones of another memory


def _copied(source: LoggedStore, target: LoggedStore) -> None:
    target.add_types(list(source.types()))
    report = target.keep_tombstones([*source.run_tombstones(), *source.tombstones()])
    assert report.refused == ()
    arrivals = [Arrival(event=event.as_event(), recorded_at=event.recorded_at) for event in everything(source)]
    assert target.load(arrivals).new == len(arrivals)


@few_memories
@given(stories(), st.sets(st.sampled_from(UIDS)), st.lists(combined_cues(TYPE_NAMES), min_size=3, max_size=5))
def test_a_memory_with_tombstones_can_be_copied(
    store_factory: StoreFactory, memory: Story, gone: set[UUID], asked: list[Cue]
) -> None:
    source, target = store_factory(), store_factory()
    tell(source, memory)
    forget(source, gone)
    _copied(source, target)

    assert set(target.tombstones()) == set(source.tombstones())
    assert list(target.run_tombstones()) == list(source.run_tombstones())
    assert target.statistics().forgotten == source.statistics().forgotten
    there = {event.uid: event for event in everything(target)}
    for event in everything(source):
        copied = there.pop(event.uid)
        assert (copied.interval, copied.parts, set(copied.wholes)) == (event.interval, event.parts, set(event.wholes))
    assert not there
    for cue in asked:
        assert {event.uid for event in target.find(Query(cue=cue))} == {
            event.uid for event in source.find(Query(cue=cue))
        }
    again = target.keep_tombstones([*source.run_tombstones(), *source.tombstones()])
    assert (again.new, again.refused) == (0, ())


def test_tombstones_that_do_not_fit_are_refused(store: LoggedStore) -> None:
    told(store, one(P))
    run = uuid4()
    grave = Tombstone(uid=Q, interval=span(0, 1), region=HERE, run=run)
    rest = RunTombstone(run=run, at=at(0), events=3, interval=span(0, 1), regions=(HERE,), subjects=(THERE,))
    given_ones: list[Tombstone | RunTombstone] = [
        Tombstone(uid=P, interval=span(0, 5), run=run),
        grave,
        Tombstone(uid=Q, interval=span(0, 1), region=HERE, run=uuid4()),
        Tombstone(uid=Q, interval=span(0, 2), region=HERE, run=run),
        rest,
        rest,
        RunTombstone(run=run, at=at(0), events=4, interval=span(0, 1)),
    ]
    report = store.keep_tombstones(given_ones)

    # An event that is there counts for more than its tombstone elsewhere.
    assert (report.new, report.existing) == (2, 3)
    assert [refusal.index for refusal in report.refused] == [3, 6]
    assert str(Q) in report.refused[0].reason
    assert str(run) in report.refused[1].reason
    assert list(store.tombstones()) == [grave]
    assert list(store.run_tombstones()) == [rest]
    assert store.keep_tombstones([]).new == 0
    _commit(store, whole(R, P, Q))
    assert store.count(cues.parts("equal", [P, Q])) == 1
    with pytest.raises(ForgottenEvent):
        _commit(store, one(Q))
