"""Recognition over what was loaded: complex events enter the log when they were given, and so are not late."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from itertools import islice
from uuid import UUID

import pytest

from elm import cues
from elm.app import Memory
from elm.event import Event
from elm.recognition import Timing
from elm.recognition.status import RecognizerStatus
from elm.recognizers import Pattern, step
from elm.taxonomy import EventType
from simulators.worlds import hierarchy
from simulators.worlds.events import simulate
from tests.conftest import StoreFactory

EVENTS = 2_000
LONGEST = timedelta(minutes=1)
"""No simulated event lasts longer."""

PAIR = Pattern(
    name="pair",
    version=1,
    type="Pair",
    elements=[step("first", cues.exactly("Scene")), step("second", cues.exactly("Scene"))],
    within=timedelta(minutes=10),
)


def life() -> list[Event]:
    """Simulated events, of which the complex ones are scenes."""
    return [replace(event, type="Scene") if event.is_complex else event for event in islice(simulate(1), EVENTS)]


def late_as_given(events: Sequence[Event], lateness: timedelta) -> int:
    """How many scenes come when others that ended more than `lateness` after them were there already."""
    ends: dict[UUID, datetime] = {}
    latest, found = None, 0
    for event in events:
        end = event.interval.end if event.interval else max(ends[part] for part in event.parts)
        assert end is not None
        ends[event.uid] = end
        found += event.is_complex and latest is not None and end < latest - lateness
        latest = end if latest is None else max(latest, end)
    return found


def recognized(memory: Memory, lateness: timedelta) -> tuple[RecognizerStatus, set[UUID]]:
    """What becomes of the pattern in one go, and its results."""
    manager = memory.recognition([PAIR], timing=Timing(lateness=lateness, simulated=True))
    manager.catch_up()
    (status,) = manager.status()
    return status, {event.uid for event in memory.recall(cues.exactly("Pair"))}


@pytest.mark.parametrize("lateness", [timedelta(seconds=1), LONGEST], ids=["some late", "none late"])
def test_of_one_batch_only_what_was_given_late_is_late(store_factory: StoreFactory, lateness: timedelta) -> None:
    """So it is too for an export in the order of ids that is loaded elsewhere."""
    events = life()
    late = late_as_given(events, lateness)
    assert late == 0 if lateness == LONGEST else 0 < late < EVENTS / 100
    memory, copy = Memory(store_factory()), Memory(store_factory())
    for each in (memory, copy):
        each.add_types([*hierarchy.event_types(), EventType(name="Scene")])
    memory.load(events, batch=EVENTS)
    copy.load([event.as_event() for event in memory.recall(order="id")], batch=EVENTS)
    found = [recognized(each, lateness) for each in (memory, copy)]
    assert [status.late for status, _ in found] == [late, late]
    assert found[0][1] == found[1][1]
    assert len(found[0][1]) == found[0][0].found > EVENTS / 100
