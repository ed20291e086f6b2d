"""docs/armem_forgetting.md is true: its Python runs as it stands, and its tables have every mechanism and row."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

from armem_bridge.forgetting import mechanisms
from simulators.armem.mechanism_rows import ROWS

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "armem_forgetting.md").read_text(encoding="utf-8")


def test_the_python_of_the_page_runs() -> None:
    scope: dict[str, object] = {}
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 4
    for block in blocks:
        exec(compile(block, "docs/armem_forgetting.md", "exec"), scope)  # noqa: S102 - the page is ours


def test_all_mechanisms_are_described_with_what_they_are_given() -> None:
    for kind in mechanisms.NAMES:
        assert f"| `{kind.__name__}({', '.join(inspect.signature(kind).parameters)})` |" in PAGE


def test_the_tables_have_all_rows() -> None:
    for row in ROWS:
        assert PAGE.count(f"\n| ({row.number}) |") == 4
