"""Sets of feature names are found as whole sets and by their size, and by names alone where that would not pay."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence
from datetime import timedelta
from operator import and_

import pytest

import elm
from elm import cues
from elm.cues.relations import SetRelation
from elm.event import Event
from elm.interval import Interval
from elm.query import Query
from elm.storage import recall_statements
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from elm.taxonomy import EventType
from tests.clock import at
from tests.servers import MEMORY

NAMES = [
    "b",
    " ",
    "\x01",
    "\x7f",
    "B",
    "a",
    "a ",
    "a'b",
    "{a,b}",
    "NULL",
    "\u00e4",
    "a\u0308",
    "\U0001f916",
    "long" * 100,
    "long" * 99,
]
"""Names that are alike, that arrays and literals quote, and that are kept as their digest."""


def _names(chance: random.Random, sizes: range) -> list[frozenset[str]]:
    return [frozenset(chance.sample(NAMES, size)) for size in sizes for _ in range(12)]


@pytest.mark.parametrize("most", [0, 1, 2, 5, 8, 9, 13, len(NAMES)])
def test_relations_of_names_are_those_of_sets(dsn: str, most: int) -> None:
    chance = random.Random(most)
    known = [frozenset[str](), *_names(chance, range(1, min(most + 3, len(NAMES)))), frozenset(NAMES)]
    asked = [frozenset(chance.sample(NAMES, most)) for _ in range(6)] + [each for each in known if len(each) == most]
    with elm.connect(dsn, MEMORY) as memory:
        memory.add_type("Seen")
        for number, names in enumerate(known):
            moment = Interval.at(at(0) + timedelta(seconds=number))
            memory.commit(Event(type="Seen", interval=moment, features=[(name, number) for name in names]))
        for given in asked:
            for relation, expected in (
                (SetRelation.EQUAL, [names == given for names in known]),
                (SetRelation.SUBSET, [names <= given for names in known]),
                (SetRelation.SUPERSET, [names >= given for names in known]),
                (SetRelation.DISJOINT, [not names & given for names in known]),
            ):
                cue = cues.feature_names(relation, [*given])
                for limit in (None, 5):
                    found = [
                        int((event.interval.begin - at(0)).total_seconds()) for event in memory.recall(cue, limit=limit)
                    ]
                    assert found == [number for number, is_so in enumerate(expected) if is_so][:limit]
                others = memory.recall(~cue).count()
                assert others == expected.count(False)
                both = cue & ~cues.feature_names("disjoint", NAMES[:4])
                shared = [not names.isdisjoint(NAMES[:4]) for names in known]
                assert memory.recall(both).count() == sum(map(and_, expected, shared))


@pytest.mark.parametrize(("number", "by_sets"), [(0, True), (8, True), (9, False)])
def test_up_to_eight_names_their_subsets_are_looked_for(dsn: str, number: int, by_sets: bool) -> None:
    store = PostgresStore(dsn, MEMORY)
    store.add_types([])
    cue = cues.feature_names("subset", [f"name-{index}" for index in range(number)])
    text, _ = store._session.asked("ids", Query(cue=cue), recall_statements.find_ids)
    assert ("hash_array" in text) is by_sets
    store.close()


# Which index is asked


WORDS = [f"word-{number}" for number in range(50)]
EVENTS = 4_000


def _filled(dsn: str, sets: Sequence[frozenset[str]]) -> PostgresStore:
    """A memory of one event for each set of names."""
    store = PostgresStore(dsn, MEMORY)
    store.add_types([EventType(name="Seen")])
    events = [
        Event(
            type="Seen",
            interval=Interval.at(at(0) + timedelta(seconds=number)),
            features=[(name, number) for name in names],
        )
        for number, names in enumerate(sets)
    ]
    assert store.load([Arrival(event=event) for event in events]).new == len(sets)
    return store


def _gather_statistics(store: PostgresStore) -> None:
    with store._connections.writing() as connection:
        connection.execute("VACUUM (ANALYZE) event")


def _found(store: PostgresStore, sets: Sequence[frozenset[str]], given: frozenset[str]) -> set[str]:
    """Asks for what holds the names, looks whether that is right, and tells which indexes on names were asked."""
    query = Query(cue=cues.feature_names("superset", [*given]))
    assert [*store.ids(query)] == [number for number, names in enumerate(sets, 1) if names >= given]
    text, values = store._session.asked("ids", query, recall_statements.find_ids)
    with store._connections.recalling() as connection:
        plan = str(connection.execute(f"EXPLAIN {text}", values).fetchall())
    return set(re.findall("event_feature_names_(?:set_)?idx", plan))


def test_what_holds_as_many_names_as_any_event_has_is_found_as_a_whole_set(dsn: str) -> None:
    """The lists of events that the inverted index has of each name would grow with the memory."""
    chance = random.Random(5)
    sets = [frozenset(chance.sample(WORDS, 5)) for _ in range(EVENTS)]
    store = _filled(dsn, sets)
    _gather_statistics(store)
    for given in sets[:20]:
        assert _found(store, sets, given) == {"event_feature_names_set_idx"}
    assert _found(store, sets, frozenset(WORDS[:6])) == {"event_feature_names_set_idx"}
    # All events are as large as these or larger.
    assert _found(store, sets, frozenset(WORDS[:2])) == {"event_feature_names_idx"}
    store.close()


@pytest.mark.parametrize("known", [False, True], ids=["without statistics", "with statistics"])
def test_what_holds_some_names_is_found_whatever_the_sizes(dsn: str, known: bool) -> None:
    chance = random.Random(10)
    sets = [frozenset(chance.sample(WORDS, chance.randint(1, 10))) for _ in range(EVENTS)]
    store = _filled(dsn, sets)
    if known:
        _gather_statistics(store)
    for number in (1, 2, 3, 5, 9, 10, 11):
        wide = [names for names in sets if len(names) >= number]
        for _ in range(5):
            given = chance.choice(wide) if wide else frozenset(WORDS)
            assert _found(store, sets, frozenset(chance.sample(sorted(given), number)))
    store.close()
