"""Regular expressions over names: whole names, and never slow."""

from __future__ import annotations

import time

import pytest

from armem_bridge.working import QueryBuilder
from armem_bridge.working.patterns import name_matcher
from armem_bridge.working.refusals import InvalidQuery
from tests.armem.working.scenes import CUP, commit, object_memory, update


@pytest.mark.parametrize(
    ("pattern", "matching", "others"),
    [
        ("cup", ["cup"], ["blue-cup", "cups", "Cup", "cup\n", ""]),
        (".*cup.*", ["cup", "blue-cup", "cups"], ["Cup", "a\ncup"]),
        ("", [""], ["a"]),
        (r"\.\*", [".*"], ["aa"]),
        ("[[:alpha:]]+", ["cup"], ["cup1"]),
        ("(?i)cup|mug", ["CUP", "Mug"], ["mugs"]),
        ("ü/.", ["ü/☃"], ["u/x"]),
        ("^cup$", ["cup"], ["cups"]),
        (r"cup-\d{1,3}", ["cup-1", "cup-999"], ["cup-1000", "cup-"]),
    ],
)
def test_whole_names_match(pattern: str, matching: list[str], others: list[str]) -> None:
    match = name_matcher(pattern)

    assert [name for name in [*matching, *others] if match(name)] == matching


@pytest.mark.parametrize(
    "pattern",
    ["(a+)+$", "(a|aa)+", "(.*)*x", "(a|a?)+b", "(x+x+)+y", "(([a-z])+.)+[A-Z]([a-z])+$", "(" * 50 + "a" + "+)" * 50],
)
def test_no_expression_is_slow(pattern: str) -> None:
    server = object_memory()
    for number in range(50):
        commit(server, update(1, entity=CUP.with_entity("a" * 5_000 + f"!{number}")))
    builder = QueryBuilder()
    builder.core_segments.all().provider_segments.all().entities.regex(pattern).snapshots.all()

    begin = time.perf_counter()
    found = server.query(builder.build())
    assert time.perf_counter() - begin < 2
    assert list(found.snapshots()) == []


@pytest.mark.parametrize(
    ("pattern", "words"),
    [
        ("(cup", "missing"),
        ("*", "repetition"),
        ("[z-a]", "range"),
        (r"(a)\1", "no back-references"),
        ("(?=a)a", "no look-around"),
        ("((a{1,500}){1,500}){1,500}", "no large counted repetitions"),
        ("(.{0,1000}){1}" * 70, "large counted repetitions"),
        ("a" * 1_001, "1,001 characters"),
        ("a\ud800", "surrogate"),
        (None, "text"),
    ],
)
def test_expressions_that_are_refused(pattern: str, words: str) -> None:
    builder = QueryBuilder()
    begin = time.perf_counter()
    with pytest.raises(InvalidQuery, match=words):
        builder.core_segments.regex(pattern)
    assert time.perf_counter() - begin < 1
