"""The exact test, in Python, of the rows that a store could only narrow down, and the order of those that pass it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from typing import Any, TypeVar

import shapely

from simulators.opponents.protocol import Question

Row = TypeVar("Row")
Facts = Mapping[str, Any]
"""What is known of an event: `number`, `type`, `begin`, `end`, `features`, `parts`, and its `region` as WKB or None."""
Kinds = Mapping[str, Sequence[str]]
"""For each type itself and all that it is a kind of."""


def fitting(question: Question, rows: Iterable[Row], facts_of: Callable[[Row], Facts], kinds: Kinds) -> list[Row]:
    """The rows that answer a question, as it orders and limits them; of `wholes` nothing is known here."""
    told = [(row, facts_of(row)) for row in rows]
    kept = [(row, facts) for row, facts in told if _fits(question, facts, kinds)]
    if question.kind == "nearest":
        return _nearest(question, kept)
    if question.kind.startswith(("region.", "near")):
        kept = _placed(question, kept)
    if question.limit is None:
        return [row for row, _ in kept]
    kept.sort(key=lambda each: (each[1]["begin"], each[1]["number"]), reverse=question.kind == "type.latest")
    return [row for row, _ in kept[: question.limit]]


def related(relation: str, event: Set[Any], given: Set[Any]) -> bool:
    """Whether the set of an event stands in a relation to the one that is asked for."""
    match relation:
        case "equal":
            return event == given
        case "subset":
            return event <= given
        case "superset":
            return event >= given
        case "intersects":
            return not event.isdisjoint(given)
        case other:
            raise ValueError(f"no relation of sets: {other}")


def features_of(pairs: Iterable[Sequence[Any]]) -> set[tuple[str, bool, Any]]:
    """Features as a set in which 1 and 1.0 are equal, and 1 and True are not."""
    return {(name, isinstance(value, bool), value) for name, value in pairs}


def _fits(question: Question, facts: Facts, kinds: Kinds) -> bool:
    """Whether an event answers, as far as places do not matter."""
    value = question.value
    match question.kind.split("."):
        case ["time", "equal"]:
            return bool(facts["begin"] == value["begin"] and facts["end"] == value["end"])
        case ["time", "subset"]:
            return bool(facts["begin"] >= value["begin"] and facts["end"] <= value["end"])
        case ["time", "superset"]:
            return bool(facts["begin"] <= value["begin"] and facts["end"] >= value["end"])
        case ["time", "intersects"] | ["window"] | ["near", "lately"]:
            return bool(facts["begin"] <= value["end"] and facts["end"] >= value["begin"])
        case ["near", "type"]:
            return value["type"] in kinds[facts["type"]]
        case ["features", relation]:
            return related(relation, features_of(facts["features"]), features_of(value))
        case ["parts", relation]:
            return related(relation, set(facts["parts"]), set(value))
        case ["payload", "equal"]:
            return bool(facts["payload"] == bytes.fromhex(value))
        case _:
            return True


def _placed(question: Question, told: Sequence[tuple[Row, Facts]]) -> list[tuple[Row, Facts]]:
    """Those whose region answers."""
    regions = shapely.from_wkb([facts["region"] for _, facts in told])
    if question.kind.startswith("near"):
        fits = shapely.dwithin(regions, _point(question), question.value["metres"])
    else:
        asked = shapely.Polygon(question.value)
        # Prepared geometries are quick on the left.
        shapely.prepare(asked)
        mirrored = {
            "region.equal": shapely.equals,
            "region.subset": shapely.covers,
            "region.superset": shapely.covered_by,
            "region.intersects": shapely.intersects,
        }
        fits = mirrored[question.kind](asked, regions)
    return [each for each, fit in zip(told, fits, strict=True) if fit]


def _nearest(question: Question, told: Sequence[tuple[Row, Facts]]) -> list[Row]:
    """Those nearest, by distance and number."""
    regions = shapely.from_wkb([facts["region"] for _, facts in told])
    metres = shapely.distance(regions, _point(question)).tolist()
    ranked = sorted(
        (distance, facts["number"], row)
        for distance, (row, facts) in zip(metres, told, strict=True)
        if facts["region"] is not None
    )
    return [row for _, _, row in ranked[: question.limit]]


def _point(question: Question) -> shapely.Point:
    return shapely.Point(question.value["x"], question.value["y"])
