"""The comparison operators of features and durations in SQL."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from sqlalchemy import ColumnElement

from elm.cues.relations import Comparison
from elm.storage.conditions.rule import Bind, SqlCondition

COMPARE: Mapping[Comparison, Callable[[ColumnElement[Any], Bind], SqlCondition]] = MappingProxyType(
    {
        Comparison.EQ: lambda stored, p: stored == p,
        Comparison.NE: lambda stored, p: stored != p,
        Comparison.LT: lambda stored, p: stored < p,
        Comparison.LE: lambda stored, p: stored <= p,
        Comparison.GT: lambda stored, p: stored > p,
        Comparison.GE: lambda stored, p: stored >= p,
        Comparison.LIKE: lambda stored, p: stored.like(p, escape="\\"),
    }
)
