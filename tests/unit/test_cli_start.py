"""How quickly the command line starts: nothing heavy is imported for help, version and completion."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

import elm

HEAVY = ("psycopg", "sqlalchemy", "alembic", "geoalchemy2", "shapely", "numpy", "rtree", "msgspec", "pyarrow", "pandas")
START_SECONDS = 0.3

_REPORT = """
import sys
sys.argv = ["elm", *sys.argv[1:]]
from elm.cli import main
try:
    main()
finally:
    print("modules:", *sys.modules, file=sys.stderr)
"""


def run(*arguments: str, **settings: str) -> subprocess.CompletedProcess[str]:
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("ELM_")}
    environment = {**inherited, "PYTHONPATH": str(Path(elm.__file__).parents[1]), **settings}
    return subprocess.run(
        [sys.executable, *arguments], env=environment, capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize(
    ("arguments", "settings", "printed"),
    [
        (("--help",), {}, "recall"),
        (("--version",), {}, "elm "),
        (("recall", "--help"), {}, "--near"),
        (("types", "load", "--help"), {}, "--wordnet"),
        (("recognize", "run", "--help"), {}, "--lateness"),
        ((), {"_ELM_COMPLETE": "complete_bash", "COMP_WORDS": "elm rec", "COMP_CWORD": "1"}, "recall"),
        ((), {"_ELM_COMPLETE": "complete_bash", "COMP_WORDS": "elm recall --li", "COMP_CWORD": "2"}, "--limit"),
    ],
)
def test_nothing_heavy_is_imported(arguments: tuple[str, ...], settings: dict[str, str], printed: str) -> None:
    done = run("-c", _REPORT, *arguments, **settings)
    assert printed in done.stdout
    imported = set(done.stderr.rpartition("modules: ")[2].split())
    assert "elm.cli.program" in imported
    assert imported.isdisjoint(HEAVY)


def seconds(*arguments: str) -> float:
    """The processor time of the quickest of five runs: what waits for other processes does not count."""
    found = []
    for _ in range(5):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert run(*arguments).returncode == 0
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        found.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(found)


def test_it_starts_in_less_than_three_tenths_of_a_second() -> None:
    assert seconds("-m", "elm", "--help") - seconds("-c", "pass") < START_SECONDS
