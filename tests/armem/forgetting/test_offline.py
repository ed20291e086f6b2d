"""Offline forgetting: each mechanism against sets found by brute force, all together, budgets, and what stays."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations, permutations
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armem_bridge.forgetting import (
    PCA,
    Candidate,
    Encoder,
    Exponential,
    Frequency,
    InvalidMechanism,
    LatentSimilarity,
    RandomProjection,
    Retention,
    Similarity,
    TimeDecay,
    make_plan,
)
from armem_bridge.forgetting.mechanisms import Offline
from tests.armem.forgetting.scenes import CUP, PLATE, SECOND, candidate

NOW = 1_000 * SECOND
NEAR = LatentSimilarity(distance="mae", minimum=2.0)


def kept(candidates: Sequence[Candidate], *mechanisms: Offline, **options: Any) -> list[int]:
    """The reference times in seconds of what a plan leaves."""
    going = set(make_plan(candidates, mechanisms, now=NOW, **options).snapshots)
    return [each.id.timestamp // SECOND for each in candidates if each.id not in going]


def history(*values: object) -> list[Candidate]:
    """Snapshots of the cup, a second apart, the first at 0 s."""
    return [candidate(number * SECOND, value) for number, value in enumerate(values)]


# Algorithm 3


def test_of_alike_snapshots_the_newest_stays() -> None:
    assert kept(history(5.0, 5.0, 5.0), NEAR) == [2]
    assert kept(history(5.0, 5.5, 4.5, 9.0), NEAR) == [2, 3]


def test_at_the_threshold_a_snapshot_stays() -> None:
    assert kept(history(2.0, 0.0), NEAR) == [0, 1]
    assert kept(history(1.9, 0.0), NEAR) == [1]
    assert kept(history(0.0, 0.0), LatentSimilarity(distance="mae", minimum=0.0)) == [0, 1]


def test_a_slow_drift_is_not_forgotten_as_a_whole() -> None:
    # Each is similar to the next; what goes is similar to one that stays.
    assert kept(history(*[float(value) for value in range(7)]), NEAR) == [0, 2, 4, 6]


def test_only_the_last_n_that_stay_are_looked_at() -> None:
    there_and_back = history(0.0, 50.0, 0.0, 50.0)
    assert kept(there_and_back, LatentSimilarity(distance="mae", minimum=2.0, count=1)) == [0, 1, 2, 3]
    assert kept(there_and_back, LatentSimilarity(distance="mae", minimum=2.0, count=2)) == [2, 3]
    assert kept(there_and_back, NEAR) == [2, 3]


def test_the_last_n_are_those_that_stayed_last_whatever_they_are_like() -> None:
    last = LatentSimilarity(distance="mae", minimum=2.0, count=1)
    made = make_plan(history(50.5, 50.0, 0.0), [last], now=NOW)
    assert [each.why for each in made.going] == ["mae 0.5 from 1000000, < 2"]
    assert kept(history(1.0, [1.0], 1.0), last) == [0, 1, 2]
    assert kept(history(1.0, [1.0], 1.0), LatentSimilarity(distance="mae", minimum=2.0, count=2)) == [1, 2]


def test_the_nearest_of_them_counts_and_not_their_mean() -> None:
    assert kept(history(0.0, 50.0, 0.5), NEAR) == [1, 2]


def test_what_cannot_be_compared_stays() -> None:
    assert kept(history("cup", "cup", 1.0, [1.0], 1.0, [1.0], "cup"), NEAR) == [0, 1, 4, 5, 6]
    assert kept(history({"x": 1.0, "name": "a"}, {"x": 1.0, "name": "b"}, {"x": 1.0, "name": "a"}), NEAR) == [1, 2]


def test_entities_have_nothing_to_do_with_each_other() -> None:
    both = [candidate(1, 5.0), candidate(2, 5.0, entity=PLATE), candidate(3, 5.0), candidate(4, 5.0, entity=PLATE)]
    going = make_plan(both, [NEAR], now=NOW)
    assert [(each.snapshot.entity, each.snapshot.timestamp) for each in going.going] == [("cup", 1), ("plate", 2)]


def only_set(candidates: Sequence[Candidate], stays: Callable[[Candidate, list[Candidate]], bool]) -> list[int]:
    """The only set of snapshots each of which stays by those of the set that are later, all others not staying."""
    found = []
    for size in range(len(candidates) + 1):
        for chosen in combinations(candidates, size):
            later = {
                each.id: [other for other in chosen if other.id.timestamp > each.id.timestamp] for each in candidates
            }
            if all((each in chosen) == stays(each, later[each.id]) for each in candidates):
                found.append([each.id.timestamp // SECOND for each in chosen])
    (one,) = found
    return one


def value_of(one: Candidate) -> float:
    (instance,) = one.snapshot.instances
    assert instance.data is not None
    number = instance.data.elements["value"]
    return float(getattr(number, "value", math.nan))


VALUES = st.lists(st.integers(0, 9).map(float), min_size=1, max_size=8)


@given(VALUES, st.integers(0, 5), st.none() | st.integers(1, 4))
def test_similarity_leaves_the_only_set_that_keeps_its_promise(
    values: list[float], minimum: int, count: int | None
) -> None:
    def stays(one: Candidate, later: list[Candidate]) -> bool:
        window = later if count is None else later[:count]
        return all(abs(value_of(one) - value_of(other)) >= minimum for other in window)

    candidates = history(*values)
    mechanism = LatentSimilarity(distance="mae", minimum=float(minimum), count=count)
    assert kept(candidates, mechanism) == only_set(candidates, stays)


@given(st.lists(st.integers(0, 30), min_size=1, max_size=8, unique=True), st.integers(0, 6))
def test_frequency_leaves_the_only_set_that_keeps_its_promise(seconds: list[int], wait: int) -> None:
    candidates = [candidate(each * SECOND) for each in sorted(seconds)]

    def stays(one: Candidate, later: list[Candidate]) -> bool:
        return not later or later[0].id.timestamp - one.id.timestamp >= wait * SECOND

    assert kept(candidates, Frequency(wait=float(wait))) == only_set(candidates, stays)


def test_distances_are_those_of_codes_where_there_is_an_encoder() -> None:
    # Along the line they vary most; across it they differ too, which a code of one number does not say.
    points = history([0.0, 0.0], [10.0, 0.5], [20.0, 0.0], [10.0, -0.5])

    def by(encoder: Encoder | None) -> list[int]:
        return kept(points, LatentSimilarity(distance="mae", minimum=0.4, encoder=encoder))

    assert by(None) == by(PCA(2)) == [0, 1, 2, 3]
    assert by(PCA(1)) == [0, 2, 3]


@pytest.mark.parametrize("encoder", [PCA(2), RandomProjection(2)])
def test_an_encoder_learns_from_each_kind_of_snapshots_by_itself(encoder: Any) -> None:
    mixed = history([0.0, 0.0], 7.0, [math.nan, 1.0], [0.0, 0.0], 7.0, [math.nan, 1.0], "cup")
    assert kept(mixed, LatentSimilarity(distance="cosine", minimum=1e-6, encoder=encoder)) == [3, 4, 5, 6]


# Decay


def test_decay_goes_by_the_time_since_the_last_use() -> None:
    decay = TimeDecay(activation=Exponential(100.0), minimum=math.exp(-1))
    candidates = [
        candidate(0, used=NOW - 100 * SECOND),
        candidate(1 * SECOND, used=NOW - 100 * SECOND - 1),
        candidate(2 * SECOND, used=NOW),
        candidate(3 * SECOND, used=0),
    ]
    # The third was used just now though it is old, the fourth is the newest.
    assert kept(candidates, decay) == [0, 2, 3]
    assert kept(candidates, decay, keep_newest=False) == [0, 2]


# Budgets


def test_budgets_of_an_entity() -> None:
    candidates = [candidate(each * SECOND, size=10) for each in range(5)]
    assert kept(candidates, Retention(count=2)) == [3, 4]
    assert kept(candidates, Retention(size=39)) == [2, 3, 4]
    assert kept(candidates, Retention(size=40)) == [1, 2, 3, 4]
    assert kept(candidates, Retention(age=997.0)) == [3, 4]
    assert kept(candidates, Retention(age=996.999)) == [4]
    assert kept(candidates, Retention(count=3, size=20)) == [3, 4]
    assert kept(candidates, Retention()) == [0, 1, 2, 3, 4]


def test_budgets_of_all_entities_together() -> None:
    both = [candidate(each * SECOND, entity=CUP if each % 2 else PLATE, size=each) for each in range(6)]
    assert kept(both, Retention(total_count=3)) == [3, 4, 5]
    assert kept(both, Retention(total_size=9)) == [4, 5]
    assert kept(both, Retention(count=2)) == [2, 3, 4, 5]


def test_the_newest_stay_and_the_plan_says_which_budget_that_breaks() -> None:
    both = [candidate(1, size=100), candidate(2, size=100), candidate(1, entity=PLATE, size=100)]
    going = make_plan(both, [Retention(count=0, total_size=150, age=1.0)], now=NOW)
    assert going.snapshots == (CUP.with_timestamp(1),)
    assert going.unmet == (
        f"1 snapshots of {CUP} stay, over the budget of 0: the newest snapshots of entities are kept",
        f"1 snapshots of {PLATE} stay, over the budget of 0: the newest snapshots of entities are kept",
        "200 bytes in all stay, over the budget of 150: the newest snapshots of entities are kept",
    )
    everything = make_plan(both, [Retention(count=0, total_size=150, age=1.0)], now=NOW, keep_newest=False)
    assert (len(everything.going), everything.unmet) == (3, ())


# Everything together


SNAPSHOTS = st.lists(
    st.builds(
        candidate,
        st.integers(0, 12).map(lambda second: second * SECOND),
        st.integers(0, 3).map(float) | st.sampled_from(["cup", "mug"]),
        entity=st.sampled_from([CUP, PLATE]),
        used=st.integers(0, 1000).map(lambda second: second * SECOND),
        size=st.integers(0, 20),
    ),
    max_size=14,
    unique_by=lambda each: each.id,
)
SOME = st.integers(0, 6)
MECHANISMS = st.tuples(
    st.none() | st.builds(TimeDecay, activation=st.just(Exponential(300.0)), minimum=st.floats(0, 1)),
    st.none() | st.builds(Frequency, wait=SOME.map(float)),
    st.none() | st.builds(LatentSimilarity, distance=st.just("mse"), minimum=SOME.map(float)),
    st.none()
    | st.builds(
        Retention,
        count=st.none() | SOME,
        size=st.none() | st.integers(0, 60),
        age=st.none() | st.integers(986, 1000).map(float),
        total_count=st.none() | SOME,
        total_size=st.none() | st.integers(0, 60),
    ),
).map(lambda all_: [each for each in all_ if each is not None])


@given(SNAPSHOTS, MECHANISMS, st.randoms(use_true_random=False))
def test_the_order_of_what_is_given_does_not_matter(
    candidates: list[Candidate], mechanisms: list[Offline], chance: Any
) -> None:
    expected = make_plan(candidates, mechanisms, now=NOW)
    for ordered in permutations(mechanisms):
        shuffled = chance.sample(candidates, len(candidates))
        assert make_plan(shuffled, ordered, now=NOW) == expected


@given(SNAPSHOTS, MECHANISMS)
def test_the_newest_of_each_entity_stays(candidates: list[Candidate], mechanisms: list[Offline]) -> None:
    going = set(make_plan(candidates, mechanisms, now=NOW).snapshots)
    for entity in (CUP, PLATE):
        snapshots = [each.id for each in candidates if each.entity == entity]
        assert not snapshots or max(snapshots) not in going


@given(SNAPSHOTS, MECHANISMS, st.booleans())
def test_budgets_are_kept_or_the_plan_says_so(
    candidates: list[Candidate], mechanisms: list[Offline], keep_newest: bool
) -> None:
    made = make_plan(candidates, mechanisms, now=NOW, keep_newest=keep_newest)
    left = [each for each in candidates if each.id not in set(made.snapshots)]
    budgets = [each for each in mechanisms if isinstance(each, Retention)]
    broken = False
    for budget in budgets:
        limits = [
            *(([each for each in left if each.entity == entity], budget.count, budget.size) for entity in (CUP, PLATE)),
            (left, budget.total_count, budget.total_size),
        ]
        for group, count, size in limits:
            broken |= count is not None and len(group) > count
            broken |= size is not None and sum(each.size for each in group) > size
    assert broken == bool(made.unmet)
    if not keep_newest:
        assert not broken
    if broken:
        newest = {max(each.id for each in candidates if each.entity == entity) for entity in {e.entity for e in left}}
        assert newest <= {each.id for each in left}


@given(SNAPSHOTS, MECHANISMS)
def test_sums_and_groups_of_a_plan_add_up(candidates: list[Candidate], mechanisms: list[Offline]) -> None:
    made = make_plan(candidates, mechanisms, now=NOW)
    sizes = {each.id: each.size for each in candidates}
    assert (made.looked_at, made.size) == (len(candidates), sum(sizes.values()))
    assert made.freed == sum(sizes[each] for each in made.snapshots)
    assert sum(made.by_mechanism().values()) == len(made.snapshots) == len(set(made.snapshots))
    assert list(made.snapshots) == sorted(made.snapshots)
    assert {entity: [each.snapshot for each in going] for entity, going in made.by_entity().items()} == {
        entity: [each for each in made.snapshots if each.entity_id == entity]
        for entity in {each.entity_id for each in made.snapshots}
    }


def test_each_mechanism_works_on_what_those_before_it_left() -> None:
    candidates = [
        candidate(0, 5.0, used=NOW),
        candidate(1 * SECOND, 5.0, used=0),
        candidate(10 * SECOND, 5.0, used=NOW),
        candidate(11 * SECOND, 9.0, used=NOW),
        candidate(12 * SECOND, 20.0, used=NOW),
        candidate(13 * SECOND, 30.0, used=NOW),
    ]
    mechanisms: list[Offline] = [
        Retention(count=2),
        NEAR,
        Frequency(wait=2.0),
        TimeDecay(activation=Exponential(100.0), minimum=0.5),
    ]
    made = make_plan(candidates, mechanisms, now=NOW)
    assert [(each.snapshot.timestamp // SECOND, each.mechanism, each.why) for each in made.going] == [
        (0, "retention", "over 2 snapshots of its entity"),
        (1, "time decay", "not used for 1000.0 s, activation 4.54e-05 < 0.5"),
        (10, "frequency", "1 s before 11000000, < 2 s"),
        (12, "frequency", "1 s before 13000000, < 2 s"),
    ]
    assert made.by_mechanism() == {"time decay": 1, "frequency": 2, "retention": 1}


def test_a_plan_as_a_text() -> None:
    made = make_plan([*history(5.0, 5.5, 9.0), candidate(7, 1.0, entity=PLATE)], [NEAR], now=NOW)
    assert list(made.lines()) == [
        "1 of 4 snapshots would go, 10 of 40 bytes",
        f"{CUP}: 1",
        "  0  latent similarity: mae 0.5 from 1000000, < 2",
    ]


def test_one_snapshot_given_twice_is_one() -> None:
    made = make_plan([candidate(1, 5.0, size=1), candidate(1, 5.0, size=2), candidate(2, 9.0)], [NEAR], now=NOW)
    assert (made.looked_at, made.size, made.going) == (2, 12, ())


def test_nothing_at_all() -> None:
    made = make_plan([], [Retention(total_count=0)], now=NOW)
    assert (made.looked_at, made.size, made.snapshots, made.freed, made.unmet) == (0, 0, (), 0, ())


def test_mechanisms_that_cannot_be_combined() -> None:
    online: list[Any] = [Similarity(distance="mse", minimum=1)]
    with pytest.raises(InvalidMechanism, match="offline forgetting knows"):
        make_plan([], online, now=NOW)
    with pytest.raises(InvalidMechanism, match="retention 2 times"):
        make_plan([], [Retention(count=1), Retention(age=1)], now=NOW)
