"""Tests of what is special to the store in this process: numbering, narrowing, snapshots, its log, and closing."""

from __future__ import annotations

import random
from collections.abc import Iterator, Set
from datetime import UTC, datetime, timedelta
from threading import Thread
from uuid import UUID, uuid5

import pytest

from elm import cues
from elm.cues.algebra import Cue
from elm.cues.match import match
from elm.cues.relations import Kin, Place, SetRelation
from elm.errors import (
    ConflictingContent,
    CycleRefused,
    ExtentRefused,
    InvalidValue,
    StoreClosed,
    UnknownEvent,
    UnknownType,
)
from elm.event import Event, Payload, StoredEvent
from elm.geometry import Region, SpatialRelation
from elm.interval import Interval
from elm.query import ByFeature, Cursor, Grouping, Join, JoinRelation, Nearest, Order, Query
from elm.storage.memory import MemoryStore
from elm.store import Arrival, Store
from elm.taxonomy import EventType

START = datetime(2026, 1, 1, 10, tzinfo=UTC)
SPACE = UUID("6ba7b810-9dad-11d1-80b4-00c04fd430c8")


def at(seconds: float) -> datetime:
    return START + timedelta(seconds=seconds)


def between(begin: float, end: float | None) -> Interval:
    return Interval(begin=at(begin), end=None if end is None else at(end))


def uid(name: str) -> UUID:
    return uuid5(SPACE, name)


def event(name: str, begin: float = 0, end: float | None = 1, **given: object) -> Event:
    return Event(type="Act", interval=between(begin, end), uid=uid(name), **given)  # type: ignore[arg-type]


def whole(name: str, *parts: str, **given: object) -> Event:
    return Event(type="Act", parts=map(uid, parts), uid=uid(name), **given)  # type: ignore[arg-type]


def arrivals(*events: Event) -> list[Arrival]:
    return [Arrival(event=event) for event in events]


def all_of(store: MemoryStore, cue: Cue) -> list[int]:
    return [found.id for found in store.find(Query(cue=cue, order=Order.ID))]


@pytest.fixture
def store() -> Iterator[MemoryStore]:
    store = MemoryStore()
    store.add_types([EventType(name="Act"), EventType(name="Move", parents=("Act",))])
    yield store
    store.close()


def test_it_fits_the_port() -> None:
    port: Store = MemoryStore("kitchen")
    assert port.memory == "kitchen"


# Writing


def test_ids_count_from_one_in_the_order_of_commit_and_parts_come_first(store: MemoryStore) -> None:
    top, middle, low, other = whole("top", "middle"), whole("middle", "low"), event("low"), event("other")
    committed = store.commit_all(arrivals(top, middle, low, other))
    assert [one.id for one in committed] == [3, 2, 1, 4]
    assert [one.uid for one in committed] == [top.uid, middle.uid, low.uid, other.uid]
    assert store.commit(Arrival(event=event("last"))).id == 5


def test_a_refused_call_leaves_no_trace(store: MemoryStore) -> None:
    with pytest.raises(UnknownEvent, match=str(uid("nobody"))):
        store.commit_all(arrivals(event("a"), whole("b", "a", "nobody")))
    with pytest.raises(UnknownType, match="'Fly'"):
        store.commit_all(arrivals(event("a"), Event(type="Fly", interval=between(0, 1))))
    with pytest.raises(ExtentRefused):
        store.commit_all(arrivals(event("a"), whole("b", "a", interval=between(0, 2))))
    with pytest.raises(CycleRefused, match="has part"):
        store.commit_all(arrivals(event("a"), whole("x", "y", "a"), whole("y", "z"), whole("z", "x"), whole("w", "x")))
    assert store.statistics().events == 0
    assert store.log.head() == 0
    assert store.commit(Arrival(event=event("a"))).id == 1


def test_the_same_uid_with_the_same_content_is_the_same_event(store: MemoryStore) -> None:
    first = store.commit(Arrival(event=event("a", features={"n": 1})))
    again = store.commit(Arrival(event=event("a", features=[("n", 1.0)])))
    assert (first.new, again.new, again.id) == (True, False, first.id)
    with pytest.raises(ConflictingContent, match=str(uid("a"))):
        store.commit(Arrival(event=event("a", features={"n": True})))
    assert store.log.head() == 1


