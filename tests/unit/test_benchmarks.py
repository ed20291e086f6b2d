"""Tests of the measurements: small runs against a real database, and that both sides of each are asked the same."""

from __future__ import annotations

import importlib.util
import json
import math
import os
from argparse import Namespace
from collections.abc import Iterator
from itertools import islice, pairwise
from pathlib import Path
from typing import Any
from uuid import UUID

import psycopg
import pytest

import elm
from elm import cues
from elm.errors import StoreFailure
from elm.interval import Interval
from simulators.__main__ import main
from simulators.bench.findings import Goal, Report
from simulators.bench.measurement import options, run
from simulators.bench.scratch import bare_schema, connect, scratch_memory, with_setting
from simulators.bench.timing import in_milliseconds, in_turn, mean_ratio, median_ratio
from simulators.bench.twins import Twins
from simulators.recalling import hand_sql
from simulators.recalling.classes import check_same
from simulators.recognizing import at_once, bounded, engine
from simulators.worlds import habits, handling, hierarchy
from simulators.worlds.events import simulate
from simulators.worlds.queries import CLASSES
from tests.servers import Server

HAS_PYARROW = importlib.util.find_spec("pyarrow") is not None
SYNSETS = "id\tparents\tinstance_of\tlemmas\nn1\t\t\tentity\nn2\tn1\t\tthing\nn3\tn1,n2\t\tcup\nn4\t\tn3\tgrail\n"


@pytest.fixture(scope="module")
def dsn(postgres_server: Server) -> Iterator[str]:
    """A database of these tests."""
    with postgres_server.database() as address:
        yield address


def measured(tmp_path: Path, *arguments: str) -> dict[str, Any]:
    """What a measurement writes, after it ended well."""
    file = tmp_path / "new" / "figures.json"
    assert main([*arguments, "--json", str(file)]) == 0
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


def schemas(dsn: str) -> set[str]:
    with connect(dsn) as connection:
        return {name for (name,) in connection.execute("SELECT nspname FROM pg_namespace WHERE nspname LIKE 'bench%'")}


def is_positive(figure: Any) -> bool:
    return isinstance(figure, float) and math.isfinite(figure) and figure > 0


# The measurements


