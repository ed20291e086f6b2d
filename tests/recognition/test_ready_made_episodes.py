"""Sessions, missions and repetitions against what docs/recognition.md says of them, enumerated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import timedelta
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from elm import cues
from elm.cues.algebra import Cue
from elm.recognizers.base import Fed
from elm.recognizers.episodes import Mission, Repetition, Session
from elm.recognizers.measures import count, first
from tests.recognition.ready_made import (
    MANY,
    SECOND,
    Found,
    Surroundings,
    features,
    fed,
    found_by,
    groups_of,
    in_order,
    kinds,
    moments_in,
    streams,
    unordered,
)

A, B, C = map(cues.is_a, "ABC")
DAY = 86_400
MIDNIGHT = 14 * 3600
"""Seconds from second 0 of the tests to the end of its day."""

partitions = st.sampled_from(((), ("k",), ("k", "l")))


def seconds(number: float) -> timedelta:
    return timedelta(seconds=number)


def of_type(events: Sequence[Fed], *types: str) -> list[Fed]:
    return [each for each in events if each.event.type in types]


def uids(events: Sequence[Fed], step: str = "event") -> tuple[tuple[str, int], ...]:
    return tuple((step, each.event.uid.int) for each in events)


# Sessions


def session(**given_fields: Any) -> Session:
    return Session(**{"name": "s", "version": 1, "type": "Session", "cue": A, "gap": seconds(2), **given_fields})


def sessions_of(definition: Session, events: Sequence[Fed]) -> Iterator[Found]:
    """Every stretch of a group that no neighbour can be added to, in pieces of the greatest size."""
    gap = definition.gap // timedelta(microseconds=1)
    for key, group in groups_of(of_type(events, "A"), definition.partition).items():
        moments = [each.moment for each in group]
        near = [later - earlier <= gap for earlier, later in pairwise(moments)]
        for i in range(len(group)):
            for j in range(i, len(group)):
                is_one = all(near[i:j])
                is_longest = (i == 0 or not near[i - 1]) and (j == len(near) or not near[j])
                if not (is_one and is_longest):
                    continue
                for at in range(i, j + 1, definition.most_parts):
                    piece = group[at : min(at + definition.most_parts, j + 1)]
                    is_cut = at + definition.most_parts <= j
                    moment = moments[at + definition.most_parts] if is_cut else moments[j] + gap
                    if len(piece) >= definition.least:
                        measured = features([("n", len(piece))])
                        yield Found(
                            moment=moment, type="Session", output="match", parts=uids(piece), key=key, features=measured
                        )


@MANY
@given(
    streams(),
    partitions,
    st.sampled_from((0, 1, 2)),
    st.sampled_from(((1, 10_000), (2, 10_000), (1, 2), (2, 3), (1, 1))),
)
def test_sessions_are_the_longest_stretches_without_a_greater_gap(
    events: list[Fed], partition: tuple[str, ...], gap: int, bounds: tuple[int, int]
) -> None:
    least, most = bounds
    definition = session(
        gap=seconds(gap), partition=partition, least=least, most_parts=most, measures={"n": count("event")}
    )

    assert unordered(found_by(definition, events)) == unordered(sessions_of(definition, events))


def test_a_session_goes_on_at_the_gap_and_ends_a_microsecond_beyond() -> None:
    found = found_by(session(), [fed(1, 0), fed(2, 2), fed(3, 4.000001), fed(4, 6.000002)])

    assert [each.parts for each in found] == [uids([fed(1, 0), fed(2, 2)]), uids([fed(3, 0)]), uids([fed(4, 0)])]
    assert [each.moment for each in found] == [moments_in(4), moments_in(6.000001), moments_in(8.000002)]


def test_gaps_are_between_moments_so_that_a_long_event_belongs_where_it_ends() -> None:
    found = found_by(session(), [fed(1, 0), fed(2, 1, 10)])

    assert [each.parts for each in found] == [uids([fed(1, 0)]), uids([fed(2, 0)])]


def test_a_session_that_was_cut_is_counted() -> None:
    process = session(most_parts=2).start(Surroundings())

    results = [process.feed(each) for each in (fed(1, 0), fed(2, 0), fed(3, 1))]

    assert [len(each) for each in results] == [0, 0, 1]
    assert process.counts() == {"partial": 1, "dropped": 0, "split": 1}


def test_a_process_drops_the_group_whose_time_is_over_first() -> None:
    process = session(partition=["k"], most_groups=2).start(Surroundings())
    for number, value in enumerate((1, 2, 1, 3), start=1):
        assert not process.feed(fed(number, number / 10, features=[("k", value)]))

    assert process.counts() == {"partial": 2, "dropped": 1, "split": 0}
    assert sorted(each.event.uid.int for each in process.held()) == [1, 3, 4]


def test_an_event_belongs_to_a_group_for_each_of_its_values() -> None:
    given_events = [
        fed(1, 0, features=[("k", 1), ("k", True)]),
        fed(2, 1, features=[("k", 1.0)]),
        fed(3, 1, features=[("l", 1)]),
    ]

    found = found_by(session(partition=["k"]), given_events)

    assert {(each.key, each.parts) for each in found} == {
        (kinds([1]), (("event", 1), ("event", 2))),
        (kinds([True]), (("event", 1),)),
    }


# Missions


def mission(**given_fields: Any) -> Mission:
    fields = {"name": "m", "version": 1, "type": "Mission", "begin": A, "end": B, "within": seconds(4)}
    return Mission(**{**fields, **given_fields})


def missions_of(definition: Mission, events: Sequence[Fed]) -> Iterator[Found]:
    """From each begin look ahead for what comes first: its end, another begin that counts, or the end of its time."""
    within = definition.within // timedelta(microseconds=1)

    def is_a(cue: Cue | None, each: Fed) -> bool:
        return cue is not None and Surroundings().matches(cue, each.event)

    def shares(one: Fed, other: Fed) -> bool:
        return all(
            set(kinds(one.event.values(name))) & set(kinds(other.event.values(name))) for name in definition.same
        )

    heard = [each for each in events if any(is_a(cue, each) for cue in (definition.begin, definition.end, C))]
    for key, group in groups_of(heard, definition.partition).items():
        at = 0
        while at < len(group):
            begin = group[at]
            if not is_a(definition.begin, begin):
                at += 1
                continue
            rest = range(at + 1, len(group))
            in_time = [j for j in rest if group[j].moment <= begin.moment + within]
            end = next((j for j in in_time if is_a(definition.end, group[j]) and shares(begin, group[j])), None)
            until = (in_time[-1] + 1 if in_time else at + 1) if end is None else end
            others = [j for j in range(at + 1, until) if is_a(definition.begin, group[j])]
            if definition.again == "restart" and others:
                at = others[0]
                continue
            between = [group[j] for j in range(at + 1, until) if is_a(definition.include, group[j])]
            between = between[: definition.most_parts - 2]
            parts = (*uids([begin], "begin"), *uids(between, "include"))
            if end is not None:
                outcome = [("outcome", value) for value in group[end].event.values("l")]
                yield Found(
                    moment=group[end].moment,
                    type="Mission",
                    output="match",
                    parts=(*parts, *uids([group[end]], "end")),
                    key=key,
                    features=features(outcome) if definition.outcome else features([("n", len(between))]),
                )
                at = end + 1
            else:
                if definition.timed_out:
                    over = begin.moment + within
                    measured = features([] if definition.outcome else [("n", len(between))])
                    yield Found(
                        moment=over,
                        type="Lost",
                        output="timed out",
                        parts=parts,
                        key=key,
                        features=measured,
                        deadline=over,
                    )
                at = until


def missions_with_any_rule() -> st.SearchStrategy[Mission]:
    return st.builds(
        mission,
        begin=st.sampled_from((A, A | C, cues.everything())),
        end=st.sampled_from((B, B | A, B | C)),
        within=st.sampled_from((0, 2, 4)).map(seconds),
        include=st.sampled_from((None, C, cues.everything())),
        same=st.sampled_from(((), ("k",))),
        timed_out=st.sampled_from((None, "Lost")),
        again=st.sampled_from(("ignore", "restart")),
        partition=st.sampled_from(((), ("k",))),
        most_parts=st.sampled_from((2, 3, 10_000)),
        measures=st.just({"n": count("include")}),
    )


@MANY
@given(streams(), missions_with_any_rule())
def test_missions_go_from_a_begin_to_the_first_end(events: list[Fed], definition: Mission) -> None:
    assert unordered(found_by(definition, events)) == unordered(missions_of(definition, events))


def test_an_end_counts_at_the_last_moment_and_not_a_microsecond_later() -> None:
    in_time = found_by(mission(timed_out="Lost"), [fed(1, 0), fed(2, 4, type="B")])
    too_late = found_by(mission(timed_out="Lost"), [fed(1, 0), fed(2, 4.000001, type="B")])

    assert [(each.output, each.moment, each.deadline) for each in in_time] == [("match", moments_in(4), None)]
    assert [(each.output, each.moment, each.deadline) for each in too_late] == [
        ("timed out", moments_in(4), moments_in(4))
    ]


def test_the_outcome_is_copied_from_the_end_with_all_its_values() -> None:
    end = fed(2, 1, type="B", features=[("result", "done"), ("result", 1), ("other", 2)])

    (found,) = found_by(mission(outcome="result", measures={"order": first("order", "begin")}), [fed(1, 0), end])

    assert found.features == features([("result", "done"), ("result", 1)])


def test_a_second_begin_is_ignored_or_begins_anew() -> None:
    events = [fed(1, 0), fed(2, 1), fed(3, 2, type="B")]

    (ignored,) = found_by(mission(), events)
    (restarted,) = found_by(mission(again="restart"), events)

    assert ignored.parts == (("begin", 1), ("end", 3))
    assert restarted.parts == (("begin", 2), ("end", 3))


def test_what_no_longer_fits_into_a_mission_is_counted() -> None:
    process = mission(include=C, most_parts=3).start(Surroundings())
    for each in (fed(1, 0), fed(2, 1, type="C"), fed(3, 1, type="C")):
        process.feed(each)

    (found,) = process.feed(fed(4, 2, type="B"))

    assert [(step, part.uid.int) for step, part in found.parts] == [("begin", 1), ("include", 2), ("end", 4)]
    assert process.counts() == {"partial": 0, "dropped": 1, "split": 0}


# Repetitions


def repetition(**given_fields: Any) -> Repetition:
    return Repetition(
        **{"name": "r", "version": 1, "type": "Again", "cue": A, "times": 3, "per": "day", **given_fields}
    )


def repetitions_of(definition: Repetition, events: Sequence[Fed]) -> Iterator[Found]:
    """Of each day the first so many; else, from the left, the earliest so many that lie near enough to each other."""
    times = definition.times
    for key, group in groups_of(of_type(events, "A"), definition.partition).items():
        chosen = []
        if isinstance(definition.per, timedelta):
            per, at = definition.per // timedelta(microseconds=1), 0
            while at + times <= len(group):
                if group[at + times - 1].moment - group[at].moment <= per:
                    chosen.append(group[at : at + times])
                    at += times
                else:
                    at += 1
        else:
            days = sorted({each.moment // (DAY * SECOND) for each in group})
            of_days = ([each for each in group if each.moment // (DAY * SECOND) == day] for day in days)
            chosen = [of_day[:times] for of_day in of_days if len(of_day) >= times]
        for parts in chosen:
            yield Found(moment=parts[-1].moment, type="Again", output="match", parts=uids(parts), key=key)


@MANY
@given(
    streams(begin=st.sampled_from((0, 1, 2, MIDNIGHT - 1, MIDNIGHT, MIDNIGHT + 1, MIDNIGHT + DAY))),
    partitions,
    st.sampled_from((1, 2, 3)),
    st.sampled_from(("day", *map(seconds, (0, 1, 3, DAY)))),
)
def test_repetitions_are_found_once_a_day_or_anew_after_each(
    events: list[Fed], partition: tuple[str, ...], times: int, per: Any
) -> None:
    definition = repetition(times=times, per=per, partition=partition)

    assert unordered(found_by(definition, events)) == unordered(repetitions_of(definition, events))


def test_midnight_belongs_to_the_day_that_it_begins() -> None:
    found = found_by(repetition(times=2), [fed(1, 0), fed(2, MIDNIGHT), fed(3, MIDNIGHT + DAY - 0.000001)])

    assert [each.parts for each in found] == [(("event", 2), ("event", 3))]


def test_what_has_been_found_today_is_remembered_until_tomorrow() -> None:
    process = repetition(times=1).start(Surroundings())

    assert process.feed(fed(1, 0))
    assert not process.feed(fed(2, 1))
    assert process.counts()["partial"] == 0
    assert process.deadline() is None, "nothing is told when the day is over"
    assert len(process.snapshot()["groups"]) == 1


@pytest.mark.parametrize("number", range(3))
def test_events_of_one_moment_count_in_the_order_in_which_they_are_fed(number: int) -> None:
    events = [fed(1, 0, 3), fed(2, 1, 3), fed(3, 1, 3)]

    (found,) = found_by(repetition(times=3, per=seconds(0)), events[number:] + events[:number])

    assert found.parts == uids(in_order(events))
