"""The relations and comparisons that cues are made of, by the names that Python, JSON and the shell have for them."""

from __future__ import annotations

from enum import StrEnum
from typing import TypeVar

from elm.errors import InvalidValue
from elm.interval import AllenRelation


class SetRelation(StrEnum):
    """How two sets compare, the event's on the left (Def 14)."""

    EQUAL = "equal"
    SUBSET = "subset"
    SUPERSET = "superset"
    INTERSECTS = "intersects"
    DISJOINT = "disjoint"


class TypeRelation(StrEnum):
    """`exactly` the type, or `is_a`: the type or one of its sub-types."""

    EXACTLY = "exactly"
    IS_A = "is_a"


class Comparison(StrEnum):
    """How some value of a feature, or a duration, compares with a given one."""

    EQ = "="
    NE = "!="
    LT = "<"
    LE = "<="
    GT = ">"
    GE = ">="
    LIKE = "like"


class TimeAxis(StrEnum):
    """Which time is meant: when it happened, or when the memory learned of it."""

    TIME = "time"
    RECORDED_AT = "recorded_at"


class Place(StrEnum):
    """Whose place is meant: the observer's region, or the subject's."""

    REGION = "region"
    SUBJECT = "subject"


class Kin(StrEnum):
    """Which relatives are meant: sub-events or super-events."""

    PARTS = "parts"
    WHOLES = "wholes"


_Name = TypeVar("_Name", bound=StrEnum)


def named(given: object, *kinds: type[_Name], what: str, also: str = "") -> _Name:
    """The member of `kinds` that `given` is or names; anything else is refused, listing what there is.

    `also` names what the caller takes beside them.
    """
    for kind in kinds:
        if isinstance(given, kind):
            return given
        if isinstance(given, str) and given in {member.value for member in kind}:
            return kind(given)
    known = ", ".join(member.value for kind in kinds for member in kind)
    raise InvalidValue(f"{what} cannot be {given!r:.80}: choose one of {known}{also}")


def time_relation(given: object, *, what: str) -> SetRelation | AllenRelation:
    """The relation in time that `given` is or names: of point sets, or one of Allen's."""
    relation = named(given, SetRelation, AllenRelation, what=what)
    assert isinstance(relation, SetRelation | AllenRelation)  # noqa: S101 - named chose among these
    return relation
