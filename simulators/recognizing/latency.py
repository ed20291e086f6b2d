"""How long after the commit of its last part a complex event is committed, against a bare commit; nothing else runs."""

from __future__ import annotations

import random
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import perf_counter
from typing import Any

import elm
from elm import cues
from elm.errors import StoreFailure
from elm.event import Event
from elm.interval import Interval
from elm.recognition import Timing
from elm.recognizers import Pattern, step
from elm.taxonomy import EventType
from simulators.bench.scratch import Connection, bare_schema, connect, scratch_memory, with_setting
from simulators.bench.timing import in_milliseconds, in_turn, seconds, steady_heap

FIRST, LAST, WHOLE = "Grasp", "Place", "Moved"
WARM_UP = 5
"""Matches at the start that are not counted."""
PAUSE = (0.05, 0.15)
"""Seconds of rest before each commit: shortest and longest."""
TIMING = Timing(lateness=timedelta(0))
PATIENCE = timedelta(seconds=30)

_CREATE = "CREATE TABLE bare_row (id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY, data bytea NOT NULL)"
_INSERT = "INSERT INTO bare_row (data) VALUES (%s)"
_ROW_BYTES = 200

# A reader that the server itself has look, every 0.2 ms: it takes neither this process's time nor a notification.
_LOOK_OUT = """
CREATE FUNCTION seen(behind bigint, patience interval) RETURNS boolean LANGUAGE plpgsql VOLATILE AS $$
BEGIN
    WHILE clock_timestamp() < statement_timestamp() + patience LOOP
        IF EXISTS (SELECT FROM {memory}.event WHERE id > behind) THEN RETURN true; END IF;
        PERFORM pg_sleep(0.0002);
    END LOOP;
    RETURN false;
END $$
"""


def pattern() -> Pattern:
    """A grasp, then a place: certain when time has passed beyond the place."""
    return Pattern(
        name="moved",
        version=1,
        type=WHOLE,
        elements=[step("grasp", cues.is_a(FIRST)), step("place", cues.is_a(LAST))],
        within=timedelta(minutes=1),
    )


def measure(dsn: str, *, matches: int, seed: int, advance: Callable[[int], None]) -> dict[str, Any]:
    """The times with a manager in a thread beside the writer, with one in its own process, and of a bare commit."""
    managers = {"in_process": _beside, "own_process": _apart}
    found: dict[str, dict[str, list[float]]] = {}
    for name, manager in managers.items():
        with scratch_memory(dsn) as memory_name, elm.connect(dsn, memory_name) as memory, connect(dsn) as reader:
            reader.execute(f"SET search_path TO {bare_schema(memory_name)}, public")
            reader.execute(_LOOK_OUT.format(memory=memory_name))
            memory.add_types([EventType(name=FIRST), EventType(name=LAST)])
            with connect(with_setting(dsn, "search_path", bare_schema(memory_name))) as bare, steady_heap():
                bare.execute(_CREATE)
                with manager(dsn, memory):
                    found[name] = _times(memory, reader, bare, matches, seed, advance)
            wholes = memory.recall(cues.exactly(WHOLE)).count()
            if wholes != matches + WARM_UP:
                raise StoreFailure(f"{wholes} complex events where {matches + WARM_UP} were to be found")
    bare_commits = [each for times in found.values() for each in times["bare"]]
    median = statistics.median(bare_commits)
    return {
        "matches": matches,
        "latency_vs_commit": statistics.median(found["in_process"]["complex"]) / median,
        "latency_vs_commit_own_process": statistics.median(found["own_process"]["complex"]) / median,
        "bare_commit": in_milliseconds(bare_commits),
        "event_commit": in_milliseconds([each for times in found.values() for each in times["commit"]]),
        **{name: in_milliseconds(times["complex"]) for name, times in found.items()},
    }


def _times(
    memory: elm.Memory, reader: Connection, bare: Connection, matches: int, seed: int, advance: Callable[[int], None]
) -> dict[str, list[float]]:
    chance = random.Random(seed)
    times: dict[str, list[float]] = {"complex": [], "commit": [], "bare": []}

    def rest() -> None:
        time.sleep(chance.uniform(*PAUSE))

    def commit_bare() -> None:
        rest()
        row = chance.randbytes(_ROW_BYTES)
        times["bare"].append(seconds(lambda: bare.execute(_INSERT, (row,), prepare=True)))

    def commit_match() -> None:
        rest()
        memory.commit(_event(FIRST))
        rest()
        last = _event(LAST)
        begin = perf_counter()
        committed = memory.commit(last)
        times["commit"].append(perf_counter() - begin)
        answer = reader.execute("SELECT seen(%s, %s)", (committed.id, PATIENCE), prepare=True).fetchone()
        times["complex"].append(perf_counter() - begin)
        if answer != (True,):
            raise StoreFailure(f"no complex event within {PATIENCE.total_seconds():g} s of its last part")

    for turn in range(WARM_UP + matches):
        for call in in_turn([commit_bare, commit_match], turn):
            call()
        if turn >= WARM_UP:
            advance(1)
    return {name: series[WARM_UP:] for name, series in times.items()}


def _event(kind: str) -> Event:
    return Event(type=kind, interval=Interval.at(datetime.now(UTC)), agent="robot")


@contextmanager
def _beside(dsn: str, memory: elm.Memory) -> Iterator[None]:
    """A manager in a thread of this process, which shares the writer's store."""
    with memory.recognition([pattern()], timing=TIMING):
        yield


@contextmanager
def _apart(dsn: str, memory: elm.Memory) -> Iterator[None]:
    """A manager in a process of its own, until stdin of that is closed."""
    with subprocess.Popen(  # noqa: S603 - our own program
        [sys.executable, "-m", "simulators.recognizing.latency", dsn, memory.name],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    ) as process:
        assert process.stdin is not None  # noqa: S101 - both are pipes
        assert process.stdout is not None  # noqa: S101
        if not process.stdout.readline():
            raise StoreFailure("the process of the manager ended before it began: see what it wrote above")
        try:
            yield
        finally:
            process.stdin.close()


def main(dsn: str, name: str) -> None:
    """Recognize in a memory until stdin ends."""
    with elm.connect(dsn, name) as memory, memory.recognition([pattern()], timing=TIMING):
        print("at work", flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main(*sys.argv[1:])
