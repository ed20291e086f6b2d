"""Tests of event types: several parents, cycles, and the closure against brute force under random additions."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm.errors import CycleRefused, InvalidValue, UnknownType
from elm.taxonomy import EventType, Taxonomy


def kind(name: str, *parents: str) -> EventType:
    return EventType(name=name, parents=parents)


def robot_life() -> Taxonomy:
    return Taxonomy(
        [
            kind("Thing"),
            kind("Action", "Thing"),
            kind("Motion", "Thing"),
            kind("Grasp", "Action"),
            kind("Drive", "Motion"),
            kind("MobileGrasp", "Grasp", "Drive"),
            kind("Noise"),
        ]
    )


# Types


@pytest.mark.parametrize("name", ["", "a\x00b", "a\x1fb", "\ud800", "t" * 501, "é" * 251, None, 5, b"Type"])
def test_names_no_store_could_keep_are_refused(name: Any) -> None:
    with pytest.raises(InvalidValue, match="the name of an event type"):
        EventType(name=name)
    with pytest.raises(InvalidValue, match="a parent of event type 'Child'"):
        EventType(name="Child", parents=(name,))


@pytest.mark.parametrize("parents", ["Motion", "M", None, 5])
def test_parents_are_several_names_not_one_text(parents: Any) -> None:
    with pytest.raises(InvalidValue, match="parent"):
        EventType(name="Drive", parents=parents)


def test_a_parent_named_twice_counts_once_and_the_order_stays() -> None:
    assert kind("C", "B", "A", "B").parents == ("B", "A")


def test_names_are_told_apart_by_case_and_by_every_character() -> None:
    taxonomy = Taxonomy([kind("drive"), kind("Drive"), kind("Drive "), kind("é"), kind("e\u0301")])

    assert len(taxonomy) == 5


# The closure


def test_is_a_is_reflexive_and_follows_every_parent() -> None:
    taxonomy = robot_life()

    assert taxonomy.is_a("MobileGrasp", "MobileGrasp")
    assert taxonomy.ancestors("MobileGrasp") == {"MobileGrasp", "Grasp", "Action", "Drive", "Motion", "Thing"}
    assert taxonomy.descendants("Motion") == {"Motion", "Drive", "MobileGrasp"}
    assert not taxonomy.is_a("Thing", "Action")
    assert not taxonomy.is_a("Grasp", "Motion")
    assert not taxonomy.is_a("Noise", "Thing")


def test_an_unknown_type_is_an_error_that_names_it_on_either_side() -> None:
    taxonomy = robot_life()

    for ask in (
        lambda: taxonomy.is_a("Dance", "Thing"),
        lambda: taxonomy.is_a("Thing", "Dance"),
        lambda: taxonomy.ancestors("Dance"),
        lambda: taxonomy.descendants("Dance"),
        lambda: taxonomy.check("Dance"),
    ):
        with pytest.raises(UnknownType, match="'Dance'"):
            ask()
    assert "Dance" not in taxonomy
    assert "Thing" in taxonomy


def test_a_type_that_is_there_gains_parents_and_its_sub_types_with_it() -> None:
    taxonomy = robot_life()

    grown = taxonomy.add([kind("Drive", "Noise")])
    assert sorted(grown) == [("Noise", "Drive"), ("Noise", "MobileGrasp")]
    assert taxonomy.is_a("MobileGrasp", "Noise")
    assert taxonomy.is_a("MobileGrasp", "Motion")


def test_a_repeated_type_or_link_changes_nothing() -> None:
    taxonomy = robot_life()
    before = list(taxonomy)

    assert taxonomy.add([kind("Drive"), kind("Drive", "Motion"), kind("Drive", "Motion")]) == []
    assert list(taxonomy) == before


def test_a_link_that_the_closure_had_already_adds_no_closure_row() -> None:
    taxonomy = robot_life()

    assert taxonomy.add([kind("MobileGrasp", "Thing")]) == []
    assert next(found for found in taxonomy if found.name == "MobileGrasp").parents == ("Grasp", "Drive", "Thing")


def test_types_of_one_call_may_stand_in_any_order() -> None:
    taxonomy = Taxonomy()

    grown = taxonomy.add([kind("C", "B"), kind("B", "A"), kind("A")])
    assert sorted(grown) == [("A", "A"), ("A", "B"), ("A", "C"), ("B", "B"), ("B", "C"), ("C", "C")]


def test_one_call_may_name_a_type_in_several_lines() -> None:
    taxonomy = Taxonomy([kind("C", "A"), kind("A"), kind("C", "B"), kind("B")])

    assert taxonomy.ancestors("C") == {"A", "B", "C"}


# Refused, and then nothing happened


@pytest.mark.parametrize(
    ("batch", "error", "named"),
    [
        ([kind("X"), kind("Y", "Dance")], UnknownType, "'Dance'"),
        ([kind("X"), kind("Noise", "Noise")], CycleRefused, "'Noise' is a 'Noise'"),
        ([kind("X"), kind("Y", "Y")], CycleRefused, "'Y' is a 'Y'"),
        ([kind("X"), kind("Thing", "MobileGrasp")], CycleRefused, "'Thing'"),
        ([kind("X", "Y"), kind("Y", "Z"), kind("Z", "X")], CycleRefused, "'X'"),
        ([kind("X"), kind("Noise", "Drive"), kind("Motion", "Noise")], CycleRefused, "'Noise'"),
    ],
)
def test_a_refused_call_leaves_the_hierarchy_as_it_was(
    batch: list[EventType], error: type[Exception], named: str
) -> None:
    taxonomy = robot_life()
    before = {found.name: (found.parents, taxonomy.ancestors(found.name)) for found in taxonomy}

    with pytest.raises(error, match=named):
        taxonomy.add(batch)
    assert {found.name: (found.parents, taxonomy.ancestors(found.name)) for found in taxonomy} == before
    assert "X" not in taxonomy


def test_a_hierarchy_deeper_than_python_recurses_is_no_difficulty() -> None:
    depth = 1_200
    chain = [kind(str(level), *([str(level - 1)] if level else [])) for level in range(depth)]

    taxonomy = Taxonomy(reversed(chain))
    assert taxonomy.is_a(str(depth - 1), "0")
    assert [found.name for found in taxonomy] == [str(level) for level in range(depth)]
    with pytest.raises(CycleRefused):
        taxonomy.add([kind("0", str(depth - 1))])


# Against brute force

TYPES = [f"T{index}" for index in range(7)]
LINKS = st.lists(st.tuples(st.sampled_from(TYPES), st.sampled_from(TYPES)), max_size=6)


def _reachable(links: set[tuple[str, str]], start: str) -> set[str]:
    found, edge = {start}, [start]
    while edge:
        name = edge.pop()
        for child, parent in links:
            if child == name and parent not in found:
                found.add(parent)
                edge.append(parent)
    return found


def _has_cycle(links: set[tuple[str, str]]) -> bool:
    return any(child in _reachable(links, parent) for child, parent in links)


@given(st.lists(LINKS, max_size=8))
def test_the_closure_equals_brute_force_under_random_additions(batches: list[list[tuple[str, str]]]) -> None:
    taxonomy = Taxonomy([kind("T0")])
    known, links, closure = {"T0"}, set[tuple[str, str]](), {("T0", "T0")}

    for batch in batches:
        batch_types = [kind(child, parent) for child, parent in batch]
        children = {child for child, _ in batch}
        wanted = links | set(batch)
        missing = {parent for _, parent in batch} - known - children
        if missing:
            with pytest.raises(UnknownType):
                taxonomy.add(batch_types)
        elif _has_cycle(wanted):
            with pytest.raises(CycleRefused):
                taxonomy.add(batch_types)
        else:
            grown = taxonomy.add(batch_types)
            known, links = known | children, wanted
            now = {(ancestor, name) for name in known for ancestor in _reachable(links, name)}
            assert len(grown) == len(set(grown))
            assert set(grown) == now - closure
            closure = now

    assert {found.name for found in taxonomy} == known
    assert {(found.name, parent) for found in taxonomy for parent in found.parents} == links
    assert {(ancestor, name) for name in known for ancestor in taxonomy.ancestors(name)} == closure
    assert {(name, below) for name in known for below in taxonomy.descendants(name)} == closure
    assert all(taxonomy.is_a(name, other) == ((other, name) in closure) for name in known for other in known)
    seen: set[str] = set()
    for found in taxonomy:
        assert set(found.parents) <= seen
        seen.add(found.name)
