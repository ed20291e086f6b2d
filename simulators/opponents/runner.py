"""Runs the sides against each other: they write in turn, are asked in turn, and must answer the same."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from elm.errors import StoreFailure
from simulators.bench.timing import in_turn, steady_heap
from simulators.opponents.catalogue import ELM, Entry
from simulators.opponents.databases import own_database, size, template
from simulators.opponents.limits import Bare
from simulators.opponents.process import ModeLackingError, SideFailedError, SideProcess
from simulators.opponents.protocol import MODES, can
from simulators.opponents.workload import Task

LIMIT = "limit"
"""The key of the bare statements among the sides."""
BLOCK = 50
"""Commits of a side before the next one's turn."""
REPEATS = 3
"""Times that a question is asked again once the answer was found to be right."""
SLOW = 0.5
"""Seconds of an answer after which asking again would tell little."""
ENOUGH = 10.0
"""Seconds that a side may spend on one kind of questions; it is asked `_FEWEST` of them anyway."""

_FEWEST = 3


@dataclass(slots=True, kw_only=True)
class Writes:
    """What a side took in one mode: seconds of each commit, seconds of the load, bytes on disk afterwards."""

    commits: list[float] = field(default_factory=list)
    loaded: float | None = None
    bytes: int | None = None


@dataclass(slots=True, kw_only=True)
class Answers:
    """A side's answers to the questions of one kind: seconds by question, and what was wrong."""

    seconds: dict[int, float] = field(default_factory=dict)
    rows: list[int] = field(default_factory=list)
    spent: float = 0.0
    wrong: dict[str, Any] | None = None

    @property
    def are_enough(self) -> bool:
        """Whether the side need not be asked for more."""
        return self.wrong is not None or (self.spent > ENOUGH and len(self.seconds) >= _FEWEST)


@dataclass(slots=True, kw_only=True)
class Race:
    """All that was measured."""

    abouts: dict[str, dict[str, Any]] = field(default_factory=dict)
    writes: dict[str, dict[str, Writes]] = field(default_factory=lambda: {mode: {} for mode in MODES})
    answers: dict[str, dict[str, Answers]] = field(default_factory=dict)
    """By kind, then by side, `LIMIT` among them."""
    failed: dict[str, str] = field(default_factory=dict)
    """Sides that gave out, with the reason; what they did before counts."""


@dataclass(slots=True, kw_only=True)
class _Running:
    entry: Entry
    mode: str
    process: SideProcess
    dsn: str | None
    empty: int = 0


