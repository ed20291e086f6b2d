"""Random patterns on random streams: the engine finds what the enumeration of docs/recognition.md finds."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings

from elm import cues
from elm.interval import to_micros
from elm.recognizers.base import Emission, Fed, Judge, Process
from elm.recognizers.elements import absent, step
from elm.recognizers.patterns import AfterMatch, Pattern
from tests.recognition.oracle import Found, Key, key_of, results
from tests.recognition.streams import BY_TYPE, PLAIN, Case, cases, fed, micros


class Harness:
    """Runs a process as a manager does: time passes deadline by deadline between the events."""

    def __init__(self, pattern: Pattern, judge: Judge) -> None:
        self.pattern, self.judge = pattern, judge
        self.process: Process = pattern.start(judge)
        self.found: list[Found] = []

    def feed(self, event: Fed) -> None:
        """Let time pass up to the event, and feed it."""
        while (deadline := self.process.deadline()) is not None and deadline < event.moment:
            self._expire(deadline)
        self._collect(self.process.feed(event), event.moment)

    def pass_time(self, until: int | None) -> None:
        """Let time pass, without a further event."""
        while until is not None and (deadline := self.process.deadline()) is not None and deadline <= until:
            self._expire(deadline)

    def interrupt(self) -> None:
        """Go on with another process, made from what this one's snapshot says and nothing else."""
        snapshot = msgspec.json.decode(msgspec.json.encode(self.process.snapshot()))
        held = {str(each.event.uid): copy.deepcopy(each) for each in self.process.held()}
        self.process = self.pattern.resume(self.judge, snapshot, held)

    def _expire(self, deadline: int) -> None:
        self._collect(self.process.expire(deadline), deadline)
        after = self.process.deadline()
        assert after is None or after > deadline, "time that is over is not waited for again"

    def _collect(self, emissions: Iterable[Emission], moment: int) -> None:
        types = {"match": self.pattern.type, "timed out": self.pattern.timed_out}
        for each in emissions:
            assert each.type == types[each.output]
            self.found.append(
                Found(
                    moment=moment,
                    output=each.output,
                    key=key_of(each.key),
                    taken=tuple((name, part.uid) for name, part in each.parts),
                    deadline=None if each.deadline is None else to_micros(each.deadline),
                )
            )


def run(case: Case, judge: Judge = PLAIN) -> list[Found]:
    """What the engine finds."""
    harness = Harness(case.pattern, judge)
    for each in case.stream:
        harness.feed(each)
    harness.pass_time(case.until)
    return harness.found


def told_apart(found: Iterable[Found]) -> dict[tuple[Key, str], list[Found]]:
    """Results by partition and output, the matches of each in their order: nothing is said of the order of others."""
    groups: dict[tuple[Key, str], list[Found]] = {}
    for each in found:
        groups.setdefault((each.key, each.output), []).append(each)
    for (_, output), group in groups.items():
        if output == "timed out":
            group.sort(key=lambda each: (each.moment, str(each.taken)))
    return groups


def check_against_the_oracle(case: Case) -> None:
    """The engine and the enumeration find the same."""
    found = run(case)

    assert told_apart(found) == told_apart(results(case.pattern, case.stream, case.until, PLAIN))
    assert [each.moment for each in found] == sorted(each.moment for each in found)


@settings(max_examples=400)
@given(cases())
def test_finds_what_the_document_says(case: Case) -> None:
    check_against_the_oracle(case)


@pytest.mark.slow
@settings(max_examples=10_000, suppress_health_check=list(HealthCheck))
@given(cases())
def test_finds_what_the_document_says_in_many_examples(case: Case) -> None:
    check_against_the_oracle(case)


@settings(max_examples=200)
@given(cases())
def test_an_interruption_after_every_event_changes_nothing(case: Case) -> None:
    harness = Harness(case.pattern, PLAIN)
    for each in case.stream:
        harness.feed(each)
        harness.interrupt()
    harness.pass_time(case.until)

    assert harness.found == run(case)


@settings(max_examples=100)
@given(cases())
def test_an_interruption_anywhere_changes_nothing(case: Case) -> None:
    expected = run(case)

    for position in range(len(case.stream) + 1):
        harness = Harness(case.pattern, PLAIN)
        for each in case.stream[:position]:
            harness.feed(each)
        harness.interrupt()
        for each in case.stream[position:]:
            harness.feed(each)
        harness.pass_time(case.until)
        assert harness.found == expected


