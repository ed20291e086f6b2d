"""Prior knowledge is read from files at start, found like everything else, and cannot be written to."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.conversion import to_python
from armem_bridge.aron.data import Float, Long
from armem_bridge.aron.textual import type_to_json
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import AddSegment, Commit, CoreSegmentDefinition, EntityUpdate, MemoryServer
from armem_bridge.working.refusals import InvalidPriorKnowledge
from tests.armem.working.scenes import data

CLASS = t.Object(name="Class", members={"mass": t.Float(), "box": t.NDArray(shape=(3,), element="float32", maybe=True)})
WITH_COLOUR = t.Object(name="ColouredClass", extends=CLASS, members={"colour": t.String()})
CUP = MemoryID(memory="Object", core_segment="Class", provider_segment="PriorKnowledge", entity="blue cup/ü")
GOOD: dict[str, Any] = {
    "core_segment": "Class",
    "provider_segment": "PriorKnowledge",
    "type": type_to_json(WITH_COLOUR),
    "entities": {
        "blue cup/ü": [
            {"instances": [{"mass": 0.2, "box": [1, 2, 3], "colour": "blue"}]},
            {"referenced": 5, "confidence": 0.5, "aron": [{"dict": {"mass": {"float": 0.25}, "n": {"long": 1}}}]},
        ],
        "mug": [],
    },
}


def server(path: Path, content: object, **options: Any) -> MemoryServer:
    """A memory that starts with a file."""
    file = path / "classes.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    core = CoreSegmentDefinition(name="Class", aron_type=CLASS)
    return MemoryServer("Object", [core], prior_knowledge=[file], clock=lambda: 77, **options)


def test_prior_knowledge_is_there_at_start(tmp_path: Path) -> None:
    memory = server(tmp_path, GOOD)
    first, second = memory.get(CUP.with_timestamp(0)), memory.get(CUP)

    assert first is not None
    assert second is not None
    known = to_python(first.instances[0].data)
    assert (known["box"].dtype, known["box"].tolist(), known["colour"]) == ("float32", [1.0, 2.0, 3.0], "blue")
    assert first.instances[0].data.elements["mass"] == Float(0.2)  # type: ignore[union-attr]
    assert first.instances[0].metadata.arrived == 77
    assert second.instances[0].data.elements["n"] == Long(1)  # type: ignore[union-attr]
    assert second.instances[0].metadata.confidence == 0.5


def test_nobody_writes_to_it(tmp_path: Path) -> None:
    memory = server(tmp_path, GOOD)
    good = memory.get(CUP.with_timestamp(0))
    assert good is not None
    update = EntityUpdate(entity=CUP, instances=(good.instances[0].data,), referenced=9)
    beside = EntityUpdate(
        entity=MemoryID(memory="Object", core_segment="Class", provider_segment="Learned", entity="cup"),
        instances=(good.instances[0].data,),
        referenced=9,
    )
    result = memory.commit(Commit(updates=[update, beside]))

    assert [each.success for each in result.results] == [False, True]
    assert "prior knowledge, which is read only" in result.errors[0]
    wish = AddSegment(core_segment="Class", provider_segment="PriorKnowledge", clear_when_exists=True)
    assert "prior knowledge, which is read only" in memory.add_segments([wish])[0].error
    assert memory.get(CUP.with_timestamp(0)) is good


def test_knowing_the_segment_is_no_change(tmp_path: Path) -> None:
    wish = AddSegment(core_segment="Class", provider_segment="PriorKnowledge", aron_type=WITH_COLOUR)

    assert server(tmp_path, GOOD).add_segments([wish])[0].success


def changed(**changes: object) -> dict[str, Any]:
    """The good file with something else in it."""
    return GOOD | changes


def entities(snapshot: object) -> dict[str, object]:
    """Entities of which one has a wrong snapshot."""
    return {"entities": {"mug": [{"instances": [{"mass": 1.0, "colour": "red"}]}, snapshot]}}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("{", "cannot be read"),
        ("[]", "cannot be read"),
        (changed(colour="blue"), "cannot be read.*colour"),
        ({"core_segment": "Class"}, "cannot be read.*provider_segment"),
        (changed(core_segment="Grasp"), "does not have"),
        (changed(type={"kind": "rock"}), "the type in .* cannot be read"),
        (changed(type=type_to_json(t.Int())), "has the type Int, and instances are Dicts"),
        (changed(type=type_to_json(t.Object(name="Other", members={"mass": t.Int()}))), "does not extend"),
        (changed(**entities({"instances": [{"mass": "heavy"}]})), "entity 'mug', snapshot 1 .*mass"),
        (changed(**entities({"aron": [{"dict": {"mass": {"double": 1}}}]})), "snapshot 1 .*Double"),
        (changed(**entities({"aron": [{"int": 1}]})), "snapshot 1 .*is a Int"),
        (changed(**entities({"aron": [{"stone": 1}]})), "snapshot 1 .*stone"),
        (changed(**entities({})), "either instances"),
        (changed(**entities({"instances": [], "aron": []})), "either instances"),
        (changed(**entities({"referenced": -1, "instances": []})), "referenced time"),
        (changed(**entities({"instances": []})), "no room"),
        (changed(entities={"": [{"instances": []}]}), "names no entity"),
        (changed(entities={"a\0": [{"instances": []}]}), "NUL"),
    ],
)
def test_files_that_are_refused(tmp_path: Path, content: object, words: str) -> None:
    with pytest.raises(InvalidPriorKnowledge, match=words) as refusal:
        server(tmp_path, content)
    assert "classes.json" in str(refusal.value)


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(InvalidPriorKnowledge, match="nowhere"):
        MemoryServer("Object", prior_knowledge=[tmp_path / "nowhere.json"])


def test_two_files_do_not_share_a_segment(tmp_path: Path) -> None:
    memory = server(tmp_path, GOOD)
    assert memory.status().snapshots == 2
    file = tmp_path / "classes.json"

    with pytest.raises(InvalidPriorKnowledge, match="another file filled"):
        MemoryServer("Object", [CoreSegmentDefinition(name="Class")], prior_knowledge=[file, file])


def test_limits_do_not_eat_prior_knowledge(tmp_path: Path) -> None:
    with pytest.raises(InvalidPriorKnowledge, match="history limit"):
        server(tmp_path, GOOD, limits={MemoryID(memory="Object"): 1})


def test_untyped_prior_knowledge(tmp_path: Path) -> None:
    file = tmp_path / "free.json"
    file.write_text(
        '{"core_segment": "F", "provider_segment": "P", "entities": {"e": [{"instances": [{"value": 3}, null]}]}}'
    )
    memory = MemoryServer("Object", [CoreSegmentDefinition(name="F")], prior_knowledge=[file])
    found = memory.get(MemoryID(memory="Object", core_segment="F", provider_segment="P", entity="e"))

    assert found is not None
    assert [each.data for each in found.instances] == [data(3), None]
