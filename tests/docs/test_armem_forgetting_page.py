"""docs/armem_forgetting.md is true: its Python runs as it stands, and its tables have every mechanism and row."""

from __future__ import annotations

import inspect

from armem_bridge.forgetting import mechanisms
from simulators.armem.mechanism_rows import ROWS
from tests.pages import Page

PAGE = Page("docs/armem_forgetting.md")


def test_the_python_of_the_page_runs() -> None:
    blocks = PAGE.blocks("python")
    assert len(blocks) >= 4
    PAGE.run(blocks)


def test_all_mechanisms_are_described_with_what_they_are_given() -> None:
    for kind in mechanisms.NAMES:
        assert f"| `{kind.__name__}({', '.join(inspect.signature(kind).parameters)})` |" in PAGE.text


def test_the_tables_have_all_rows() -> None:
    for row in ROWS:
        assert PAGE.text.count(f"\n| ({row.number}) |") == 4
