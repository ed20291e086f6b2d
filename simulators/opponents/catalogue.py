"""Which sides there are, and where each one's Python and packages are."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
ENVIRONMENTS = ROOT / ".opponents"
"""Where `make opponents` puts them."""
ELM = "elm_side"


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A side: its module, and what it needs."""

    name: str
    room: str = "simulators.opponents.sides"
    """The package of its module, which has its name."""
    environment: str | None = None
    """The one that it runs in; None: it runs with this Python."""
    has_database: bool = False
    """Whether it works in a database of its own on the server that elm is measured on."""

    def python(self, environments: Path) -> Path:
        """The interpreter that runs it, which may be missing."""
        return Path(sys.executable) if self.environment is None else environments / self.environment / "bin" / "python"

    def command(self, environments: Path, *arguments: str) -> list[str]:
        """How its process is started."""
        return [str(self.python(environments)), "-m", f"{self.room}.{self.name}", *arguments]

    def is_installed(self, environments: Path) -> bool:
        """Whether it can be run."""
        return self.python(environments).exists()


SIDES = (
    Entry(name=ELM, has_database=True),
    Entry(name="naive_orm", has_database=True),
    Entry(name="pgstac", environment="pgstac", has_database=True),
    Entry(name="sqlite_rtree"),
    Entry(name="spatialite", environment="spatialite"),
    Entry(name="duckdb_side", environment="duckdb"),
    Entry(name="emem_side", environment="emem"),
    Entry(name="dimos_side", environment="dimos"),
    Entry(name="soar_side", environment="soar"),
)
"""In the order of the tables."""


def chosen(names: Iterable[str]) -> list[Entry]:
    """The sides of these names, elm's first whether it is named or not; all, if none is named."""
    wanted = set(names)
    return [side for side in SIDES if side.name == ELM or not wanted or side.name in wanted]
