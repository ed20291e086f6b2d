"""The simulated type hierarchy: a DAG of 11,110 event types below ten roots, ten children to an inner node."""

from __future__ import annotations

import random

from elm.taxonomy import EventType

ROOTS = 10
CHILDREN = 10
LEVELS = 4
SECOND_PARENTS = 0.05
"""Share of the nodes below the roots that have a second parent."""


def levels() -> list[list[str]]:
    """The type names of each level, roots first: 10, 100, 1,000 and 10,000 of them."""
    found = [[f"type-{root}" for root in range(ROOTS)]]
    while len(found) < LEVELS:
        found.append([f"{parent}.{child}" for parent in found[-1] for child in range(CHILDREN)])
    return found


def event_types() -> list[EventType]:
    """The hierarchy, parents first; always the same one, so that runs with different seeds compare."""
    chance = random.Random(11_110)
    above, *below = levels()
    types = [EventType(name=name) for name in above]
    for names in below:
        for name in names:
            parents = [name.rpartition(".")[0]]
            if chance.random() < SECOND_PARENTS:
                parents += [other for other in [chance.choice(above)] if other not in parents]
            types.append(EventType(name=name, parents=tuple(parents)))
        above = names
    return types
