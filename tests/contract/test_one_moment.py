"""Exports and joins while somebody forgets: what comes is the memory as it was at one moment, whole and in order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from uuid import UUID

from elm import cues
from elm.event import Event, StoredEvent
from elm.exporting import Exported, jsonl, with_parts
from elm.forgetting import forget
from elm.loading import RefusedLine, load_lines
from elm.log import LoggedStore
from elm.query import Join, JoinRelation, Query
from elm.recollector import Recollection
from elm.storage.memory import MemoryStore
from elm.store import Arrival, ForgettingCount
from elm.taxonomy import EventType
from elm.tombstone import RunTombstone
from elm.writer import Writer
from tests.clock import span

MANY = 1_500
"""More events than any store reads at a time."""
TYPES = [EventType(name="Atom"), EventType(name="Whole")]


def uid(number: int) -> UUID:
    return UUID(int=number)


def atoms(first: int, last: int) -> list[Event]:
    """Atoms with the uids from first to last, one a second."""
    return [Event(type="Atom", interval=span(10 * n, 10 * n + 1), uid=uid(n)) for n in range(first, last + 1)]


def whole(number: int, parts: Iterable[int]) -> Event:
    return Event(type="Whole", parts=[uid(part) for part in parts], uid=uid(number))


def keep(store: LoggedStore, events: Sequence[Event]) -> None:
    report = store.load([Arrival(event=event) for event in events])
    assert report.new == len(events)


def filled(store: LoggedStore, *wholes: Event) -> LoggedStore:
    """A memory of many atoms and these wholes, of which one atom was forgotten that left no tombstone."""
    store.add_types(TYPES)
    keep(store, [*atoms(1, MANY), *wholes])
    forget(store, [uid(MANY)])
    return store


def loaded(exported: Iterable[Exported]) -> tuple[MemoryStore, list[RefusedLine]]:
    """An empty memory that an export was loaded into, and what of it was refused."""
    copy, refused = MemoryStore(), list[RefusedLine]()
    copy.add_types(TYPES)
    load_lines(Writer(copy), jsonl(exported), refused=refused.append)
    return copy, refused


def names(exported: Iterable[Exported]) -> list[UUID]:
    return [each.run if isinstance(each, RunTombstone) else each.uid for each in exported]


def test_an_export_of_everything_is_of_one_moment(store: LoggedStore) -> None:
    lines = with_parts(Recollection(filled(store, whole(9_001, range(1, 1_400))), Query()))
    first = next(lines)
    assert isinstance(first, RunTombstone)
    done = forget(store, [uid(number) for number in range(1_200, 1_450)])
    assert (done.events, done.tombstones) == (250, 200)
    keep(store, atoms(8_001, 8_010))
    rest = list(lines)
    assert names(rest) == [*map(uid, range(1, MANY)), uid(9_001)]
    copy, refused = loaded(chain([first], rest))
    assert refused == []
    assert copy.count(cues.everything()) == MANY
    (known,) = copy.find(Query(cue=cues.uid(uid(9_001))))
    assert known.interval == span(10, 10 * 1_399 + 1)


def test_an_export_of_some_is_of_one_moment(store: LoggedStore) -> None:
    inner, outer = whole(9_001, range(1, 1_400)), whole(9_002, [9_001, 1_450])
    query = Query(cue=cues.uid(outer.uid))
    lines = with_parts(Recollection(filled(store, inner, outer), query))
    first = next(lines)
    forget(store, [uid(number) for number in (*range(1_200, 1_451), 9_001)])
    exported = [first, *lines]
    assert all(isinstance(each, StoredEvent) for each in exported)
    assert names(exported) == [*map(uid, range(1, 1_400)), uid(1_450), inner.uid, outer.uid]
    assert loaded(exported)[1] == []


def test_an_export_of_some_has_the_tombstones_of_its_moment(store: LoggedStore) -> None:
    over = filled(store, whole(9_001, range(1, 1_400)), whole(9_002, [1_450]))
    forget(store, [uid(3), uid(1_450)])
    lines = with_parts(Recollection(over, Query(cue=cues.uid(uid(9_001)))))
    first = next(lines)
    forget(store, [uid(9_001), uid(1_000)])
    exported = [first, *lines]
    assert names(exported) == [uid(3), uid(1), uid(2), *map(uid, range(4, 1_400)), uid(9_001)]
    assert loaded(exported)[1] == []
    assert names(store.tombstones()) == [uid(1_450)]


def test_an_export_that_is_left_off_leaves_the_memory_usable(store: LoggedStore) -> None:
    memory = filled(store, whole(9_001, range(1, 1_400)))
    for query in (Query(), Query(cue=cues.uid(uid(9_001)))):
        for taken in (0, 1, 2, 700):
            lines = with_parts(Recollection(memory, query))
            assert len([next(lines) for _ in range(taken)]) == taken
            del lines
    pairs = memory.join(Join(anchors=Query(), relation=JoinRelation.BEFORE, cue=cues.everything()))
    next(pairs)
    del pairs
    assert memory.count(cues.everything()) == MANY
    memory.close()


def test_exports_load_while_others_forget_and_commit(store: LoggedStore) -> None:
    store.add_types(TYPES)

    def live(rounds: int) -> None:
        """Remember rounds of eight atoms with two wholes above them, and forget of each round what is odd."""
        for base in range(100, 100 * (rounds + 1), 100):
            here = range(base + 1, base + 9)
            parts = atoms(here.start, here.stop - 1)
            keep(store, [*parts, whole(base + 50, here[:6]), whole(base + 60, [base + 50, *here[6:]])])
            forget(store, [uid(number) for number in here if number % 2])
            forget(store, [uid(base - 50), uid(base - 98)])

    with ThreadPoolExecutor(1) as pool:
        living = pool.submit(live, 25)
        while not living.done():
            for cue in (cues.everything(), cues.exactly("Whole")):
                assert loaded(with_parts(Recollection(store, Query(cue=cue))))[1] == []
        living.result()
    copy, refused = loaded(with_parts(Recollection(store, Query())))
    assert (refused, copy.forgetting_count()) == ([], store.forgetting_count())


def test_a_join_is_of_one_moment(store: LoggedStore) -> None:
    filled(store)
    found = store.join(Join(anchors=Query(), relation=JoinRelation.BEFORE, cue=cues.everything()))
    first = next(found)
    assert forget(store, [uid(number) for number in range(10, MANY, 2)]).events == 745
    pairs = [first, *found]
    assert [anchor.uid for anchor, _ in pairs] == [*map(uid, range(1, MANY))]
    assert [other and other.uid for _, other in pairs] == [None, *map(uid, range(1, MANY - 1))]


def test_joins_while_others_forget(store: LoggedStore) -> None:
    store.add_types(TYPES)
    keep(store, atoms(1, 600))

    def forgotten() -> Iterator[int]:
        for start in range(1, 600, 20):
            yield forget(store, [uid(number) for number in range(start, start + 10)]).events

    def asked() -> list[tuple[StoredEvent, StoredEvent | None]]:
        return list(store.join(Join(anchors=Query(), relation=JoinRelation.BEFORE, cue=cues.everything())))

    with ThreadPoolExecutor(1) as pool:
        forgetting = pool.submit(lambda: sum(forgotten()))
        while not forgetting.done():
            pairs = asked()
            assert [other for _, other in pairs] == [None, *(anchor for anchor, _ in pairs[:-1])]
        assert forgetting.result() == 300
    assert len(asked()) == 300


def test_how_often_and_how_much_was_forgotten(store: LoggedStore) -> None:
    store.add_types(TYPES)
    assert store.forgetting_count() == ForgettingCount(runs=0, events=0)
    keep(store, [*atoms(1, 5), whole(9_001, [1, 2])])
    forget(store, [uid(1), uid(4), uid(5)])
    assert store.forgetting_count() == ForgettingCount(runs=1, events=2)
    forget(store, [uid(2)])
    assert store.forgetting_count() == ForgettingCount(runs=2, events=2)
    forget(store, [uid(9_001)])
    assert store.forgetting_count() == ForgettingCount(runs=3, events=5)
