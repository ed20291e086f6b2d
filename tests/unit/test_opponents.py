"""Tests of the comparison with other stores: each answers as the meaning of cues has it, and who does not is told."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
import shapely

import elm
from elm.cues.match import match
from elm.event import StoredEvent
from simulators.__main__ import main
from simulators.bench.scratch import connect
from simulators.opponents import compared, workload
from simulators.opponents.asking import cue_of
from simulators.opponents.catalogue import ELM, ENVIRONMENTS, SIDES, Entry
from simulators.opponents.databases import own_database, template
from simulators.opponents.process import ModeLackingError, SideFailedError, SideProcess
from simulators.opponents.protocol import CLASSES, EVERYDAY, KINDS, MODES, Question, Record, Workload, can
from simulators.opponents.runner import LIMIT, Runner
from simulators.opponents.workload import Task
from simulators.worlds import hierarchy, queries
from simulators.worlds.events import simulate
from tests.servers import Server

EVENTS = 300
COMMITS = 40


@pytest.fixture(scope="module")
def dsn(postgres_server: Server) -> Iterator[str]:
    """A database of these tests."""
    with postgres_server.database() as address:
        yield address


@pytest.fixture(scope="module")
def model(dsn: str) -> Iterator[str]:
    """What the sides' databases are made from."""
    with template(dsn) as name:
        yield name


@pytest.fixture(scope="module")
def task() -> Task:
    """A small life and two questions of each kind."""
    return workload.make(events=EVENTS, per_kind=2, seed=3)


# What they are given


def test_a_workload_is_read_as_it_was_written(tmp_path: Path, task: Task) -> None:
    odd = Record(
        number=7,
        uid="0" * 31 + "1",
        type="a",
        begin=-1,
        end=2**60,
        ring=None,
        features=(("n", "ü\n"), ("n", 1), ("n", 1.5), ("n", True)),
        agent="r",
        payload=b"\x00\xff",
        media_type=None,
        parts=("f" * 32,),
    )
    known = task.workload
    written = Workload(types=known.types, records=[*known.records, odd], questions=known.questions)
    written.write(tmp_path / "workload.jsonl")
    read = Workload.read(tmp_path / "workload.jsonl")
    assert read == written
    assert [type(value) for _, value in read.records[-1].features] == [str, int, float, bool]


def test_a_file_that_is_no_workload_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other.jsonl").write_text('{"events": []}\n')
    with pytest.raises(ValueError, match="no part of a workload"):
        Workload.read(tmp_path / "other.jsonl")


def test_the_closure_is_reflexive_and_reaches_all_ancestors() -> None:
    types = [("a", ()), ("b", ("a",)), ("c", ()), ("d", ("b", "c"))]
    known = Workload(types=types, records=[], questions=[])
    assert known.closure == {"a": ("a",), "b": ("a", "b"), "c": ("c",), "d": ("a", "b", "c", "d")}
    assert known.descendants == {"a": ("a", "b", "d"), "b": ("b", "d"), "c": ("c", "d"), "d": ("d",)}


def test_the_classes_are_those_of_the_query_simulator() -> None:
    assert CLASSES == queries.CLASSES
    assert (*CLASSES, *EVERYDAY) == KINDS


def test_the_same_seed_makes_the_same_task(task: Task) -> None:
    assert workload.make(events=EVENTS, per_kind=2, seed=3) == task
    assert workload.make(events=EVENTS, per_kind=2, seed=4).workload != task.workload


def test_records_are_the_stored_events_extents_included(task: Task) -> None:
    records = {record.uid: record for record in task.workload.records}
    wholes = [record for record in records.values() if record.parts]
    assert len(wholes) == EVENTS // 10
    for whole in wholes:
        parts = [records[uid] for uid in whole.parts]
        assert (whole.begin, whole.end) == (min(p.begin for p in parts), max(p.end for p in parts))
        assert whole.ring is not None
        corners = [corner for part in parts for corner in part.ring or ()]
        assert shapely.Polygon(whole.ring).equals(shapely.MultiPoint(corners).convex_hull)


