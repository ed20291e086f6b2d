"""Stays, passages, crossings and standstills against what docs/recognition.md says of them, enumerated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.errors import InvalidValue
from elm.geometry import Region
from elm.recognizers.base import Fed
from elm.recognizers.measures import count
from elm.recognizers.places import Standstill, Stay
from tests.recognition.ready_made import (
    MANY,
    REGIONS,
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

INSIDE, OUTSIDE = Region.box(4, 4, 6, 6), Region.box(20, 20, 21, 21)


def seconds(number: float) -> timedelta:
    return timedelta(seconds=number)


def micros(duration: timedelta) -> int:
    return duration // timedelta(microseconds=1)


def events_of(held: Sequence[Fed]) -> tuple[tuple[str, int], ...]:
    return tuple(("event", each.event.uid.int) for each in held)


def lasted(held: Sequence[Fed]) -> int:
    bounds = [each.event.interval.micros for each in held]
    return max(end for _, end in bounds) - min(begin for begin, _ in bounds)


# Stays


def stay(**given_fields: Any) -> Stay:
    fields = {"name": "s", "version": 1, "type": "Stay", "cue": cues.is_a("A") | cues.is_a("B"), "places": REGIONS}
    return Stay(**{**fields, "least": seconds(2), "gap": seconds(2), **given_fields})


def is_in(definition: Stay, place: Region, each: Fed) -> bool:
    where = each.event.region
    assert where is not None
    if definition.relation == "subset":
        return bool(where.polygon.covered_by(place.polygon))
    distance = where.polygon.distance(place.polygon)
    return bool(distance <= (0 if definition.distance is None else definition.distance))


def stays_of(definition: Stay, events: Sequence[Fed]) -> Iterator[Found]:
    """Of each place the longest stretches inside, in pieces of the greatest size, and the pairs around its boundary."""
    gap, most = micros(definition.gap), definition.most_parts
    heard = [each for each in events if each.event.type in "AB"]
    for key, group in groups_of(heard, definition.partition).items():
        for name, place in definition.places.items():
            located = [each for each in group if each.event.region and each.event.region.frame == place.frame]
            inside = [is_in(definition, place, each) for each in located]
            near = [later.moment - earlier.moment <= gap for earlier, later in pairwise(located)]
            own_key = (*key, ("s", name))
            for i in range(len(located)):
                for j in range(i, len(located)):
                    joined = all(inside[i : j + 1]) and all(near[i:j])
                    before = i > 0 and inside[i - 1] and near[i - 1]
                    after = j + 1 < len(located) and inside[j + 1] and near[j]
                    if not joined or before or after:
                        continue
                    seen_outside = j + 1 < len(located) and near[j]
                    over = located[j + 1].moment if seen_outside else located[j].moment + gap
                    for at in range(i, j + 1, most):
                        piece = located[at : min(at + most, j + 1)]
                        is_stay = lasted(piece) >= micros(definition.least)
                        type_name = definition.type if is_stay else definition.passage
                        if type_name is not None:
                            yield Found(
                                moment=located[at + most].moment if at + most <= j else over,
                                type=type_name,
                                output="match" if is_stay else "passage",
                                parts=events_of(piece),
                                features=features([("place", name), ("n", len(piece))]),
                                key=own_key,
                            )
            for k, (one, other) in enumerate(pairwise(located)):
                if not near[k] or inside[k] == inside[k + 1]:
                    continue
                sides = ("inside", "outside") if inside[k] else ("outside", "inside")
                type_name = definition.leave if inside[k] else definition.enter
                if type_name is not None:
                    yield Found(
                        moment=other.moment,
                        type=type_name,
                        output="leave" if inside[k] else "enter",
                        parts=((sides[0], one.event.uid.int), (sides[1], other.event.uid.int)),
                        features=features([("place", name)]),
                        key=own_key,
                    )


relations = st.sampled_from(
    (
        {"relation": "subset"},
        {"relation": "intersects"},
        {"relation": "within_distance", "distance": 0},
        {"relation": "within_distance", "distance": 1.5},
    )
)


@MANY
@given(
    streams(max_size=14),
    relations,
    st.sampled_from((0, 2, 5)),
    st.sampled_from((0, 1, 2)),
    st.sampled_from(((), ("k",))),
    st.sampled_from((1, 2, 10_000)),
    st.tuples(*(st.sampled_from((None, name)) for name in ("Passage", "Enter", "Leave"))),
)
def test_stays_are_the_longest_stretches_inside(
    events: list[Fed],
    relation: dict[str, Any],
    least: int,
    gap: int,
    partition: tuple[str, ...],
    most_parts: int,
    others: tuple[str | None, ...],
) -> None:
    passage, enter, leave = others
    definition = stay(
        least=seconds(least),
        gap=seconds(gap),
        partition=partition,
        most_parts=most_parts,
        passage=passage,
        enter=enter,
        leave=leave,
        measures={"n": count()},
        **relation,
    )

    assert unordered(found_by(definition, events)) == unordered(stays_of(definition, events))


def one_place(**given_fields: Any) -> Stay:
    return stay(places={"kitchen": REGIONS["kitchen"]}, passage="Passage", enter="Enter", leave="Leave", **given_fields)


def test_a_visit_is_told_from_its_enter_to_its_leave() -> None:
    seen = [fed(1, 0, region=OUTSIDE), fed(2, 1, region=INSIDE), fed(3, 3, region=INSIDE), fed(4, 4, region=OUTSIDE)]

    found = found_by(one_place(), seen)

    assert [(each.type, each.moment, each.parts) for each in found] == [
        ("Enter", moments_in(1), (("outside", 1), ("inside", 2))),
        ("Stay", moments_in(4), (("event", 2), ("event", 3))),
        ("Leave", moments_in(4), (("inside", 3), ("outside", 4))),
    ]


@pytest.mark.parametrize(("end", "kind"), [(3, "Stay"), (2.999999, "Passage")])
def test_what_is_a_microsecond_too_short_is_a_passage(end: float, kind: str) -> None:
    found = found_by(one_place(), [fed(1, 1, region=INSIDE), fed(2, end, region=INSIDE)])

    assert [(each.type, each.moment) for each in found] == [(kind, moments_in(end + 2))]


def test_what_was_not_seen_for_longer_than_the_gap_neither_stayed_nor_entered_nor_left() -> None:
    apart = [fed(1, 0, region=OUTSIDE), fed(2, 2.000001, region=INSIDE), fed(3, 4.000002, region=OUTSIDE)]
    near = [fed(1, 0, region=OUTSIDE), fed(2, 2, region=INSIDE), fed(3, 4, region=OUTSIDE)]

    assert [each.type for each in found_by(one_place(), apart)] == ["Passage"]
    assert [each.type for each in found_by(one_place(), near)] == ["Enter", "Passage", "Leave"]


def test_events_that_tell_no_place_or_one_of_another_frame_say_nothing() -> None:
    silent = [fed(2, 1), fed(3, 1, region=Region.box(20, 20, 21, 21, frame="odom"))]

    (found,) = found_by(one_place(), [fed(1, 0, region=INSIDE), *silent, fed(4, 2, region=INSIDE)])

    assert (found.type, found.parts) == ("Stay", (("event", 1), ("event", 4)))


def test_the_order_in_which_places_are_given_does_not_matter() -> None:
    events = [fed(1, 0, region=Region.box(0, 0, 1, 1))]
    there, back = stay(places=REGIONS, passage="P"), stay(places=dict(reversed([*REGIONS.items()])), passage="P")

    assert [each.key for each in found_by(there, events)] == [(("s", "corner"),), (("s", "kitchen"),)]
    assert found_by(there, events) == found_by(back, events)


def test_a_stay_that_was_cut_is_counted() -> None:
    process = one_place(most_parts=2).start(Surroundings())

    results = [process.feed(fed(number, 2 * number, region=INSIDE)) for number in range(3)]

    assert [[emission.type for emission in each] for each in results] == [[], [], ["Stay"]]
    assert process.counts() == {"partial": 1, "dropped": 0, "split": 1}


def test_the_subject_may_be_what_stays() -> None:
    seen = [fed(1, 0, region=OUTSIDE, subject=INSIDE), fed(2, 2, region=OUTSIDE, subject=INSIDE)]

    assert [each.type for each in found_by(stay(of="subject"), seen)] == ["Stay"]
    assert [each.type for each in found_by(standstill(of="subject"), [*seen, fed(3, 2, region=INSIDE)])] == ["Rest"]
    assert found_by(stay(), seen) == []


@pytest.mark.parametrize(
    "wrong",
    [
        {"relation": "touches"},
        {"relation": "within_distance"},
        {"distance": 1.0},
        {"places": {}},
        {"places": {"": INSIDE}},
        {"places": {"dock": "here"}},
        {"measures": {"place": count()}},
        {"measures": {"n": count("inside")}},
        {"gap": seconds(-1)},
        {"enter": ""},
        {"most_parts": 0},
    ],
)
def test_stays_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        stay(**wrong)


# Standstills


def standstill(**given_fields: Any) -> Standstill:
    fields = {"name": "s", "version": 1, "type": "Rest", "cue": cues.is_a("A") | cues.is_a("B"), "radius": 2}
    return Standstill(**{**fields, "least": seconds(2), "gap": seconds(2), **given_fields})


def standstills_of(definition: Standstill, events: Sequence[Fed]) -> Iterator[Found]:
    """From each event as far as the run reaches; where that is too short, from the next one."""
    gap = micros(definition.gap)
    heard = [each for each in events if each.event.type in "AB" and each.event.region]
    frames = sorted({each.event.region.frame for each in heard if each.event.region})
    for key, group in groups_of(heard, definition.partition).items():
        for frame in frames:
            seen = [(each, each.event.region) for each in group if each.event.region]
            seen = [(each, region) for each, region in seen if region.frame == frame]
            at = 0
            while at < len(seen):
                middle, end = seen[at][1].polygon.centroid, at + 1
                while (
                    end < len(seen)
                    and seen[end][0].moment - seen[end - 1][0].moment <= gap
                    and seen[end][1].polygon.distance(middle) <= definition.radius
                    and end - at < definition.most_parts
                ):
                    end += 1
                run = [each for each, _ in seen[at:end]]
                is_cut = len(run) == definition.most_parts and (
                    end < len(seen)
                    and seen[end][0].moment - run[-1].moment <= gap
                    and seen[end][1].polygon.distance(middle) <= definition.radius
                )
                if lasted(run) >= micros(definition.least):
                    over = run[-1].moment + gap
                    yield Found(
                        moment=min(over, seen[end][0].moment) if end < len(seen) else over,
                        type="Rest",
                        output="match",
                        parts=events_of(run),
                        key=key,
                    )
                    at = end
                else:
                    at = end if is_cut else at + 1


@MANY
@given(
    streams(
        max_size=14,
        region=st.sampled_from(
            (None, Region.box(0, 0, 1, 1, frame="odom"), *(Region.box(x, 0, x + 1, 1) for x in (0, 0, 1, 2, 4)))
        ),
    ),
    st.sampled_from((0, 0.5, 1.5, 2.5)),
    st.sampled_from((0, 1, 3)),
    st.sampled_from((0, 1, 2)),
    st.sampled_from(((), ("k",))),
    st.sampled_from((1, 2, 4, 10_000)),
)
def test_standstills_are_runs_around_their_first_event(
    events: list[Fed], radius: float, least: int, gap: int, partition: tuple[str, ...], most_parts: int
) -> None:
    definition = standstill(
        radius=radius, least=seconds(least), gap=seconds(gap), partition=partition, most_parts=most_parts
    )

    assert unordered(found_by(definition, events)) == unordered(standstills_of(definition, events))


@MANY
@given(
    st.lists(st.sampled_from((0, 0.5, 1, 1.5, 2, 3, 5)), max_size=14),
    st.sampled_from((0, 0.5, 1)),
    st.sampled_from((1, 2, 3, 5)),
)
def test_the_search_goes_on_within_runs_that_were_too_short(spots: list[float], radius: float, least: int) -> None:
    definition = standstill(radius=radius, least=seconds(least))
    events = seen_at(*spots)

    assert unordered(found_by(definition, events)) == unordered(standstills_of(definition, events))


def seen_at(*spots: float) -> list[Fed]:
    return [fed(number, number, region=Region.box(x, 0, x + 1, 1)) for number, x in enumerate(spots)]


def test_the_edge_of_the_radius_counts_and_what_lies_beyond_ends_the_run() -> None:
    at_the_edge = found_by(standstill(least=seconds(1)), seen_at(0, 2.5, 2.5625))

    assert [(each.parts, each.moment) for each in at_the_edge] == [((("event", 0), ("event", 1)), moments_in(2))]


@pytest.mark.parametrize(
    ("radius", "spots", "run"),
    [(2, (0, 2, 4, 4, 4, 10), (1, 2, 3, 4)), (0.5, (1, 0, 2, 3, 3, 3, 9), (2, 3, 4, 5))],
    ids=["from the second", "past one that lies on the other side"],
)
def test_a_run_that_is_too_short_gives_way_to_one_that_begins_later(
    radius: float, spots: tuple[float, ...], run: tuple[int, ...]
) -> None:
    (found,) = found_by(standstill(radius=radius, least=seconds(3)), seen_at(*spots))

    assert found.parts == tuple(("event", number) for number in run)


def test_runs_of_two_frames_do_not_end_each_other() -> None:
    here = [fed(1, 0, region=INSIDE), fed(3, 2, region=INSIDE)]
    there = [fed(2, 1, region=Region.box(50, 50, 51, 51, frame="odom"))]

    (found,) = found_by(standstill(), [*here, *there])

    assert found.parts == (("event", 1), ("event", 3))


def test_a_cut_standstill_is_counted() -> None:
    process = standstill(most_parts=2, least=seconds(1)).start(Surroundings())

    found = [emission for each in seen_at(0, 0, 0) for emission in process.feed(each)]

    assert [len(each.parts) for each in found] == [2]
    assert process.counts() == {"partial": 1, "dropped": 0, "split": 1}


@pytest.mark.parametrize("wrong", [{"radius": -1}, {"radius": True}, {"radius": float("nan")}, {"of": "agent"}])
def test_standstills_that_cannot_be_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(InvalidValue):
        standstill(**wrong)
