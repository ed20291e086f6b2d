"""Definitions of recognizers: the same wherever and however they are written down, and clear about what is wrong."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

import elm
from elm import cues
from elm.errors import InvalidValue
from elm.recognizers import CoOccurrence, Mission, Pattern, Repetition, Session, Windowed, count, near, same, step
from elm.recognizers.base import Recognizer, fingerprint
from elm.recognizers.elements import absent, without
from elm.recognizers.matching import Matching
from elm.recognizers.runs import SPARE
from tests.recognition.ready_made import Surroundings, fed

ROOT = Path(__file__).resolve().parents[2]
SECOND = timedelta(seconds=1)
A = cues.is_a("A")
SETS = """
from datetime import timedelta
from uuid import UUID
from elm import cues
from elm.recognizers import Mission, Session, Windowed, count
from elm.recognizers.base import fingerprint
asked = (
    cues.features("superset", {("a", 1), ("b", "x"), ("c", True), ("d", 2.5)})
    | cues.feature_names("subset", {"a", "b", "cc", "dd"})
    | ~cues.parts("intersects", {UUID(int=number) for number in range(9)})
)
common = {"name": "r", "version": 1, "type": "R", "parents": {"P", "Q", "S"}}
minute = timedelta(minutes=1)
for each in (
    Session(cue=asked, gap=minute, **common),
    Mission(begin=asked, end=asked, within=minute, same={"x", "y", "z"}, **common),
    Windowed(cue=asked, length=minute, measures={"n": count()}, having={("n", ">", 1), ("n", "<", 9)}, **common),
):
    print(fingerprint(each))
"""


def pattern(**fields: Any) -> Pattern:
    given = {"name": "p", "version": 1, "type": "P", "elements": [step("a", A)], "within": SECOND}
    return Pattern(**{**given, **fields})


def test_a_fingerprint_is_the_same_in_every_process() -> None:
    printed = [
        subprocess.run(
            [sys.executable, "-c", SETS],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]

    assert len(printed[0].split()) == 3
    assert printed[0] == printed[1]


def test_the_order_of_what_is_a_set_is_not_part_of_a_definition() -> None:
    pairs = [("b", 1), ("a", 2)]
    first, second = (
        fingerprint(pattern(elements=[step("a", cues.features("superset", given))], parents=parents))
        for given, parents in ((pairs, ["P", "Q"]), (pairs[::-1], ["Q", "P"]))
    )

    assert first == second


@pytest.mark.parametrize("partition", [{"x"}, frozenset({"x"}), 5, "x"], ids=repr)
def test_a_partition_is_several_names_in_an_order(partition: Any) -> None:
    with pytest.raises(InvalidValue, match=r"the partition of .* is .*feature names"):
        pattern(partition=partition)
    with pytest.raises(InvalidValue, match=r"the partition of .* is .*feature names"):
        Session(name="s", version=1, type="S", cue=A, gap=SECOND, partition=partition)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"measures": {"n": "count"}}, "measures by count"),
        ({"measures": [count()]}, "have names"),
        ({"measures": {3: count()}}, "must be text"),
        ({"measures": {"elm.recognizer": count()}}, "every recognized event carries"),
        ({"measures": {"elm.version": count()}}, "every recognized event carries"),
        ({"measures": {"elm.output": count()}}, "every recognized event carries"),
        ({"among": "A"}, "needs a cue"),
        ({"elements": step("a", A)}, "are a list"),
        ({"elements": None}, "are a list"),
        ({"parents": "Abc"}, "several names"),
        ({"most_runs": 1_000_001}, "from 1 to 1,000,000"),
    ],
)
def test_patterns_that_cannot_be_are_refused(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidValue, match=says):
        pattern(**wrong)


def test_elements_and_conditions_say_what_is_wrong_with_them() -> None:
    text: Any = "A"
    for make in (lambda: step("a", text), lambda: without(text), lambda: absent(text, SECOND)):
        with pytest.raises(InvalidValue, match="needs a cue"):
            make()
    with pytest.raises(InvalidValue, match="choose one of last, first, every"):
        same("k", "a", of=_any("lst"))
    with pytest.raises(InvalidValue, match="choose one of region, subject"):
        near(1, "a", place=_any("regio"))


def _any(given: str) -> Any:
    return given


@pytest.mark.parametrize("having", [[(["x"], ">", 1)], 5, "n"], ids=repr)
def test_what_is_compared_must_be_measured(having: Any) -> None:
    with pytest.raises(InvalidValue, match="Windowed 'w'"):
        Windowed(name="w", version=1, type="W", cue=A, length=SECOND, measures={"n": count()}, having=having)


def test_a_subscription_says_what_is_wrong_with_it() -> None:
    with elm.connect("memory://") as memory:
        with pytest.raises(InvalidValue, match="a cue"):
            memory.subscribe(_any("A"))
        with pytest.raises(InvalidValue, match="number of seconds"):
            memory.subscribe(timeout=_any("5"))


SILENT: tuple[Recognizer, ...] = (
    Repetition(name="r", version=1, type="R", cue=A, times=3, per=SECOND),
    CoOccurrence(name="c", version=1, type="C", first=A, second=cues.is_a("B"), within=SECOND),
    Session(name="s", version=1, type="S", cue=A, gap=SECOND, least=2),
    Mission(name="m", version=1, type="M", begin=A, end=cues.is_a("B"), within=SECOND),
)


@pytest.mark.parametrize("definition", SILENT, ids=lambda each: each.name)
def test_nobody_waits_for_what_nothing_is_told_of(definition: Recognizer) -> None:
    process = definition.start(Surroundings())
    process.feed(fed(1, 0))
    assert process.deadline() is None
    assert [each.event.uid.int for each in process.held()] == [1]

    process.feed(fed(2, 100))
    assert [each.event.uid.int for each in process.held()] == [2], "forgotten with the next event"


def test_queues_do_not_keep_runs_that_have_ended() -> None:
    process = pattern(
        elements=[step("a", A), step("b", cues.is_a("B"))], within=timedelta(days=1), timed_out="Lost", most_runs=50
    ).start(Surroundings())
    assert isinstance(process, Matching)
    for number in range(4000):
        process.feed(fed(number, number))

    assert process.counts() == {"partial": 50, "dropped": 3950}
    assert sorted(each.event.uid.int for each in process.held()) == list(range(3950, 4000))
    assert process._oldest is not None
    queues = (process._deadlines.telling, process._deadlines.silent, process._oldest)
    assert all(len(queue) <= 2 * 51 + SPARE for queue in queues)
