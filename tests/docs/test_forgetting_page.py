"""The Python of docs/forgetting.md runs as it stands there, block after block."""

from __future__ import annotations

from tests.pages import Page

PAGE = Page("docs/forgetting.md")


def test_the_python_of_the_page_runs() -> None:
    blocks = PAGE.blocks("python")
    assert len(blocks) == 4
    assert PAGE.run(blocks)["report"] is not None
