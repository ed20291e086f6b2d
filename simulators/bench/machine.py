"""Under which circumstances a figure was measured: machine, load, versions, server settings and commit."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from simulators.bench.scratch import connect

_PACKAGES = ("elm-memory", "psycopg", "sqlalchemy", "numpy", "shapely", "pyarrow", "adbc-driver-postgresql")
_SETTINGS = """
SELECT name, setting || coalesce(unit, '') FROM pg_settings
WHERE name IN ('shared_buffers', 'fsync', 'synchronous_commit', 'full_page_writes', 'wal_compression', 'max_wal_size',
               'checkpoint_timeout', 'autovacuum', 'commit_delay', 'jit', 'work_mem', 'random_page_cost')
ORDER BY name
"""


def circumstances(dsn: str) -> dict[str, Any]:
    """What to know about a figure before comparing it with another one."""
    with connect(dsn) as connection:
        settings = dict(connection.execute(_SETTINGS).fetchall())
        server = connection.execute("SELECT current_setting('server_version'), PostGIS_Lib_Version()").fetchone()
    assert server is not None  # noqa: S101 - a select without FROM has a row
    return {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": _machine(),
        "versions": {
            "python": platform.python_version(),
            "postgresql": server[0],
            "postgis": server[1],
            **{name: found for name in _PACKAGES if (found := _version(name)) is not None},
        },
        "settings": settings,
        "commit": _commit(),
    }


def load_average() -> list[float]:
    """Processes that wanted to run over the last 1, 5 and 15 minutes: more than the cores make figures unsteady."""
    return [round(value, 2) for value in os.getloadavg()]


def _machine() -> dict[str, Any]:
    return {
        "cpu": _processor(),
        "cores": os.cpu_count(),
        "memory_gb": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1),
        "system": platform.platform(),
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _processor() -> str:
    described = Path("/proc/cpuinfo")
    if described.exists():
        for line in described.read_text().splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()


def _commit() -> str | None:
    """The commit of the checkout, "-dirty" where files differ from it; None outside of one."""
    asked = ["git", "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        found = subprocess.run(  # noqa: S603 - a constant command
            asked, cwd=Path(__file__).parent, capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        return None
    return found.stdout.strip() or None
