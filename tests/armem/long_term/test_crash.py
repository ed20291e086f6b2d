"""A process that is killed loses nothing that was durable, and who sends everything again doubles nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

from armem_bridge.long_term import Consolidation, LongTermMemory, LongTermSource
from elm.app import Memory, connect
from tests.armem.long_term.memories import behind
from tests.armem.working.scenes import CUP, commit, update
from tests.servers import MEMORY, Server

ROOT = Path(__file__).resolve().parents[3]

ROBOT = """
import sys
from armem_bridge.long_term import Consolidation, LongTermMemory
from elm.app import connect
from tests.armem.long_term.memories import behind
from tests.armem.working.scenes import commit, update

archive = LongTermMemory(connect(sys.argv[1], sys.argv[2]), Consolidation(durable=sys.argv[3] == "durable"))
with behind(archive) as server:
    for moment in range(100_000):
        commit(server, update(moment))
        print(moment, flush=True)
"""


def lived_for(dsn: str, acknowledged: int, how: str) -> int:
    """The last commit that a robot saw acknowledged before it was killed in the midst of committing."""
    command = [sys.executable, "-c", ROBOT, dsn, MEMORY, how]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT) as robot:
        assert robot.stdout is not None
        for line in robot.stdout:
            if int(line) >= acknowledged:
                break
        robot.send_signal(signal.SIGKILL)
        rest = [int(line) for line in robot.stdout if line.endswith("\n")]
    return max([acknowledged, *rest])


def times_kept(memory: Memory) -> Counter[int]:
    """How often each snapshot of the cup is in elm."""
    return Counter(event.interval.micros[0] for event in memory.recall())


def test_a_killed_process_loses_nothing_durable_and_doubles_nothing(postgres_server: Server) -> None:
    with postgres_server.database() as dsn, connect(dsn, MEMORY) as memory:
        last = lived_for(dsn, 40, "durable")
        kept = times_kept(memory)
        assert set(range(last + 1)) <= kept.keys() <= set(range(last + 2))
        assert set(kept.values()) == {1}

        again = lived_for(dsn, last + 300, "soon")
        kept = times_kept(memory)
        assert kept.keys() == set(range(len(kept)))
        assert last < len(kept) <= again + 2

        with behind(LongTermMemory(memory, Consolidation())) as server:
            commit(server, *(update(moment) for moment in range(again + 1)))
        assert times_kept(memory) == dict.fromkeys(range(again + 1), 1)
        assert len(LongTermSource(memory).history(CUP).all()) == again + 1
