"""Tests of the evaluation of ArmarX-style memory: its objects, its samples and turns, and a small run as a whole."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armem_bridge.aron.data import NDArray
from armem_bridge.aron.realization import Level, realizes
from armem_bridge.ice.installation import load_ice, slice_directory
from armem_bridge.ice.refusals import IceMissing
from armem_bridge.working import Commit, CommitResult, Memory, MemoryServer, Query, QueryTarget
from elm.errors import StoreFailure
from simulators.__main__ import main
from simulators.armem import batches, evaluation
from simulators.armem.data_objects import IMAGE, KINDS, Kind, information
from simulators.armem.preloaded import BEGIN, ENTRIES, at, batch, entity, latest, make_server
from simulators.armem.processes import Process
from simulators.armem.series import in_microseconds
from tests.servers import Server

SMALL = ("--quick", "--samples", "2", "--snapshots", "40")


@pytest.fixture
def ice() -> None:
    """Skips where there is no Ice for this Python."""
    try:
        load_ice()
        slice_directory()
    except IceMissing as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def dsn(postgres_server: Server) -> Iterator[str]:
    """A database of these tests."""
    with postgres_server.database() as address:
        yield address


def measured(tmp_path: Path, *arguments: str) -> dict[str, Any]:
    """What the command writes, after it ended well."""
    file = tmp_path / "armem.json"
    assert main(["armem", *SMALL, *arguments, "--json", str(file)]) == 0
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


# The data objects


@pytest.mark.parametrize(("name", "size"), [("simple", 8), ("moderate", 33), ("complex", 49_225)])
def test_the_objects_have_as_much_information_as_in_the_thesis(name: str, size: int) -> None:
    kind = KINDS[name]
    assert kind.information == size
    for number in (0, 7):
        data = kind.make(number).to_aron()
        assert information(data, kind.type_object) == size
        assert realizes(data, kind.type_object).level is Level.FULL
        assert kind.business_class.from_aron(data) == kind.make(number)
    assert kind.make(0) != kind.make(7)


def test_most_of_the_complex_object_is_an_image() -> None:
    made = KINDS["complex"].make(3)
    image = made.to_aron().elements["image"]
    assert isinstance(image, NDArray)
    assert image.shape == (*IMAGE, 1)
    assert information(image, KINDS["complex"].type_object.members["image"]) == 49_152
    assert np.array_equal(KINDS["complex"].business_class.from_aron(made.to_aron()).image, made.image)


# The memories


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_memory_has_a_thousand_entries_whatever_is_committed(kind: Kind) -> None:
    data = [kind.make(number).to_aron() for number in (1, 2, 3)]
    with make_server(kind) as server:
        assert server.status().snapshots == ENTRIES
        assert server.commit(batch(kind, data, ENTRIES)).success
        assert server.status().snapshots == ENTRIES
        found = server.query(latest(kind, 3))
        assert [instance.data for _, instance in found.instances()] == data
        (one,) = server.query(at(kind, BEGIN + ENTRIES + 1, QueryTarget.WM)).snapshots()
        assert one.instances[0].data == data[1]
        assert one.id.entity_id == entity(kind)


# Samples and turns


class Watched:
    """A memory server, and when it was called."""

    def __init__(self, server: MemoryServer) -> None:
        self._server = server
        self.committed: list[int] = []
        self.asked = 0

    def commit(self, commit: Commit) -> CommitResult:
        self.committed.append(commit.updates[0].referenced)
        return self._server.commit(commit)

    def query(self, query: Query) -> Memory:
        self.asked += 1
        return self._server.query(query)


def test_every_sample_commits_and_queries_on_each_side() -> None:
    kind = KINDS["moderate"]
    advanced: list[int] = []
    with make_server(kind) as server:
        other = Watched(server)
        found = batches.measure(kind, 5, samples=4, remote=other, first=count(1), advance=advanced.append)
        assert server.status().commits == 1 + 1 + 4
    assert advanced == [1] * 4
    assert other.committed == [BEGIN + number * ENTRIES for number in range(1, 6)], "one to begin with, not measured"
    assert other.asked == 5
    parts = {"to_aron", "commit", "commit_alone", "from_aron", "query", "query_alone"}
    assert found.keys() == {"core", "ice"}
    assert found["ice"].keys() == parts
    assert found["core"].keys() == parts | {"store", "lookup"}
    for side in found.values():
        assert {series["count"] for series in side.values()} == {4}
        assert side["commit"]["mean"] == pytest.approx(side["to_aron"]["mean"] + side["commit_alone"]["mean"], abs=0.05)
        assert side["query"]["mean"] == pytest.approx(side["from_aron"]["mean"] + side["query_alone"]["mean"], abs=0.05)


def test_a_memory_that_does_not_give_back_what_it_got_is_not_measured() -> None:
    with make_server(KINDS["complex"]) as other, pytest.raises(StoreFailure, match="side 'ice' gave back 0 of 2"):
        batches.measure(KINDS["simple"], 2, samples=1, remote=other, first=count(1), advance=lambda _: None)


def test_series_are_told_in_microseconds_with_their_variance() -> None:
    assert in_microseconds([1e-6, 3e-6, 8e-6]) == {
        "count": 3,
        "mean": 4.0,
        "variance": pytest.approx(26 / 3, abs=0.01),
        "median": 3.0,
        "p95": 7.5,
        "max": 8.0,
    }


def test_a_process_that_ends_early_is_told() -> None:
    with (
        Process("simulators.armem.series") as silent,
        pytest.raises(StoreFailure, match=r"simulators\.armem\.series ended before it answered"),
    ):
        silent.line()


# The command


def test_a_small_run_has_all_figures(ice: None, dsn: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = measured(tmp_path, "--dsn", dsn)
    assert found["information"] == {"simple": 8, "moderate": 33, "complex": 49_225}
    assert found["goals"].keys() == set(evaluation.GOALS)
    for name in evaluation.GOALS:
        assert math.isfinite(found[name])
        assert found["goals"][name]["value"] == found[name] > 0
    for name in KINDS:
        calls = found["calls"][name]
        counts = {call: series["count"] for call, series in calls.items() if isinstance(series, dict)}
        assert counts == {call: 4 if call in ("commit", "query", "echo") else 2 for call in counts}
        assert {*counts} == {
            *("commit", "query", "echo", "bare_commit", "bare_query", "ping", "core_commit", "core_query")
        }
        for call in ("commit", "query"):
            assert calls[f"{call}_vs_echo"] > 0
            assert calls[f"{call}_vs_bare_{call}"] > 0
            assert calls[f"core_{call}"]["median"] > 0
        assert found["batches"][name].keys() == {"1", "20", "50", "100"}
        assert all(sides.keys() == {"core", "ice"} for sides in found["batches"][name].values())
        assert found["ages"][name].keys() == {"direct", "topic", "memory"}
        kept = found["long_term"][name]
        assert kept["snapshots"] == 40
        assert 0 < kept["snapshots_per_second"] <= kept["acknowledged_per_second"]
        for part in ("query_wm", "query_ltm", "query_both", "durable_commit"):
            assert kept[part]["count"] == 2
    assert found["commit_vs_echo"] == found["calls"]["simple"]["commit_vs_echo"]
    assert found["retrieval_hz"] == pytest.approx(1e6 / found["batches"]["moderate"]["1"]["ice"]["query"]["mean"])
    assert found["age_hz"] == pytest.approx(1e6 / found["ages"]["moderate"]["memory"]["mean"])
    assert found["forgetting"] is None
    said = capsys.readouterr()
    assert "moderate, 100" in said.out
    assert said.err.count("\n") == 1, "only that fsync is off on this server"
    _check_section(found, tmp_path)


def _check_section(found: dict[str, Any], tmp_path: Path) -> None:
    """The report has a section about these figures, with pictures."""
    drawn = pytest.importorskip("simulators.armem.drawn", exc_type=ImportError)
    text = drawn.section(found, tmp_path / "pictures")
    for heading in ("Commits and queries", "Age of data", "What a call costs", "Long-term memory"):
        assert f"### {heading}\n" in text
    for name in ("armem-batches-ice", "armem-batches-core", "armem-ages", "armem-calls"):
        assert f"pictures/{name}.png" in text
        for ending in ("png", "svg"):
            assert (tmp_path / "pictures" / f"{name}.{ending}").stat().st_size > 1000


def test_without_ice_the_core_is_measured(
    dsn: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing() -> None:
        raise IceMissing("there is none")

    monkeypatch.setattr(evaluation, "load_ice", missing)
    monkeypatch.setattr(evaluation, "BATCHES", (1, 20))
    found = measured(tmp_path, "--parts", "calls", "batches", "ages", "--dsn", dsn)
    assert found["goals"] == {}
    assert [found[name] for name in (*evaluation.GOALS, "calls", "ages", "long_term", "forgetting")] == [None] * 8
    assert {*found["batches"]["simple"]["20"]} == {"core"}
    assert found["batches"]["simple"]["20"]["core"]["store"]["count"] == 2
    assert "nothing is measured through Ice: there is none" in capsys.readouterr().err
    drawn = pytest.importorskip("simulators.armem.drawn", exc_type=ImportError)
    text = drawn.section(found, tmp_path / "pictures")
    assert "armem-batches-core" in text
    assert "Through Ice:" not in text