def test_the_same_uid_twice_in_one_call(store: MemoryStore) -> None:
    first, again = store.commit_all(arrivals(event("a"), event("a")))
    assert (first.id, first.new, again.id, again.new) == (1, True, 1, False)
    with pytest.raises(ConflictingContent):
        store.commit_all(arrivals(event("b"), event("b", 0, 2)))
    assert uid("b") not in {found.uid for found in store.find(Query())}


def test_an_event_as_it_stands_now_is_the_same_content(store: MemoryStore) -> None:
    store.commit_all(arrivals(event("a", 0, None, agent="r"), whole("w", "a")))
    store.close_event(uid("a"), at(5))
    for stored in list(store.find(Query())):
        assert not store.commit(Arrival(event=stored.as_event())).new
    assert not store.commit(Arrival(event=event("a", 0, None, agent="r"))).new
    assert not store.commit(Arrival(event=whole("w", "a"))).new
    with pytest.raises(ConflictingContent):
        store.commit(Arrival(event=event("a", 0, 6, agent="r")))
    with pytest.raises(ConflictingContent):
        store.commit(Arrival(event=whole("w", "a", agent="s")))


def test_extents_and_agent_derive_from_the_parts(store: MemoryStore) -> None:
    store.commit_all(
        arrivals(
            event("a", 0, 4, region=Region.box(0, 0, 1, 1), agent="r"),
            event("b", 2, 3, region=Region.box(3, 0, 4, 1), subject=Region.box(9, 9, 10, 10), agent="r"),
            event("c", 1, 2, agent="s"),
            event("d", 1, 2, region=Region.box(0, 0, 1, 1, frame="lab")),
            whole("ab", "b", "a"),
            whole("abc", "a", "b", "c"),
            whole("ad", "a", "d", agent="t"),
            whole("cd", "c", "d"),
        )
    )
    found = {stored.uid: stored for stored in store.find(Query())}
    ab, abc, ad, cd = (found[uid(name)] for name in ("ab", "abc", "ad", "cd"))
    assert ab.interval == between(0, 4)
    assert ab.region == Region.box(0, 0, 4, 1)
    assert ab.subject == Region.box(9, 9, 10, 10)
    assert ab.parts == (uid("b"), uid("a"))
    assert [ab.agent, abc.agent, ad.agent, cd.agent] == ["r", None, "t", None]
    assert ad.region is None
    assert cd.region == Region.box(0, 0, 1, 1, frame="lab")
    assert found[uid("a")].wholes == (uid("ab"), uid("abc"), uid("ad"))


def test_given_extents_must_be_the_derived_ones(store: MemoryStore) -> None:
    store.commit_all(arrivals(event("a", 0, 4, region=Region.box(0, 0, 1, 1)), event("b", 0, None)))
    store.commit(Arrival(event=whole("w", "a", interval=between(0, 4), region=Region.box(0, 0, 1, 1 + 5e-7))))
    store.commit(Arrival(event=whole("v", "a", "b", interval=between(0, None))))
    for given in (
        {"region": Region.box(0, 0, 1, 1.1)},
        {"region": Region.box(0, 0, 1, 1, frame="lab")},
        {"subject": Region.box(0, 0, 1, 1)},
        {"interval": Interval(begin=at(0), end=at(4) + timedelta(microseconds=1))},
    ):
        with pytest.raises(ExtentRefused, match="Leave the"):
            store.commit(Arrival(event=whole("x", "a", **given)))


def test_load_keeps_what_can_be_kept(store: MemoryStore) -> None:
    store.commit(Arrival(event=event("known")))
    learned = datetime(2020, 1, 1, tzinfo=UTC)
    batch = [
        Arrival(event=event("a"), recorded_at=learned),
        Arrival(event=Event(type="Fly", interval=between(0, 1), uid=uid("fly"))),
        Arrival(event=whole("of fly", "a", "fly")),
        Arrival(event=whole("of that", "of fly")),
        Arrival(event=event("known", 5, 6)),
        Arrival(event=whole("of known", "known", "a")),
        Arrival(event=event("known")),
        Arrival(event=whole("early", "late")),
        Arrival(event=event("late")),
    ]
    report = store.load(batch)
    store.finish_load()
    assert (report.new, report.existing) == (3, 1)
    assert [refusal.index for refusal in report.refused] == [1, 2, 3, 4, 7]
    reasons = [refusal.reason for refusal in report.refused]
    assert "'Fly'" in reasons[0]
    assert "was refused" in reasons[1]
    assert "was refused" in reasons[2]
    assert str(uid("known")) in reasons[3]
    assert str(uid("late")) in reasons[4]
    stored = store.get([2])[0]
    assert (stored.uid, stored.recorded_at) == (uid("a"), learned)


