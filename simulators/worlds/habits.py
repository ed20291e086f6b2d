"""Twenty patterns in the life of a robot that handles objects: sequences, loops, negations, absences, some alike."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta

from elm import cues
from elm.recognizers import Pattern, absent, count, greatest, same, step, without
from elm.recognizers.elements import Element, Step


def twenty() -> list[Pattern]:
    """The patterns, each with results of a type of its own."""
    of_an_object: dict[str, list[Element]] = {
        "fetch": [_step("Grasp"), _step("Carry"), _step("Place")],
        "fumble": [_step("Grasp"), without(cues.is_a("Place")), _step("Drop")],
        "picked-up-again": [_step("Drop"), _step("Grasp").gap(timedelta(seconds=40))],
        "slipped": [_step("Lift"), _step("Slip")],
        "poured": [_step("Grasp"), _step("Pour").one_or_more(), _step("Place")],
        "to-and-fro": [_step("Push"), _step("Pull")],
        "mishap-on-the-way": [_step("Carry"), _step("Mishap")],
        "recovered": [_step("Mishap"), _step("Approach").optional(), _step("Grasp")],
        "shown": [_step("Look").times(1, 3), _step("Point")],
    }
    at_a_place: dict[str, list[Element]] = {
        "left-open": [_step("Open"), absent(cues.is_a("Close"), timedelta(seconds=30))],
        "opened-and-closed": [_step("Open"), _step("Close")],
        "wiped": [_step("Wipe").times(2, 4)],
        "answered": [_step("Speak"), _step("Listen")],
        "narrow": [_step("Bump").times(3)],
        "hit-hard": [step("Bump", cues.is_a("Bump") & cues.feature("force", ">=", 20)), _step("Fail")],
    }
    anywhere: dict[str, list[Element]] = {
        "charged": [_step("Dock"), _step("Charge"), _step("Undock")],
        "waited": [_step("Dock"), _step("Wait").one_or_more(), _step("Undock")],
        "unnoticed": [_step("Fail"), absent(cues.is_a("Look"), timedelta(seconds=10))],
        "handed-over": [
            _step("Grasp"),
            _step("Speak"),
            step("Release", cues.is_a("Release"), same("object", "Grasp")),
        ],
    }
    at_once = Pattern(
        name="at-once",
        version=1,
        type="Habit.at-once",
        elements=[_step("Approach"), _step("Grasp").strict()],
        among=cues.is_a("Handling"),
        within=timedelta(seconds=30),
    )
    return [
        *(_pattern(name, elements, ["object"]) for name, elements in of_an_object.items()),
        *(_pattern(name, elements, ["place"]) for name, elements in at_a_place.items()),
        *(_pattern(name, elements, []) for name, elements in anywhere.items()),
        at_once,
    ]


def _step(kind: str) -> Step:
    return step(kind, cues.is_a(kind))


def _pattern(name: str, elements: Sequence[Element], partition: Sequence[str]) -> Pattern:
    return Pattern(
        name=name,
        version=1,
        type=f"Habit.{name}",
        elements=elements,
        partition=partition,
        within=timedelta(minutes=1),
        measures={"events": count(), "force": greatest("force")},
    )
