"""The evaluation: episodes that lose nothing by themselves, trials by hand, and a small table 5.1."""

from __future__ import annotations

import json
import math
from collections.abc import Collection
from types import MappingProxyType

import numpy as np
import pytest

from armem_bridge.forgetting import PCA, Exponential, Frequency, LatentSimilarity, Similarity, TimeDecay
from armem_bridge.memory_id import MemoryID
from armem_bridge.working.snapshot import Snapshot
from elm.errors import ElmError
from simulators.armem import forgetting
from simulators.armem.episodes import Episode, recorded
from simulators.armem.forgetting_trials import Trials
from simulators.armem.heard_beacons import plaza_episode
from simulators.armem.mechanism_rows import ROWS, Grid, Setting, settings
from simulators.armem.seen_things import household_episode
from tests.armem.forgetting.scenes import CUP, SECOND, snapshot
from tests.armem.working.scenes import update

HOUSEHOLD = household_episode(6, seconds=60)
PLAZA = plaza_episode("plaza2")

GRID = Grid(
    waits=(0.4, 100.0),
    distances=MappingProxyType({"mse": (0.002,), "mae": (0.02,), "cosine": (0.05,)}),
    idle=(55.0,),
    latent=(0.1,),
    size=8,
)


def ids(episode: Episode) -> list[MemoryID]:
    return [each.id for each, _ in episode.left]