def test_a_chain_of_wholes_ten_thousand_deep_in_one_call(store: MemoryStore) -> None:
    chain = [event("0", 0, None), *(whole(str(n), str(n - 1)) for n in range(1, 10_000))]
    store.commit_all(arrivals(*reversed(chain)))
    assert store.close_event(uid("0"), at(1)).wholes == tuple(one.uid for one in chain[1:])
    assert store.exists(cues.uid(uid("9999")) & cues.parts("superset", [uid("0")], transitive=True))


# Closing


def test_closing_ends_the_wholes_whose_last_open_part_it_was(store: MemoryStore) -> None:
    store.commit_all(
        arrivals(
            event("a", 0, None),
            event("b", 1, None),
            whole("wa", "a"),
            whole("wb", "b"),
            whole("top", "wa", "wb"),
            whole("side", "wa", agent="s"),
        )
    )
    first = store.close_event(uid("a"), at(9))
    assert first.new
    assert first.wholes == (uid("wa"), uid("side"))
    assert store.close_event(uid("b"), at(5)).wholes == (uid("wb"), uid("top"))
    (top,) = store.find(Query(cue=cues.uid(uid("top"))))
    assert top.interval == between(0, 9)
    again = store.close_event(uid("a"), at(9))
    assert (again.new, again.wholes) == (False, ())
    entries = store.log.read(0, 100)
    kinds = [(each.position, each.event.id, each.kind, each.agent) for each in entries[6:] if each.event]
    assert kinds == [
        (7, 1, "close", None),
        (8, 3, "close", None),
        (9, 6, "close", "s"),
        (10, 2, "close", None),
        (11, 4, "close", None),
        (12, 5, "close", None),
    ]
    assert [each.kind for each in entries[:6]] == ["open"] * 6
    assert all(each.at.tzinfo is UTC for each in entries)


def test_what_cannot_be_closed(store: MemoryStore) -> None:
    store.commit_all(arrivals(event("a", 5, None), event("b", 0, 1), whole("w", "a")))
    with pytest.raises(UnknownEvent):
        store.close_event(uid("nobody"), at(9))
    with pytest.raises(InvalidValue, match="derives"):
        store.close_event(uid("w"), at(9))
    with pytest.raises(InvalidValue, match="cannot end"):
        store.close_event(uid("b"), at(9))
    with pytest.raises(InvalidValue, match="before"):
        store.close_event(uid("a"), at(4))
    with pytest.raises(InvalidValue, match="naive"):
        store.close_event(uid("a"), datetime(2026, 1, 1))  # noqa: DTZ001 - a naive one is the point
    assert store.log.head() == 3
    assert store.close_event(uid("a"), at(5)).new


# Reading


class FullScan:
    """Surroundings that know nothing of indexes."""

    def __init__(self, events: list[StoredEvent]) -> None:
        self.events = {stored.uid: stored for stored in events}

    def is_a(self, name: str, ancestor: str) -> bool:
        return name == ancestor or (name, ancestor) == ("Move", "Act")

    def kin(self, uid: UUID, kin: Kin, *, transitive: bool) -> Set[UUID]:
        direct = set(self.events[uid].parts if kin is Kin.PARTS else self.events[uid].wholes)
        if not transitive:
            return direct
        return direct.union(*(self.kin(relative, kin, transitive=True) for relative in direct))


def random_events(chance: random.Random, count: int) -> list[Event]:
    found: list[Event] = []
    for number in range(count):
        if number > 5 and chance.random() < 0.3:
            parts = chance.sample([one.uid for one in found], chance.randint(1, 3))
            found.append(Event(type="Act", parts=parts, uid=uid(str(number))))
            continue
        x, y, begin = chance.randint(0, 8), chance.randint(0, 8), chance.randint(0, 20)
        box = Region.box(x, y, x + chance.randint(1, 3), y + 1, frame=chance.choice(["map", "lab"]))
        found.append(
            Event(
                type=chance.choice(["Act", "Move"]),
                interval=between(begin, chance.choice([None, begin, begin + 2])),
                region=chance.choice([None, box]),
                subject=chance.choice([None, box]),
                uid=uid(str(number)),
            )
        )
    return found


