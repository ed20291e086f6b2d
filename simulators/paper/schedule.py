"""When events are inserted and when queries are asked: the alternating periods of an experimental run (VI-B1b)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

from elm.errors import InvalidValue

INSERTIONS = 100
QUERIES = 25

EXPERIMENTS = MappingProxyType({1: "one component", 2: "two components", 3: "three components"})
"""The experiments by the number of components of their cues."""

_BIN = 1000
"""Insertions and sizes of the memory that make one data point of figures 7 and 8."""


class Answer(StrEnum):
    """As what the events that a cue asks for are read."""

    OBJECTS = "objects"
    """All of them, as Event objects."""
    IDS = "ids"
    """The ids of all; then all as objects, of more than 1,000 the first 1,000."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """One experimental run: from an empty memory to so many events, asked by cues of so many components."""

    components: int
    number: int
    events: int
    answer: Answer
    seed: int

    def __post_init__(self) -> None:
        if self.events < 10 * INSERTIONS or self.events % (10 * INSERTIONS):
            raise InvalidValue(
                f"a run has a multiple of {10 * INSERTIONS:,} events, for its tenths are compared, not {self.events:,}"
            )
        if self.components not in EXPERIMENTS:
            raise InvalidValue(f"the experiments are of 1, 2 and 3 components, not of {self.components}")

    def periods(self) -> Iterator[tuple[int, int]]:
        """Of each insertion period the first and the last event, counted from 1; `QUERIES` queries follow it."""
        for before in range(0, self.events, INSERTIONS):
            yield before + 1, before + INSERTIONS

    @property
    def queries(self) -> int:
        """How many queries are asked in all."""
        return self.events // INSERTIONS * QUERIES

    @property
    def step(self) -> int:
        """Sizes of the memory in one data point: those of the paper, smaller in runs too short for ten such points."""
        return min(_BIN, self.events // 10)

    @property
    def own_seed(self) -> int:
        """The seed of this run, another one for each run of each experiment."""
        return (self.seed * 10 + self.components) * 1000 + self.number

    @property
    def name(self) -> str:
        """What tells this run from the others of a command, fit for the name of a file."""
        return f"{self.components}-components-run-{self.number:02}-{self.answer}"


def courses(*, runs: int, events: int, components: list[int], seed: int) -> list[Course]:
    """All runs of the experiments: one of each experiment after the other, so that an early end leaves some of each.

    The first run of several reads its answers as objects, the others as ids.
    """
    if runs < 1:
        raise InvalidValue(f"each experiment has one run at least, not {runs}")
    return [
        Course(
            components=each,
            number=number,
            events=events,
            answer=Answer.OBJECTS if number == 0 and runs > 1 else Answer.IDS,
            seed=seed,
        )
        for number in range(runs)
        for each in components
    ]
