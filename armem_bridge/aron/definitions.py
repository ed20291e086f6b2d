"""Type definitions in ArmarX's XML (section 4.3.3, listings 4.1 to 4.8) read as type objects.

    <typedefinition>
      <aronincludes> <include include="Location.xml"/> </aronincludes>
      <generatetypes>
        <object name="Cup" namespace="::example::dto" extends="::example::dto::Thing">
          <objectchild key="place"> <object name="Location" namespace="::example::dto"/> </objectchild>
          <objectchild key="colours"> <list> <string optional="true"/> </list> </objectchild>
        </object>
        <intenum name="Side" namespace="::example::dto"> <enumvalue key="LEFT" value="0"/> </intenum>
      </generatetypes>
    </typedefinition>

Tags and attributes are spelled in many ways (`ObjectChild`, `int-enum`, `framed_pose`): capitals, `-` and
`_` do not count. Types may be used before they are defined, in any of the files read together. What
generates C++ only (code includes, documentation attributes) is passed over; any other tag or attribute that
is not known is refused with its file and line, for a type read with something left out would be another type.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES, plain_name
from armem_bridge.aron.markup import Element, parse_markup, read_markup
from armem_bridge.aron.tags import TagReader, attribute, attributes_of, full_name
from armem_bridge.errors import InvalidDefinition, InvalidTypeObject

_ROOTS = {"typedefinition", "arontypedefinition"}
_PASSED_OVER = {"codeincludes", "includes", "codeinclude"}
_INCLUDES = {"aronincludes", "aronincludetypes"}


def read_definitions(
    *paths: Path | str,
    include_directories: Iterable[Path | str] = (),
    known: Mapping[str, t.TypeObject] | None = None,
) -> dict[str, t.TypeObject]:
    """The types that files and what they include define, by their full names (`example::dto::Cup`).

    Includes are looked for beside the file that includes, then in `include_directories`; each file is read
    once. `known` are types defined elsewhere, which may be used by name. Raises `InvalidDefinition`.
    """
    reader = _Reader(include_directories, known or {})
    for path in paths:
        reader.read(Path(path))
    return reader.types()


def parse_definitions(
    text: str | bytes,
    *,
    source: str = "(text)",
    include_directories: Iterable[Path | str] = (),
    known: Mapping[str, t.TypeObject] | None = None,
) -> dict[str, t.TypeObject]:
    """As `read_definitions`, of a document in memory; `source` names it in messages."""
    reader = _Reader(include_directories, known or {})
    reader.collect(parse_markup(text, source=source), beside=None)
    return reader.types()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Definition:
    element: Element
    namespace: str


class _Reader:
    """Collects definitions first, then resolves each when it is first used."""

    def __init__(self, include_directories: Iterable[Path | str], known: Mapping[str, t.TypeObject]) -> None:
        self._directories = [Path(directory) for directory in include_directories]
        self._files: set[Path] = set()
        self._definitions: dict[str, _Definition] = {}
        self._done: dict[str, t.TypeObject] = {}
        self._known = {name.removeprefix("::"): type_object for name, type_object in known.items()}
        self._doing: list[str] = []

    def read(self, path: Path) -> None:
        """Collect what a file defines, unless it was read before."""
        resolved = path.resolve()
        if resolved not in self._files:
            self._files.add(resolved)
            self.collect(read_markup(path), beside=path.parent)

    def collect(self, root: Element, *, beside: Path | None) -> None:
        """Collect what a document and its includes define."""
        if plain_name(root.tag) not in _ROOTS:
            root.refuse(f"the root of a type definition is <typedefinition>, not <{root.tag}>")
        attributes_of(root)
        generating = [child for child in root.children if plain_name(child.tag) == "generatetypes"]
        if not generating:
            root.refuse("there is no <generatetypes>: put the types into one")
        for child in root.children:
            name = plain_name(child.tag)
            if name in _INCLUDES:
                self._include(child, beside)
            elif child not in generating and name not in _PASSED_OVER:
                child.refuse(f"<{child.tag}> is not known: there are aronincludes, codeincludes and generatetypes")
        for child in generating:
            attributes_of(child)
            for definition in child.children:
                self._define(definition)

    def types(self) -> dict[str, t.TypeObject]:
        """All types that were collected."""
        try:
            return {name: self.resolve(name) for name in self._definitions}
        except RecursionError as error:
            raise InvalidDefinition(f"the types refer to each other too deep: {self._doing[:3]} ...") from error

    def resolve(self, name: str) -> t.TypeObject:
        """The type of a full name that has a definition."""
        if name not in self._done:
            definition = self._definitions[name]
            if name in self._doing:
                definition.element.refuse(
                    f"{name!r} contains itself ({' > '.join([*self._doing, name])}): take <any/> for the inner one"
                )
            self._doing.append(name)
            try:
                self._done[name] = TagReader(self.find, definition.namespace).define(definition.element, name)
            except InvalidTypeObject as error:
                raise InvalidDefinition(f"{definition.element.source}:{definition.element.line}: {error}") from error
            self._doing.pop()
        return self._done[name]

    def find(self, name: str, namespace: str) -> t.TypeObject | None:
        """The type that `name` means inside `namespace`: from the innermost outwards, as C++ looks names up."""
        name = name.strip()
        scopes = [] if name.startswith("::") else namespace.split("::") if namespace else []
        name = name.removeprefix("::")
        for length in range(len(scopes), -1, -1):
            full = "::".join([*scopes[:length], name])
            if full in self._definitions:
                return self.resolve(full)
            if full in self._known:
                return self._known[full]
        return ALIASES.get(name)

    def _define(self, element: Element) -> None:
        if plain_name(element.tag) not in ("object", "intenum"):
            element.refuse(f"<{element.tag}> defines no type: <generatetypes> holds <object> and <intenum>")
        name = full_name(element)
        if name in self._definitions:
            other = self._definitions[name].element
            element.refuse(f"{name!r} is defined twice, here and in {other.source}:{other.line}: rename one")
        self._definitions[name] = _Definition(element=element, namespace=name.rpartition("::")[0])

    def _include(self, includes: Element, beside: Path | None) -> None:
        attributes_of(includes)
        for child in includes.children:
            match plain_name(child.tag):
                case "include":
                    attributes_of(child, "include", "autoinclude")
                    self._read_included(child, attribute(child, "include").strip("<> "), beside)
                case "packagepath":
                    attributes_of(child, "package", "path")
                    package, path = attribute(child, "package"), attribute(child, "path")
                    self._read_included(child, f"{package}/{path}", beside)
                case _:
                    child.refuse(f"<{child.tag}> is not known: <{includes.tag}> holds <include> and <packagepath>")

    def _read_included(self, element: Element, name: str, beside: Path | None) -> None:
        places = [*([] if beside is None else [beside]), *self._directories]
        for place in places:
            if (place / name).is_file():
                self.read(place / name)
                return
        looked = ", ".join(map(str, places)) or "nowhere, for there are no include directories"
        element.refuse(f"the included file {name!r} is not found (looked in {looked}): add its include directory")
