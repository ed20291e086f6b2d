"""Keeping what was found: a result that was forgotten since it was first found is not kept again."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from elm.errors import ForgottenEvent
from elm.store import Arrival, Committed, Store


def keep_results(
    store: Store, results: Sequence[Arrival], keep: Callable[[Sequence[Arrival]], list[Committed]]
) -> list[Committed]:
    """Have `keep` commit the results, without those of which the memory has tombstones.

    A consumer that was rewound, and a replay, find results again; those that were forgotten, but are parts of
    others, the memory refuses.
    """
    try:
        return keep(results)
    except ForgottenEvent:
        forgotten = {each.uid for each in store.tombstones([each.event.uid for each in results])}
        return keep([each for each in results if each.event.uid not in forgotten])
