"""Every store gives the answers of the hand-made truth tables."""

from __future__ import annotations

from dataclasses import replace
from uuid import UUID, uuid5

import pytest

from elm.query import Query
from elm.store import Store
from tests.truth_tables import TABLES, Table


def _commit(store: Store, table: Table) -> None:
    store.add_types(table.types)
    store.commit_all(table.arrivals)


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.family)
def test_a_store_recalls_what_the_table_says(store: Store, table: Table) -> None:
    _commit(store, table)

    for row in table.rows:
        answers = {name: {event.uid for event in store.find(Query(cue=cue))} for name, cue in row.asked.items()}
        assert {name for name, uids in answers.items() if row.event in uids} == row.holds, row.why


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.family)
def test_a_store_recalls_all_else_by_the_negation(store: Store, table: Table) -> None:
    _commit(store, table)
    every = {arrival.event.uid for arrival in table.arrivals}

    for row in table.rows:
        for name, cue in row.asked.items():
            matched = {event.uid for event in store.find(Query(cue=cue))}
            others = {event.uid for event in store.find(Query(cue=~cue))}
            assert (matched | others, matched & others) == (every, set()), f"{name}: {row.why}"


NAMED_BY_UID = ("uid", "parts", "wholes")
"""Families whose cues name uids: their events cannot be given others."""


def test_events_of_all_tables_in_one_memory_do_not_disturb_each_other(store: Store) -> None:
    tables = [table for table in TABLES if table.family not in NAMED_BY_UID]
    store.add_types([event_type for table in tables for event_type in table.types])
    store.commit_all(
        [
            replace(arrival, event=replace(arrival.event, uid=_name(table, arrival.event.uid)))
            for table in tables
            for arrival in table.arrivals
        ]
    )

    for table in tables:
        for row in table.rows:
            answers = {name: {event.uid for event in store.find(Query(cue=cue))} for name, cue in row.asked.items()}
            uid = _name(table, row.event)
            assert {name for name, uids in answers.items() if uid in uids} == row.holds, row.why


def _name(table: Table, uid: UUID) -> UUID:
    return uuid5(uid, table.family)
