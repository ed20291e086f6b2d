"""Whatever first looks answer, and whichever leave it to the next, the answer is that of a full scan."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import timedelta
from itertools import count, product
from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.app import Memory
from elm.cues.algebra import Cue
from elm.event import Event
from elm.features import FeatureValue
from elm.geometry import Region
from elm.interval import Interval
from elm.query import Cursor, Order, Query
from elm.storage import first_look
from elm.storage.first_look import AT_ONCE, Look
from elm.storage.postgres import PostgresStore
from tests.clock import at
from tests.contract.telling import few_memories, tell
from tests.contract.test_recall import ordered
from tests.model import ids_of, same_events
from tests.servers import Server
from tests.strategies import TYPE_NAMES, Story, combined_cues, single_cues, stories

SOME_CUES = st.lists(single_cues(TYPE_NAMES) | combined_cues(TYPE_NAMES), min_size=4, max_size=8)
STEPS = st.fixed_dictionaries(
    {
        "FEW": st.integers(0, 3),
        "SOME": st.integers(0, 3),
        "MANY": st.integers(0, 4),
        "PEEK": st.integers(0, 3),
        "GLANCE": st.integers(1, 3),
        "GLANCE_FACTOR": st.just(1),
        "WALK": st.integers(1, 4),
        "FAR": st.integers(1, 2),
    }
)
"""How far looks go: so little that in a memory of a few events each falls short sometimes."""


@contextmanager
def going(steps: Mapping[str, int]) -> Iterator[list[Look]]:
    """Have looks go only so far, and note which are taken."""
    taken: list[Look] = []
    is_worth = first_look.is_worth

    def noted(look: Look, seen: int) -> bool:
        taken.extend([look] if is_worth(look, seen) else [])
        return is_worth(look, seen)

    with pytest.MonkeyPatch.context() as patched:
        for name, value in steps.items():
            patched.setattr(first_look, name, value)
        patched.setattr(first_look, "is_worth", noted)
        yield taken


def test_a_look_for_few_is_not_that_for_many(new_store: Callable[[], PostgresStore]) -> None:
    """Both have a limit, and the same conditions; the one sees first whether the next events are what is wanted."""
    store = new_store()
    store.add_types([])
    for limit in (AT_ONCE + 1, 5, AT_ONCE + 1, None, 5):
        assert list(store.find(Query(cue=cues.agent("robot"), limit=limit))) == []
    texts = [key for key in store._session.statements._texts if Look.AT_FEW in key]
    assert len(texts) == 3


@pytest.fixture(scope="module")
def new_store(postgres_server: Server) -> Iterator[Callable[[], PostgresStore]]:
    opened: list[PostgresStore] = []
    numbers = count()
    with postgres_server.database() as dsn:

        def make() -> PostgresStore:
            opened.append(PostgresStore(dsn, f"looked_{next(numbers)}"))
            return opened[-1]

        yield make
        for each in opened:
            each.close()


@few_memories
@given(stories(max_events=12), SOME_CUES, STEPS, st.none() | st.integers(0, 6))
def test_looks_that_fall_short_leave_the_answer_to_the_next(
    new_store: Callable[[], PostgresStore],
    told: Story,
    asked: list[Cue],
    steps: dict[str, int],
    limit: int | None,
) -> None:
    store = new_store()
    model = tell(store, told)
    with going(steps):
        for cue, order in product(asked, Order):
            expected = ordered(model.scan(cue), order)
            query = Query(cue=cue, order=order, limit=limit)
            assert same_events(list(store.find(query)), expected[:limit])
            assert list(store.ids(query)) == ids_of(expected)[:limit]
            for event in expected[:3]:
                behind = expected[expected.index(event) + 1 :][:limit]
                after = Query(cue=cue, order=order, limit=limit, after=Cursor.after(event))
                assert ids_of(list(store.find(after))) == list(store.ids(after)) == ids_of(behind)
    store.close()


# Which looks are taken, until one answers


@pytest.fixture(scope="module")
def day(new_store: Callable[[], PostgresStore]) -> PostgresStore:
    """A thousand events, one a second: six far away, one in ten with a mark of its own, every other with a tick."""
    store = new_store()
    memory = Memory(store)
    memory.add_type("Seen")
    memory.add_type("Found", "Seen")
    memory.add_type("Lost", "Seen")
    memory.load(_seen(number) for number in range(1_000))
    return store


def _seen(number: int) -> Event:
    marked, far = number % 10 == 0, 5 <= number % 500 < 8
    even = number % 2 == 0
    features: dict[str, FeatureValue] = {"tick": even, "side": "left" if even else "right"}
    if marked:
        features["mark"] = number
    return Event(
        type="Lost" if far else "Found",
        interval=Interval.at(at(0) + timedelta(seconds=number)),
        region=Region.around(40 if far else 0, 0, 1),
        features=features,
        agent="visitor" if number == 700 else "robot",
    )


_HERE, _THERE = cues.region("intersects", Region.around(0, 0, 1)), cues.region("intersects", Region.around(40, 0, 1))
_FEW, _ORDER, _ALONG = Look.AT_FEW, Look.IN_ORDER, Look.ALONG_INDEX
_PLAN, _LISTS = Look.BY_PLAN, Look.BY_LISTS
_TICKS = cues.features("superset", {"tick": True})
_NEVER_TOGETHER = cues.features("superset", {"tick": True, "side": "right"})
_HOUR = cues.time("subset", at(0), at(0) + timedelta(hours=1))


@pytest.mark.parametrize(
    ("cue", "limit", "taken", "is_answered"),
    [
        (cues.everything(), 10, [_ORDER], True),
        (cues.everything(), None, [], False),
        (cues.everything(), AT_ONCE + 1, [], False),
        # A few: seen from an index.
        (_THERE, None, [_FEW], True),
        (_THERE, 2, [_FEW], True),
        (cues.agent("visitor"), 1, [_FEW], True),
        (cues.agent("nobody"), None, [_FEW], True),
        (cues.exactly("Lost"), None, [_FEW], True),
        # One index after the other, whichever of the conditions has few.
        (_HERE & cues.agent("visitor"), None, [_FEW], True),
        (cues.agent("visitor") & _HERE, None, [_FEW], True),
        (_HOUR & cues.agent("robot") & _THERE, 3, [_FEW], True),
        # Too many: as many as are wanted are met in order, at once if they are few.
        (_HERE, None, [_FEW], False),
        (_HERE, 10, [_FEW], True),
        (_HERE, 21, [_FEW, _ORDER], True),
        (_HERE, AT_ONCE + 1, [_FEW], False),
        (_HERE & _HOUR & cues.agent("robot"), 50, [_FEW, _ORDER], True),
        (cues.is_a("Seen"), 10, [_ORDER], True),
        (_TICKS, 10, [_ORDER], True),
        (~cues.agent("visitor"), 10, [_ORDER], True),
        # Only far ahead, as the planner finds out.
        (cues.feature("mark", "=", 700), 10, [_ORDER, _LISTS], True),
        (cues.feature("mark", "=", 701), 10, [_ORDER, _LISTS], True),
        (_NEVER_TOGETHER, 10, [_ORDER, _LISTS], True),
        (_NEVER_TOGETHER & cues.is_a("Seen"), 10, [_ORDER, _LISTS], True),
        (cues.features("superset", {"tick": True, "mark": 10}), 100, [_ORDER], False),
        (cues.is_a("Lost") & cues.lasting(">", timedelta(seconds=1)), 10, [_ORDER, _PLAN], True),
        # Nothing of the kind: some here and there.
        (cues.feature_names("superset", ["mark"]), 100, [_ORDER], True),
        (cues.lasting(">", timedelta(seconds=1)), 10, [_ORDER], False),
        # To judge one event takes all relatives of those named.
        (~cues.parts("intersects", [UUID(int=7)]), 10, [], False),
        (_THERE & ~cues.parts("intersects", [UUID(int=7)]), 10, [_FEW], True),
        (~cues.parts("subset", [UUID(int=7)]), 10, [_ORDER], False),
        # An index has them in order, or there is a plan that is good for whatever is named.
        (cues.exactly("Found"), 10, [_ALONG], True),
        (cues.exactly("Found"), None, [_FEW], False),
    ],
    ids=lambda value: "",
)
def test_looks_are_taken_until_one_answers(
    day: PostgresStore, cue: Cue, limit: int | None, taken: list[Look], is_answered: bool
) -> None:
    query = Query(cue=cue, limit=limit)
    with going({}) as found:
        answer = day._session.look("ids", query, lambda e: [e.c.id])
    assert found == taken
    assert (answer is not None) is is_answered


@pytest.mark.parametrize("cue", [_NEVER_TOGETHER, _NEVER_TOGETHER & cues.is_a("Seen")], ids=["alone", "of a type"])
def test_what_is_never_together_is_not_looked_for_in_all_events(day: PostgresStore, cue: Cue) -> None:
    """Each of the two is in half of the events, so that the planner expects a quarter of all."""
    explained = day.explain(Query(cue=cue, limit=10))
    assert "Bitmap Index Scan on event_feature_tokens_idx" in explained.plan
    assert "Seq Scan on event" not in explained.plan
    assert "event_begin_id_idx" not in explained.plan
