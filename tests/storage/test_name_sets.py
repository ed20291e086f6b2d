"""Sets of feature names are found as whole sets by an index, and by names alone where the cue has too many."""

from __future__ import annotations

import random
from datetime import timedelta

import pytest

import elm
from elm import cues
from elm.cues.relations import SetRelation
from elm.event import Event
from elm.interval import Interval
from elm.query import Query
from elm.storage import recall_statements
from elm.storage.postgres import PostgresStore
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


@pytest.mark.parametrize("most", [0, 1, 2, 5, 8, 9, 13])
def test_equal_and_subset_of_names_are_those_of_sets(dsn: str, most: int) -> None:
    chance = random.Random(most)
    known = [frozenset[str](), *_names(chance, range(1, min(most + 3, len(NAMES))))]
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
            ):
                cue = cues.feature_names(relation, [*given])
                for limit in (None, 5):
                    found = [
                        int((event.interval.begin - at(0)).total_seconds()) for event in memory.recall(cue, limit=limit)
                    ]
                    assert found == [number for number, is_so in enumerate(expected) if is_so][:limit]
                others = memory.recall(~cue).count()
                assert others == expected.count(False)


@pytest.mark.parametrize(("number", "by_sets"), [(0, True), (8, True), (9, False)])
def test_up_to_eight_names_their_subsets_are_looked_for(dsn: str, number: int, by_sets: bool) -> None:
    store = PostgresStore(dsn, MEMORY)
    store.add_types([])
    cue = cues.feature_names("subset", [f"name-{index}" for index in range(number)])
    text, _ = store._session.asked("ids", Query(cue=cue), recall_statements.find_ids)
    assert ("hash_array" in text) is by_sets
    store.close()