def test_answers_are_those_of_a_full_scan_by_the_meaning_of_the_cue(task: Task) -> None:
    with elm.connect("memory://") as memory:
        memory.add_types(hierarchy.event_types())
        memory.load(islice(simulate(3), EVENTS))
        events = list(memory.recall(order="id"))
    around = _Around(task.workload, events)
    asked = {question.kind for question in task.workload.questions}
    assert asked == set(KINDS)
    for question, answer in zip(task.workload.questions, task.answers, strict=True):
        found = _scan(question, events, around)
        assert (found if question.is_ordered else sorted(found)) == answer, question
        assert answer or question.kind.startswith("near."), question


class _Around:
    """What cues may ask beyond an event, read off the workload."""

    def __init__(self, known: Workload, events: list[StoredEvent]) -> None:
        self._closure = known.closure
        self._events = {event.uid: event for event in events}

    def is_a(self, name: str, ancestor: str) -> bool:
        return ancestor in self._closure[name]

    def kin(self, uid: Any, kin: Any, *, transitive: bool) -> set[Any]:
        assert not transitive
        return set(getattr(self._events[uid], kin.value))


def _scan(question: Question, events: list[StoredEvent], around: _Around) -> list[str]:
    if question.kind == "nearest":
        point = shapely.Point(question.value["x"], question.value["y"])
        placed = [(event.region.polygon.distance(point), event.id, event) for event in events if event.region]
        return [event.uid.hex for _, _, event in sorted(placed)[: question.limit]]
    kind = "type.exactly" if question.kind == "type.latest" else question.kind
    found = [event for event in events if match(cue_of(kind, question.value), event, around)]
    found.sort(key=lambda event: (event.interval.begin, event.id), reverse=question.kind == "type.latest")
    return [event.uid.hex for event in found[: question.limit]]


def test_answers_that_are_too_large_are_asked_for_with_a_limit(monkeypatch: pytest.MonkeyPatch, task: Task) -> None:
    monkeypatch.setattr(workload, "LARGE", 50)
    monkeypatch.setattr(workload, "FIRST", 5)
    smaller = workload.make(events=EVENTS, per_kind=1, seed=3)
    limits = {question.kind: question.limit for question in smaller.workload.questions}
    assert (limits["parts.subset"], limits["parts.equal"], limits["nearest"]) == (5, None, 5)
    assert all(len(answer) <= 50 for answer in smaller.answers)


# The sides


@pytest.mark.parametrize("entry", SIDES, ids=lambda entry: entry.name)
def test_each_side_answers_as_the_meaning_of_cues_has_it(
    entry: Entry, dsn: str, model: str, task: Task, tmp_path: Path
) -> None:
    if not entry.is_installed(ENVIRONMENTS):
        pytest.skip(f"{entry.name} is not installed: run `make opponents`")
    file = tmp_path / "workload.jsonl"
    task.workload.write(file)
    (tmp_path / entry.name).mkdir()
    with ExitStack() as opened:
        addresses = []
        if entry.has_database:
            addresses = [opened.enter_context(own_database(dsn, entry.name, model))]
        side = opened.enter_context(_started(entry, str(file), tmp_path / entry.name, *addresses))
        about = side.ask(do="about")
        committed = side.ask(do="commit", **{"from": 0, "to": COMMITS})["seconds"]
        loaded = side.ask(do="load", **{"from": COMMITS, "to": EVENTS})["seconds"]
        wrong, answered = [], 0
        for question, expected in zip(task.workload.questions, task.answers, strict=True):
            answer = side.ask(do="ask", question=question.number, repeat=1)
            if can(about["abilities"][question.kind]):
                answered += 1
                if answer["uids"] != expected:
                    wrong.append((question.kind, len(answer["uids"]), len(expected)))
            else:
                assert answer == {"cannot": about["abilities"][question.kind]}
        side.end()
    assert wrong == []
    assert answered >= len(KINDS)
    assert len(committed) == COMMITS
    assert min(*committed, loaded) > 0
    assert about["name"] == entry.name
    assert about["abilities"].keys() == set(KINDS)
    assert about["durability"].keys() <= set(MODES)
    assert all(about[name] for name in ("title", "why", "version"))


