"""docs/armem.md is true: its Python runs as it stands, its prior knowledge can be read, its table is complete."""

from __future__ import annotations

import re
from pathlib import Path

from armem_bridge.memory_id import MemoryID
from armem_bridge.working import CoreSegmentDefinition, MemoryServer
from armem_bridge.working.builder import SnapshotsSelector
from tests.pages import Page

PAGE = Page("docs/armem.md")

WORKING_MEMORY = ("Memory servers", "IDs", "Commits", "Queries", "Listening", "Prior knowledge", "Names")
"""The sections whose blocks run one after the other, with nothing but working memory."""

LONG_TERM_MEMORY = ("Long-term memory",)
"""The sections whose blocks run after those, with an elm memory in the process."""


def test_the_python_about_working_memory_runs() -> None:
    found = PAGE.blocks("python", *WORKING_MEMORY)
    assert len(found) == 7
    PAGE.run(found)


def test_the_python_about_long_term_memory_runs() -> None:
    found = PAGE.blocks("python", *WORKING_MEMORY, *LONG_TERM_MEMORY)
    assert len(found) == 7 + 4
    PAGE.run(found)


def test_the_file_of_prior_knowledge_is_one(tmp_path: Path) -> None:
    (shown,) = PAGE.blocks("json", "Prior knowledge")
    file = tmp_path / "classes.json"
    file.write_text(shown, encoding="utf-8")
    server = MemoryServer("Object", [CoreSegmentDefinition(name="Class")], prior_knowledge=[file])
    segment = MemoryID(memory="Object", core_segment="Class", provider_segment="PriorKnowledge")

    assert all(server.get(segment.with_entity(name)) for name in ("cup", "mug"))


def test_the_table_lists_every_selection_of_snapshots() -> None:
    rows = [line.split("|")[1] for line in PAGE.sections["Queries"].splitlines() if line.startswith("| `")]
    listed = {name for row in rows for name in re.findall(r"`(\w+)\(", row)}

    assert listed == {name for name in vars(SnapshotsSelector) if not name.startswith("_")}
