"""Co-occurrences against what docs/recognition.md says of them, enumerated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta
from itertools import combinations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.errors import InvalidValue
from elm.event import StoredEvent
from elm.geometry import Region
from elm.recognizers.base import Fed
from elm.recognizers.measures import first
from elm.recognizers.together import CoOccurrence
from tests.recognition.ready_made import (
    MANY,
    Found,
    Surroundings,
    features,
    fed,
    found_by,
    groups_of,
    kinds,
    moments_in,
    streams,
    unordered,
)

A, B = cues.is_a("A"), cues.is_a("B")


def seconds(number: float) -> timedelta:
    return timedelta(seconds=number)


def together(**given_fields: Any) -> CoOccurrence:
    fields = {"name": "c", "version": 1, "type": "Both", "first": A, "second": B, "within": seconds(10)}
    return CoOccurrence(**{**fields, **given_fields})


def shared(one: StoredEvent, other: StoredEvent) -> timedelta:
    assert one.interval.end is not None
    assert other.interval.end is not None
    return min(one.interval.end, other.interval.end) - max(one.interval.begin, other.interval.begin)


def pairs_of(definition: CoOccurrence, events: Sequence[Fed]) -> Iterator[Found]:
    """Every pair of a group's events, the one fed before taken first if it fits both ways."""
    is_one = Surroundings().matches
    for key, group in groups_of(events, definition.partition).items():
        for one, other in combinations(group, 2):
            a, b = one.event, other.event
            if is_one(definition.first, a) and is_one(definition.second, b):
                parts = (("first", a.uid.int), ("second", b.uid.int))
            elif is_one(definition.second, a) and is_one(definition.first, b):
                parts = (("first", b.uid.int), ("second", a.uid.int))
            else:
                continue
            if shared(a, b) < definition.at_least or timedelta(microseconds=other.moment - one.moment) > (
                definition.within
            ):
                continue
            if not all(set(kinds(a.values(name))) & set(kinds(b.values(name))) for name in definition.same):
                continue
            if definition.near is not None:
                if a.region is None or b.region is None or a.region.frame != b.region.frame:
                    continue
                if a.region.polygon.distance(b.region.polygon) > definition.near:
                    continue
            yield Found(moment=other.moment, type="Both", output="match", parts=parts, key=key)


definitions = st.builds(
    together,
    first=st.sampled_from((A, A | cues.is_a("C"), cues.everything())),
    second=st.sampled_from((B, B | cues.is_a("C"), cues.everything())),
    within=st.sampled_from((0, 1, 3, 20)).map(seconds),
    at_least=st.sampled_from((0, 0, 1, 2)).map(seconds),
    near=st.sampled_from((None, None, 0, 1.5, 5)),
    same=st.sampled_from(((), (), ("k",), ("k", "l"))),
    partition=st.sampled_from(((), (), ("k",))),
)


@MANY
@given(streams(length=st.sampled_from((0, 1, 2, 5))), definitions)
def test_co_occurrences_are_all_pairs_that_fit(events: list[Fed], definition: CoOccurrence) -> None:
    assert unordered(found_by(definition, events)) == unordered(pairs_of(definition, events))


@pytest.mark.parametrize(("begin", "at_least", "found"), [(2, 0, 1), (2.000001, 0, 0), (1, 1, 1), (1.000001, 1, 0)])
def test_what_is_shared_is_as_long_as_asked_to_the_microsecond(begin: float, at_least: float, found: int) -> None:
    events = [fed(1, 0, 2), fed(2, begin, 3, type="B")]

    assert len(found_by(together(at_least=seconds(at_least)), events)) == found


@pytest.mark.parametrize(("end", "found"), [(12, 1), (12.000001, 0)])
def test_an_event_is_held_until_the_last_moment_within(end: float, found: int) -> None:
    assert len(found_by(together(), [fed(1, 0, 2), fed(2, 0, end, type="B")])) == found


def test_the_oldest_event_of_a_side_is_dropped_at_the_bound() -> None:
    process = together(most_held=2).start(Surroundings())
    for number in (1, 2, 3):
        assert not process.feed(fed(number, 0))

    found = process.feed(fed(4, 0, type="B"))

    assert [emission.parts[0][1].uid.int for emission in found] == [2, 3]
    assert process.counts() == {"partial": 2, "dropped": 1, "split": 0}


def test_what_is_too_old_is_let_go_of_though_others_keep_coming() -> None:
    process = together(within=seconds(1)).start(Surroundings())
    for number in range(100):
        process.feed(fed(number, number / 2))

    assert len(process.held()) == 3


def test_subjects_may_be_what_is_near_and_one_side_may_be_measured() -> None:
    here, there = Region.box(0, 0, 1, 1), Region.box(3, 0, 4, 1)
    events = [
        fed(1, 0, subject=here, region=there, features=[("what", "cup")]),
        fed(2, 0, type="B", subject=here, region=here, features=[("what", "hand")]),
    ]
    definition = together(near=1, of="subject", measures={"held by": first("what", "second")})

    (found,) = found_by(definition, events)

    assert found.features == features([("held by", "hand")])
    assert found.moment == moments_in(0)
    assert found_by(together(near=1.999), events) == []
    assert len(found_by(together(near=2), events)) == 1


@pytest.mark.parametrize("wrong", [{"near": -1}, {"at_least": seconds(-1)}, {"most_held": 0}, {"same": "k"}, {"of": 1}])
def test_co_occurrences_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        together(**wrong)
