"""Strands: recognizers that may feed each other work, fail and are kept together; all others apart."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import Any

import msgspec

from elm.errors import InvalidValue
from elm.recognition.clocks import Timing
from elm.recognizers.base import Judge, Recognizer, fingerprint
from elm.recognizers.spelling import plain

_SHOWN = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Strand:
    """Recognizers in the order in which they are fed: those that feed others before them, then by name."""

    recognizers: tuple[Recognizer, ...]
    fingerprints: tuple[str, ...]
    name: str


def strands(recognizers: Sequence[Recognizer], judge: Judge, timing: Timing) -> list[Strand]:
    """The recognizers by strand; two with one name are refused."""
    known = {each.name: each for each in sorted(recognizers, key=lambda each: each.name)}
    if len(known) != len(recognizers):
        names = sorted(each.name for each in recognizers)
        twice = sorted({name for name in names if names.count(name) > 1})
        raise InvalidValue(f"several recognizers are named {twice[0]!r}: give each its own name")
    fed_by = {
        name: [other for other, feeder in known.items() if other != name and feeds(feeder, each, judge)]
        for name, each in known.items()
    }
    found = []
    left = dict.fromkeys(known)
    while left:
        members = _connected(next(iter(left)), fed_by)
        for name in members:
            del left[name]
        found.append(_strand([known[name] for name in _feeders_first(members, fed_by)], timing))
    return found


def feeds(feeder: Recognizer, fed: Recognizer, judge: Judge) -> bool:
    """Whether a result of the one may be of interest to the other."""
    if feeder.across_agents and not fed.across_agents:
        return False
    return any(judge.of_type(fed.interest, output.name) is not False for output in feeder.outputs)


def _connected(start: str, fed_by: dict[str, list[str]]) -> list[str]:
    found = {start}
    while more := {
        name
        for name, feeders in fed_by.items()
        if name not in found and (found & set(feeders) or any(name in fed_by[each] for each in found))
    }:
        found |= more
    return sorted(found)


def _feeders_first(members: list[str], fed_by: dict[str, list[str]]) -> list[str]:
    graph = TopologicalSorter({name: sorted(set(fed_by[name]) & set(members)) for name in members})
    try:
        order: list[str] = []
        graph.prepare()
        while graph.is_active():
            ready = sorted(graph.get_ready())
            order += ready
            graph.done(*ready)
        return order
    except CycleError:
        # They feed each other in a ring: any fixed order will do.
        return members


def _strand(recognizers: Sequence[Recognizer], timing: Timing) -> Strand:
    fingerprints = tuple(map(fingerprint, recognizers))
    told: Any = [plain(timing), fingerprints]
    digest = hashlib.sha256(msgspec.json.encode(told)).hexdigest()[:12]
    names = ",".join(each.name for each in recognizers)
    shown = names if len(names) <= _SHOWN else f"{names[:_SHOWN]}..."
    return Strand(recognizers=tuple(recognizers), fingerprints=fingerprints, name=f"{shown}@{digest}")
