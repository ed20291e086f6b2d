"""Where the socket of a private PostgreSQL server is: in the cluster's home, or elsewhere if that path is unfit."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from pathlib import Path

from elm.storage.server_account import ServerAccount

PORT = 5432
SOCKET_NAME = f".s.PGSQL.{PORT}"
# macOS takes 103 bytes for the path of a socket (Linux 107); its name follows the directory.
_LONGEST_DIRECTORY = 103 - len(f"/{SOCKET_NAME}")


def socket_directory(home: Path) -> Path:
    """The directory of the socket; a link in the home remembers one elsewhere, so that addresses stay valid."""
    run = home / "run"
    return run.readlink() if run.is_symlink() else run


def make_socket_directory(home: Path, account: ServerAccount) -> None:
    """Have a directory for the socket that only the account (and root) can enter."""
    run = home / "run"
    # libpq takes a comma for the end of a host's name.
    if len(os.fsencode(run)) <= _LONGEST_DIRECTORY and "," not in str(run):
        if run.is_symlink():
            run.unlink()
        account.make_directory(run)
        return
    if run.is_symlink() and _is_private(run.readlink(), account):
        return
    if run.is_dir() and not run.is_symlink():
        shutil.rmtree(run)
    run.unlink(missing_ok=True)
    elsewhere = Path(tempfile.mkdtemp(prefix="elm-"))
    account.require_open(elsewhere.parent)
    account.own(elsewhere)
    run.symlink_to(elsewhere)


def _is_private(directory: Path, account: ServerAccount) -> bool:
    try:
        found = directory.lstat()
    except FileNotFoundError:
        return False
    return stat.S_ISDIR(found.st_mode) and found.st_uid == account.uid and not found.st_mode & 0o077
