"""Which generation slice files are of, and what happens where two do not fit."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from armem_bridge.ice.refusals import RemoteFailure
from armem_bridge.memory_id import MemoryID
from tests.armem.ice.processes import ROOT, ClientProcess, ServerProcess
from tests.armem.ice.serving import SLICES
from tests.armem.ice.test_two_processes import committing, moments, update

MEMORY = "RobotAPI/interface/armem/memory.ice"
ARON = "RobotAPI/interface/aron.ice"


def load(*directories: Path | str) -> str:
    """Load slice files in a process of its own: the generation, or the error that was raised."""
    program = (
        "import sys\n"
        "from armem_bridge.errors import ArmemError\n"
        "from armem_bridge.ice import load_slices\n"
        "try:\n"
        "    print(load_slices(sys.argv[1:]).generation.name)\n"
        "except ArmemError as error:\n"
        "    print(type(error).__name__, error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, *map(str, directories)], capture_output=True, text=True, cwd=ROOT, check=True
    )
    return done.stdout.strip()


@pytest.fixture
def slices(tmp_path: Path, ice: None) -> Path:
    """A copy of the fourth generation's files, to be changed."""
    return shutil.copytree(SLICES / "gen4", tmp_path / "slices")


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


@pytest.mark.parametrize(("name", "generation"), [("gen3", "THIRD"), ("gen4", "FOURTH")])
def test_generations_are_told_apart_by_their_members(ice: None, name: str, generation: str) -> None:
    assert load(SLICES / name) == generation


def test_packages_may_lie_in_a_workspace(slices: Path, tmp_path: Path) -> None:
    for package in ("ArmarXCore", "RobotAPI"):
        shutil.move(slices / package, tmp_path / "workspace" / package / "source" / package)

    assert load(tmp_path / "workspace") == "FOURTH"


def test_packages_may_lie_in_several_directories_and_have_more_members(slices: Path, tmp_path: Path) -> None:
    shutil.move(slices / "ArmarXCore", tmp_path / "other" / "ArmarXCore")
    change(slices / MEMORY, "float confidence = 1.0;", "string more; float confidence = 1.0; int evenMore = 3;")

    assert load(slices, tmp_path / "other") == "FOURTH"


def test_classes_of_unknown_names_are_found_by_their_members(slices: Path) -> None:
    for old, new in (("EntityUpdateResult", "Outcome"), ("AddSegmentResult", "Added")):
        text = (slices / MEMORY).read_text()
        (slices / MEMORY).write_text(re.sub(rf"\b{old}\b", new, text))

    assert load(slices) == "FOURTH"


def test_mixed_generations_are_refused(slices: Path) -> None:
    shutil.copy(SLICES / "gen3" / ARON, slices / ARON)

    message = load(slices)

    assert message.startswith("UnknownGeneration")
    assert "ARON has no Version" in message
    assert "update ArmarXCore and RobotAPI together" in message


def test_older_generations_are_refused(slices: Path) -> None:
    change(slices / MEMORY, "core::time::dto::DateTime referencedTime;", "long timeCreatedMicroSeconds;")

    assert "of the first or second generation" in load(slices)


def test_missing_files_are_named_with_the_remedy(slices: Path) -> None:
    (slices / MEMORY).unlink()

    message = load(slices)

    assert message.startswith("SlicesMissing")
    assert MEMORY in message
    assert str(slices) in message
    assert "no directory at all" in load()


def test_files_that_are_no_slice_are_named(slices: Path) -> None:
    (slices / MEMORY).write_text("this is not Slice")

    message = load(slices)

    assert message.startswith("SlicesUnreadable")
    assert "memory.ice" in message


def test_a_missing_member_is_named(slices: Path) -> None:
    change(slices / MEMORY, "int instanceIndex = -1;", "")

    message = load_and_wire(slices)

    assert "MemoryID has no member instanceIndex" in message


def load_and_wire(directory: Path) -> str:
    program = (
        "import sys\n"
        "from armem_bridge.errors import ArmemError\n"
        "from armem_bridge.ice import load_slices\n"
        "from armem_bridge.ice.wire import Wire\n"
        "try:\n"
        "    Wire(load_slices(sys.argv[1:]))\n"
        "except ArmemError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(directory)], capture_output=True, text=True, cwd=ROOT, check=True
    )
    return done.stdout


def test_a_process_loads_one_set_of_files(ice: None) -> None:
    program = (
        "import sys\n"
        "from armem_bridge.ice import load_slices\n"
        "one, other = sys.argv[1:]\n"
        "assert load_slices([one]) is load_slices([one])\n"
        "try:\n"
        "    load_slices([other])\n"
        "except ValueError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(SLICES / "gen3"), str(SLICES / "gen4")],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )

    assert "take another process" in done.stdout


def test_a_client_of_another_generation_is_told_so(server: ServerProcess, client: ClientProcess, cup: MemoryID) -> None:
    other = {"gen3": "gen4", "gen4": "gen3"}[server.generation]
    with (
        ClientProcess(other, server.locator) as stranger,
        pytest.raises(RemoteFailure, match="slice files of different generations"),
    ):
        stranger.call(committing, update(cup, 1))

    assert client.call(committing, update(cup, 2)).success
    assert moments(client, cup) == [2]
