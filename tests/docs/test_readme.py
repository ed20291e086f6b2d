"""The README's Python runs as it stands there, block after block, against a real database."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.servers import Server

README = (Path(__file__).parents[2] / "README.md").read_text()


def test_the_python_of_the_readme_runs(postgres_server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", README, flags=re.DOTALL | re.MULTILINE)
    assert len(blocks) >= 6
    with postgres_server.database() as dsn:
        monkeypatch.setenv("ELM_DSN", dsn)
        scope: dict[str, object] = {}
        for block in blocks:
            exec(compile(block, "README.md", "exec"), scope)  # noqa: S102 - the README is ours
        for name in ("memory",):
            scope[name].close()  # type: ignore[attr-defined]


def test_the_readme_opens_with_what_elm_is() -> None:
    before_the_tour = README.split("## The tour")[0]
    assert "make demo" in before_the_tour
    assert "make test" in before_the_tour
    assert README.index("docs/plaza.png") < README.index("make demo") < README.index("```python")
