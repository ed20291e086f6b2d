"""The pages of the documentation, as tests read them: their sections, the code blocks, and running these."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]

_BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Page:
    """One page, by its path in the repository."""

    def __init__(self, path: str) -> None:
        self.path = path

    @property
    def exists(self) -> bool:
        """Whether it is there: the tests may stand beside an installed package, without the documents."""
        return (ROOT / self.path).exists()

    @cached_property
    def text(self) -> str:
        """All of it."""
        return (ROOT / self.path).read_text(encoding="utf-8")

    @cached_property
    def sections(self) -> dict[str, str]:
        """By their headings of the second level."""
        return {part.partition("\n")[0]: part for part in re.split(r"^## ", self.text, flags=re.MULTILINE)[1:]}

    def all_blocks(self, *sections: str) -> list[tuple[str, str, str]]:
        """Language, name of the file or nothing, and text of the code blocks of some sections, or of the whole page."""
        return _BLOCK.findall("".join(self.sections[name] for name in sections) if sections else self.text)

    def blocks(self, language: str, *sections: str) -> list[str]:
        """Those in a language that are no files."""
        return [text for kind, name, text in self.all_blocks(*sections) if kind == language and not name]

    def run(self, blocks: Iterable[str]) -> dict[str, Any]:
        """Run blocks of Python one after the other, as if they were one module; what is defined then."""
        scope: dict[str, Any] = {}
        for block in blocks:
            exec(compile(block, self.path, "exec"), scope)  # noqa: S102 - the pages are ours
        return scope
