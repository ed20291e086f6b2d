"""Tests of the measurement of growth: what is loaded, kept and continued, what growth is, and what a run leaves."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from psycopg import sql

import elm
from elm.errors import InvalidValue, StoreFailure
from elm.storage import migrate
from simulators.__main__ import main
from simulators.bench.scratch import bare_schema, connect
from simulators.scaling import explaining, growth, loaded, scale
from simulators.scaling.asking import LIMIT, Answers, Asked
from simulators.scaling.drawn import section
from simulators.scaling.loaded import drop_kept, memory_of, name_of, take_out_what_came_later
from simulators.worlds.events import simulate
from simulators.worlds.queries import CLASSES
from tests.servers import Server

SEED = 3


@pytest.fixture(scope="module")
def dsn(postgres_server: Server) -> Iterator[str]:
    """A database of these tests."""
    with postgres_server.database() as address:
        yield address


def schemas(dsn: str) -> set[str]:
    with connect(dsn) as connection:
        return {name for (name,) in connection.execute("SELECT nspname FROM pg_namespace WHERE nspname LIKE 'scale%'")}


def count(dsn: str, table: str) -> int:
    with connect(dsn) as connection:
        schema, name = table.split(".")
        row = connection.execute(sql.SQL("SELECT count(*) FROM {}").format(sql.Identifier(schema, name))).fetchone()
    assert row is not None
    return int(row[0])


class _StoppedError(Exception):
    """What a run is stopped by."""


# Loading


def test_a_load_that_was_stopped_is_continued_to_exactly_as_many_events(
    dsn: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, events = name_of(1000, SEED), 1000
    told: list[int] = []

    def advance(more: int) -> None:
        told.append(more)
        if sum(told) >= 300:
            raise _StoppedError

    with pytest.raises(_StoppedError), memory_of(dsn, events, SEED, keep=True, advance=advance):
        pytest.fail("the load was not stopped")
    assert schemas(dsn) == {name, bare_schema(name)}
    assert 300 <= count(dsn, f"{name}.event") < events
    # As if it had been stopped between a batch and its record: events that no record tells of.
    with connect(dsn) as connection:
        record = sql.Identifier(bare_schema(name), "record")
        connection.execute(sql.SQL("UPDATE {} SET events = 200, last_id = 200").format(record))

    told = []
    with memory_of(dsn, events, SEED, keep=True, advance=told.append) as found:
        assert told[0] == 200
        assert sum(told) == events
        assert (found.name, found.events) == (name, events)
        assert found.load_seconds > 0
        assert found.bytes > sum(found.relations.values()) > 1_000_000
        assert found.copy_events_per_second > 0
        with elm.connect(dsn, name) as memory:
            assert [event.uid for event in memory.recall(order="id")] == [
                event.uid for event in islice(simulate(SEED), events)
            ]
            assert memory.statistics().links == 900
        assert count(dsn, f"{bare_schema(name)}.bare_row") == events
        with (
            pytest.raises(StoreFailure, match="another process is measuring"),
            memory_of(dsn, events, SEED, keep=True, advance=told.append),
        ):
            pytest.fail("two at once")

    # Found again as it is: nothing is simulated or loaded.
    monkeypatch.setattr(loaded, "simulate", None)
    with memory_of(dsn, events, SEED, keep=True, advance=told.append) as again:
        assert (again.load_seconds, again.last_id) == (found.load_seconds, found.last_id)


def test_what_is_committed_into_a_loaded_memory_is_taken_out_again(dsn: str) -> None:
    with memory_of(dsn, 1000, SEED, keep=True, advance=lambda more: None) as found:
        with elm.connect(dsn, found.name) as memory:
            for event in islice(simulate(SEED + 1), 20):
                memory.commit(event)
            assert memory.statistics().events == 1020
            take_out_what_came_later(dsn, found.name)
            assert (memory.statistics().events, memory.statistics().links) == (1000, 900)
        assert count(dsn, f"{found.name}.log_inbox") == 1000


def test_memories_that_are_not_kept_have_names_of_their_own_and_go(dsn: str) -> None:
    before = schemas(dsn)

    def failing() -> None:
        with memory_of(dsn, 1000, SEED, keep=False, advance=lambda more: None) as found:
            assert found.name.startswith(f"{name_of(1000, SEED)}_")
            assert schemas(dsn) == before | {found.name, bare_schema(found.name)}
            raise _StoppedError

    with pytest.raises(_StoppedError):
        failing()
    assert schemas(dsn) == before


def test_kept_memories_and_only_those_are_dropped(dsn: str) -> None:
    with memory_of(dsn, 1000, SEED, keep=True, advance=lambda more: None):
        pass
    migrate(dsn, "scale_of_fish")
    assert drop_kept(dsn) == [name_of(1000, SEED)]
    assert schemas(dsn) == {"scale_of_fish"}


# Figures


def test_growth_is_the_ratio_between_two_sizes() -> None:
    series = {10: [1.0, 2.0, 9.0], 100: [1.0, 4.0, 7.0], 1000: [2.0, 3.0, 13.0]}
    assert growth.of_medians(series, (10, 100)) == 2.0
    assert growth.of_medians(series, (100, 1000)) == 0.75
    assert growth.of_means(series, (10, 100)) == 1.0
    assert growth.of_means(series, (10, 1000)) == 1.5


def test_sizes_are_powers_of_ten_and_the_goals_are_between_two_of_them() -> None:
    assert growth.sizes_up_to(1_000_000, smallest=10_000) == [10_000, 100_000, 1_000_000]
    for largest in (10_000, 50_000):
        with pytest.raises(InvalidValue, match=r"has 100,000 events or a power of ten more"):
            growth.sizes_up_to(largest, smallest=10_000)
    whole = growth.sizes_up_to(10_000_000, smallest=10_000)
    assert growth.compared(whole, growth.INSERT_SIZES) == (10_000, 1_000_000)
    assert growth.compared(whole, growth.RECALL_SIZES) == (100_000, 1_000_000)
    assert growth.compared([10, 100, 1000], growth.INSERT_SIZES) == (10, 1000)
    assert growth.compared([10, 100, 1000], growth.RECALL_SIZES) == (100, 1000)


def _answers(rows: int, millis: float) -> Answers:
    return Answers(rows=[rows] * 3, first=[millis / 500] * 3, again=[millis / 1000] * 3, bare=[0.001] * 3)


def test_growth_is_that_of_equally_large_answers() -> None:
    alike = {10: _answers(5, 2.0), 100: _answers(6, 3.0)}
    found = Asked(answers=alike, limit=LIMIT, bounded=alike).figures((10, 100))
    assert found["growth"] == pytest.approx(1.5)
    assert (found["bare_growth"], found["limit"]) == (1.0, LIMIT)
    assert found["sizes"]["100"]["first_ms"] == pytest.approx(6.0)

    grown = {10: _answers(5, 2.0), 100: _answers(50, 8.0)}
    bounded = {10: _answers(5, 2.0), 100: _answers(5, 2.2)}
    found = Asked(answers=grown, limit=5, bounded=bounded).figures((10, 100))
    assert found["growth"] == pytest.approx(1.1)
    assert found["growth_limit_100"] == pytest.approx(4.0)
    assert found["sizes"]["100"]["rows"] == 50
    assert found["sizes_limit_5"]["100"]["rows"] == 5


def test_pages_and_times_are_read_off_a_plan() -> None:
    plan = (
        "Limit  (cost=1 rows=1)\n  Buffers: shared hit=12 read=3 dirtied=1\n  ->  Scan\n        Buffers: shared hit=9"
    )
    found = explaining.read(f"{plan}\nPlanning Time: 0.5 ms\nExecution Time: 1.25 ms")
    assert found == {"pages_hit": 12, "pages_read": 3, "planning_ms": 0.5, "execution_ms": 1.25}
    assert explaining.read("Buffers: shared read=2") == {"pages_hit": 0, "pages_read": 2}


# The whole


def is_positive(figure: Any) -> bool:
    return isinstance(figure, float) and math.isfinite(figure) and figure > 0


def test_a_quick_run_measures_everything_and_leaves_nothing(
    dsn: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    before = schemas(dsn)
    file = tmp_path / "scale.json"
    monkeypatch.setattr(scale, "QUICK_SMALLEST", 100)
    small = ("--quick", "--largest", "1e3", "--cues", "2", "--groups", "5", "--dsn", dsn)
    assert main(["scale", *small, "--json", str(file)]) == 0
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    assert schemas(dsn) == before
    assert found["sizes"] == found["insert_between"] == found["recall_between"] == [100, 1000]
    assert is_positive(found["insert_growth"])
    assert found["insert_growth"] == found["insert"]["durable"]["event"]["growth"]
    for size in ("100", "1000"):
        assert found["memories"][size]["events"] == int(size)
        assert all(
            is_positive(found["memories"][size][key])
            for key in ("load_seconds", "events_per_second", "copy_events_per_second", "bytes_per_event")
        )
        for mode in ("durable", "relaxed"):
            calls = {kind: series["sizes"][size]["count"] for kind, series in found["insert"][mode].items()}
            assert calls == {"event": 45, "complex_event": 5, "bare": 50}
    assert list(found["classes"]) == list(CLASSES)
    assert list(found["subtypes"]) == ["root", "one_below", "two_below", "leaf"]
    for name, figures in {**found["classes"], **found["subtypes"]}.items():
        assert is_positive(figures["growth"]), name
        assert all(figures["sizes"][size]["cues"] == 2 for size in ("100", "1000")), name
    assert set(found["goals"]) == {
        "insert_growth",
        *(f"classes.{name}" for name in CLASSES),
        *(f"subtypes.{depth}" for depth in found["subtypes"]),
    }
    assert len(found["slowest"]) == 3
    assert all(is_positive(each["execution_ms"]) and each["plan"] for each in found["slowest"].values())
    assert found["run"]["measurement"] == "scale"
    assert "feature_names.subset" in capsys.readouterr().out

    text = section(found, tmp_path / "pictures")
    drawn = {path.name for path in (tmp_path / "pictures").iterdir()}
    names = ("commits", "what_and_where", "kin_and_features", "growth", "subtypes")
    assert drawn == {f"scale_{name}.{kind}" for name in names for kind in ("png", "svg")}
    assert all(f"pictures/{name}" in text for name in drawn)
    assert "| `feature_names.subset` |" in text
    assert "| durable: an atomic event |" in text


@pytest.mark.parametrize("largest", ["5e4", "10.5", "10000"])
def test_a_largest_size_that_is_none_is_refused(dsn: str, largest: str, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["scale", "--largest", largest, "--dsn", dsn]
    if "." in largest:
        with pytest.raises(SystemExit):
            main(command)
    else:
        assert main(command) == 1
    assert "events" in capsys.readouterr().err


def test_dropping_measures_nothing(dsn: str, capsys: pytest.CaptureFixture[str]) -> None:
    with memory_of(dsn, 1000, SEED, keep=True, advance=lambda more: None):
        pass
    assert main(["scale", "--drop", "--dsn", dsn]) == 0
    assert capsys.readouterr().out == f"dropped {name_of(1000, SEED)}\n"
