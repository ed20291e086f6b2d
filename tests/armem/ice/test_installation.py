"""Where Ice comes from, and that nothing else of the bridge needs it."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

import pytest

from armem_bridge.ice.installation import PACKAGES, DebianFinder, fits
from tests.armem.ice.processes import ROOT

OUTSIDE = [
    path for path in sorted((ROOT / "armem_bridge").rglob("*.py")) if ROOT / "armem_bridge" / "ice" not in path.parents
]


def run(program: str, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, cwd=ROOT, check=True
    )
    return done.stdout.strip()


def test_the_finder_finds_packages_of_ice_and_no_others(tmp_path: Path) -> None:
    for name in ("Ice", "IceGrid", "numpy", "yaml"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").touch()
    finder = DebianFinder(tmp_path)

    found = {name for name in ("Ice", "IceGrid", "numpy", "yaml", "IceBox") if finder.find_spec(name) is not None}

    assert found == {"Ice", "IceGrid"}
    assert finder.find_spec("Ice.Future", [str(tmp_path)]) is None


def test_only_a_directory_for_this_python_fits(tmp_path: Path) -> None:
    (tmp_path / "IcePy.cpython-27-somewhere.so").touch()
    assert not fits(tmp_path)

    (tmp_path / f"IcePy{EXTENSION_SUFFIXES[0]}").touch()
    assert fits(tmp_path)


def test_nothing_of_the_system_comes_along(ice: None) -> None:
    program = (
        "import sys\n"
        "from armem_bridge.ice.installation import load_ice\n"
        "before = list(sys.path)\n"
        "load_ice()\n"
        "assert sys.path == before\n"
        "print(*sorted({name.partition('.')[0] for name, module in sys.modules.items()\n"
        "               if 'dist-packages' in (getattr(module, '__file__', None) or '')}))\n"
    )

    assert set(run(program).split()) <= PACKAGES


def test_where_ice_is_missing_the_message_says_what_to_do() -> None:
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from armem_bridge.ice import installation\n"
        "from armem_bridge.ice.refusals import IceMissing\n"
        "sys.modules['Ice'] = None\n"
        "installation.DEBIAN = Path('nowhere')\n"
        "try:\n"
        "    installation.load_ice()\n"
        "except IceMissing as error:\n"
        "    print(error)\n"
    )

    message = run(program)

    assert "apt-get install python3-zeroc-ice" in message
    assert "pip install zeroc-ice" in message


def test_the_bridge_imports_no_ice() -> None:
    program = (
        "import sys\n"
        "import armem_bridge, armem_bridge.working, armem_bridge.ice\n"
        "print([name for name in sys.modules if name.partition('.')[0] in sys.argv[1:]])\n"
    )

    assert run(program, *PACKAGES) == "[]"


@pytest.mark.parametrize("path", OUTSIDE, ids=lambda path: str(path.relative_to(ROOT)))
def test_only_the_ice_edge_imports_ice(path: Path) -> None:
    """And what is not an edge itself imports the edge, if at all, where it is used."""
    tree = ast.parse(path.read_text(encoding="utf-8"))

    assert not {name.partition(".")[0] for name in imported(ast.walk(tree))} & PACKAGES
    assert not any(name.startswith("armem_bridge.ice") for name in imported(iter(tree.body)))


def imported(nodes: Iterator[ast.AST]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