def random_cue(chance: random.Random, events: list[Event]) -> Cue:
    uids = [one.uid for one in chance.sample(events, chance.randint(0, 2))] + [uid("nobody")][: chance.randint(0, 1)]
    x, y = chance.randint(0, 8), chance.randint(0, 8)
    box = Region.box(x, y, x + chance.randint(1, 4), y + chance.randint(1, 4), frame=chance.choice(["map", "lab"]))
    relation = chance.choice(list(SetRelation))
    spatial = [place for place in SpatialRelation if place is not SpatialRelation.WITHIN_DISTANCE]
    return chance.choice(
        [
            cues.uid(*uids),
            cues.region(chance.choice(spatial), box),
            cues.subject(chance.choice(spatial), box),
            cues.within(chance.randint(0, 3), box),
            cues.parts(relation, uids, transitive=chance.random() < 0.5),
            cues.wholes(relation, uids, transitive=chance.random() < 0.5),
            cues.is_a(chance.choice(["Act", "Move"])),
            cues.time(relation, between(x, x + 5)),
        ]
    )


@pytest.mark.parametrize("seed", range(5))
def test_narrowing_by_indexes_loses_nothing(store: MemoryStore, seed: int) -> None:
    chance = random.Random(seed)
    events = random_events(chance, 60)
    store.commit_all(arrivals(*events))
    stored = list(store.find(Query()))
    assert len(stored) == 60
    scan = FullScan(stored)
    hits = 0
    for _ in range(400):
        cue = random_cue(chance, events)
        for _ in range(chance.randint(0, 2)):
            other = random_cue(chance, events)
            cue = chance.choice([cue & other, cue | other, cue & ~other])
        expected = [one for one in stored if match(cue, one, scan)]
        hits += len(expected)
        assert list(store.find(Query(cue=cue))) == expected
        assert [*store.ids(Query(cue=cue, order=Order.BEGIN_REVERSED))] == [one.id for one in reversed(expected)]
        assert store.count(cue) == len(expected)
        assert store.exists(cue) is bool(expected)
    assert hits > 1_000


def test_pages_begin_after_their_cursor_in_every_order(store: MemoryStore) -> None:
    store.commit_all(arrivals(event("a", 3, 3), event("b", 1, 1), event("c", 2, 2), event("d", 2, 9)))
    for order, expected in (
        (Order.BEGIN, [2, 3, 4, 1]),
        (Order.BEGIN_REVERSED, [1, 4, 3, 2]),
        (Order.ID, [1, 2, 3, 4]),
    ):
        for narrowing in (cues.everything(), cues.uid(uid("a"), uid("b"), uid("c"), uid("d"))):
            found: list[int] = []
            cursor: Cursor | None = None
            while page := list(store.find(Query(cue=narrowing, order=order, limit=1, after=cursor))):
                found.append(page[0].id)
                cursor = Cursor.after(page[0])
            assert found == expected
    assert list(store.find(Query(limit=0))) == []


def test_nearest_by_distance_then_id(store: MemoryStore) -> None:
    store.commit_all(
        arrivals(
            event("far", region=Region.box(7, 0, 8, 1)),
            event("nowhere"),
            event("left", region=Region.box(-3, 0, -2, 1)),
            event("right", region=Region.box(3, 0, 4, 1)),
            event("elsewhere", region=Region.box(0, 0, 1, 1, frame="lab")),
            event("about", subject=Region.box(0, 0, 1, 1)),
        )
    )
    here = Region.box(0, 0, 1, 1)
    assert [*store.ids(Query(order=Nearest(to=here)))] == [3, 4, 1]
    assert [*store.ids(Query(order=Nearest(to=here), limit=2))] == [3, 4]
    assert [*store.ids(Query(order=Nearest(to=here, place=Place.SUBJECT)))] == [6]
    assert [*store.ids(Query(cue=cues.uid(uid("nowhere")), order=Nearest(to=here)))] == []


def test_unknown_types_in_a_cue_are_refused_even_when_nothing_would_be_compared(store: MemoryStore) -> None:
    cue = cues.any_of() & ~(cues.agent("nobody") | cues.is_a("Fly"))
    for ask in (
        lambda: store.find(Query(cue=cue, limit=0)),
        lambda: store.ids(Query(cue=cue)),
        lambda: store.count(cue),
        lambda: store.exists(cue),
        lambda: store.groups(cue, Grouping.DAY),
        lambda: store.explain(Query(cue=cue)),
        lambda: store.join(Join(anchors=Query(), relation=JoinRelation.BEFORE, cue=cue)),
    ):
        with pytest.raises(UnknownType, match="'Fly'"):
            ask()


