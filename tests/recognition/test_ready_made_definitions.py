"""Definitions of ready-made recognizers: what they refuse, how they are told apart, and the examples of the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import timedelta
from typing import Any

import msgspec
import pytest

from elm import cues
from elm.errors import InvalidValue
from elm.geometry import Region
from elm.recognizers.base import Recognizer, fingerprint
from elm.recognizers.episodes import Mission, Repetition, Session
from elm.recognizers.grouped import Grouped
from elm.recognizers.measures import count
from elm.recognizers.places import Standstill, Stay
from elm.recognizers.together import CoOccurrence
from elm.recognizers.windows import Windowed
from tests.pages import Page
from tests.recognition.ready_made import LATEST, Surroundings, fed, feed_all, in_order, moments_in

PAGE = Page("docs/recognition.md")

A, B = cues.is_a("A"), cues.is_a("B")
HERE = Region.box(0, 0, 2, 2)
MINUTE = timedelta(minutes=1)
COMMON: Mapping[str, Any] = {"name": "r", "version": 1, "type": "R"}

KINDS: tuple[tuple[type[Grouped], dict[str, Any]], ...] = (
    (Session, {"cue": A, "gap": MINUTE}),
    (Mission, {"begin": A, "end": B, "within": MINUTE}),
    (Repetition, {"cue": A, "times": 3, "per": "day"}),
    (Repetition, {"cue": A, "times": 3, "per": MINUTE}),
    (Stay, {"cue": A, "places": {"here": HERE}, "least": MINUTE, "gap": MINUTE, "enter": "Enter"}),
    (Standstill, {"cue": A, "radius": 1, "least": MINUTE, "gap": MINUTE}),
    (CoOccurrence, {"first": A, "second": B, "within": MINUTE}),
    (Windowed, {"cue": A, "length": MINUTE}),
)
every_kind = pytest.mark.parametrize(("kind", "fields"), KINDS, ids=lambda each: getattr(each, "__name__", ""))


def made(kind: type[Grouped], fields: Mapping[str, Any], **others: Any) -> Any:
    return kind(**{**COMMON, **fields, **others})


def is_recognizer(given: Recognizer) -> Recognizer:
    """For the type checker: every kind keeps the protocol."""
    return given


@every_kind
def test_a_definition_is_plain_json_and_so_told_apart(kind: type[Grouped], fields: dict[str, Any]) -> None:
    definition = is_recognizer(made(kind, fields))

    assert msgspec.json.decode(msgspec.json.encode(definition.definition)) == definition.definition
    others = [
        made(kind, fields, version=2),
        made(kind, fields, across_agents=True),
        made(kind, fields, partition=["k"]),
        made(kind, fields, most_groups=7),
        made(kind, fields, measures={"n": count()}),
        *(made(kind, {**fields, name: A & B}) for name in fields if isinstance(fields[name], cues.Cue)),
        *(made(kind, {**fields, name: 2 * MINUTE}) for name in fields if isinstance(fields[name], timedelta)),
    ]
    prints = [fingerprint(each) for each in (definition, *others)]
    assert len(set(prints)) == len(prints)
    assert fingerprint(made(kind, fields)) == prints[0]


@every_kind
def test_results_have_a_type_with_parents(kind: type[Grouped], fields: dict[str, Any]) -> None:
    definition = is_recognizer(made(kind, fields, parents=["Episode"]))

    assert next((each.name, each.parents) for each in definition.outputs) == ("R", ("Episode",))


@every_kind
@pytest.mark.parametrize(
    "wrong",
    [
        {"name": ""},
        {"version": 0},
        {"version": True},
        {"type": ""},
        {"partition": "k"},
        {"partition": [""]},
        {"parents": "Episode"},
        {"most_groups": 0},
        {"most_groups": 10**7},
        {"measures": {"": count()}},
        {"measures": {"n": count("nowhere")}},
    ],
    ids=repr,
)
def test_what_all_kinds_refuse(kind: type[Grouped], fields: dict[str, Any], wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        made(kind, fields, **wrong)


@every_kind
def test_cues_must_be_such_that_a_replay_answers_them_the_same(kind: type[Grouped], fields: dict[str, Any]) -> None:
    names = [name for name, value in fields.items() if isinstance(value, cues.Cue)]
    assert names
    for name in names:
        with pytest.raises(InvalidValue, match="asks for wholes"):
            made(kind, {**fields, name: A | cues.wholes("equal", [])})
        with pytest.raises(InvalidValue, match="needs a cue"):
            made(kind, {**fields, name: "A"})


@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        (0, {"least": 0}),
        (0, {"least": 3, "most_parts": 2}),
        (0, {"gap": -MINUTE}),
        (0, {"gap": 60}),
        (1, {"within": None}),
        (1, {"timed_out": ""}),
        (1, {"again": "sometimes"}),
        (1, {"same": "k"}),
        (1, {"outcome": ""}),
        (1, {"outcome": "n", "measures": {"n": count()}}),
        (1, {"include": "C"}),
        (1, {"most_parts": 1}),
        (2, {"times": 0}),
        (2, {"times": True}),
        (2, {"per": "week"}),
        (2, {"per": -MINUTE}),
        (2, {"per": 7}),
    ],
)
def test_episodes_that_cannot_be_are_refused(kind: int, wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        made(*KINDS[kind], **wrong)


@every_kind
def test_a_time_beyond_all_datetimes_is_never_over(kind: type[Grouped], fields: dict[str, Any]) -> None:
    longest = {name: timedelta.max if isinstance(value, timedelta) else value for name, value in fields.items()}
    process = is_recognizer(made(kind, longest)).start(Surroundings())
    process.feed(fed(1, 0, region=HERE))

    assert process.deadline() in (None, LATEST)
    assert msgspec.json.encode(process.snapshot())
    assert process.expire(LATEST - 1) == []
    assert bool(process.held()) is (fields.get("per") != "day"), "a day is over long before"


def test_a_mission_that_never_times_out_still_says_when_it_would() -> None:
    definition = Mission(**COMMON, begin=A, end=B, within=timedelta.max, timed_out="Lost")

    (found,) = feed_all(definition, [fed(1, 0)], lambda process: process)

    assert found.deadline == found.moment


@every_kind
def test_what_is_held_does_not_grow_with_what_was_fed(kind: type[Grouped], fields: dict[str, Any]) -> None:
    definition = is_recognizer(made(kind, fields, partition=["k"]))
    process, most = definition.start(Surroundings()), 0
    steps = [
        fed(number, 5 * number, type="AB"[number % 7 == 0], region=HERE, features=[("k", number % 3)])
        for number in range(2000)
    ]
    steps += [fed(2000 + number, 20_000 + 7200 * number, features=[("k", number)]) for number in range(100)]
    for each in in_order(steps):
        while (deadline := process.deadline()) is not None and deadline < each.moment:
            process.expire(deadline)
        if Surroundings().matches(definition.interest, each.event):
            process.feed(each)
        most = max(most, len(process.snapshot()["groups"]))

    assert most < 40
    assert len(process.held()) <= 25


def test_every_kind_has_an_example_that_runs() -> None:
    shown: list[Any] = []
    for example in PAGE.blocks("python", "Ready-made recognizers"):
        shown += [each for each in PAGE.run([example]).values() if isinstance(each, Grouped)]

    assert {type(each) for each in shown} == {kind for kind, _ in KINDS}
    assert all(fingerprint(is_recognizer(replace(each))) == fingerprint(each) for each in shown)


def test_a_day_is_remembered_for_as_many_groups_as_the_bound_allows() -> None:
    process = Repetition(**COMMON, cue=A, times=1, per="day", partition=["k"], most_groups=2).start(Surroundings())
    results = [process.feed(fed(number, number, features=[("k", value)])) for number, value in enumerate((1, 2, 3, 1))]

    assert [len(each) for each in results] == [1, 1, 1, 1]
    assert process.counts() == {"partial": 0, "dropped": 2, "split": 0}
    assert process.deadline() is None, "nothing is told when a day is over"
    process.expire(moments_in(14 * 3600) - 2)
    assert len(process.snapshot()["groups"]) == 2
    process.expire(moments_in(14 * 3600) - 1)
    assert process.snapshot()["groups"] == []
