"""What every condition is made of: the key and values of its SQL, and how to build it from parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from sqlalchemy import ARRAY, TIMESTAMP, ColumnElement, Text, Uuid
from sqlalchemy.types import TypeEngine

SqlCondition = Any  # a ColumnElement of bool; SQLAlchemy types what operators return as Any
Bind = ColumnElement[Any]


class Names(Protocol):
    """The numbers that a memory gave to its types and frames."""

    def type_id(self, name: str) -> int:
        """The number of a type; an unknown one is an error."""

    def frame_id(self, name: str) -> int:
        """The number of a frame; of an unknown one a number that no event has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """One condition: what its SQL depends on, the values it binds, and how to build it from their parameters."""

    key: tuple[Any, ...]
    values: tuple[tuple[Any, TypeEngine[Any]], ...]
    build: Callable[..., Any]
    """Takes the table (or an alias of it) whose rows are judged, then one parameter for each value."""
    search: Callable[..., Any] | None = None
    """Likewise: what an index finds, all that match and perhaps others, if the planner can tell how many that are.

    The same as `build` where it finds no others; None where no index serves.
    """
    glimpse: Callable[..., Any] | None = None
    """Likewise: something cheap that all fulfil that match, to be asked first of rows that no index chose."""
    narrow: Callable[..., Any] | None = None
    """Likewise: what all fulfil that match, as an index understands it that knows begins too; None without one."""
    outline: Callable[..., Any] | None = None
    """Likewise: the same with boxes in place of polygons, next to nothing to judge; None where there is no polygon."""
    looks: tuple[Callable[..., Any], ...] = ()
    """Likewise, each: what one index finds, all that match and perhaps others, few of which are read at little cost.

    The planner does not know the values then, and must not take another index: see `exactly`.
    """
    alone: Callable[..., Any] | None = None
    """Likewise: what an index finds, as it is best asked if nothing else is; None where that is as searched."""
    judge: Callable[..., Any] | None = None
    """Likewise: the condition as any plan judges a row in the same short time; None where it is so as built."""

    @property
    def is_search(self) -> bool:
        """Whether an index finds exactly what matches."""
        return self.search is self.build


def exactly(indexed_value: Any, wanted: Any) -> SqlCondition:
    """That an index has this very value, as a look says it.

    By an equation the planner takes the value for as frequent as all others are on average, and may read all events
    along another index; between two values it does not know it takes one event in two hundred.
    """
    return indexed_value.between(wanted, wanted)


def indexed(
    key: tuple[Any, ...],
    values: tuple[tuple[Any, TypeEngine[Any]], ...],
    build: Callable[..., Any],
    *,
    judge: Callable[..., Any] | None = None,
    look: Callable[..., Any] | None = None,
) -> Rule:
    """A condition that an index serves as it is, how else it is judged, and a look at it, if there are such."""
    looks = () if look is None else (look,)
    return Rule(key=key, values=values, build=build, search=build, judge=judge, looks=looks)


TIME = TIMESTAMP(timezone=True)
"""The type of a parameter that is an instant."""
TEXTS = ARRAY(Text)
"""The type of a parameter that is several texts."""
UIDS = ARRAY(Uuid)
"""The type of a parameter that is several uids."""
