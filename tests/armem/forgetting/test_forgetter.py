"""The forgetter: a plan changes nothing, and what then happens is what it said."""

from __future__ import annotations

import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.forgetting import (
    Applied,
    Candidate,
    Exponential,
    Forgetter,
    Frequency,
    InvalidMechanism,
    LatentSimilarity,
    Retention,
    TimeDecay,
    make_plan,
)
from armem_bridge.forgetting.mechanisms import Offline
from tests.armem.forgetting.scenes import CUP, PLATE, SECOND, Remembering, candidate

NOW = 100 * SECOND
MECHANISMS: list[Offline] = [
    TimeDecay(activation=Exponential(50.0), minimum=0.2),
    Frequency(wait=2.0),
    LatentSimilarity(distance="mse", minimum=1.0),
    Retention(total_count=4),
]


def some(values: list[int]) -> list[Candidate]:
    return [
        candidate(number * SECOND, float(value), entity=PLATE if value % 2 else CUP)
        for number, value in enumerate(values)
    ]


@given(st.lists(st.integers(0, 5), max_size=30), st.integers(1, 7))
def test_a_dry_run_changes_nothing_and_tells_what_then_happens(values: list[int], batch: int) -> None:
    candidates = some(values)
    memory = Remembering(candidates)
    before = copy.deepcopy((memory.snapshots, candidates))

    made = make_plan(candidates, MECHANISMS, now=NOW)
    assert (memory.snapshots, candidates) == before
    assert make_plan(candidates, MECHANISMS, now=NOW) == made

    told: list[int] = []
    done = Forgetter(memory, batch=batch).apply(made, progress=told.append)
    assert memory.snapshots == before[0] - set(made.snapshots)
    assert done == Applied(planned=len(made.going), forgotten=len(made.going))
    assert max(memory.calls, default=0) <= batch
    assert sum(memory.calls) == max(told, default=0) == len(made.going)


def test_a_plan_can_be_applied_again() -> None:
    candidates = some([0] * 9)
    memory = Remembering(candidates)
    made = make_plan(candidates, [LatentSimilarity(distance="mse", minimum=1.0)], now=NOW)
    memory.held = {made.snapshots[0]}
    forgetter = Forgetter(memory)
    assert forgetter.apply(made) == Applied(planned=8, forgotten=7)
    assert forgetter.apply(made).left == 8
    memory.held = set()
    assert forgetter.apply(made).forgotten == 1
    assert memory.snapshots == {candidates[-1].id}


def test_an_empty_plan_asks_nothing_of_the_memory() -> None:
    memory = Remembering([])
    assert Forgetter(memory).apply(make_plan([], MECHANISMS, now=NOW)) == Applied(planned=0, forgotten=0)
    assert memory.calls == []


@pytest.mark.parametrize("batch", [0, -1, True])
def test_a_batch_has_one_snapshot_at_least(batch: int) -> None:
    with pytest.raises(InvalidMechanism, match="at once"):
        Forgetter(Remembering([]), batch=batch)
