"""Recognition by processes that are killed at any moment: nothing is lost, nothing is found twice."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from random import Random

import pytest

from elm.errors import ConsumerBusy
from elm.log import LogKind, Tick
from elm.recognition import RecognitionManager, replay
from elm.storage.postgres import PostgresStore
from elm.store import Arrival
from tests.clock import at
from tests.recognition.scenes import AGENTS, TYPES, recognizers, results, shuffled, stream
from tests.recognition.victim import LATENESS, TIMING
from tests.servers import MEMORY, Server


@pytest.fixture
def dsn(postgres_server: Server) -> Iterator[str]:
    with postgres_server.database() as address:
        yield address


@pytest.mark.parametrize("seed", range(2))
def test_a_process_killed_at_any_moment_loses_nothing(dsn: str, seed: int) -> None:
    chance = Random(seed)
    store = PostgresStore(dsn, MEMORY)
    store.add_types(TYPES)
    store.commit_all([Arrival(event=event) for event in shuffled(chance, stream(chance, 300), LATENESS)])
    kills = 0
    for _ in range(8):
        command = [sys.executable, "-m", "tests.recognition.victim", dsn, MEMORY, str(chance.randrange(1, 6))]
        victim = subprocess.Popen(command, stdout=subprocess.PIPE)
        assert victim.stdout is not None
        assert victim.stdout.readline() == b"at work\n"
        time.sleep(chance.random() * 0.12)
        kills += victim.poll() is None
        victim.kill()
        victim.wait()
        victim.stdout.close()
    assert kills >= 4, "the victims were done before they could be killed"
    store.log.write([Tick(agent=agent, deadline=at(10_000), kind=LogKind.PUNCTUATION) for agent in AGENTS])
    _catch_up(store)
    found = replay(store, recognizers(), timing=TIMING)
    assert (found.new, found.missing) == ((), ())
    assert len(found.found) > 100
    assert len(results(store)) >= len(found.found)
    store.close()


def _catch_up(store: PostgresStore) -> None:
    """Go on where the last one was killed; the server may take a moment to notice that it is gone."""
    for _ in range(50):
        try:
            RecognitionManager(store, recognizers(), timing=TIMING).catch_up()
        except ConsumerBusy:
            time.sleep(0.1)
        else:
            return
    raise AssertionError("the lock of a killed process was never released")
