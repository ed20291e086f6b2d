"""Tumbling and sliding windows against what docs/recognition.md says of them, enumerated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.errors import InvalidValue
from elm.features import FeatureValue
from elm.recognizers.base import Fed
from elm.recognizers.measures import count, first, greatest, mean, sum_of
from elm.recognizers.windows import Windowed
from tests.recognition.ready_made import (
    MANY,
    SECOND,
    Found,
    Surroundings,
    features,
    fed,
    found_by,
    groups_of,
    moments_in,
    streams,
    unordered,
)

MEASURES = {"n": count(), "sum": sum_of("k"), "top": greatest("k"), "first": first("l")}


def seconds(number: float) -> timedelta:
    return timedelta(seconds=number)


def windowed(**given_fields: Any) -> Windowed:
    fields = {"name": "w", "version": 1, "type": "Window", "cue": cues.is_a("A") | cues.is_a("B")}
    return Windowed(**{**fields, "length": seconds(2), **given_fields})


def measured(events: Sequence[Fed]) -> dict[str, FeatureValue]:
    values = [value for each in events for value in each.event.values("k")]
    numbers = [value for value in values if isinstance(value, int | float) and not isinstance(value, bool)]
    found: dict[str, FeatureValue] = {"n": len(events)}
    if numbers:
        found |= {"sum": float(sum(numbers)), "top": max(numbers)}
    ls = [value for each in events for value in each.event.values("l")]
    return found | ({"first": ls[0]} if ls else {})


def by_end(each: Fed) -> tuple[Any, ...]:
    return each.event.interval.end, each.event.interval.begin, each.event.uid


def windows_of(definition: Windowed, events: Sequence[Fed]) -> Iterator[Found]:
    """Every window that could have an event in it."""
    length = definition.length // timedelta(microseconds=1)
    every = (definition.every or definition.length) // timedelta(microseconds=1)
    heard = [each for each in events if each.event.type in "AB"]
    for key, group in groups_of(heard, definition.partition).items():
        first_k, last_k = (min(e.moment for e in group) - length) // every, max(e.moment for e in group) // every
        for k in range(first_k, last_k + 1):
            inside = sorted((e for e in group if k * every <= e.moment < k * every + length), key=by_end)
            if not inside or len(inside) > definition.most_parts:
                continue
            known = measured(inside)
            if definition.having and not (known["n"] in (2, 3) and known.get("top", 0) == 2):
                continue
            yield Found(
                moment=k * every + length - 1,
                type="Window",
                output="match",
                parts=tuple(("event", each.event.uid.int) for each in inside),
                key=(*key, ("n", k * every)),
                features=features(known.items()),
            )


@MANY
@given(
    streams(max_size=14),
    st.sampled_from(((2, None), (3, 1), (5, 2), (4, 4), (1, 3), (2.5, 1.000001))),
    st.sampled_from(((), ("k",), ("k", "l"))),
    st.sampled_from((1, 2, 3, 10_000)),
    st.sampled_from(((), (("n", ">=", 2), ("n", "<", 4), ("top", "=", 2.0)))),
)
def test_windows_hold_the_events_whose_moments_lie_in_them(
    events: list[Fed],
    times: tuple[float, float | None],
    partition: tuple[str, ...],
    most_parts: int,
    having: tuple[Any, ...],
) -> None:
    length, every = times
    definition = windowed(
        length=seconds(length),
        every=None if every is None else seconds(every),
        partition=partition,
        most_parts=most_parts,
        measures=MEASURES,
        having=having,
    )

    assert unordered(found_by(definition, events)) == unordered(windows_of(definition, events))


def test_a_window_begins_with_its_first_moment_and_ends_before_the_next_one() -> None:
    found = found_by(windowed(), [fed(1, 0), fed(2, 1.999999), fed(3, 2)])

    assert [(each.parts, each.moment) for each in found] == [
        ((("event", 1), ("event", 2)), moments_in(2) - 1),
        ((("event", 3),), moments_in(4) - 1),
    ]


def test_windows_are_counted_from_1970_backwards_too() -> None:
    before = -(moments_in(0) // SECOND)

    (found,) = found_by(windowed(length=seconds(10)), [fed(1, before - 1), fed(2, before - 10)])

    assert found.key == (("n", -10 * SECOND),)
    assert found.parts == (("event", 2), ("event", 1))


@pytest.mark.parametrize(("second", "is_in_one"), [(0.999999, True), (1, False), (2.999999, False), (3, True)])
def test_an_event_between_windows_is_in_none(second: float, is_in_one: bool) -> None:
    # Second 0 of the tests is a multiple of three seconds since 1970.
    process = windowed(length=seconds(1), every=seconds(3)).start(Surroundings())

    process.feed(fed(1, second))

    assert (process.deadline() is not None) == is_in_one
    assert len(process.held()) == is_in_one


def test_two_windows_of_the_same_events_are_two_results() -> None:
    found = found_by(windowed(length=seconds(2), every=seconds(1)), [fed(1, 0)])

    assert [each.parts for each in found] == [(("event", 1),)] * 2
    assert len({each.key for each in found}) == 2


def test_a_window_with_too_many_events_is_dropped_and_counted_once() -> None:
    process = windowed(most_parts=2).start(Surroundings())
    for number in range(10):
        process.feed(fed(number, number / 10))

    assert process.counts() == {"partial": 0, "dropped": 1}
    assert process.held() == []
    assert process.deadline() == moments_in(2) - 1
    assert process.expire(moments_in(2) - 1) == []
    assert process.deadline() is None


def test_sliding_windows_share_the_events_that_they_hold() -> None:
    process = windowed(length=seconds(100), every=seconds(1)).start(Surroundings())
    for number in range(1000):
        each = fed(number, number)
        while (deadline := process.deadline()) is not None and deadline < each.moment:
            process.expire(deadline)
        process.feed(each)

    assert len(process.held()) == 100
    assert len(process.snapshot()["groups"][0]["held"]) == 100


def test_the_first_group_is_dropped_beyond_the_bound() -> None:
    process = windowed(partition=["k"], most_groups=2).start(Surroundings())
    for number in (1, 2, 3):
        process.feed(fed(number, 0, features=[("k", number)]))

    assert process.counts() == {"partial": 2, "dropped": 1}
    assert [each.event.uid.int for each in process.held()] == [2, 3]


def test_what_could_not_be_measured_compares_with_nothing() -> None:
    asked = windowed(measures={"mean": mean("k")}, having=[("mean", "!=", 7)])

    assert found_by(asked, [fed(1, 0)]) == []
    assert len(found_by(asked, [fed(1, 0, features=[("k", 1)])])) == 1


@pytest.mark.parametrize(
    "wrong",
    [
        {"length": seconds(0)},
        {"every": seconds(0)},
        {"every": seconds(-1)},
        {"most_parts": 0},
        {"having": [("count", ">=", 3)]},
        {"having": [("n", ">=")]},
        {"having": ["n"]},
        {"measures": {"n": count()}, "having": [("n", "like", 3)]},
        {"measures": {"n": count()}, "having": [("n", "about", 3)]},
        {"measures": {"n": "count"}},
        {"measures": {"n": count("row")}},
    ],
)
def test_windows_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        windowed(**wrong)
