"""Algorithm 1: each mechanism alone, all together, at the thresholds, and what is remembered of an entity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations, product
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.forgetting import (
    Candidate,
    Exponential,
    Frequency,
    InvalidMechanism,
    LatentSimilarity,
    OnlineForgetting,
    Retention,
    Similarity,
    TimeDecay,
)
from armem_bridge.forgetting.mechanisms import Online
from armem_bridge.working import Evicted
from armem_bridge.working.access_statistics import Usage
from tests.armem.forgetting.scenes import CUP, PLATE, SECOND, candidate, snapshot

DECAY = TimeDecay(activation=Exponential(10.0), minimum=math.exp(-1))
FREQUENCY = Frequency(wait=0.2)
SIMILARITY = Similarity(distance="mae", minimum=2.0)

LAST = 100 * SECOND
"""The reference time of what was consolidated last, whose value is 10.0."""
FITS = {"used": 0, "now": 10 * SECOND, "moment": LAST + SECOND // 5, "value": 12.0}
"""Just enough for each of the three: used 10 s ago, 0.2 s after the last, 2 away from it."""


def judged(mechanisms: Sequence[Online], *, used: int, now: int, moment: int, value: float) -> bool:
    forgetting = OnlineForgetting(mechanisms)
    forgetting.consolidated(candidate(LAST, 10.0))
    return forgetting.decide(candidate(moment, value, used=used), now).keep


@pytest.mark.parametrize(
    ("change", "decay", "frequency", "similarity"),
    [
        ({}, True, True, True),
        # A microsecond longer ago is too long.
        ({"now": 10 * SECOND + 1}, False, True, True),
        # How long it takes to be consolidated is nothing to the frequency.
        ({"now": 1000 * SECOND, "moment": LAST + SECOND // 5 - 1}, False, False, True),
        ({"moment": LAST + SECOND // 5 - 1}, True, False, True),
        # What comes late has a place of its own if it is far enough.
        ({"moment": LAST - SECOND // 5}, True, True, True),
        ({"moment": LAST - SECOND // 5 + 1}, True, False, True),
        ({"value": 11.9}, True, True, False),
        # The distance has no sign.
        ({"value": 8.0}, True, True, True),
        ({"value": 8.1}, True, True, False),
        # The clock was set back.
        ({"now": -1}, True, True, True),
    ],
)
def test_a_snapshot_is_kept_only_if_every_mechanism_keeps_it(
    change: dict[str, Any], decay: bool, frequency: bool, similarity: bool
) -> None:
    says: list[tuple[Online, bool]] = [(DECAY, decay), (FREQUENCY, frequency), (SIMILARITY, similarity)]
    for chosen in product((True, False), repeat=3):
        used = [each for each, wanted in zip(says, chosen, strict=True) if wanted]
        for ordered in permutations(used):
            assert judged([mechanism for mechanism, _ in ordered], **FITS | change) == all(keep for _, keep in ordered)


def test_similarity_is_to_the_mean_of_the_last_n() -> None:
    def keeps(count: int, value: float) -> bool:
        forgetting = OnlineForgetting([Similarity(distance="mae", minimum=2.0, count=count)])
        for moment, known in enumerate([100.0, 0.0, 4.0]):
            forgetting.consolidated(candidate(moment, known))
        return forgetting.decide(candidate(9, value), 9).keep

    # The last: 4. The last two: 0 and 4. The last three: also 100, which is the first and not the last.
    assert [keeps(1, value) for value in (1.9, 2.1, 5.9, 6.0)] == [True, False, False, True]
    assert [keeps(2, value) for value in (0.1, 2.0, 3.9, 4.1)] == [True, True, True, True]
    assert [keeps(3, value) for value in (2.0, 100.0)] == [True, True]
    close = OnlineForgetting([Similarity(distance="mse", minimum=5.0, count=2)])
    for moment, known in enumerate([100.0, 0.0, 4.0]):
        close.consolidated(candidate(moment, known))
    # (2^2 + 2^2) / 2 = 4, (3^2 + 1^2) / 2 = 5.
    assert [close.decide(candidate(9, value), 9).keep for value in (2.0, 3.0)] == [False, True]


def test_the_first_snapshot_of_an_entity_is_kept() -> None:
    forgetting = OnlineForgetting([Frequency(wait=1e9), Similarity(distance="mse", minimum=1e9)])
    assert forgetting.decide(candidate(1), 1).keep
    forgetting.consolidated(candidate(1))
    assert not forgetting.decide(candidate(2), 2).keep
    assert forgetting.decide(candidate(2, entity=PLATE), 2).keep


def test_deciding_changes_nothing() -> None:
    forgetting = OnlineForgetting([FREQUENCY, SIMILARITY])
    assert [forgetting.decide(candidate(1), 1).keep for _ in range(3)] == [True, True, True]
    forgetting.consolidated(candidate(1))
    assert [forgetting.decide(candidate(2), 2).keep for _ in range(2)] == [False, False]


def test_versions_of_what_is_consolidated_or_forgotten() -> None:
    def version(moment: int, sent: int) -> Candidate:
        return Candidate.of(snapshot(moment, 1.0, sent=sent))

    forgetting = OnlineForgetting([Frequency(wait=1.0)])
    forgetting.consolidated(version(0, 5))
    forgetting.forgotten(version(9, 5))
    assert [forgetting.decide(version(0, sent), 9).keep for sent in (4, 5, 6)] == [False, True, True]
    assert forgetting.decide(version(0, 4), 9).why == "version: -1e-06 < 0"
    told = [forgetting.decide(version(9, sent), 9).why for sent in (4, 5, 6)]
    assert told == ["version: -1e-06 < 1e-06", "version: 0 < 1e-06", "frequency: 9e-06 < 1"]


def test_what_comes_late_is_compared_with_what_is_next_to_it() -> None:
    forgetting = OnlineForgetting([Frequency(wait=2.0), Similarity(distance="mae", minimum=2.0, count=2)])
    for second, value in ((0, 0.0), (10, 4.0), (20, 8.0), (30, 100.0)):
        forgetting.consolidated(candidate(second * SECOND, value))

    def why(second: int, value: float) -> str:
        return forgetting.decide(candidate(second * SECOND, value), 0).why

    assert why(21, 0.0) == "frequency: 1 < 2"
    assert why(19, 0.0) == "frequency: 1 < 2"
    assert why(25, 7.0) == "frequency: 5 >= 2; similarity: 2 >= 2"
    assert why(12, 2.0) == "frequency: 2 >= 2; similarity: 2 >= 2"
    assert why(35, 54.0) == "frequency: 5 >= 2; similarity: 46 >= 2"


def test_what_cannot_be_compared_is_kept() -> None:
    forgetting = OnlineForgetting([SIMILARITY])
    for moment, value in enumerate(["cup", "cup", 1.0, [1.0], 1.0, 1.0]):
        decision = forgetting.decide(candidate(moment, value), moment)
        assert decision.keep == (moment != 5)
        if decision.keep:
            forgetting.consolidated(candidate(moment, value))


def test_a_zero_threshold_keeps_all() -> None:
    forgetting = OnlineForgetting(
        [
            TimeDecay(activation=Exponential(1e-3), minimum=0.0),
            Frequency(wait=0.0),
            Similarity(distance="cosine", minimum=0.0),
        ]
    )
    for _ in range(3):
        assert forgetting.decide(candidate(5), 10**15).keep
        forgetting.consolidated(candidate(5))


def test_without_mechanisms_everything_is_kept() -> None:
    decision = OnlineForgetting().decide(candidate(1), 1)
    assert decision.keep
    assert decision.why == "no mechanism is used"


def test_decisions_say_why() -> None:
    forgetting = OnlineForgetting([SIMILARITY, FREQUENCY, DECAY])
    forgetting.consolidated(candidate(LAST, 10.0))
    later = LAST + 5 * SECOND
    kept = forgetting.decide(candidate(later, 12.5, used=0), 5 * SECOND)
    assert kept.why == "time decay: 0.6065 >= 0.3679; frequency: 5 >= 0.2; similarity: 2.5 >= 2"
    forgotten = forgetting.decide(candidate(later, 10.5, used=0), 5 * SECOND)
    assert forgotten.why == "time decay: 0.6065 >= 0.3679; frequency: 5 >= 0.2; similarity: 0.5 < 2"
    assert forgotten.snapshot == CUP.with_timestamp(later)
    # Nobody asks further once one forgets it.
    assert forgetting.decide(candidate(later, 10.5, used=0), LAST).why == "time decay: 4.54e-05 < 0.3679"


@pytest.mark.parametrize(
    ("usage", "arrived", "used"),
    [(Usage(count=1, last=7), 5, 7), (Usage(), 5, 5), (Usage(), -1, 3), (Usage(count=1, last=0), 5, 0)],
)
def test_last_used_is_the_last_query_else_the_arrival_else_the_reference_time(
    usage: Usage, arrived: int, used: int
) -> None:
    found = Candidate.evicted(Evicted(snapshot=snapshot(3, 1.0, arrived=arrived), usage=usage))
    assert found.used == used
    assert found.entity == CUP


def test_idle_is_measured_from_now_and_not_from_the_reference_time() -> None:
    old = candidate(1, used=10 * SECOND)
    assert old.idle(12 * SECOND) == 2.0
    assert old.idle(9 * SECOND) == 0.0


@given(
    st.lists(st.tuples(st.integers(1, 30), st.integers(0, 6)), max_size=25),
    st.integers(0, 8),
    st.integers(0, 4),
    st.integers(1, 3),
)
def test_against_a_plain_rendering_of_algorithm_1(
    stream: list[tuple[int, int]], wait: int, minimum: int, count: int
) -> None:
    forgetting = OnlineForgetting(
        [Frequency(wait=float(wait)), Similarity(distance="mae", minimum=minimum, count=count)]
    )
    stored: list[tuple[int, int]] = []
    now = 0
    for step, value in stream:
        now += step
        keep = True
        if stored and now - stored[-1][0] < wait:
            keep = False
        if stored and keep:
            last = stored[-count:]
            keep = sum(abs(value - known) for _, known in last) / len(last) >= minimum
        one = candidate(now * SECOND, float(value))
        assert forgetting.decide(one, now * SECOND).keep == keep
        if keep:
            stored.append((now, value))
            forgetting.consolidated(one)


def test_mechanisms_that_cannot_be_combined() -> None:
    with pytest.raises(InvalidMechanism, match="frequency 2 times"):
        OnlineForgetting([FREQUENCY, Frequency(wait=1.0)])
    offline: list[Any] = [Retention(count=1), LatentSimilarity(distance="mse", minimum=1)]
    for mechanism in offline:
        with pytest.raises(InvalidMechanism, match="online forgetting knows"):
            OnlineForgetting([mechanism])


def test_the_published_threshold_of_time_decay_is_refused() -> None:
    with pytest.raises(InvalidMechanism, match=r"at least 0 and at most 1, not 1\.679"):
        TimeDecay(activation=Exponential(), minimum=1.679)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Frequency(wait=-0.1),
        lambda: Frequency(wait=math.nan),
        lambda: Similarity(distance="euclid", minimum=1),
        lambda: Similarity(distance="mse", minimum=-1),
        lambda: Similarity(distance="mse", minimum=1, count=0),
        lambda: LatentSimilarity(distance="cos", minimum=1),
        lambda: LatentSimilarity(distance="mse", minimum=1, count=0),
        lambda: TimeDecay(activation=None, minimum=0.5),  # type: ignore[arg-type]
        lambda: Retention(count=-1),
        lambda: Retention(size=True),
        lambda: Retention(age=-1.0),
    ],
)
def test_thresholds_that_cannot_be(make: Any) -> None:
    with pytest.raises(InvalidMechanism):
        make()
