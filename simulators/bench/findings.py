"""What a measurement found: its figures as JSON with the circumstances, and as tables that show the goals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from simulators.bench.files import write_json


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """A figure and the bound that it should keep: as its greatest value, or as its least."""

    name: str
    value: float
    at_most: float | None = None
    at_least: float | None = None

    @property
    def met(self) -> bool:
        """Whether the figure keeps its bounds."""
        return (self.at_most is None or self.value <= self.at_most) and (
            self.at_least is None or self.value >= self.at_least
        )

    @property
    def bound(self) -> str:
        """The bounds in words of the tables."""
        bounds = [("<=", self.at_most), (">=", self.at_least)]
        return " and ".join(f"{sign} {bound:g}" for sign, bound in bounds if bound is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """The figures of one measurement under their keys, the goals among them, and what to show beside those."""

    figures: Mapping[str, Any]
    goals: Sequence[Goal]
    tables: Mapping[str, Table] = field(default_factory=dict)
    """By title."""

    def as_json(self, run: Mapping[str, Any]) -> dict[str, Any]:
        """The figures, then the goals, then the circumstances of the run."""
        goals = {goal.name: {"value": goal.value, "goal": goal.bound, "met": goal.met} for goal in self.goals}
        return {**self.figures, "goals": goals, "run": dict(run)}

    def write(self, file: Path, run: Mapping[str, Any]) -> None:
        """Write the report as JSON, whole or not at all; missing directories are made."""
        write_json(file, self.as_json(run), indent=2)

    def show(self, title: str, console: Console) -> None:
        """Print the tables, the goals last where there are some."""
        goals = table_of("figure", "value", "goal", "")
        for goal in self.goals:
            goals.add_row(goal.name, f"{goal.value:.2f}", goal.bound, "met" if goal.met else "[bold red]missed[/]")
        # Not as the tables' own titles, which are broken to their widths.
        shown = {**self.tables, title: goals} if self.goals else self.tables
        for heading, table in shown.items():
            console.print(f"\n[bold]{heading}[/]")
            console.print(table)


def table_of(first: str, *others: str) -> Table:
    """An empty table whose first column is text and whose others are numbers."""
    table = Table()
    table.add_column(first)
    for name in others:
        table.add_column(name, justify="right")
    return table
