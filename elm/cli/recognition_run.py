"""Running recognizers from the command line: until somebody says stop, or until the log has been dealt with."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Event as Signal
from threading import Thread
from time import monotonic
from typing import TYPE_CHECKING

from elm.cli.stopping import set_by_signals, warnings_said
from elm.cli.terminal import progress, remarks, say
from elm.errors import DatabaseUnreachable, ElmError, MemoryMissing

if TYPE_CHECKING:
    from elm.app import Memory
    from elm.recognition import RecognitionManager

LOOK_EVERY = 1.0
"""Seconds between two looks at how far the recognizers are."""
TELL_EVERY = 60.0
"""Seconds between two lines about it, where no terminal shows it all the time."""


def run_once(manager: RecognitionManager) -> bool:
    """Deal with what the log holds; whether no recognizer failed."""
    with warnings_said("elm"), progress("recognizing", total=None, unit=""):
        manager.catch_up()
    say(_told(manager))
    return not any(each.is_failing for each in manager.status())


def run_until_stopped(memory: Memory, manager: RecognitionManager) -> None:
    """Deal with the log as it grows; SIGINT and SIGTERM stop it after the batch at hand, a second one at once."""
    # Who is told a wrong address hears of it: only later on a server may be away.
    with suppress(MemoryMissing):
        memory.log.head()
    stop, broke = Signal(), list[Exception]()
    work = Thread(target=_work, args=(manager, stop, broke), name="recognition", daemon=True)
    what = f"recognizing in memory {memory.name!r} as {manager.consumer!r}"
    with warnings_said("elm"), set_by_signals(stop), _shown(what) as show:
        work.start()
        work.join(LOOK_EVERY)
        while work.is_alive():
            if stop.is_set():
                say("ending after the batch at hand; once more ends it at once")
                work.join()
                break
            with suppress(ElmError):
                show(_told(manager))
            work.join(LOOK_EVERY)
    if broke:
        raise broke[0]
    with suppress(DatabaseUnreachable):
        say(f"stopped: {_told(manager)}")


def _work(manager: RecognitionManager, stop: Signal, broke: list[Exception]) -> None:
    try:
        manager.run(stop)
    except Exception as error:
        broke.append(error)


def _told(manager: RecognitionManager) -> str:
    found = manager.status()
    position = min((each.position for each in found), default=0)
    head = max((each.position + each.lag for each in found), default=0)
    failing = [each.name for each in found if each.is_failing]
    told = [f"position {position:,} of {head:,}", f"{sum(each.found for each in found):,} complex events so far"]
    if late := [f"{each.late:,} for {each.name}" for each in found if each.late]:
        told.append(f"too late: {', '.join(late)}")
    if failing:
        told.append(f"failing: {' '.join(failing)}")
    return ", ".join(told)


@contextmanager
def _shown(what: str) -> Iterator[Callable[[str], None]]:
    """Show on stderr how far things are: all the time on a terminal, else now and then when something has changed."""
    if sys.stderr.isatty():
        from elm.cli.event_table import cell

        with remarks().status(cell(what)) as line:
            yield lambda told: line.update(cell(f"{what}: {told}"))
        return
    said, due = "", monotonic()

    def tell(told: str) -> None:
        nonlocal said, due
        if told != said and monotonic() >= due:
            say(f"{what}: {told}")
            said, due = told, monotonic() + TELL_EVERY

    yield tell
