"""Tests of the sides that need environments of their own, in the processes that the comparison runs them in."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import shapely

from simulators.opponents import workload
from simulators.opponents.catalogue import ENVIRONMENTS, ROOT, SIDES, Entry
from simulators.opponents.process import ModeLackingError, SideProcess
from simulators.opponents.protocol import MODES, Question, Record, Ring, Workload, can
from simulators.opponents.sides.points import Circle, Extents, Point, search_of

NAMES = ("duckdb_side", "emem_side", "dimos_side", "soar_side")
SECOND = 1_000_000
BEGIN = 1_767_225_600 * SECOND + 1


def box(west: float, south: float, east: float, north: float) -> Ring:
    return ((west, south), (east, south), (east, north), (west, north), (west, south))


def record(number: int, **fields: Any) -> Record:
    usual: dict[str, Any] = {
        "type": "thing",
        "begin": BEGIN,
        "end": BEGIN + 10 * SECOND,
        "ring": box(0, 0, 2, 2),
        "features": (),
        "agent": "robot",
        "payload": b"\0payload",
        "media_type": None,
        "parts": (),
    }
    return Record(number=number, uid=f"{number + 1:032x}", **{**usual, **fields})


FIRST = record(0, type="cup", features=(("count", 1), ("held", True)))
TOUCHING = record(
    1, type="red cup", end=BEGIN + 20 * SECOND, ring=box(2, 0, 4, 2), features=(("count", 1.0), ("held", 1))
)
NOWHERE = record(2, begin=BEGIN + 1, ring=None, features=(("colour", "red"), ("colour", "blue")))
AROUND = record(
    3, ring=box(0, 0, 50, 50), features=(("count", "1"),), payload=b"", media_type="application/json", agent="other"
)
WHOLE = record(4, end=BEGIN + 20 * SECOND, ring=box(0, 0, 4, 2), parts=(TOUCHING.uid, FIRST.uid))
AWKWARD = (FIRST, TOUCHING, NOWHERE, AROUND, WHOLE)

ASKED: Sequence[tuple[str, Any, int | None, Sequence[Record]]] = (
    ("type.exactly", "thing", None, (NOWHERE, AROUND, WHOLE)),
    ("type.exactly", "thing", 2, (AROUND, WHOLE)),
    ("type.is_a", "cup", None, (FIRST, TOUCHING)),
    ("type.is_a", "thing", 3, (FIRST, TOUCHING, AROUND)),
    ("type.is_a", "red", None, (TOUCHING,)),
    ("type.latest", "thing", 2, (NOWHERE, WHOLE)),
    ("payload.equal", "", None, (AROUND,)),
    ("payload.equal", FIRST.payload.hex(), 1, (FIRST,)),
    ("time.equal", {"begin": BEGIN, "end": BEGIN + 20 * SECOND}, None, (TOUCHING, WHOLE)),
    ("time.subset", {"begin": BEGIN, "end": BEGIN + 10 * SECOND}, None, (FIRST, NOWHERE, AROUND)),
    ("time.superset", {"begin": BEGIN + 1, "end": BEGIN + 10 * SECOND}, None, AWKWARD),
    ("time.superset", {"begin": BEGIN, "end": BEGIN + 11 * SECOND}, None, (TOUCHING, WHOLE)),
    ("time.intersects", {"begin": BEGIN - 1, "end": BEGIN}, 2, (FIRST, TOUCHING)),
    ("window", {"begin": BEGIN + 20 * SECOND, "end": BEGIN + 600 * SECOND}, None, (TOUCHING, WHOLE)),
    ("region.equal", [*FIRST.ring[2:], *FIRST.ring[1:3]], None, (FIRST,)),  # type: ignore[index]
    ("region.subset", WHOLE.ring, None, (FIRST, TOUCHING, WHOLE)),
    ("region.superset", FIRST.ring, None, (FIRST, AROUND, WHOLE)),
    ("region.intersects", FIRST.ring, None, (FIRST, TOUCHING, AROUND, WHOLE)),
    ("parts.equal", [FIRST.uid, TOUCHING.uid], None, (WHOLE,)),
    ("parts.equal", [FIRST.uid], None, ()),
    ("parts.subset", [FIRST.uid], None, (FIRST, TOUCHING, NOWHERE, AROUND)),
    ("parts.superset", [FIRST.uid], None, (WHOLE,)),
    ("parts.intersects", [FIRST.uid, AROUND.uid], None, (WHOLE,)),
    ("wholes.equal", [WHOLE.uid], None, (FIRST, TOUCHING)),
    ("wholes.subset", [AROUND.uid], None, (NOWHERE, AROUND, WHOLE)),
    ("wholes.subset", [WHOLE.uid], 2, (FIRST, TOUCHING)),
    ("wholes.superset", [WHOLE.uid], None, (FIRST, TOUCHING)),
    ("wholes.intersects", [WHOLE.uid, AROUND.uid], None, (FIRST, TOUCHING)),
    ("features.equal", [["held", True], ["count", 1.0]], None, (FIRST,)),
    ("features.equal", [["colour", "blue"], ["colour", "red"]], None, (NOWHERE,)),
    ("features.subset", [["count", "1"], ["colour", "red"]], None, (AROUND, WHOLE)),
    ("features.superset", [["count", 1]], None, (FIRST, TOUCHING)),
    ("features.superset", [["colour", "blue"]], None, (NOWHERE,)),
    ("features.intersects", [["held", True], ["colour", "red"]], None, (FIRST, NOWHERE)),
    ("feature_names.equal", ["colour"], None, (NOWHERE,)),
    ("feature_names.subset", ["count", "held"], None, (FIRST, TOUCHING, AROUND, WHOLE)),
    ("feature_names.superset", ["count"], None, (FIRST, TOUCHING, AROUND)),
    ("feature_names.intersects", ["colour", "held"], 2, (FIRST, TOUCHING)),
    ("near", {"x": -3.0, "y": 1.0, "metres": 3.0}, None, (FIRST, AROUND, WHOLE)),
    ("near.lately", {"x": 3.0, "y": 1.0, "metres": 0.5, "begin": BEGIN + 11 * SECOND, "end": BEGIN + 12 * SECOND}, 9,
     (TOUCHING, WHOLE)),
    ("near.type", {"x": 3.0, "y": 1.0, "metres": 0.5, "type": "cup"}, None, (TOUCHING,)),
    ("nearest", {"x": 1.0, "y": 1.0}, 3, (FIRST, AROUND, WHOLE)),
    ("nearest", {"x": 100.0, "y": 25.0}, 2, (AROUND, TOUCHING)),
)  # fmt: skip
"""Kinds, values, limits, and by hand what answers: shared bounds, equal begins, and values that only look equal."""

TELLING = {
    "duckdb_side": "dict(uid=row[0].hex, type=row[1], begin=micros(row[2]), end=micros(row[3]), region=row[4],"
    " features=json.loads(row[5]), agent=row[6], payload=row[7], media_type=row[8], parts=[u.hex for u in row[9]])",
    "emem_side": "dict(row.metadata, uid=row.id, type=row.layer_name, agent=row.source_type,"
    " payload=base64.b64decode(row.metadata['payload']))",
    "dimos_side": "row.data",
    "soar_side": "row",
}
"""How the user of each side reads a row."""

SCRIPT = """
import base64, importlib, json, sys
from datetime import UTC
from pathlib import Path
from simulators.opponents.protocol import MODES, Workload