def _started(entry: Entry, file: str, directory: Path, *addresses: str) -> SideProcess:
    """The side in the first mode that it has."""
    for mode in MODES:
        try:
            return SideProcess(entry.command(ENVIRONMENTS, file, str(directory), mode, *addresses), directory)
        except ModeLackingError:
            continue
    raise AssertionError(f"{entry.name} has no mode")


def test_databases_of_sides_go_and_their_roles_with_them(dsn: str, model: str) -> None:
    asked = "SELECT datname FROM pg_database WHERE datname LIKE 'bench_odd%'"
    with connect(dsn) as connection:

        def failing() -> None:
            with own_database(dsn, "odd", model) as address, connect(address) as own:
                own.execute("CREATE ROLE odd_reader")
                own.execute("GRANT CREATE ON SCHEMA public TO odd_reader")
                assert len(connection.execute(asked).fetchall()) == 1
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            failing()
        assert connection.execute(asked).fetchall() == []
        assert connection.execute("SELECT 1 FROM pg_roles WHERE rolname = 'odd_reader'").fetchall() == []


def test_a_side_that_falls_silent_is_given_up(tmp_path: Path) -> None:
    with pytest.raises(SideFailedError, match="exit code -9, and last wrote: so far so good"):
        SideProcess(["sh", "-c", "echo so far so good >&2; exec sleep 60"], tmp_path / "mute", silence=0.3)


def test_a_side_is_not_run_in_a_mode_that_it_lacks(tmp_path: Path) -> None:
    liar = Entry(name="lying_side", room="tests.unit")
    with pytest.raises(ModeLackingError, match="durable"):
        SideProcess(liar.command(ENVIRONMENTS, "unread", str(tmp_path), "durable"), tmp_path / "liar")


# The comparison