@settings(max_examples=200)
@given(cases())
def test_an_interruption_while_time_passes_changes_nothing(case: Case) -> None:
    harness = Harness(case.pattern, PLAIN)
    for each in case.stream:
        harness.feed(each)
    harness.pass_time(case.until)
    harness.interrupt()
    harness.pass_time(case.end)

    assert harness.found == run(replace(case, until=case.end))


@settings(max_examples=200)
@given(cases())
def test_what_types_tell_in_advance_changes_nothing(case: Case) -> None:
    assert run(case, BY_TYPE) == run(case, PLAIN)


@settings(max_examples=200)
@given(cases())
def test_events_of_no_interest_need_not_be_fed(case: Case) -> None:
    case = replace(case, until=case.end)
    interesting = [each for each in case.stream if PLAIN.matches(case.pattern.interest, each.event)]

    assert told_apart(run(replace(case, stream=interesting))) == told_apart(run(case))


@settings(max_examples=200)
@given(cases())
def test_a_snapshot_names_what_is_held_and_nothing_once_every_deadline_is_over(case: Case) -> None:
    harness = Harness(case.pattern, PLAIN)
    for position, each in enumerate(case.stream):
        harness.feed(each)
        snapshot = msgspec.json.encode(harness.process.snapshot()).decode()
        held = {known.event.uid for known in harness.process.held()}
        assert held == {known.event.uid for known in case.stream[: position + 1] if str(known.event.uid) in snapshot}
        assert bool(held) == (harness.process.counts()["partial"] > 0)
    harness.pass_time(case.end)

    # Runs that nothing comes of are not waited for: they go with the next event, or when somebody says the time.
    assert list(harness.process.expire(case.end)) == []
    assert list(harness.process.held()) == []
    assert harness.process.counts()["partial"] == 0
    assert harness.process.counts()["dropped"] == 0
    assert harness.process.deadline() is None


@settings(max_examples=100)
@given(cases())
def test_each_rule_chooses_among_all_matches(case: Case) -> None:
    def found(rule: AfterMatch) -> set[tuple[Key, str, tuple[Any, ...]]]:
        ruled = replace(case, pattern=replace(case.pattern, after_match=rule))
        return {(each.key, each.output, each.taken) for each in run(ruled)}

    assert found(AfterMatch.PAST_LAST) <= found(AfterMatch.NEXT_START) <= found(AfterMatch.ALL)


@pytest.mark.parametrize("rule", list(AfterMatch))
def test_the_state_does_not_grow_with_the_partitions_seen(rule: AfterMatch) -> None:
    pattern = Pattern(
        name="quiet",
        version=1,
        type="Quiet",
        elements=[
            step("a", cues.is_a("A")),
            step("b", cues.is_a("B")).one_or_more(),
            absent(cues.is_a("C"), micros(2)),
        ],
        within=micros(5),
        partition=["object"],
        after_match=rule,
    )

    def size_after(partitions: int) -> int:
        harness = Harness(pattern, PLAIN)
        for number in range(partitions):
            for offset, name in enumerate(("A", "B")):
                uid = 2 * number + offset + 1
                harness.feed(fed(name, 100 * number + offset, uid=uid, features={"object": f"thing {number:04}"}))
        harness.pass_time(1_000_000)
        assert len(harness.found) == partitions
        return len(msgspec.json.encode(harness.process.snapshot()))

    assert size_after(200) <= size_after(2) + 50


def test_beyond_the_most_runs_the_one_that_began_first_is_dropped_and_counted() -> None:
    pattern = Pattern(
        name="few",
        version=1,
        type="Found",
        elements=[step("a", cues.is_a("A")), step("b", cues.is_a("B"))],
        within=micros(100),
        after_match="all",
        most_runs=2,
    )
    stream = [fed("A", 0, uid=1), fed("A", 1, uid=2), fed("A", 2, uid=3), fed("B", 3, uid=4)]
    harness = Harness(pattern, PLAIN)
    for each in stream:
        harness.feed(each)

    assert [begin(found) for found in harness.found] == [2, 3]
    assert harness.process.counts()["dropped"] == 1


def begin(found: Found) -> Any:
    """The number of the event at which a result begins."""
    return found.taken[0][1].int
