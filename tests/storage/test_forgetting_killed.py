"""A forgetting killed at any moment, or the server under it: what went is whole, and the same call forgets the rest."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import psycopg

from elm import cues
from elm.event import Event, StoredEvent
from elm.forgetting import forget
from elm.query import Query
from elm.storage.postgres import PostgresStore
from elm.taxonomy import EventType
from tests.clock import span
from tests.servers import MEMORY, run_private_cluster
from tests.storage.test_concurrency import arrivals, whole
from tests.storage.test_forgetting import BROKEN

THINGS, BATCH = 400, 5
FORGETTER = f"""
import sys
from elm import cues
from elm.forgetting import forget
from elm.storage.postgres import PostgresStore
store = PostgresStore(sys.argv[1], {MEMORY!r})
store.statistics()
print("ready", flush=True)
forget(store, cues.exactly("Thing"), batch={BATCH})
"""
_BACKENDS = "SELECT pid FROM pg_stat_activity WHERE application_name = 'forgetter'"
_PATIENCE = 60.0


def told(store: PostgresStore) -> int:
    """Things, wholes of them that are Things, and Laps over both; how many events in all."""
    store.add_types([EventType(name="Thing"), EventType(name="Lap")])
    things = [Event(type="Thing", interval=span(number, number + 1)) for number in range(THINGS)]
    above = [whole(*things[number : number + 3]) for number in range(0, THINGS, 5)]
    laps = [Event(type="Lap", parts=[above[n].uid, things[5 * n + 4].uid]) for n in range(0, len(above), 2)]
    events = [*things, *above, *laps]
    store.commit_all(arrivals(*events))
    return len(events)


@contextmanager
def opened(dsn: str) -> Iterator[PostgresStore]:
    store = PostgresStore(dsn, MEMORY)
    try:
        yield store
    finally:
        store.close()


def check_links(dsn: str) -> None:
    with psycopg.connect(dsn) as connection:
        for query in BROKEN:
            assert connection.execute(query).fetchone() == (0,), query


def laps(store: PostgresStore) -> list[StoredEvent]:
    return list(store.find(Query(cue=cues.exactly("Lap"))))


def kill_process(forgetter: subprocess.Popen[str], dsn: str) -> None:
    forgetter.kill()


def kill_backend(forgetter: subprocess.Popen[str], dsn: str) -> None:
    """Upon which the server lets go of all others, and recovers from its log."""
    with psycopg.connect(dsn) as connection:
        found = connection.execute(_BACKENDS).fetchall()
    for (pid,) in found:
        os.kill(pid, signal.SIGKILL)


@contextmanager
def forgetting(dsn: str) -> Iterator[subprocess.Popen[str]]:
    """A process that is about to forget all Things."""
    address = psycopg.conninfo.make_conninfo(dsn, application_name="forgetter")
    command = [sys.executable, "-c", FORGETTER, address]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield process
        finally:
            process.kill()


def left(dsn: str) -> int:
    """How many events there are, once the server answers and the killed have let go of all they held."""
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline:
        try:
            with psycopg.connect(dsn) as connection:
                if not connection.execute(_BACKENDS).fetchall():
                    row = connection.execute("SELECT count(*) FROM event").fetchone()
                    assert row is not None
                    return int(row[0])
        except psycopg.OperationalError:
            pass
        time.sleep(0.01)
    raise AssertionError("the server does not come back, or the killed go on")


def wait_until_some_went(dsn: str, most: int) -> None:
    """Return in the midst of it."""
    deadline = time.monotonic() + _PATIENCE
    with psycopg.connect(dsn, autocommit=True) as connection:
        while connection.execute("SELECT count(*) <= %s FROM event", [most]).fetchone() != (True,):
            assert time.monotonic() < deadline, "nothing goes"


def attack(dsn: str, kill: Callable[[subprocess.Popen[str], str], None], *, times: int) -> None:
    # What others see is in the log of the server by then.
    dsn = psycopg.conninfo.make_conninfo(dsn, options=f"-c search_path={MEMORY},public -c synchronous_commit=on")
    chance = random.Random(7)
    with opened(dsn) as store:
        total = told(store)
        before = laps(store)
    there = total
    for number in range(times):
        with forgetting(dsn) as forgetter:
            # The first time at any moment, also before the first tombstone.
            if number > 0:
                wait_until_some_went(dsn, there - chance.randrange(1, 60))
            time.sleep(chance.uniform(0, 0.01))
            kill(forgetter, dsn)
            forgetter.communicate()
            assert forgetter.returncode != 0
        now = left(dsn)
        assert len(before) < now <= there
        assert number == 0 or now < there
        there = now
        check_links(dsn)
        with opened(dsn) as store:
            statistics = store.statistics()
            assert (statistics.events, statistics.events + statistics.forgotten) == (now, total)
            assert laps(store) == before
    with opened(dsn) as store:
        assert forget(store, cues.exactly("Thing")).events == there - len(before)
        assert laps(store) == before
        assert {each.uid for each in store.tombstones()} == {part for lap in before for part in lap.parts}
        assert store.statistics().forgotten == total - len(before)
    check_links(dsn)


def test_a_forgetting_killed_at_any_moment_is_whole_and_goes_on_when_it_is_repeated(dsn: str) -> None:
    attack(dsn, kill_process, times=3)


def test_a_server_killed_while_it_forgets_is_whole_and_goes_on_when_that_is_repeated() -> None:
    with run_private_cluster() as server, server.database() as dsn:
        attack(dsn, kill_backend, times=2)