class Runner:
    """One comparison: the sides' processes, and what came out so far."""

    def __init__(
        self, task: Task, dsn: str, directory: Path, environments: Path, advance: Callable[[int], None]
    ) -> None:
        self.race = Race()
        self._task = task
        self._dsn = dsn
        self._directory = directory
        self._environments = environments
        self._advance = advance
        self._template = ""
        self._file = directory / "workload.jsonl"
        task.workload.write(self._file)

    def run(self, sides: Sequence[Entry], commits: int) -> Race:
        """In each mode all sides commit the first `commits` events one by one and load the rest; then they are asked.

        A side is asked in the first mode that it has: what it answers does not depend on it.
        """
        with ExitStack() as opened, steady_heap():
            asked: dict[str, _Running] = {}
            self._template = opened.enter_context(template(self._dsn))
            bare = opened.enter_context(self._bare())
            for mode in MODES:
                running = self._started(sides, mode, opened)
                self._write(running, mode, commits, bare[mode])
                for side in self._alive(running):
                    if side.entry.name in asked:
                        self._ended(side)
                    else:
                        asked[side.entry.name] = side
            self._ask(asked, bare[MODES[0]])
            for side in self._alive(list(asked.values())):
                self._ended(side)
        return self.race

    @contextmanager
    def _bare(self) -> Iterator[dict[str, Bare]]:
        with ExitStack() as opened:
            made = {}
            for mode in MODES:
                made[mode] = Bare(opened.enter_context(own_database(self._dsn, LIMIT, self._template)), mode)
                opened.callback(made[mode].close)
            yield made

    def _started(self, sides: Sequence[Entry], mode: str, opened: ExitStack) -> list[_Running]:
        running = []
        for entry in sides:
            if entry.name in self.race.failed:
                continue
            directory = self._directory / f"{entry.name}-{mode}"
            directory.mkdir()
            dsn = None
            if entry.has_database:
                dsn = opened.enter_context(own_database(self._dsn, entry.name, self._template))
            arguments = [str(self._file), str(directory), mode, *([dsn] if dsn else [])]
            command = entry.command(self._environments, *arguments)
            with self._watched(entry):
                try:
                    process = opened.enter_context(SideProcess(command, directory))
                except ModeLackingError:
                    continue
                side = _Running(entry=entry, mode=mode, process=process, dsn=dsn)
                side.empty = self._bytes(side)
                self.race.abouts.setdefault(entry.name, process.ask(do="about"))
                running.append(side)
        return running

    def _write(self, running: Sequence[_Running], mode: str, commits: int, bare: Bare) -> None:
        records = self._task.workload.records
        writes = self.race.writes[mode]
        writes |= {name: Writes() for name in [*(side.entry.name for side in running), LIMIT]}
        for turn, first in enumerate(range(0, commits, BLOCK)):
            stop = min(first + BLOCK, commits)
            for side in in_turn([*self._alive(running), None], turn):
                if side is None:
                    writes[LIMIT].commits += map(bare.commit, records[first:stop])
                    continue
                with self._watched(side.entry):
                    answer = side.process.ask(do="commit", **{"from": first, "to": stop})
                    writes[side.entry.name].commits += answer["seconds"]
            self._advance(stop - first)
        writes[LIMIT].loaded = bare.load(records[commits:])
        for side in self._alive(running):
            with self._watched(side.entry):
                answer = side.process.ask(do="load", **{"from": commits, "to": len(records)})
                writes[side.entry.name].loaded = answer["seconds"]
                writes[side.entry.name].bytes = self._bytes(side) - side.empty

    def _ask(self, asked: dict[str, _Running], bare: Bare) -> None:
        numbers = {record.uid: record.number for record in self._task.workload.records}
        questions = zip(self._task.workload.questions, self._task.answers, strict=True)
        for turn, (question, expected) in enumerate(questions):
            answers = self.race.answers.setdefault(question.kind, {})
            for side in in_turn(self._alive(list(asked.values())), turn):
                with self._watched(side.entry):
                    found = answers.setdefault(side.entry.name, Answers())
                    if not found.are_enough and can(self.race.abouts[side.entry.name]["abilities"][question.kind]):
                        self._ask_one(side, question.number, expected, found)
            limit = answers.setdefault(LIMIT, Answers())
            rows = [numbers[uid] for uid in expected]
            limit.rows.append(len(rows))
            limit.seconds[question.number] = statistics.median(bare.fetch(rows) for _ in range(REPEATS))
            self._advance(1)

    def _ask_one(self, side: _Running, number: int, expected: Sequence[str], found: Answers) -> None:
        first = side.process.ask(do="ask", question=number, repeat=1)
        if first["uids"] != list(expected):
            missing, extra = _differences(first["uids"], expected)
            counts = {"rows": len(first["uids"]), "expected": len(expected), "missing": missing, "extra": extra}
            found.wrong = {"question": number, **counts}
            return
        (taken,) = first["seconds"]
        series = [taken]
        if taken <= SLOW:
            series = side.process.ask(do="ask", question=number, repeat=REPEATS)["seconds"]
        found.seconds[number] = statistics.median(series)
        found.rows.append(len(expected))
        found.spent += taken + sum(series)

    @contextmanager
    def _watched(self, entry: Entry) -> Iterator[None]:
        """Whoever gives out is set aside by name, and the others go on; without elm there is nothing to compare."""
        try:
            yield
        except SideFailedError as error:
            if entry.name == ELM:
                raise StoreFailure(f"elm's side failed: {error}") from error
            self.race.failed[entry.name] = str(error)

    def _alive(self, running: Sequence[_Running]) -> list[_Running]:
        return [side for side in running if side.entry.name not in self.race.failed]

    def _ended(self, side: _Running) -> None:
        with self._watched(side.entry):
            side.process.end()

    def _bytes(self, side: _Running) -> int:
        return int(side.process.ask(do="size")["bytes"]) if side.dsn is None else size(side.dsn)


def _differences(found: Sequence[str], expected: Sequence[str]) -> tuple[int, int]:
    """How many of the expected uids are missing, and how many others were found; none of either: another order."""
    return len(set(expected) - set(found)), len(set(found) - set(expected))
