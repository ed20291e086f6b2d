"""Paths into ARON data, written as text: `pose`, `objects[*].objectPoseGlobal`, `trajectory[0].position`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from armem_bridge.aron.data import Data, Dict, List
from armem_bridge.long_term.refusals import InvalidArchive

_EVERY: Final = "*"
_STEP = re.compile(r"\.?(?P<name>(?:[^.\[\]\\]|\\.)+)|\[(?P<index>\d+|\*)\]", re.DOTALL)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Name:
    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Index:
    index: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Every:
    """All elements of a List, or of a Dict, in their order."""


_Step = _Name | _Index | _Every


@dataclass(frozen=True, slots=True)
class DataPath:
    """Where in a data object something stands: names of Dicts with dots between them, `[n]` and `[*]`.

    `[n]` is an element of a List, `[*]` all elements of a List or a Dict. In a name a backslash makes the
    next character plain. The empty path is the data object itself.
    """

    text: str
    _steps: tuple[_Step, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_steps", tuple(_parse(self.text)))

    def find(self, data: Data | None) -> Iterator[Data]:
        """What stands there; nothing where it is missing or null, or where the data have another form."""
        found = [data]
        for step in self._steps:
            found = [below for each in found for below in _below(each, step)]
        return (each for each in found if each is not None)

    def __str__(self) -> str:
        return self.text


def _parse(text: str) -> Iterator[_Step]:
    at = 0
    while at < len(text):
        step = _STEP.match(text, at)
        if step is None or (step[0].startswith(".") != (at > 0) and step["name"] is not None):
            raise InvalidArchive(
                f"{text!r:.200} is no path into data: write names with dots between them, and [0] or [*] for elements"
            )
        at = step.end()
        if step["name"] is not None:
            yield _Name(name=re.sub(r"\\(.)", r"\1", step["name"], flags=re.DOTALL))
        else:
            yield _Every() if step["index"] == _EVERY else _Index(index=int(step["index"]))


def _below(data: Data | None, step: _Step) -> list[Data | None]:
    match step, data:
        case _Name(name=name), Dict(elements=elements):
            return [elements[name]] if name in elements else []
        case _Index(index=index), List(elements=several):
            return [several[index]] if index < len(several) else []
        case _Every(), List(elements=several):
            return list(several)
        case _Every(), Dict(elements=elements):
            return list(elements.values())
        case _:
            return []