def test_an_answer_is_that_of_the_moment_it_was_asked_for(store: MemoryStore) -> None:
    store.commit_all(arrivals(event("a", 0, None), event("b")))
    cue = cues.wholes("equal", []) & cues.exactly("Act")
    answer = store.find(Query(cue=cue))
    typed = store.find(Query(cue=~cues.is_a("Move")))
    store.add_types([EventType(name="Act", parents=("Root",)), EventType(name="Root")])
    store.commit_all(arrivals(event("c"), whole("w", "a", "b")))
    store.close_event(uid("a"), at(7))
    first, second = answer
    assert (first.uid, first.interval.is_open, first.wholes) == (uid("a"), True, ())
    assert second.uid == uid("b")
    assert len(list(typed)) == 2
    assert store.count(cue) == 2


def test_groups_have_one_key_for_one_and_one_point_zero(store: MemoryStore) -> None:
    given = [{"k": 1}, {"k": 1.0}, {"k": "1"}, {"k": True}, {"k": 0.5}, {"k": False}, {}, [("k", "a"), ("k", 1)]]
    store.commit_all(arrivals(*(event(str(n), n, n + 2, features=pairs) for n, pairs in enumerate(given))))
    found = store.groups(cues.everything(), ByFeature(name="k"))
    assert [(type(group.key), group.key, group.count) for group in found] == [
        (bool, False, 1),
        (bool, True, 1),
        (float, 0.5, 1),
        (int, 1, 3),
        (str, "1", 1),
        (str, "a", 1),
        (type(None), None, 1),
    ]
    one = found[3]
    assert (one.duration, one.first_begin, one.last_end) == (timedelta(seconds=6), at(0), at(9))


def test_groups_by_time_agent_and_frame(store: MemoryStore) -> None:
    store.commit_all(
        arrivals(
            event("a", 0, None, agent="s", region=Region.box(0, 0, 1, 1)),
            event("b", 3600, 3601, agent="r"),
            event("c", 86400, 86401),
        )
    )
    every = cues.everything()
    by_agent = store.groups(every, Grouping.AGENT)
    assert [group.key for group in by_agent] == ["r", "s", None]
    assert (by_agent[1].duration, by_agent[1].last_end) == (timedelta(), None)
    assert [group.key for group in store.groups(every, Grouping.FRAME)] == ["map", None]
    midnight = datetime(2026, 1, 1, tzinfo=UTC)
    assert [group.key for group in store.groups(every, Grouping.DAY)] == [midnight, midnight + timedelta(days=1)]
    assert [group.key for group in store.groups(every, Grouping.HOUR)] == [at(0), at(3600), at(86400)]
    assert store.groups(cues.any_of(), Grouping.TYPE) == []


def test_joins_look_strictly_before_and_after(store: MemoryStore) -> None:
    here, there = Region.box(0, 0, 1, 1), Region.box(5, 5, 6, 6)
    store.commit_all(
        arrivals(
            event("long", 0, 3, region=here, agent="x"),
            event("short", 1, 2, region=there, agent="x"),
            event("ends at ten", 4, 10, agent="x"),
            event("open", 4, None, agent="x"),
            event("anchor", 10, 20, region=here),
            event("still on", 10, None),
            event("begins at twenty", 20, 21, agent="x"),
            event("later", 22, 23, region=there, agent="x"),
            event("latest", 24, 25, region=Region.box(1, 1, 2, 2), agent="x"),
        )
    )

    def neighbour(anchor: str, relation: JoinRelation, *, same_region: bool = False) -> UUID | None:
        anchors = Query(cue=cues.uid(uid(anchor)))
        join = Join(anchors=anchors, relation=relation, cue=cues.agent("x"), same_region=same_region)
        ((_, found),) = store.join(join)
        return None if found is None else found.uid

    assert neighbour("anchor", JoinRelation.BEFORE) == uid("short")
    assert neighbour("anchor", JoinRelation.BEFORE, same_region=True) == uid("long")
    assert neighbour("anchor", JoinRelation.AFTER) == uid("later")
    assert neighbour("anchor", JoinRelation.AFTER, same_region=True) == uid("latest")
    assert neighbour("still on", JoinRelation.AFTER) is None
    assert neighbour("still on", JoinRelation.BEFORE, same_region=True) is None
    assert neighbour("long", JoinRelation.BEFORE) is None


