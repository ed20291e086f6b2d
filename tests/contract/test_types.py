"""Types of a memory: added at any time, in any order, whole calls or nothing, and events follow."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.errors import CycleRefused, UnknownType
from elm.event import Event
from elm.query import Query
from elm.store import Arrival, Store, TypesAdded
from elm.taxonomy import EventType, Taxonomy
from tests.clock import span
from tests.conftest import StoreFactory
from tests.contract.telling import few_memories
from tests.strategies import TYPE_NAMES


def kind(name: str, *parents: str) -> EventType:
    return EventType(name=name, parents=parents)


def links(store: Store) -> set[tuple[str, str]]:
    return {(event_type.name, parent) for event_type in store.types() for parent in event_type.parents}


def names(store: Store) -> list[str]:
    return [event_type.name for event_type in store.types()]


def test_types_are_added_with_all_they_are_a_kind_of(store: Store) -> None:
    added = store.add_types([kind("C", "A", "B"), kind("B", "A"), kind("A")])

    # The closure: each of itself, B and C of A, C of B.
    assert added == TypesAdded(types=3, links=3, closure=6)
    assert names(store) == ["A", "B", "C"]
    assert links(store) == {("C", "A"), ("C", "B"), ("B", "A")}


def test_no_types_are_added_as_nothing(store: Store) -> None:
    assert store.add_types([]) == TypesAdded(types=0, links=0, closure=0)
    assert names(store) == []


def test_what_is_there_is_not_added_again(store: Store) -> None:
    store.add_types([kind("A"), kind("B", "A")])

    assert store.add_types([kind("A"), kind("B", "A"), kind("B")]) == TypesAdded(types=0, links=0, closure=0)
    assert store.add_types([kind("B"), kind("C", "B"), kind("C", "B")]) == TypesAdded(types=1, links=1, closure=3)
    assert store.add_types([kind("C", "A")]) == TypesAdded(types=0, links=1, closure=0)


def test_events_follow_when_their_type_gains_a_parent(store: Store) -> None:
    store.add_types([kind("Drive"), kind("Row", "Drive")])
    store.commit(Arrival(event=Event(type="Row", interval=span(0, 1))))
    store.add_types([kind("Motion")])
    assert not store.exists(cues.is_a("Motion"))

    store.add_types([kind("Drive", "Motion")])
    assert store.count(cues.is_a("Motion")) == 1
    assert store.count(cues.exactly("Motion")) == 0
    assert [event.type for event in store.find(Query(cue=cues.is_a("Motion")))] == ["Row"]


@pytest.mark.parametrize(
    ("batch", "error", "named"),
    [
        ([kind("X"), kind("Y", "Dance")], UnknownType, "'Dance'"),
        ([kind("X"), kind("Y", "Y")], CycleRefused, "'Y'"),
        ([kind("X"), kind("A", "C")], CycleRefused, "'A'"),
        ([kind("X", "Y"), kind("Y", "Z"), kind("Z", "X")], CycleRefused, "'X'"),
        ([kind("X", "C"), kind("A", "X")], CycleRefused, "'A'"),
    ],
)
def test_a_refused_call_adds_nothing(store: Store, batch: list[EventType], error: type[Exception], named: str) -> None:
    store.add_types([kind("A"), kind("B", "A"), kind("C", "B")])
    before = list(store.types())

    with pytest.raises(error, match=named):
        store.add_types(batch)
    assert list(store.types()) == before
    assert store.statistics().types == 3
    with pytest.raises(UnknownType, match="'X'"):
        store.commit(Arrival(event=Event(type="X", interval=span(0, 1))))


def test_a_deep_and_wide_hierarchy_is_a_whole(store: Store) -> None:
    depth = 60
    chain = [kind(f"T{level}", *([f"T{level - 1}"] if level else [])) for level in range(depth)]
    leaves = [kind(f"Leaf{number}", f"T{depth - 1}") for number in range(40)]

    added = store.add_types([*reversed(leaves), *reversed(chain)])
    assert added == TypesAdded(types=100, links=99, closure=depth * (depth + 1) // 2 + 40 * (depth + 1))
    store.commit_all([Arrival(event=Event(type=leaf.name, interval=span(0, 1))) for leaf in leaves])
    assert store.count(cues.is_a("T0")) == 40
    assert store.count(cues.is_a(f"T{depth - 1}")) == 40
    assert store.count(cues.exactly("T0")) == 0


@few_memories
@given(
    st.lists(
        st.lists(st.tuples(st.sampled_from(TYPE_NAMES), st.sampled_from(TYPE_NAMES)), min_size=1, max_size=4),
        max_size=6,
    )
)
def test_random_additions_end_like_the_taxonomy(
    store_factory: StoreFactory, batches: list[list[tuple[str, str]]]
) -> None:
    """`Taxonomy` is itself judged by brute force in its own tests."""
    store, taxonomy = store_factory(), Taxonomy([kind("Thing")])
    store.add_types([kind("Thing")])

    for batch in batches:
        types = [kind(child, parent) for child, parent in batch]
        before = list(taxonomy)
        try:
            grown = taxonomy.add(types)
        except (CycleRefused, UnknownType) as error:
            with pytest.raises(type(error)):
                store.add_types(types)
        else:
            added = store.add_types(types)
            new_links = sum(len(each.parents) for each in taxonomy) - sum(len(each.parents) for each in before)
            assert added == TypesAdded(types=len(taxonomy) - len(before), links=new_links, closure=len(grown))
    assert links(store) == {(each.name, parent) for each in taxonomy for parent in each.parents}
    seen: set[str] = set()
    for event_type in store.types():
        assert set(event_type.parents) <= seen
        seen.add(event_type.name)
    for number, name in enumerate(sorted(seen)):
        store.commit(Arrival(event=Event(type=name, interval=span(number, number))))
    for ancestor in seen:
        recalled = {event.type for event in store.find(Query(cue=cues.is_a(ancestor)))}
        assert recalled == taxonomy.descendants(ancestor)
