"""The wheel as users get it: what is in it, and that its migrations run from where it is installed."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest

import elm
from elm.storage.tables import REVISION

SOURCES = Path(elm.__file__).parents[1]


def run(*command: object, cwd: Path) -> str:
    """What a command says, started as if there was no checkout and no setting."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ELM_", "PG"))}
    given = [str(part) for part in command]
    done = subprocess.run(given, cwd=cwd, env=inherited, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the checkout, built without network."""
    place = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel")
    run(*pip, "--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir", place, SOURCES, cwd=place)
    (built,) = place.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def names(wheel: Path) -> Sequence[str]:
    """The files in the wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of an environment in which the wheel is installed, and of everything else what is here."""
    place = tmp_path_factory.mktemp("environment")
    run(sys.executable, "-m", "venv", "--without-pip", place, cwd=place)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", place / "bin" / "python")
    run(*pip, "install", "--no-deps", "--no-index", wheel, cwd=place)
    packages = next(place.glob("lib/python*/site-packages"))
    here = {sysconfig.get_path(kind) for kind in ("purelib", "platlib")}
    (packages / "dependencies.pth").write_text("\n".join(sorted(here)))
    return place / "bin" / "python"


def _files(folder: str, pattern: str = "*") -> set[str]:
    found = (path for path in (SOURCES / folder).rglob(pattern) if path.is_file() and path.suffix != ".pyc")
    return {path.relative_to(SOURCES).as_posix() for path in found}


def test_has_every_module_and_its_data(names: Sequence[str]) -> None:
    expected = _files("elm") | _files("armem_bridge")
    assert expected - set(names) == set()
    assert {"elm/py.typed", "elm/storage/postgres.py", "elm/demo/data/plaza1_path.csv.gz"} <= expected


def test_has_the_migrations(names: Sequence[str]) -> None:
    expected = {f"elm/_migrations/{name.removeprefix('alembic/')}" for name in _files("alembic")}
    assert expected == {name for name in names if name.startswith("elm/_migrations/")}
    assert {"elm/_migrations/env.py", "elm/_migrations/script.py.mako"} < expected
    assert any(name.startswith(f"elm/_migrations/versions/{REVISION}_") for name in expected)


def test_has_the_licence(names: Sequence[str]) -> None:
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)
    assert "elm/demo/data/LICENSE.BSD" in names


def test_has_nothing_else(names: Sequence[str]) -> None:
    tops = {name.partition("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"elm", "armem_bridge"}
    assert not [name for name in names if name.endswith(".pyc") or "__pycache__" in name]
    assert len(names) == len(set(names))


def test_types_are_found_by_checkers(names: Sequence[str]) -> None:
    assert {"elm/py.typed", "armem_bridge/py.typed"} <= set(names)


def test_installed_program_migrates(python: Path, dsn: str, tmp_path: Path) -> None:
    where = run(python, "-c", "import elm, armem_bridge; print(elm.__file__)", cwd=tmp_path).strip()
    assert Path(where).is_relative_to(python.parents[1])
    program = python.with_name("elm")
    said = run(program, "migrate", "--dsn", dsn, "--memory", "kitchen", cwd=tmp_path)
    again = run(python, "-m", "elm", "migrate", "--dsn", dsn, "--memory", "kitchen", cwd=tmp_path)
    assert (said.strip(), again.strip()) == (
        f"created memory 'kitchen' (schema {REVISION})",
        f"memory 'kitchen' is up to date (schema {REVISION})",
    )


def test_installed_library_writes_and_recalls(python: Path, dsn: str, tmp_path: Path) -> None:
    script = """
import sys, elm
from datetime import UTC, datetime
with elm.connect(sys.argv[1], "kitchen") as memory:
    memory.add_type("Thing")
    now = datetime(2026, 1, 1, tzinfo=UTC)
    memory.commit(elm.Event(type="Thing", interval=elm.Interval.at(now), region=elm.Region.box(0, 0, 1, 1)))
    print(memory.recall(elm.cues.is_a("Thing")).count())
"""
    assert run(python, "-W", "error", "-c", script, dsn, cwd=tmp_path) == "1\n"
