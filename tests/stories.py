"""Stories for the tests of the log: events one after the other, many still going on, with wholes between."""

from __future__ import annotations

import random
from collections.abc import Callable

from elm.event import Event


def story(chance: random.Random, thing: Callable[..., Event]) -> list[Event]:
    """Sixty events that `thing` makes, half of them wholes over three earlier ones, some others without end."""
    events: list[Event] = []
    for _ in range(60):
        if len(events) > 3 and chance.random() < 0.5:
            events.append(thing(*chance.sample(events, 3)))
        else:
            events.append(thing(end=chance.choice([None, 1])))
    return events
