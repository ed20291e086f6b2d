"""XML as a tree of elements with their lines: the little of it that type definitions need, and no more.

Read with expat itself rather than with a library above it: type definitions name types by tags such as
`armarx::arondto::DateTime`, which is no prefix that namespace-aware readers know, and messages need lines.
Document type declarations are refused, and with them all entities that could blow up.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NoReturn
from xml.parsers import expat

from armem_bridge.errors import InvalidDefinition

SIZE_LIMIT: Final = 16 * 1024 * 1024
"""Longest file in bytes."""

DEPTH_LIMIT: Final = 200
"""How deep elements may nest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """One element: its tag and attributes as written, its children, and where it begins."""

    tag: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)
    source: str
    line: int

    def refuse(self, why: str) -> NoReturn:
        """Raise `InvalidDefinition` with file and line."""
        raise InvalidDefinition(f"{self.source}:{self.line}: {why}")


def read_markup(path: Path) -> Element:
    """The root element of a file. Raises `InvalidDefinition`."""
    try:
        size = path.stat().st_size
        if size > SIZE_LIMIT:
            raise InvalidDefinition(f"{path}: a file of {size:,} bytes is no type definition (limit {SIZE_LIMIT:,})")
        return parse_markup(path.read_bytes(), source=str(path))
    except OSError as error:
        raise InvalidDefinition(f"{path}: the file cannot be read ({error.strerror}): correct its path") from error


def parse_markup(text: str | bytes, *, source: str) -> Element:
    """The root element of a document; `source` names it in messages. Raises `InvalidDefinition`."""
    builder = _Builder(source, encoding="utf-8" if isinstance(text, str) else None)
    return builder.build(text.encode(errors="surrogatepass") if isinstance(text, str) else text)


class _Builder:
    """Takes what expat reports and builds the tree."""

    def __init__(self, source: str, *, encoding: str | None) -> None:
        self._source = source
        self._open: list[Element] = []
        self._roots: list[Element] = []
        self._parser = expat.ParserCreate(encoding)
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text
        self._parser.StartDoctypeDeclHandler = self._doctype

    def build(self, text: bytes) -> Element:
        try:
            self._parser.Parse(text, True)
        except expat.ExpatError as error:
            reason = expat.ErrorString(error.code)
            raise InvalidDefinition(f"{self._source}:{error.lineno}: the XML is broken ({reason})") from error
        except (ValueError, LookupError) as error:
            # An encoding that Python does not have, or one that expat cannot use.
            if isinstance(error, InvalidDefinition):
                raise
            raise InvalidDefinition(f"{self._source}: the XML cannot be read ({error}): write it in UTF-8") from error
        # Expat refuses documents of no element, and of two.
        return self._roots[0]

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        line = self._parser.CurrentLineNumber
        element = Element(tag=tag, attributes=attributes, source=self._source, line=line)
        if len(self._open) >= DEPTH_LIMIT:
            element.refuse(f"elements nest deeper than {DEPTH_LIMIT} levels")
        siblings = self._open[-1].children if self._open else self._roots
        siblings.append(element)
        self._open.append(element)

    def _end(self, tag: str) -> None:
        self._open.pop()

    def _text(self, text: str) -> None:
        if text.strip():
            line = self._parser.CurrentLineNumber
            raise InvalidDefinition(f"{self._source}:{line}: text has no meaning here: {text.strip()!r:.60}. Remove it")

    def _doctype(self, name: str, *_: object) -> None:
        line = self._parser.CurrentLineNumber
        raise InvalidDefinition(f"{self._source}:{line}: a document type ({name}) is not read: remove its declaration")
