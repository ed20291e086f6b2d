"""Tests of the layout of rows: each column stands where it is looked for, and each format is one and the same."""

from __future__ import annotations

import struct
from concurrent.futures import ThreadPoolExecutor
from threading import Event as Signal

import numpy as np
from sqlalchemy import Select, literal_column, select

from elm.storage.binary import BOUNDED_RANGE, BOUNDED_RANGE_FIELDS
from elm.storage.recall_statements import StatementCache, columns
from elm.storage.rows import Column
from elm.storage.tables import event


def test_columns_stand_where_they_are_looked_for() -> None:
    assert list(Column) == list(range(len(Column)))
    assert select(*columns(event)).selected_columns.keys() == [column.name.lower() for column in Column]


def test_numpy_reads_a_range_as_struct_does() -> None:
    packed = BOUNDED_RANGE.pack(6, 8, -(2**40), 8, 2**50)
    (found,) = np.frombuffer(packed, dtype=[*BOUNDED_RANGE_FIELDS]).tolist()
    assert found == struct.unpack("!Biqiq", packed) == (6, 8, -(2**40), 8, 2**50)


# Statements


def test_of_many_statements_the_newest_are_kept() -> None:
    built: list[int] = []
    cache = StatementCache()

    def text(number: int) -> str:
        def build() -> Select[tuple[int]]:
            built.append(number)
            return select(literal_column(str(number)))

        return cache.text(("shape", number), build)

    for number in range(cache.MOST + 1):
        assert text(number) == f"SELECT {number}"
    newest = list(range(1, cache.MOST + 1))
    built.clear()
    assert [text(number) for number in newest] == [f"SELECT {number}" for number in newest]
    assert built == []
    assert text(0) == "SELECT 0"
    assert built == [0]


def test_a_statement_that_two_threads_ask_for_is_built_once() -> None:
    built: list[int] = []
    begun, both_ask = Signal(), Signal()

    class Key:
        """Looked up a third time by the thread that comes second, while the first still builds."""

        looks = 0

        def __hash__(self) -> int:
            self.looks += 1
            if self.looks > 2:
                both_ask.set()
            return 1

    def build() -> Select[tuple[int]]:
        built.append(len(built))
        begun.set()
        assert both_ask.wait(10)
        return select(literal_column("1"))

    cache, key = StatementCache(), Key()
    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(cache.text, key, build)
        assert begun.wait(10)
        second = threads.submit(cache.text, key, build)
        assert first.result() == second.result() == "SELECT 1"
    assert built == [0]
