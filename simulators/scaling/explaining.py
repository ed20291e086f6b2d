"""Where the slowest classes of cues spend their time: their plans as run, with the pages that they looked at."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from simulators.scaling.asking import LIMIT, Asked, Side

SLOWEST = 3
"""How many classes are explained."""

_PAGES = re.compile(r"Buffers: shared(?: hit=(\d+))?(?: read=(\d+))?")
_TIME = re.compile(r"(Planning|Execution) Time: ([\d.]+) ms")


def slowest(classes: Mapping[str, Mapping[str, Any]], size: int) -> list[str]:
    """The classes whose median at this size is the greatest, that one first."""
    return sorted(classes, key=lambda name: -float(classes[name]["sizes"][str(size)]["ms"]))[:SLOWEST]


def explained(side: Side, names: Iterable[str], answers: Mapping[str, Asked]) -> dict[str, Any]:
    """For each class its cue of the middling time: the plan, its pages, and what the server took to plan and run it."""
    found = {}
    for name in names:
        times = answers[name].answers[side.size].again
        middling = sorted(range(len(times)), key=times.__getitem__)[len(times) // 2]
        cue = side.cues(name, len(times))[middling]
        plan = side.memory.recall(cue, limit=LIMIT).explain().plan
        found[name] = {"elm_ms": times[middling] * 1e3, **read(plan), "plan": plan.splitlines()}
    return found


def read(plan: str) -> dict[str, float]:
    """The pages of the whole plan, hit and read, and the milliseconds of planning and running it."""
    pages = _PAGES.search(plan)
    hit, missed = (int(number or 0) for number in pages.groups()) if pages else (0, 0)
    times = {f"{what.lower()}_ms": float(taken) for what, taken in _TIME.findall(plan)}
    return {"pages_hit": hit, "pages_read": missed, **times}
