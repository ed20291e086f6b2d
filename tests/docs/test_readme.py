"""The README's Python runs as it stands there, block after block, against a real database."""

from __future__ import annotations

import pytest

from tests.pages import Page
from tests.servers import Server

PAGE = Page("README.md")


def test_the_python_of_the_readme_runs(postgres_server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = PAGE.blocks("python")
    assert len(blocks) >= 6
    with postgres_server.database() as dsn:
        monkeypatch.setenv("ELM_DSN", dsn)
        PAGE.run(blocks)["memory"].close()


def test_the_readme_opens_with_what_elm_is() -> None:
    before_the_tour = PAGE.text.split("## The tour")[0]
    assert "make demo" in before_the_tour
    assert "make test" in before_the_tour
    assert PAGE.text.index("docs/plaza.png") < PAGE.text.index("make demo") < PAGE.text.index("```python")