def test_what_leaves_a_memory_server_is_everything_in_its_order() -> None:
    left = recorded("Object", [update(moment * SECOND, moment) for moment in (1, 2, 3, 4, 5)], limit=2)
    assert [(each.referenced // SECOND, at // SECOND) for each, at in left] == [(1, 3), (2, 4), (3, 5), (4, 5), (5, 5)]


@pytest.mark.parametrize("episode", [HOUSEHOLD, PLAZA], ids=lambda episode: episode.name)
def test_by_everything_everything_is_found_and_by_nothing_nothing(episode: Episode) -> None:
    assert episode.found(set(ids(episode))) == 1
    assert episode.found(set()) == 0


@pytest.mark.parametrize("episode", [HOUSEHOLD, PLAZA], ids=lambda episode: episode.name)
def test_what_is_kept_is_used_and_what_is_forgotten_is_not(episode: Episode) -> None:
    every_third = set(ids(episode)[::3])
    used, used_then = episode.used(set(ids(episode))), episode.used(every_third)
    assert used.keys() - every_third
    assert used_then.keys() <= every_third
    assert used_then.keys() - used.keys(), "others in their place"
    for found in (used, used_then):
        assert found
        assert all(snapshot.timestamp <= moment <= episode.end for snapshot, moment in found.items())


def test_the_latest_pictures_are_what_the_search_needs() -> None:
    pictures = sorted(ids(HOUSEHOLD))
    shares = [HOUSEHOLD.found(set(pictures[begin:])) for begin in range(0, len(pictures), 25)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] == 1
    assert len(set(shares)) >= 3


def test_a_beacon_is_found_by_readings_from_several_sides() -> None:
    readings = ids(PLAZA)
    assert PLAZA.found({each for each in readings if each.entity == "1"}) == 0.25
    assert PLAZA.found({each for number, each in enumerate(readings) if number % 10 == 0}) == 1
    # From one place a range is a circle.
    assert PLAZA.found(set(readings[:12])) == 0


def test_the_same_seed_gives_the_same_episode() -> None:
    again = household_episode(6, seconds=60)
    assert (again.left, again.end) == (HOUSEHOLD.left, HOUSEHOLD.end)
    assert again.used(set(ids(again))) == HOUSEHOLD.used(set(ids(again)))


def test_an_episode_in_which_nothing_is_seen_is_refused() -> None:
    with pytest.raises(ElmError, match="nothing is seen"):
        household_episode(1, seconds=0.4)


def episode(*values: float) -> Episode:
    """Snapshots a second apart, each leaving at its own time; those that are found are those kept."""
    left: list[tuple[Snapshot, int]] = [
        (snapshot(number * SECOND, value, value), number * SECOND) for number, value in enumerate(values)
    ]

    def share(kept: Collection[MemoryID]) -> float:
        return len(kept) / len(values)

    return Episode(
        name="by hand",
        left=tuple(left),
        used=lambda kept: {CUP.with_timestamp(0): 9 * SECOND},
        end=10 * SECOND,
        found=share,
    )


def test_a_trial_by_hand() -> None:
    trials = Trials(episode(0.0, 3.0, 10.0, 11.0))
    every_other = trials.run(Setting(frequency=Frequency(wait=2.0)))
    assert [each.id.timestamp // SECOND for each in every_other.snapshots] == [0, 2]
    assert (every_other.kept, every_other.found, every_other.offline) == (0.5, 0.5, 0.0)
    # 3 is as near to 0 as to 10, of which the earlier counts, and 11 to 10: (9 + 1) / 2.
    assert trials.error(every_other) == pytest.approx(math.sqrt(5))

    both = trials.run(
        Setting(
            similarity=Similarity(distance="mae", minimum=2.0),
            decay=TimeDecay(activation=Exponential(1.0), minimum=math.exp(-5)),
            latent=LatentSimilarity(distance="mae", minimum=1.0),
        )
    )
    # Online 11 goes, offline 3, which was used 9 s ago; 0 was used a second ago, 10 is the newest.
    assert [each.id.timestamp // SECOND for each in both.snapshots] == [0, 2]
    nothing = trials.run(Setting())
    assert (nothing.kept, trials.error(nothing), nothing.online, nothing.offline) == (1, 0, 0, 0)


def test_what_codes_lose_by_hand() -> None:
    # All on a line, so that one number is enough.
    assert Trials(episode(0.0, 3.0, 10.0)).encoded(PCA(1)) == pytest.approx(0, abs=1e-12)


def test_the_rows_are_those_of_table_5_1() -> None:
    used = {
        row.number: "".join(
            letter
            for letter, mechanism in zip("FSDL", (row.frequency, row.similarity, row.decay, row.latent), strict=True)
            if mechanism
        )
        for row in ROWS
    }
    assert [used[number] for number in range(1, 17)] == [
        "F",
        "S",
        "S",
        "D",
        "L",
        "FS",
        "FD",
        "FL",
        "FSD",
        "FSL",
        "FDL",
        "SD",
        "SL",
        "SDL",
        "DL",
        "FSDL",
    ]
    for row in ROWS:
        for setting in settings(row, GRID):
            assert len(setting.thresholds()) == len(used[row.number])


def test_a_small_table() -> None:
    steps: list[int] = []
    found = forgetting.compared([HOUSEHOLD, HOUSEHOLD], GRID, (4, 16), steps.append)
    assert sum(steps) * 2 == forgetting.STEPS
    rows = found["rows"]
    assert rows["2"]["safe"]["found_percent_of_each"] == [100, 100]
    assert rows["2"]["safe"]["kept_percent"] < 50
    assert rows["1"]["best"]["thresholds"] == {"delta_wait": 0.4}
    assert rows["1"]["best"]["kept_percent"] == pytest.approx(50, abs=1)
    for row in rows.values():
        for chosen in filter(None, (row["best"], row["safe"])):
            assert chosen["found_percent"] == 100
            assert chosen["kept_percent_of_each"][0] == chosen["kept_percent"]
            assert (chosen["error"] > 0) == (chosen["kept_percent"] < 100)
    assert {len(found["curves"]["1"]), len(found["curves"]["17"])} == {2, 1}
    four, sixteen = found["codes"]
    assert sixteen["pca"] < four["pca"] < four["random_projection"]

    text = forgetting.table({"household": found, "plaza": found})
    assert text.count("\n| (16) |") == 4
    widths = {line.count("|") for line in text.splitlines() if line.startswith("| (")}
    assert len(widths) == 2
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert np.isfinite(found["codes"][0]["pca"])
