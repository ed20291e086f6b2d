"""Finds the newest PostgreSQL with PostGIS on the machine, and says how to install what is missing."""

from __future__ import annotations

import os
import platform
import re
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from elm.errors import ClusterError
from elm.storage.server_account import ServerAccount

OLDEST_MAJOR = 14
EXTENSIONS = ("postgis", "btree_gist")
"""What a memory needs of the database that it is in."""

_PLACES = (
    "usr/lib/postgresql/*/bin",  # Debian, Ubuntu
    "usr/pgsql-*/bin",  # Fedora, RHEL: packages of the PostgreSQL project
    "usr/bin",  # Fedora, Arch
    "usr/local/pgsql/bin",
    "usr/local/bin",
    "opt/homebrew/opt/postgresql@*/bin",
    "usr/local/opt/postgresql@*/bin",
    "opt/homebrew/bin",
    "Applications/Postgres.app/Contents/Versions/*/bin",
)
_DISTRIBUTION_MAJORS = {
    "debian 12": 15,
    "debian 13": 17,
    "ubuntu 22.04": 14,
    "ubuntu 24.04": 16,
}


@dataclass(frozen=True, kw_only=True)
class Installation:
    """One set of PostgreSQL server programs."""

    programs: Path
    version: str
    share: Path

    @property
    def major(self) -> int:
        """The major version, which the data of a server are bound to."""
        return int(re.split(r"\D", self.version, maxsplit=1)[0])

    @property
    def missing(self) -> list[str]:
        """The extensions that a memory needs and this installation lacks."""
        return [name for name in EXTENSIONS if not (self.share / "extension" / f"{name}.control").exists()]


def find_installations(account: ServerAccount) -> list[Installation]:
    """All PostgreSQL servers of the machine, the newest first."""
    found = {}
    for place in _candidates(account):
        # Links in a common directory lead to the programs' own.
        programs = (place / "postgres").resolve().parent
        if programs in found or not all(
            os.access(programs / name, os.X_OK) for name in ("initdb", "pg_ctl", "postgres")
        ):
            continue
        # It prints where the programs look for their extensions, and needs no pg_config (often not installed).
        shown = account.run(programs / "initdb", "--show", "-D", "/nonexistent").stderr
        facts = dict(line.split("=", 1) for line in shown.splitlines() if "=" in line)
        if version := re.match(r"\d+[.\w]*", facts.get("VERSION", "")):
            share = Path(facts["share_path"])
            found[programs] = Installation(programs=programs, version=version[0], share=share)
    return sorted(found.values(), key=lambda each: (each.major, not each.missing), reverse=True)


def choose_installation(account: ServerAccount, *, major: int | None = None) -> Installation:
    """The newest fit installation, or that of the given major version, which existing data need."""
    found = find_installations(account)
    if major is not None:
        found = [each for each in found if each.major == major]
        if not found:
            raise ClusterError(
                f"The data were made by PostgreSQL {major}, which is not installed (any more). {_advice(major)}"
            )
    recent = [each for each in found if each.major >= OLDEST_MAJOR]
    fit = [each for each in recent if not each.missing]
    if fit:
        return fit[0]
    if recent:
        raise ClusterError(
            f"PostgreSQL {recent[0].version} in {recent[0].programs} lacks the extensions "
            f"{' and '.join(recent[0].missing)}. {_advice(recent[0].major)}"
        )
    if found:
        raise ClusterError(
            f"PostgreSQL {found[0].version} in {found[0].programs} is too old: "
            f"elm needs {OLDEST_MAJOR} or newer. {_advice(None)}"
        )
    raise ClusterError(f"No PostgreSQL server with PostGIS is installed on this machine. {_advice(None)}")


def _candidates(account: ServerAccount) -> Iterator[Path]:
    for place in _PLACES:
        yield from Path("/").glob(place)
    if pg_config := shutil.which("pg_config"):
        yield Path(account.run(pg_config, "--bindir").stdout.strip() or "/")


def _advice(major: int | None) -> str:
    """The command that installs a fit server here; of this major version where it must be that one."""
    otherwise = " Or name a server that has PostGIS in ELM_DSN."
    if sys.platform == "darwin":
        return "Install it with `brew install postgis`." + otherwise
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        release = {}
    family = {release.get("ID", ""), *release.get("ID_LIKE", "").split()}
    if family & {"debian", "ubuntu"}:
        number = major or _DISTRIBUTION_MAJORS.get(f"{release.get('ID')} {release.get('VERSION_ID')}")
        if number:
            return f"Install it as root with `apt-get install postgresql-{number}-postgis-3`." + otherwise
        return (
            "Install it as root with `apt-get install postgresql-NN-postgis-3`, NN being the number that "
            "`apt-cache search postgis-3` shows." + otherwise
        )
    if family & {"fedora", "rhel", "centos"}:
        return "Install it as root with `dnf install postgresql-server postgresql-contrib postgis`." + otherwise
    return f"Install PostgreSQL {major or f'{OLDEST_MAJOR} or newer'} with PostGIS 3 and contrib." + otherwise
