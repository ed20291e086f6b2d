"""Where the report's sections come from: the file of each measurement, the command that makes it, who draws it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from elm.errors import InvalidValue

Section = Callable[[Mapping[str, Any], Path], str]
"""From the figures of a measurement and the directory of its pictures to Markdown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A measurement that the report has a section about."""

    name: str
    title: str
    module: str | None = None
    """The module that draws it; without one there are only its goals and circumstances."""
    function: str = "section"
    first: str = ""
    """What must have been done before its command."""

    @property
    def file(self) -> str:
        """The file of its figures."""
        return f"{self.name}.json"

    def command(self, directory: Path) -> str:
        """The command that makes it."""
        return f"{self.first}python -m simulators {self.name} --json {directory / self.file}"

    def draw(self, figures: Mapping[str, Any], pictures: Path) -> str:
        """The section below the goals; figures of another shape than its module knows are an error."""
        if self.module is None:
            return ""
        section = cast(Section, getattr(import_module(self.module), self.function))
        try:
            return section(figures, pictures)
        except (KeyError, TypeError, IndexError) as error:
            raise InvalidValue(
                f"{self.file} lacks what its section needs ({type(error).__name__}: {error}): it was written by "
                f"another version; measure again, or take it out of the directory"
            ) from error


SOURCES = (
    Source(name="paper", title="The experiments of the paper", module="simulators.paper.drawn"),
    Source(name="scale", title="Growth with the memory", module="simulators.scaling.drawn"),
    Source(
        name="opponents",
        title="elm beside what a user would pick instead",
        module="simulators.opponents.drawn",
        first="make opponents; ",
    ),
    Source(name="insert", title="Writing", module="simulators.report.writing"),
    Source(name="recall", title="Recalling", module="simulators.report.recalling"),
    Source(name="recognize", title="Recognition", module="simulators.report.recognizing", first="make opponents; "),
    Source(
        name="types",
        title="Type hierarchies",
        module="simulators.report.writing",
        function="hierarchy_section",
        first="ELM_TEST_DATA=DIR ",
    ),
    Source(name="armem", title="ArmarX-style memory", module="simulators.armem.drawn"),
)
"""In the order of the report."""


def found(directory: Path) -> dict[Source, dict[str, Any]]:
    """The figures that lie in a directory: those of `SOURCES` in their order, then others, which have no pictures.

    Other files that are no figures of a measurement are passed over.
    """
    read = {source: _read(directory / source.file) for source in SOURCES if (directory / source.file).is_file()}
    for file in sorted(directory.glob("*.json")):
        if file.name not in {source.file for source in SOURCES} and _is_measurement(figures := _parsed(file)):
            read[Source(name=file.stem, title=file.stem)] = figures
    return read


def _read(file: Path) -> dict[str, Any]:
    figures = _parsed(file)
    if not _is_measurement(figures):
        raise InvalidValue(f"{file} has no figures of a measurement: it needs the keys 'goals' and 'run'; take it away")
    return cast(dict[str, Any], figures)


def _parsed(file: Path) -> Any:
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InvalidValue(f"{file} is no JSON ({error}): measure again, or take it out of the directory") from error


def _is_measurement(figures: Any) -> bool:
    return isinstance(figures, dict) and {"goals", "run"} <= figures.keys()