def test_explain_says_what_each_condition_keeps(store: MemoryStore) -> None:
    store.commit_all(
        arrivals(
            event("a", agent="r", region=Region.box(0, 0, 1, 1)),
            event("b", agent="r"),
            event("c", region=Region.box(1, 1, 2, 2)),
            event("d", region=Region.box(50, 50, 51, 51)),
        )
    )
    cue = cues.agent("r") & cues.region("intersects", Region.box(0, 0, 1, 1))
    explained = store.explain(Query(cue=cue))
    assert (explained.sql, explained.parameters, explained.events) == ("", {}, 4)
    assert explained.plan == "scan of 2 candidates"
    assert [(row.alone, row.left) for row in explained.conditions] == [(2, 2), (2, 1)]
    assert explained.conditions[0].condition == '{"op":"agent","agent":"r"}'
    assert store.explain(Query()).conditions == ()
    assert store.explain(Query(cue=cues.agent("r"), limit=1)).events == 4


def test_statistics(store: MemoryStore) -> None:
    empty = store.statistics()
    assert (empty.events, empty.types, empty.first_begin, empty.last_recorded_at) == (0, 2, None, None)
    learned = datetime(2026, 2, 1, tzinfo=UTC)
    parts = [event("a", agent="r", region=Region.box(0, 0, 1, 1)), event("b", 3, None, subject=Region.box(0, 0, 1, 1))]
    store.commit_all([Arrival(event=one, recorded_at=learned) for one in (*parts, whole("w", "a", "b"))])
    found = store.statistics()
    assert (found.events, found.complex_events, found.open_events, found.links) == (3, 1, 2, 2)
    assert (found.types, found.frames, found.agents, found.bytes) == (2, 1, 1, None)
    assert (found.first_begin, found.last_begin, found.last_recorded_at) == (at(0), at(3), learned)


def test_types_added_are_counted(store: MemoryStore) -> None:
    added = store.add_types([EventType(name="Run", parents=("Move",)), EventType(name="Move", parents=("Act",))])
    assert (added.types, added.links, added.closure) == (1, 1, 3)
    assert [one.name for one in store.types()] == ["Act", "Move", "Run"]
    with pytest.raises(CycleRefused):
        store.add_types([EventType(name="New", parents=("Act",)), EventType(name="Act", parents=("Run",))])
    assert store.statistics().types == 3


def test_get_by_id_leaves_out_what_is_unknown(store: MemoryStore) -> None:
    store.commit_all(arrivals(event("a"), event("b", payload=Payload(data=b""))))
    assert [one.id for one in store.get([2, 99, 1, 2])] == [1, 2]


# Threads, and the end


def test_threads_share_a_store(store: MemoryStore) -> None:
    def write(name: str) -> None:
        for number in range(50):
            store.commit_all(arrivals(event(f"{name}{number}"), whole(f"w{name}{number}", f"{name}{number}")))

    torn: list[int] = []

    def read() -> None:
        for _ in range(50):
            found = list(store.find(Query(cue=cues.parts("subset", [], transitive=True), order=Order.ID)))
            torn.append(sum(one.wholes == () for one in found))

    threads = [Thread(target=write, args=(name,)) for name in "abc"] + [Thread(target=read)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert torn == [0] * 50
    entries = store.log.read(0, 1_000)
    assert [each.position for each in entries] == list(range(1, 301))
    assert [each.event.id for each in entries if each.event] == list(range(1, 301))


def test_after_close_every_call_is_refused(store: MemoryStore) -> None:
    store.close()
    store.close()
    every = cues.everything()
    for call in (
        lambda: store.add_types([]),
        lambda: store.types(),
        lambda: store.commit(Arrival(event=event("a"))),
        lambda: store.commit_all([]),
        lambda: store.load([]),
        lambda: store.finish_load(),
        lambda: store.close_event(uid("a"), at(1)),
        lambda: store.find(Query()),
        lambda: store.ids(Query()),
        lambda: store.count(every),
        lambda: store.exists(every),
        lambda: store.groups(every, Grouping.TYPE),
        lambda: store.join(Join(anchors=Query(), relation=JoinRelation.AFTER, cue=every)),
        lambda: store.get([1]),
        lambda: store.explain(Query()),
        lambda: store.arrow(Query()),
        lambda: store.statistics(),
    ):
        with pytest.raises(StoreClosed, match="elm"):
            call()
