"""The tour: fill a memory with the mower's two runs, ask it what a person would ask, and draw it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from rich.console import Console
from rich.markup import escape
from rich.syntax import Syntax
from rich.table import Table

from elm import cues
from elm.app import Memory
from elm.demo.mower_recognizers import recognize
from elm.demo.plaza import TYPES, PlazaRun, load_all
from elm.demo.questions import QUESTIONS
from elm.demo.recording import ANCHOR, CREDIT
from elm.demo.words import listed, named
from elm.recognizers.base import RECOGNIZER, VERSION

EXPLAINED = QUESTIONS[0]
"""The question whose statement is shown."""
CONDITION_SHOWN = 80
"""Characters of a condition that are shown."""


def run(memory: Memory, *, picture: Path | None, console: Console) -> None:
    """Load the runs into `memory` (again changes nothing), ask and answer on `console`, draw to `picture`."""
    draw = None if picture is None else _drawing()
    runs = load_all()
    _introduce(runs, console)
    _fill(memory, runs, console)
    _recognize(memory, runs, console)
    _count(memory, console)
    _show_recognized(memory, console)
    _ask(memory, console)
    _show_statement(memory, console)
    if picture is not None and draw is not None:
        start = perf_counter()
        draw(memory, picture)
        console.print(f"\n[bold]Picture:[/] {escape(str(picture))} ({perf_counter() - start:.1f} s)", soft_wrap=True)


def _drawing() -> Callable[[Memory, Path], None]:
    # Asked for before the tour begins: a missing package is not told only after it.
    from elm.demo.picture import draw

    return draw


def _introduce(runs: list[PlazaRun], console: Console) -> None:
    console.print("[bold]Half an hour in the life of a robot mower[/]")
    console.print(f"{CREDIT}.", soft_wrap=True)
    console.print(
        f"Its clock counts the seconds of a day that nobody wrote down: second 0 is taken for "
        f"{ANCHOR:%Y-%m-%dT%H:%M:%SZ}. Whether both runs are of one day is not known.",
        soft_wrap=True,
    )
    for one in runs:
        console.print(f"Odd in [bold]{one.name}[/]: {'; '.join(one.oddities.lines())}.", soft_wrap=True)


def _fill(memory: Memory, runs: list[PlazaRun], console: Console) -> None:
    memory.add_types(TYPES)
    start = perf_counter()
    report = memory.load(event for one in runs for event in one.events)
    seconds = perf_counter() - start
    known = f", {report.existing:,} were there already" if report.existing else ""
    console.print(
        f"\n[bold]Loaded[/] {report.new:,} events in {seconds:.2f} s ({report.read / seconds:,.0f} events/s){known}.",
        soft_wrap=True,
    )


def _recognize(memory: Memory, runs: list[PlazaRun], console: Console) -> None:
    start, before = perf_counter(), memory.statistics().events
    found = recognize(memory, runs)
    seconds, new = perf_counter() - start, memory.statistics().events - before
    known = sum(each.found for each in found) - new
    console.print(
        f"[bold]Recognized[/] {new:,} episodes in {seconds:.2f} s, from these events alone"
        f"{f', {known:,} were there already' if known else ''}.",
        soft_wrap=True,
    )
    table = Table("recognizer", "version", "events fed", "episodes found", "types")
    for each in found:
        types = ", ".join(each.outputs)
        table.add_row(each.name, f"{each.version}", f"{each.fed:,}", f"{each.found:,}", types)
    console.print(table)


def _count(memory: Memory, console: Console) -> None:
    table = Table("type", "events", "first begin", "last end", "together")
    for group in memory.recall().groups("type"):
        minutes = group.duration.total_seconds() / 60
        end = "" if group.last_end is None else f"{group.last_end:%H:%M:%S}"
        table.add_row(str(group.key), f"{group.count:,}", f"{group.first_begin:%H:%M:%S}", end, f"{minutes:.1f} min")
    console.print(table)


def _show_recognized(memory: Memory, console: Console) -> None:
    stands = [stand.uid for stand in memory.recall(cues.exactly("Stand"))]
    episode = memory.recall(cues.exactly("Row") & cues.parts("intersects", stands)).first()
    assert episode is not None  # noqa: S101 - the mower stood in the midst of a row
    console.print(
        f"\n[bold]What {escape(named(episode))} was recognized from[/], by {episode.value(RECOGNIZER)} of version "
        f"{episode.value(VERSION)}, in the order in which it matched",
        soft_wrap=True,
    )
    for line in listed(memory.get(part) for part in episode.parts):
        console.print(f"    {escape(line)}", soft_wrap=True)


def _ask(memory: Memory, console: Console) -> None:
    for number, question in enumerate(QUESTIONS, start=1):
        start = perf_counter()
        sentences = question.answer(memory)
        millis = (perf_counter() - start) * 1000
        console.print(f"\n[bold]{number:2}. {escape(question.text)}[/] [dim]{millis:.1f} ms[/]", soft_wrap=True)
        for sentence in sentences:
            console.print(f"    {escape(sentence)}", soft_wrap=True)


def _show_statement(memory: Memory, console: Console) -> None:
    explanation = EXPLAINED.recall(memory).explain()
    console.print(f"\n[bold]How “{escape(EXPLAINED.text)}” is answered[/]", soft_wrap=True)
    if explanation.sql:
        console.print(Syntax(explanation.sql, "sql", background_color="default", word_wrap=True))
    else:
        console.print("    This memory lives in this process and runs no SQL.")
    for rows in explanation.conditions:
        condition = rows.condition
        if len(condition) > CONDITION_SHOWN:
            condition = f"{condition[:CONDITION_SHOWN]}..."
        console.print(f"    {rows.alone:4,} events by itself, {rows.left:4,} left: {escape(condition)}", soft_wrap=True)