def test_insert_measures_commits_and_loads(dsn: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = measured(tmp_path, "insert", "--quick", "--events", "100", "--dsn", dsn)
    for key in ("ratio_durable", "ratio_relaxed", "complex_vs_ten_rows", "load_vs_copy"):
        assert is_positive(found[key])
        assert found["goals"][key]["value"] == found[key]
    for mode in ("durable", "relaxed"):
        counts = {name: found[mode][name]["count"] for name in ("bare", "event", "ten_rows", "complex_event")}
        assert counts == {"bare": 90, "event": 90, "ten_rows": 10, "complex_event": 10}
        figures = found[mode]["event"]
        assert 0 < figures["median"] <= figures["p95"] <= figures["p99"] <= figures["max"]
        assert found[mode]["ratio"] == pytest.approx(figures["mean"] / found[mode]["bare"]["mean"], rel=0.01)
        assert is_positive(found[mode]["complex_vs_ten_rows_executemany"])
    assert found["ratio_relaxed"] == found["relaxed"]["ratio"]
    assert found["load"]["events"] == 400
    assert found["load_vs_copy"] == pytest.approx(
        found["load"]["events_per_second"] / found["load"]["copy_events_per_second"]
    )
    assert found["run"]["measurement"] == "insert"
    assert found["run"]["settings"]["fsync"] == "off"
    assert {"machine", "versions", "commit", "load_average", "started", "seconds"} <= found["run"].keys()
    said = capsys.readouterr()
    assert "durable: event" in said.out
    assert "nothing here was durable" in said.err
    assert schemas(dsn) == set()


def test_recall_measures_every_class_and_large_answers(
    dsn: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = measured(tmp_path, "recall", "--quick", "--events", "1200", "--cues", "2", "--dsn", dsn)
    assert list(found["classes"]) == list(CLASSES)
    for name, figures in found["classes"].items():
        assert all(is_positive(figures[key]) for key in ("ratio", "rows", "elm_ms", "hand_ms")), name
        assert figures["cues"] == 2
    # All events without parts, and the one that the cue was made of.
    assert found["classes"]["parts.subset"]["rows"] == 1081
    assert found["classes"]["wholes.equal"]["rows"] == 9
    goals = {"objects_vs_fetch"} | ({"arrow_vs_fetch"} if HAS_PYARROW else set())
    assert goals == {name for name in found["goals"] if name not in CLASSES}
    assert "parts.subset" not in found["goals"], "its answers are larger than those that the goal is about"
    assert found["goals"]["time.equal"]["value"] == found["classes"]["time.equal"]["ratio"]
    for name in (*goals, "objects_vs_raw_fetch", "objects_read_vs_fetch"):
        assert is_positive(found[name])
    rates = found["rows_per_second"]
    assert found["objects_vs_fetch"] == pytest.approx(rates["objects"] / rates["fetch"])
    assert "feature_names.intersects" in capsys.readouterr().out
    assert schemas(dsn) == set()


def test_recognize_measures_rates_latency_and_memory(
    dsn: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(engine, "ENVIRONMENT", tmp_path / "nothing")
    size = ("--events", "600", "--matches", "2", "--stream", "3000")
    found = measured(tmp_path, "recognize", "--quick", *size, "--dsn", dsn)
    for key in ("twenty_vs_one", "db_vs_load", "latency_vs_commit", "memory_bounded"):
        assert is_positive(found[key])
        assert found["goals"][key]["value"] == found[key]
    assert found["engine_vs_bobocep"] is None
    assert found["engine_vs_bobocep_divided"] is None
    assert "engine_vs_bobocep" not in found["goals"]
    rates = found["twenty"]
    assert found["twenty_vs_one"] == pytest.approx(rates["one_events_per_second"] / rates["twenty_events_per_second"])
    assert len(rates["matches"]) == 20
    database = found["database"]
    assert found["db_vs_load"] == pytest.approx(database["events_per_second"] / database["load_events_per_second"])
    assert 10 <= database["events_per_result"] <= 20
    latency = found["latency"]
    assert found["latency_vs_commit"] == pytest.approx(
        latency["in_process"]["median"] / latency["bare_commit"]["median"], rel=0.01
    )
    assert latency["in_process"]["count"] == latency["own_process"]["count"] == 2
    assert [stage["events"] for stage in found["stream"]["stages"]] == [300, 1500, 3000]
    said = capsys.readouterr()
    assert "run `make opponents`" in said.err
    assert "manager in a process of its own" in said.out
    assert schemas(dsn) == set()


def test_both_engines_find_the_same() -> None:
    if not (engine.ENVIRONMENT / "bin" / "python").exists():
        pytest.skip(engine.MISSING)
    found = engine.measure(events=500, rounds=1, seed=3, advance=lambda more: None)
    rates = found["events_per_second"]
    assert found["engine_vs_bobocep"] == pytest.approx(rates["elm"] / rates["bobocep_together"])
    assert found["engine_vs_bobocep_divided"] == pytest.approx(rates["elm"] / rates["bobocep_divided"])
    assert found["matches"] > 10


def test_types_measures_a_hierarchy_end_to_end(dsn: str, tmp_path: Path) -> None:
    file = tmp_path / "synsets.tsv"
    file.write_text(SYNSETS, encoding="utf-8")
    found = measured(tmp_path, "types", "--quick", "--file", str(file), "--dsn", dsn)
    # Pairs: four of a type with itself; n2-n1, n3-n1, n3-n2, n4-n3, n4-n2, n4-n1.
    assert found["rows"] == {"event_type": 4, "type_parent": 4, "type_closure": 10}
    assert found["types_vs_copy"] == pytest.approx(
        (found["read_seconds"] + found["add_seconds"]) / found["copy_seconds"]
    )
    assert 0 < found["types_vs_copy_without_reading"] < found["types_vs_copy"]
    assert found["goals"]["types_vs_copy"]["goal"] == "<= 5"
    assert schemas(dsn) == set()


def test_types_of_wordnet_can_be_cut_short(dsn: str, tmp_path: Path) -> None:
    if not os.environ.get("ELM_TEST_DATA"):
        pytest.skip("ELM_TEST_DATA is not set: no WordNet")
    found = measured(tmp_path, "types", "--quick", "--types", "300", "--dsn", dsn)
    assert found["rows"]["event_type"] == 300
    assert found["rows"]["type_closure"] > 300


def test_types_without_a_file_says_where_one_is_looked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("ELM_TEST_DATA", raising=False)
    assert main(["types", "--quick"]) == 1
    assert "skipped" in (said := capsys.readouterr().err)
    assert "ELM_TEST_DATA" in said


@pytest.mark.parametrize(
    ("chosen", "reason"),
    [("memory://", "no statements to measure against"), ("postgresql://nobody@localhost:1/none", "Look at --dsn")],
)
def test_a_database_that_cannot_be_measured_is_one_line_on_stderr(
    chosen: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["insert", "--quick", "--dsn", chosen]) == 1
    said = capsys.readouterr()
    assert said.err.startswith("simulators insert: ")
    assert reason in said.err
    assert said.out == ""


def test_a_measurement_that_is_stopped_says_so_in_one_line(dsn: str, capsys: pytest.CaptureFixture[str]) -> None:
    def stopped(_: str, __: Namespace) -> Report:
        raise KeyboardInterrupt

    given = options("insert", "").parse_args(["--dsn", dsn, "--quick"])
    assert run("insert", given, stopped) == 130
    assert capsys.readouterr().err.splitlines() == [
        "simulators insert: stopped before the end; scratch memories are dropped"
    ]


# Fairness


def test_hand_statements_fetch_what_events_have(dsn: str) -> None:
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory, hand_sql.like_elm(dsn, name) as hand:
        memory.add_types(hierarchy.event_types())
        life = list(islice(simulate(4), 50))
        memory.load(life)
        events = list(memory.recall())
        rows = hand.execute(hand_sql.EVERYTHING, prepare=True, binary=True).fetchall()
        for event, row in zip(events, rows, strict=True):
            number, uid, kind, begin, end, frame, region, subject_frame, subject = row[:9]
            features, agent, media_type, payload, parts, recorded_at = row[9:]
            assert (number, uid, kind) == (event.id, event.uid, event.type)
            assert Interval(begin=begin, end=end) == event.interval
            assert event.region is not None
            assert event.payload is not None
            assert (frame, region) == (event.region.frame, event.region.wkb)
            assert (subject_frame, subject) == (None, None)
            assert tuple(map(tuple, features)) == event.features
            assert (agent, media_type, payload) == (event.agent, event.payload.media_type, event.payload.data)
            assert (tuple(parts), recorded_at) == (event.parts, event.recorded_at)


def test_hand_statements_run_with_the_settings_that_elm_recalls_with(dsn: str) -> None:
    with scratch_memory(dsn) as name, hand_sql.like_elm(dsn, name) as hand:
        asked = "SELECT current_setting('plan_cache_mode'), current_setting('jit'), current_schema()"
        assert hand.execute(asked).fetchone() == ("force_custom_plan", "off", name)
        value = hand.execute("SELECT '00000000-0000-0000-0000-000000000001'::uuid", binary=True).fetchone()
        assert value == (UUID(int=1),), "psycopg's own loaders"


def test_there_is_a_hand_statement_for_each_class() -> None:
    assert list(hand_sql.CONDITIONS) == list(CLASSES)


def test_different_answers_are_no_measurement() -> None:
    assert check_same("type.exactly", cues.everything(), [1, 2], [1, 2]) == 2
    with pytest.raises(StoreFailure, match=r"class type\.exactly: elm recalls 2 events and the statement by hand 1,"):
        check_same("type.exactly", cues.everything(), [1, 2], [2])
    with pytest.raises(StoreFailure, match="another order"):
        check_same("type.exactly", cues.everything(), [1, 2], [2, 1])


def test_engines_that_find_different_numbers_are_no_measurement() -> None:
    engine.check_same({"elm": 3, "bobocep_together": 3})
    with pytest.raises(StoreFailure, match="different numbers of matches"):
        engine.check_same({"elm": 3, "bobocep_together": 2})


def test_patterns_that_find_something_else_in_company_are_no_measurement() -> None:
    at_once.check_same({"fetch": 3, "wiped": 2}, {"fetch": 3, "wiped": 2})
    with pytest.raises(StoreFailure, match=r"other numbers.*'wiped': \(2, 1\)"):
        at_once.check_same({"fetch": 3, "wiped": 2}, {"fetch": 3, "wiped": 1})


def test_a_process_that_ends_before_it_answers_is_an_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    python = tmp_path / "bin" / "python"
    python.parent.mkdir()
    python.write_text("#!/bin/sh\nexit 1\n")
    python.chmod(0o755)
    monkeypatch.setattr(engine, "ENVIRONMENT", tmp_path)
    with pytest.raises(StoreFailure, match="ended before it"):
        engine.measure(events=20, rounds=1, seed=1, advance=lambda more: None)


def test_every_one_of_the_twenty_patterns_finds_something() -> None:
    found = at_once.measure(events=6000, rounds=1, seed=1, advance=lambda more: None)
    assert list(found["matches"]) == [each.name for each in habits.twenty()]
    assert min(found["matches"].values()) > 0


def test_handling_is_a_stream_of_ascending_instants_that_repeats_for_a_seed() -> None:
    first, again, other = (list(islice(handling.live(seed, objects=3, replaced=10), 25)) for seed in (1, 1, 2))
    assert first == again != other
    assert all(before.moment < after.moment for before, after in pairwise(first))
    objects = [{done.object for done in first[at : at + 10]} for at in (0, 10, 20)]
    assert not objects[0] & objects[1]
    assert not objects[1] & objects[2]


def test_memory_is_watched_in_a_process_of_its_own() -> None:
    stages = list(bounded.stages(2000, seed=1))
    assert [stage["events"] for stage in stages] == [200, 1000, 2000]
    assert all(stage["runs"] <= stage["most_runs"] for stage in stages)
    assert stages[-1]["matches"] > 100
    # Not that of this process, which holds much more.
    assert bounded.measure(events=2000, seed=1)["stages"][-1]["peak_mb"] < stages[-1]["peak_mb"]


def test_twins_have_the_indexes_and_constraints_of_the_tables(dsn: str) -> None:
    indexes = """
        SELECT tablename, regexp_replace(indexdef, 'INDEX \\S+ ON \\S+\\.', ''), reloptions
        FROM pg_indexes JOIN pg_class c ON c.oid = format('%%I.%%I', schemaname, indexname)::regclass
        WHERE schemaname = %s AND tablename IN ('event', 'part') ORDER BY 1, 2
    """
    constraints = """
        SELECT t.relname, c.contype, regexp_replace(pg_get_constraintdef(c.oid), 'REFERENCES \\S*\\.', 'REFERENCES ')
        FROM pg_constraint c JOIN pg_class t ON t.oid = c.conrelid
        WHERE c.connamespace = %s::regnamespace AND t.relname IN ('event', 'part') ORDER BY 1, 2, 3
    """
    with scratch_memory(dsn) as name, elm.connect(dsn, name) as memory, connect(dsn) as connection:
        memory.add_types(hierarchy.event_types())
        twins = Twins(connection, name, ["event", "part"])
        with connect(dsn) as asking:
            for question in (indexes, constraints):
                own, bare = (asking.execute(question, [schema]).fetchall() for schema in (name, bare_schema(name)))
                assert own == bare
                assert len(own) > 5
            home = asking.execute(
                "SELECT confrelid::regclass::text FROM pg_constraint WHERE conname = 'part_whole_id_fkey'"
                " AND connamespace = %s::regnamespace",
                [bare_schema(name)],
            ).fetchone()
            assert home == (f"{bare_schema(name)}.event",)
        memory.load(islice(simulate(5), 20))
        rows = {table: twins.finished(table) for table in ("event", "part")}
        twins.copy(rows)
        assert (twins.count("event"), twins.count("part")) == (20, 18)
        with pytest.raises(psycopg.errors.UniqueViolation):
            twins.copy(rows)


def test_scratch_memories_go_when_a_measurement_fails(dsn: str) -> None:
    def failing() -> None:
        with scratch_memory(dsn) as name:
            assert schemas(dsn) == {name, bare_schema(name)}
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        failing()
    assert schemas(dsn) == set()


def test_a_setting_is_added_to_those_a_dsn_has(dsn: str) -> None:
    both = with_setting(with_setting(dsn, "synchronous_commit", "off"), "jit", "on")
    with connect(both) as connection:
        asked = "SELECT current_setting('synchronous_commit'), current_setting('jit')"
        assert connection.execute(asked).fetchone() == ("off", "on")


# Figures


def test_each_side_comes_first_equally_often() -> None:
    assert [in_turn("abc", turn) for turn in range(4)] == [[*"abc"], [*"bca"], [*"cab"], [*"abc"]]


def test_a_series_is_summed_up_in_milliseconds() -> None:
    found = in_milliseconds([0.001] * 98 + [0.002, 0.101])
    assert found == {"count": 100, "mean": 2.01, "median": 1.0, "p95": 1.0, "p99": 2.99, "max": 101.0}
    assert mean_ratio([1.0, 5.0], [1.0, 2.0]) == 2.0
    assert median_ratio([1.0, 2.0, 30.0], [1.0, 1.0, 9.0]) == 2.0


def test_goals_include_their_bound() -> None:
    assert Goal(name="a", value=2.0, at_most=2.0).met
    assert not Goal(name="a", value=2.01, at_most=2.0).met
    assert Goal(name="a", value=0.6, at_least=0.6).met
    assert not Goal(name="a", value=0.59, at_least=0.6).met
    assert (Goal(name="a", value=1, at_most=2.5).bound, Goal(name="a", value=1, at_least=0.6).bound) == (
        "<= 2.5",
        ">= 0.6",
    )
