"""Pieces of text that all sections of the report are made of, and the labels of its plots: tables and numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table whose first column is text and whose others are numbers; ends with an empty line."""
    lines = [head, [":--", *["--:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines) + "\n\n"


def number(value: float | None, unit: str = "") -> str:
    """A number in about three digits, without an exponent; a dash for None."""
    if value is None:
        return "-"
    if value == int(value) or abs(value) >= 100:
        text = f"{value:,.0f}"
    elif abs(value) >= 0.01:
        text = f"{value:.3g}"
    else:
        text = f"{value:.2g}"
    return f"{text} {unit}".strip()


def span(values: Iterable[float | None], unit: str = "") -> str:
    """The least and the greatest of the values; a dash where there are none."""
    known = [value for value in values if value is not None]
    return f"{number(min(known))}..{number(max(known), unit)}" if known else number(None)


def duration(seconds: float) -> str:
    """A time that something took, in seconds, minutes or hours."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    if seconds < 7200:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
