"""What `elm doctor` finds out: versions, settings, the private cluster and the database, each on its own."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Callable, Iterable, Iterator

_DISTRIBUTION = "elm-memory"
_OPTIONAL = ("pyarrow", "geopandas", "matplotlib", "adbc-driver-postgresql")
_SETTINGS = ("ELM_DSN", "ELM_MEMORY", "ELM_HOME")
_LIBPQ = ("PGHOST", "PGPORT", "PGUSER", "PGDATABASE", "PGSERVICE", "PGPASSFILE", "PGOPTIONS")
_SECRET = ("PGPASSWORD",)

Finding = tuple[str, str]


def diagnosis(dsn: str | None, memory: str) -> Iterator[Finding]:
    """What there is to know, line by line; a part that fails says so, and the next one follows."""
    parts: tuple[tuple[str, Callable[[], Iterable[Finding]]], ...] = (
        ("elm", _program),
        ("packages", _packages),
        ("settings", _settings),
        ("private cluster", _cluster),
        ("database", lambda: _database(dsn, memory)),
    )
    for name, find in parts:
        try:
            yield from find()
        except Exception as error:
            yield name, f"cannot be told: {type(error).__name__}: {error}"


def elm_version() -> str:
    """The version of elm that is installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(_DISTRIBUTION)
    except PackageNotFoundError:
        return "unknown (not installed, runs from its sources)"


def _program() -> Iterator[Finding]:
    yield "elm", elm_version()
    yield "Python", f"{platform.python_implementation()} {platform.python_version()} ({sys.executable})"
    yield "system", platform.platform()


def _packages() -> Iterator[Finding]:
    from importlib.metadata import PackageNotFoundError, requires, version

    try:
        needed = [line for line in requires(_DISTRIBUTION) or () if "extra ==" not in line]
        names = [_name_in(line) for line in needed]
    except PackageNotFoundError:
        names = []
    for name in (*names, *_OPTIONAL):
        try:
            yield f"package {name}", version(name)
        except PackageNotFoundError:
            yield f"package {name}", "missing" if name in names else "not installed (optional)"
    import shapely

    yield "GEOS", ".".join(map(str, shapely.geos_version))
    from elm.storage.diagnosis import libpq_version

    yield "libpq", libpq_version()


def _name_in(requirement: str) -> str:
    end = next((i for i, c in enumerate(requirement) if not (c.isalnum() or c in "-_.")), len(requirement))
    return requirement[:end]


def _settings() -> Iterator[Finding]:
    from elm.storage.diagnosis import masked

    for name in (*_SETTINGS, *_LIBPQ, *_SECRET):
        value = os.environ.get(name)
        if value is None:
            continue
        if name in _SECRET:
            yield name, "set (not shown)"
        else:
            yield name, masked(value) if name == "ELM_DSN" else value


def _cluster() -> Iterator[Finding]:
    from elm.storage.cluster import Cluster

    status = Cluster.default().status()
    size = "no data" if status.data_bytes is None else f"{status.data_bytes:,} bytes"
    running = f"running as process {status.pid}" if status.running else "not running"
    yield "private cluster", f"{running}, PostgreSQL {status.version or 'none yet'}, {size}"
    yield "private cluster's home", str(status.home)
    yield "private cluster's socket", f"{status.socket_directory}, port {status.port}"
    yield "private cluster's log", str(status.log_file)


def _database(dsn: str | None, memory: str) -> Iterable[Finding]:
    from elm.storage import diagnose

    return diagnose(dsn, memory)
