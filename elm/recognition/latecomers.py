"""Warnings of events that came too late to be fed: one line for all strands of a consumer, once in a while."""

from __future__ import annotations

import logging
import time
from collections import Counter

from elm.recognition.fold import Fold

TELL_EVERY = 60.0
"""Seconds between two lines about events that came too late."""
_NAMED = 5
"""Recognizers, or groups of those that feed each other, that are named in a line."""

log = logging.getLogger(__name__)


class Latecomers:
    """What came too late for the strands of one consumer since it was warned of the last time."""

    def __init__(self, consumer: str) -> None:
        self._consumer = consumer
        self._counted: dict[str, int] = {}
        self._untold: Counter[str] = Counter()
        self._due = time.monotonic()

    def enter(self, fold: Fold) -> None:
        """Take what these strands had counted before for told."""
        for name, work in fold.works.items():
            self._counted[name] = work.tally.late

    def look(self, fold: Fold) -> None:
        """Warn of what these strands have counted since, if that is due."""
        for name, work in fold.works.items():
            if more := work.tally.late - self._counted[name]:
                self._untold[",".join(each.name for each in work.strand.recognizers)] += more
                self._counted[name] = work.tally.late
        if not self._untold or fold.last_late is None or time.monotonic() < self._due:
            return
        told = [f"{number:,} to {name!r}" for name, number in sorted(self._untold.items())]
        named = ", ".join(told[:_NAMED]) + (f" and {len(told) - _NAMED:,} more" if len(told) > _NAMED else "")
        agent, behind = fold.last_late
        log.warning(
            "recognition %r: events come too late and are not fed: %s; the last, of %s, ended %s s before what is "
            "still waited for. Correct the clock if it was set back, or allow for the delay "
            "(Timing(lateness=...), --lateness); a complete replay feeds them",
            self._consumer,
            named,
            "no agent" if agent is None else f"agent {agent!r}",
            f"{behind / 1e6:,.1f}",
        )
        self._untold.clear()
        self._due = time.monotonic() + TELL_EVERY
