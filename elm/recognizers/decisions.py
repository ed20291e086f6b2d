"""Which matches of a pattern are results, and how a result is told, as docs/recognition.md says."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from elm.features import Feature, FeatureValue
from elm.interval import from_micros
from elm.recognizers.base import Emission
from elm.recognizers.partition import Key, values_of
from elm.recognizers.plan import Plan, Rules
from elm.recognizers.runs import Run, Taken

MATCH, TIMED_OUT = "match", "timed out"


def counting(certain: Sequence[Run], rules: Rules, bar: Callable[[Key, int, int], None]) -> list[Run]:
    """Those that count among matches that are certain at one moment, of one partition or of several.

    `bar` is told which runs cannot become results any more: those of a partition that began from one place to another.
    """
    found: list[Run] = []
    barred_to: dict[Key, int] = {}
    barred: set[tuple[Key, int]] = set()
    for run in sorted(certain, key=Run.rank):
        if run.start <= barred_to.get(run.key, 0) or (run.key, run.start) in barred:
            continue
        found.append(run)
        if rules.bars_overlaps:
            barred_to[run.key] = run.taken[3]
            bar(run.key, 0, run.taken[3])
        elif rules.bars_same_start:
            barred.add((run.key, run.start))
            bar(run.key, run.start, run.start)
    return found


def match_of(run: Run, rules: Rules, plan: Plan, moment: int) -> Emission:
    """What a match that was certain at a moment is told as; with the moment if it waited for an absence."""
    deadline = None if plan.absent is None else moment
    return _emission(run, rules, plan, output=MATCH, type_name=rules.type, deadline=deadline)


def time_out_of(run: Run, rules: Rules, plan: Plan, *, type_name: str, deadline: int) -> Emission:
    """What a run that has timed out at its deadline is told as."""
    return _emission(run, rules, plan, output=TIMED_OUT, type_name=type_name, deadline=deadline)


def _emission(run: Run, rules: Rules, plan: Plan, *, output: str, type_name: str, deadline: int | None) -> Emission:
    trail = run.trail()
    return Emission(
        type=type_name,
        parts=tuple((plan.names[step], fed.event) for _, step, fed, _ in trail),
        output=output,
        key=values_of(run.key),
        features=_measured(trail, rules, plan),
        deadline=None if deadline is None else from_micros(deadline),
    )


def _measured(trail: Sequence[Taken], rules: Rules, plan: Plan) -> tuple[Feature, ...]:
    found: list[tuple[str, FeatureValue]] = []
    for name, measure in rules.measures.items():
        of_step = [fed.event for _, at, fed, _ in trail if measure.step in (None, plan.names[at])]
        value = measure.of(of_step)
        if value is not None:
            found.append((name, value))
    return tuple(found)