def micros(when):
    return int(when.replace(tzinfo=UTC).timestamp()) * 10**6 + when.microsecond

def plain(value):
    return value.hex() if isinstance(value, bytes) else value

side, file, directory, telling = sys.argv[1:]
module = importlib.import_module(f"simulators.opponents.sides.{side}")
adapter_class = next(found for found in vars(module).values() if getattr(found, "name", None) == side)
work = Workload.read(Path(file))
adapter = adapter_class(work, Path(directory), next(mode for mode in MODES if mode in adapter_class.durability), None)
for record in work.records[:3]:
    adapter.commit(record)
adapter.load(work.records[3:])
found = []
for question in work.questions:
    for row in adapter.ask(question):
        facts = eval(telling)
        found.append({name: plain(value) for name, value in facts.items()})
adapter.close()
Path(directory, "told.json").write_text(json.dumps(found))
"""


@dataclass(frozen=True)
class Work:
    """A workload, in a file too, and the answers."""

    workload: Workload
    file: Path
    answers: Sequence[Sequence[str]]


@pytest.fixture(params=NAMES)
def side(request: pytest.FixtureRequest) -> Entry:
    (entry,) = (entry for entry in SIDES if entry.name == request.param)
    if not entry.is_installed(ENVIRONMENTS):
        pytest.skip(f"{entry.name} is not installed: run `make opponents`")
    return entry


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Work:
    """A small life, with questions of each kind that the meaning of cues answers."""
    task = workload.make(events=250, per_kind=2, seed=11)
    file = tmp_path_factory.mktemp("simulated") / "workload.jsonl"
    task.workload.write(file)
    return Work(task.workload, file, task.answers)


@pytest.fixture(scope="module")
def awkward(tmp_path_factory: pytest.TempPathFactory) -> Work:
    """Few events that are told apart by what engines get wrong."""
    types = [("thing", ()), ("cup", ("thing",)), ("red", ("thing",)), ("red cup", ("cup", "red"))]
    questions = [
        Question(number=number, kind=kind, value=value, limit=limit)
        for number, (kind, value, limit, _) in enumerate(ASKED)
    ]
    answers = [[each.uid for each in expected] for _, _, _, expected in ASKED]
    made = Workload(types=types, records=AWKWARD, questions=questions)
    file = tmp_path_factory.mktemp("awkward") / "workload.jsonl"
    made.write(file)
    return Work(made, file, [uids if questions[n].is_ordered else sorted(uids) for n, uids in enumerate(answers)])


def running(side: Entry, work: Work, directory: Path, mode: str) -> SideProcess:
    directory.mkdir()
    return SideProcess(side.command(ENVIRONMENTS, str(work.file), str(directory), mode), directory)


def modes_of(side: Entry, work: Work, tmp_path: Path) -> Iterator[SideProcess]:
    """The side at work in each mode that it has."""
    for mode in MODES:
        try:
            process = running(side, work, tmp_path / mode, mode)
        except ModeLackingError:
            continue
        with process:
            yield process
            process.end()


def check_answers(process: SideProcess, work: Work) -> None:
    abilities = process.ask(do="about")["abilities"]
    for question, expected in zip(work.workload.questions, work.answers, strict=True):
        answer = process.ask(do="ask", question=question.number, repeat=2)
        if can(abilities[question.kind]):
            assert answer["uids"] == list(expected), (question.kind, question.value, question.limit)
            assert len(answer["seconds"]) == 2
        else:
            assert answer == {"cannot": abilities[question.kind]}


def test_answers_what_the_meaning_of_cues_says(side: Entry, simulated: Work, tmp_path: Path) -> None:
    events = len(simulated.workload.records)
    tried = 0
    for process in modes_of(side, simulated, tmp_path):
        assert len(process.ask(do="commit", **{"from": 0, "to": 25})["seconds"]) == 25
        assert process.ask(do="load", **{"from": 25, "to": events})["seconds"] > 0
        check_answers(process, simulated)
        assert process.ask(do="size")["bytes"] > 0
        tried += 1
    assert tried >= 1


def test_answers_where_engines_differ(side: Entry, awkward: Work, tmp_path: Path) -> None:
    for process in modes_of(side, awkward, tmp_path):
        process.ask(do="commit", **{"from": 0, "to": 1})
        process.ask(do="load", **{"from": 1, "to": 3})
        process.ask(do="ask", question=0, repeat=1)
        process.ask(do="commit", **{"from": 3, "to": len(AWKWARD)})
        check_answers(process, awkward)


def test_points_and_begins_of_what_answers_are_within_bounds(simulated: Work) -> None:
    """What stores of points are not asked for they cannot find."""
    extents = Extents()
    points = {each.uid: extents.note(each) for each in simulated.workload.records}
    begins = {each.uid: each.begin for each in simulated.workload.records}
    bounded = 0
    for question, answer in zip(simulated.workload.questions, simulated.answers, strict=True):
        bounds = extents.begins(question)
        if question.kind.startswith(("region.", "near.")) or question.kind == "near":
            circles = list(extents.circles(search_of(question)))
            found = {uid for uid in answer if any(is_within(points[uid], circle) for circle in circles)}
            assert found == set(answer), question
            inside = [uid for uid, point in points.items() if any(is_within(point, circle) for circle in circles)]
            bounded += len(inside) < len(points) / 2
        if bounds is not None:
            assert all(bounds[0] <= begins[uid] <= bounds[1] for uid in answer), question
            bounded += not all(bounds[0] <= begin <= bounds[1] for begin in begins.values())
    assert bounded >= 16


def is_within(point: Point | None, circle: Circle) -> bool:
    return point is not None and math.dist(point, circle.centre) <= circle.radius


def test_describes_itself(side: Entry, awkward: Work, tmp_path: Path) -> None:
    for process in modes_of(side, awkward, tmp_path):
        about = process.ask(do="about")
        assert about["name"] == side.name
        assert set(about["durability"]) <= set(MODES)
        assert len(about["why"]) > 40
        assert about["version"]


def test_gives_back_all_that_an_event_has(side: Entry, awkward: Work, tmp_path: Path) -> None:
    questions = [
        Question(number=number, kind="type.exactly", value=name, limit=None)
        for number, (name, _) in enumerate(awkward.workload.types)
    ]
    file = tmp_path / "workload.jsonl"
    Workload(types=awkward.workload.types, records=AWKWARD, questions=questions).write(file)
    command = [str(side.python(ENVIRONMENTS)), "-c", SCRIPT, side.name, str(file), str(tmp_path), TELLING[side.name]]
    subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
    told = {facts["uid"]: facts for facts in json.loads((tmp_path / "told.json").read_text())}
    assert told.keys() == {each.uid for each in AWKWARD}
    for each in AWKWARD:
        facts = told[each.uid]
        for name in ("type", "begin", "end", "agent", "media_type"):
            assert facts[name] == getattr(each, name), name
        assert bytes.fromhex(facts["payload"]) == each.payload
        assert facts["parts"] == list(each.parts)
        assert kinds(facts["features"]) == kinds(each.features)
        assert facts["region"] is None if each.ring is None else ring(facts["region"]) == each.ring


def ring(region: str) -> Ring:
    return tuple((x, y) for x, y in shapely.from_wkb(region).exterior.coords)


def kinds(features: Sequence[Sequence[Any]]) -> set[tuple[str, str, Any]]:
    """Features, where 1, 1.0 and True are three different values."""
    return {(name, type(value).__name__, value) for name, value in features}
