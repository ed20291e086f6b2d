"""The operating-system account that runs a private PostgreSQL server, and how programs are run as it."""

from __future__ import annotations

import errno
import os
import pwd
import subprocess
from dataclasses import dataclass
from pathlib import Path

from elm.errors import ClusterError


@dataclass(frozen=True, kw_only=True)
class ServerAccount:
    """A user of the machine: the one who calls, or the one root steps down to."""

    name: str
    uid: int
    gid: int

    @classmethod
    def of_uid(cls, uid: int) -> ServerAccount:
        """The account of this number; one without a name, as containers have them, is called by its number."""
        try:
            entry = pwd.getpwuid(uid)
        except KeyError:
            return cls(name=f"#{uid}", uid=uid, gid=os.getegid())
        return cls(name=entry.pw_name, uid=uid, gid=entry.pw_gid)

    @classmethod
    def unprivileged(cls) -> ServerAccount:
        """The account for a server that root starts; PostgreSQL refuses to run as root."""
        for name in ("postgres", "nobody"):
            try:
                return cls.of_uid(pwd.getpwnam(name).pw_uid)
            except KeyError:
                continue
        raise ClusterError(
            "PostgreSQL does not run as root, and this machine has neither a user `postgres` nor `nobody`. "
            "Run elm as an ordinary user, or add one of them (`useradd --system postgres`)."
        )

    @property
    def differs(self) -> bool:
        """Whether programs must step down to this account."""
        return self.uid != os.geteuid()

    def run(self, program: Path | str, *arguments: Path | str) -> subprocess.CompletedProcess[str]:
        """Run a program to its end as this account, its output captured, undisturbed by our PG* variables."""
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PG")}
        environment["LC_ALL"] = "C"
        try:
            return subprocess.run(
                [program, *arguments],
                user=self.uid if self.differs else None,
                group=self.gid if self.differs else None,
                extra_groups=os.getgrouplist(self.name, self.gid) if self.differs else None,
                # The caller's directory may be closed to this account.
                cwd="/",
                env=environment,
                umask=0o077,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                check=False,
            )
        except OSError as error:
            raise self._not_allowed(error) from error

    def own(self, path: Path) -> None:
        """Give a file or directory to this account."""
        if not self.differs:
            return
        try:
            os.chown(path, self.uid, self.gid, follow_symlinks=False)
        except OSError as error:
            raise self._not_allowed(error) from error

    def make_directory(self, path: Path) -> None:
        """A directory of this account that nobody else (but root) can enter; kept when it exists."""
        if not path.is_dir():
            path.mkdir(mode=0o700)
            self.own(path)

    def require_open(self, directory: Path) -> None:
        """Refuse a directory that this account cannot get into."""
        if not self.differs:
            return
        way = [*reversed(directory.parents), directory]
        # Asked of the system as that account: permission bits alone would miss access lists.
        script = 'for d; do test -x "$d" || { printf %s "$d"; exit; }; done'
        if closed := self.run("/bin/sh", "-c", script, "sh", *way).stdout:
            raise ClusterError(
                f"PostgreSQL does not run as root, and user `{self.name}`, who runs it instead, may not enter "
                f"{closed} on the way to {directory}. Set ELM_HOME to a directory open to all (root's default is "
                f"/var/lib/elm), or run `chmod o+x {closed}`."
            )

    def _not_allowed(self, error: OSError) -> OSError | ClusterError:
        if not self.differs or error.errno not in (errno.EPERM, errno.EINVAL):
            return error
        return ClusterError(
            f"PostgreSQL does not run as root, and this root may not switch to user `{self.name}` "
            f"({error.strerror}). Run elm as an ordinary user, or with the capabilities CHOWN, SETUID and SETGID."
        )
