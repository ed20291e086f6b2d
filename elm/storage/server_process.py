"""The server process of one PostgreSQL data directory: whether it lives, how it is started and stopped."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from elm.errors import ClusterError
from elm.storage.server_account import ServerAccount

# A crash recovery reads up to max_wal_size of log, a shutdown writes all of shared_buffers: minutes on an SD card.
PATIENCE = 300
_LARGEST_LOG = 10_000_000


@dataclass(frozen=True, kw_only=True)
class ServerProcess:
    """A handle on the server that may run on a data directory, whoever started it."""

    data: Path
    log_file: Path

    @property
    def pid(self) -> int | None:
        """The process that serves the data directory, if it is alive."""
        pid = self._recorded_pid()
        if pid is None:
            return None
        command = _command_of(pid)
        # A server's children call themselves `postgres: ...`.
        serves = re.match(r"\S*postgres\s", command) is not None
        return pid if serves and (f" -D {self.data} " in command or " -D " not in command) else None

    def start(self, account: ServerAccount, programs: Path, socket_lock: Path) -> None:
        """Start the server and wait until it takes connections."""
        # PostgreSQL believes in a lock file if any process has its number: the zombie of a killed server (in a
        # container whose first process does not reap), another program after a reboot. We looked closer; and
        # should the data still be in use, their shared memory says so.
        for stale in (self.data / "postmaster.pid", socket_lock):
            stale.unlink(missing_ok=True)
        account.make_directory(self.log_file.parent)
        if self._log_size() > _LARGEST_LOG:
            self.log_file.replace(self.log_file.with_suffix(".log.1"))
        deadline = time.monotonic() + PATIENCE
        while True:
            known = self._log_size()
            done = account.run(
                *(programs / "pg_ctl", "start", "--silent", "--wait", "--timeout", str(PATIENCE)),
                # Without a log file the server would keep our pipe open.
                *("--pgdata", self.data, "--log", self.log_file),
            )
            if done.returncode == 0:
                return
            written = self._log_from(known)
            # Processes of a killed server end when they notice; until then PostgreSQL refuses to start.
            if "is still in use" not in written or time.monotonic() > deadline:
                break
            time.sleep(0.1)
        lines = "\n".join((written or done.stderr).strip().splitlines()[-12:])
        raise ClusterError(
            f"The PostgreSQL server of {self.data} did not start. The last lines of {self.log_file} say why:\n{lines}"
        )

    def stop(self) -> None:
        """Stop the server, if there is one, and wait until it is gone; open transactions are rolled back."""
        pid = self.pid
        if pid is None:
            return
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGINT)
        deadline = time.monotonic() + PATIENCE
        while self.pid == pid:
            if time.monotonic() > deadline:
                raise ClusterError(
                    f"The PostgreSQL server of {self.data} (process {pid}) has not stopped within {PATIENCE} s. "
                    f"Look into {self.log_file}."
                )
            time.sleep(0.02)

    def _recorded_pid(self) -> int | None:
        try:
            first = (self.data / "postmaster.pid").read_text().partition("\n")[0]
        except FileNotFoundError:
            return None
        # The number is negative while somebody uses the data in single-user mode.
        return abs(int(first)) if re.fullmatch(r"-?\d+", first) else None

    def _log_size(self) -> int:
        return self.log_file.stat().st_size if self.log_file.exists() else 0

    def _log_from(self, offset: int) -> str:
        if not self.log_file.exists():
            return ""
        with self.log_file.open("rb") as log:
            log.seek(offset)
            return log.read().decode(errors="replace")


def _command_of(pid: int) -> str:
    """The command line of a process, a space after each word; empty if it is gone or only its zombie is left."""
    if Path("/proc/self/cmdline").exists():
        try:
            return os.fsdecode(Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" "))
        except (FileNotFoundError, ProcessLookupError):
            return ""
    ps = subprocess.run(["/bin/ps", "-o", "command=", "-p", str(pid)], capture_output=True, text=True, check=False)
    return f"{ps.stdout.strip()} "
