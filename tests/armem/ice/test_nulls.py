"""Null where the slice files allow it: commits, updates and IDs that are none are refused, each by itself."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.armem.ice.processes import ROOT
from tests.armem.ice.serving import SLICES

PROGRAM = """
import sys
from armem_bridge.ice import MemoryClient, Standalone, load_slices
from armem_bridge.memory_id import MemoryID
from armem_bridge.working import Commit
from tests.armem.ice.serving import make_server
from tests.armem.ice.test_two_processes import update

words = load_slices([sys.argv[1]])
cup = MemoryID(memory="Object", core_segment="Instance", provider_segment="p", entity="cup")
with Standalone(words, [make_server("Object")], port=0) as robot, MemoryClient(words, robot.locator) as client:
    remote = client.memory("Object")
    commit = client.wire.commits.write_commit(Commit(updates=[update(cup, number) for number in (1, 2, 3, 4)]))
    commit.updates[1] = None
    commit.updates[2].entityID = None
    for given in (None, commit):
        for each in remote.writing.commit(given).results:
            print(each.success, each.errorMessage)
    print(robot.status().malformed)
"""


@pytest.fixture
def slices(tmp_path: Path, ice: None) -> Path:
    """Files of a generation whose commits, updates and IDs are classes, as which they may be null."""
    directory: Path = shutil.copytree(SLICES / "gen4", tmp_path / "slices")
    file = directory / "RobotAPI/interface/armem/memory.ice"
    text = file.read_text()
    for name in ("EntityUpdate", "Commit", "MemoryID"):
        assert text.count(f"struct {name}\n") == 1
        text = text.replace(f"struct {name}\n", f"class {name}\n")
    file.write_text(text)
    return directory


def test_nulls_are_refused_one_by_one(slices: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(slices)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    null, first, second, third, last, malformed = done.stdout.splitlines()

    assert null == "False the commit is null: send one with its updates"
    assert first == last == "True "
    assert second == "False the update cannot be read: it is null"
    assert third.startswith("False the memory 'Object' failed at an update: AttributeError")
    assert malformed == "3"
