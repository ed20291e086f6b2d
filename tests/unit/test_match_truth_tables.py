"""Tests of `match` by the hand-made truth tables, and of the tables: no two relations of a family look alike."""

from __future__ import annotations

from itertools import combinations

import pytest
from hypothesis import given

from elm import cues
from elm.cues.match import match
from elm.cues.relations import Comparison, Kin, SetRelation, TypeRelation
from elm.geometry import SpatialRelation
from elm.interval import AllenRelation
from tests.model import Model, ids_of
from tests.strategies import CUE_CLASSES, PAPER_CLASSES, TYPE_NAMES, Story, combined_cues, stories
from tests.truth_tables import TABLES, Row, Table

BY_FAMILY = {table.family: table for table in TABLES}
EVERY_ROW = [(table, row) for table in TABLES for row in table.rows]
IN_TIME = {*SetRelation, *AllenRelation}


@pytest.mark.parametrize(("table", "row"), EVERY_ROW, ids=[f"{table.family}: {row.why}" for table, row in EVERY_ROW])
def test_match_says_what_the_table_says(table: Table, row: Row) -> None:
    model = Model(table.types, table.arrivals)
    event = model.stored(row.event)

    assert {relation for relation, cue in row.asked.items() if match(cue, event, model)} == row.holds


@pytest.mark.parametrize(("table", "row"), EVERY_ROW, ids=[f"{table.family}: {row.why}" for table, row in EVERY_ROW])
def test_a_negation_is_true_where_the_relation_is_not(table: Table, row: Row) -> None:
    model = Model(table.types, table.arrivals)
    event = model.stored(row.event)

    assert {relation for relation, cue in row.asked.items() if not match(~cue, event, model)} == row.holds


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.family)
def test_every_two_relations_of_a_family_are_told_apart_by_some_row(table: Table) -> None:
    for one, other in combinations(table.relations, 2):
        told_apart = any(
            (one in row.holds) != (other in row.holds) for row in table.rows if {one, other} <= row.asked.keys()
        )
        are_alike = any({one, other} <= group for group in table.alike)
        assert told_apart != are_alike, f"{one} and {other}"


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.family)
def test_every_relation_holds_somewhere_and_fails_somewhere(table: Table) -> None:
    constant = set[str]().union(*table.alike)

    for relation in set(table.relations) - constant:
        answers = {relation in row.holds for row in table.rows if relation in row.asked}
        assert answers == {True, False}, relation


@pytest.mark.parametrize(
    ("family", "relations"),
    [
        ("type", {*TypeRelation}),
        ("time", IN_TIME),
        ("recorded_at", IN_TIME),
        ("region", {*SpatialRelation}),
        ("subject", {*SpatialRelation}),
        ("features", {*SetRelation}),
        ("feature_names", {*SetRelation}),
        ("feature", {*Comparison}),
        ("duration", {*Comparison} - {Comparison.LIKE}),
        *((kin.value, {*SetRelation, *(f"transitive {relation}" for relation in SetRelation)}) for kin in Kin),
    ],
)
def test_a_family_has_all_its_relations(family: str, relations: set[str]) -> None:
    assert set(BY_FAMILY[family].relations) == {str(relation) for relation in relations}


def test_the_paper_counts_27_classes() -> None:
    sets = ("equal", "subset", "superset", "intersects")
    families = ("time", "region", "parts", "wholes", "features", "feature_names")

    expected = {"type.exactly", "type.is_a", "payload.equal"} | {
        f"{family}.{relation}" for family in families for relation in sets
    }
    assert set(PAPER_CLASSES) == expected
    assert len(PAPER_CLASSES) == 27
    assert set(PAPER_CLASSES) <= set(CUE_CLASSES)


@given(stories(), combined_cues(TYPE_NAMES), combined_cues(TYPE_NAMES))
def test_and_or_not_are_those_of_sets(story: Story, one: cues.Cue, other: cues.Cue) -> None:
    model = Model(story.types, story.arrivals)

    def found(cue: cues.Cue) -> set[int]:
        return set(ids_of(model.scan(cue)))

    every = found(cues.everything())
    assert found(one & other) == found(one) & found(other)
    assert found(one | other) == found(one) | found(other)
    assert found(~one) == every - found(one)
    assert found(~~one) == found(one)
    assert every == {*model.ids.values()}
    assert found(cues.any_of()) == set()