@pytest.fixture(scope="module")
def figures(dsn: str, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A comparison with one that lies and one that dies."""
    small = workload.make(events=120, per_kind=1, seed=3)
    directory = tmp_path_factory.mktemp("opponents")
    steps: list[int] = []
    runner = Runner(small, dsn, directory, ENVIRONMENTS, steps.append)
    others = [Entry(name=name, room="tests.unit") for name in ("lying_side", "dying_side")]
    race = runner.run([SIDES[0], *others], 20)
    assert sum(steps) == len(MODES) * 20 + len(KINDS)
    found = compared.figures(race, small, 20) | {"missing": {"absent": "not installed: run `make opponents`"}}
    return json.loads(json.dumps(found))  # type: ignore[no-any-return]


def test_a_side_that_lies_is_told_of_and_gets_no_ratio(figures: dict[str, Any]) -> None:
    lie = figures["classes"]["window"]["lying_side"]
    rows = figures["classes"]["window"]["rows"]
    assert lie == {"wrong": {"question": lie["wrong"]["question"], **_counts(rows - 1, rows, missing=1)}}
    assert figures["against"]["lying_side"]["wrong"] == ["window"]
    assert compared.cell(lie) == "WRONG"
    assert any("Liar is WRONG at window" in line for line in compared.complaints(figures))
    assert figures["classes"]["type.exactly"]["lying_side"]["ratio"] > 0
    assert "lying_side" not in figures["commit"]["durable"]
    assert figures["commit"]["relaxed"]["lying_side"]["count"] == 20


def _counts(rows: float, expected: float, *, missing: int) -> dict[str, float]:
    return {"rows": rows, "expected": expected, "missing": missing, "extra": 0}


def test_a_side_that_dies_is_told_of_and_the_others_go_on(figures: dict[str, Any]) -> None:
    assert figures["failed"].keys() == {"dying_side"}
    assert "MemoryError: this was too much" in figures["failed"]["dying_side"]
    assert figures["against"]["dying_side"]["failed"] == ["near", "near.lately", "near.type", *EVERYDAY[3:]]
    assert figures["classes"]["type.exactly"]["dying_side"]["ratio"] > 0
    assert any(line.startswith("Mortal failed: ") for line in compared.complaints(figures))
    assert "absent is left out: not installed: run `make opponents`" in list(compared.complaints(figures))


def test_ratios_are_the_opponents_median_over_elms(figures: dict[str, Any]) -> None:
    for mode in MODES:
        commits, loads = figures["commit"][mode], figures["load"][mode]
        assert commits.keys() == loads.keys() == {ELM, LIMIT, *(["lying_side"] * (mode == "relaxed")), "dying_side"}
        assert commits[ELM]["ratio"] == loads[ELM]["ratio"] == 1
        assert commits["dying_side"]["ratio"] == pytest.approx(
            commits["dying_side"]["median"] / commits[ELM]["median"], rel=0.01
        )
        assert loads[LIMIT]["ratio"] == pytest.approx(
            loads[ELM]["events_per_second"] / loads[LIMIT]["events_per_second"]
        )
    for kind, cells in figures["classes"].items():
        for name in (LIMIT, "lying_side", "dying_side"):
            if cells[LIMIT]["ratio"] is None:
                assert "wrong" in cells[ELM]
            elif name == LIMIT or kind in (
                *figures["against"][name]["elm_faster"],
                *figures["against"][name]["elm_slower"],
            ):
                found = cells[name]
                assert found["ratio"] == pytest.approx(found["median_ms"] / found["elm_ms"])
                assert found["elm_ms"] == cells[ELM]["median_ms"]
    assert figures["bytes_per_event"][ELM] > 500
    assert figures["bytes_per_event"]["lying_side"] > 500


def test_the_section_shows_who_wins_who_lies_and_who_died(figures: dict[str, Any], tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from simulators.opponents.drawn import section

    text = section(figures, tmp_path / "pictures")
    assert "| `window` |" in text
    assert "It is WRONG at window: no ratio there." in text
    assert "Mortal failed: " in text
    assert "- absent is left out" in text
    pictures = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    names = ("opponents-answers", "opponents-commits", "opponents-loads")
    assert pictures == sorted(f"{name}.{kind}" for name in names for kind in ("png", "svg"))
    for name in names:
        assert f"(pictures/{name}.png)" in text


def test_the_command_writes_figures_and_names_what_is_missing(
    dsn: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "opponents.json"
    places = ["--environments", str(tmp_path / "none"), "--scratch", str(tmp_path / "scratch")]
    size = ["--quick", "--events", "100", "--dsn", dsn, "--json", str(file)]
    assert main(["opponents", *size, *places, "--sides", "spatialite"]) == 0
    found = json.loads(file.read_text(encoding="utf-8"))
    assert found["missing"] == {"spatialite": "not installed: run `make opponents`"}
    assert found["sides"].keys() == {ELM}
    assert found["events"] == 100
    assert found["run"]["measurement"] == "opponents"
    said = capsys.readouterr()
    assert "spatialite is left out: not installed: run `make opponents`" in said.err
    assert "bare PostgreSQL" in said.out
    assert list((tmp_path / "scratch").iterdir()) == []


def test_a_side_that_nobody_knows_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["opponents", "--sides", "nobody"])
    assert "invalid choice: 'nobody'" in capsys.readouterr().err


def test_what_libraries_print_is_not_taken_for_an_answer(tmp_path: Path, task: Task) -> None:
    file = tmp_path / "workload.jsonl"
    task.workload.write(file)
    code = (
        "from simulators.opponents.protocol import serve\n"
        "from tests.unit.dying_side import DyingSide\n"
        "class Chatty(DyingSide):\n"
        "    def commit(self, record): print('hello'); return super().commit(record)\n"
        "serve(Chatty)\n"
    )
    (tmp_path / "store").mkdir()
    command = [str(SIDES[0].python(ENVIRONMENTS)), "-c", code, str(file), str(tmp_path / "store"), "relaxed"]
    with SideProcess(command, tmp_path / "store") as side:
        assert len(side.ask(do="commit", **{"from": 0, "to": 3})["seconds"]) == 3
        side.end()
