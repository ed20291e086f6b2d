"""The private PostgreSQL cluster: created, started and stopped in ELM_HOME, reached by a unix socket only."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from urllib.parse import quote

from elm.errors import ClusterError
from elm.storage.installation import EXTENSIONS, choose_installation, find_installations
from elm.storage.server_account import ServerAccount
from elm.storage.server_process import PATIENCE, ServerProcess
from elm.storage.server_settings import as_configuration, default_settings
from elm.storage.server_socket import PORT, SOCKET_NAME, make_socket_directory, socket_directory

DATABASE = "elm"
_USER = "elm"
# pg_ctl hands paths to a shell, in double quotes and otherwise as they are.
_REFUSED_IN_PATHS = frozenset('$`"\\\n')


@dataclass(frozen=True, kw_only=True)
class ClusterStatus:
    """What there is to know about a private cluster, running or not."""

    running: bool
    home: Path
    pid: int | None
    version: str | None
    data_bytes: int | None
    socket_directory: Path
    port: int
    log_file: Path


@dataclass(frozen=True, kw_only=True)
class Cluster:
    """An ordinary PostgreSQL server in a directory of its own, without password, network port or service.

    `settings` stand above elm's own from the next start on; a running server keeps those it has.
    """

    home: Path
    settings: Mapping[str, str] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        # One spelling per place: a server is recognised by the directory it was started with.
        object.__setattr__(self, "home", Path(self.home).expanduser().resolve())
        if not _REFUSED_IN_PATHS.isdisjoint(str(self.home)):
            raise ClusterError(
                f"PostgreSQL's pg_ctl cannot handle the path {str(self.home)!r}: set ELM_HOME to one without "
                f'the characters $ ` " \\ and line breaks.'
            )
        object.__setattr__(self, "settings", MappingProxyType(dict(self.settings)))

    @classmethod
    def default(cls) -> Cluster:
        """The cluster in ELM_HOME, else in the user's data directory (of root: /var/lib/elm)."""
        if home := os.environ.get("ELM_HOME"):
            return cls(home=Path(home))
        if os.geteuid() == 0:
            return cls(home=Path("/var/lib/elm"))
        shared = os.environ.get("XDG_DATA_HOME", "")
        return cls(home=Path(shared if os.path.isabs(shared) else "~/.local/share", "elm"))

    def dsn(self, dbname: str = DATABASE) -> str:
        """The address of a database of this cluster for any client of libpq; final once `up` returned."""
        directory = quote(str(socket_directory(self.home)), safe="")
        return f"postgresql://{_USER}@/{quote(dbname, safe='')}?host={directory}&port={PORT}"

    def up(self) -> None:
        """Have the server running, with its database and extensions; what is missing is made."""
        with self._explained():
            account = self._account()
            if self._server.pid is not None and self._is_complete():
                return
            programs = choose_installation(account, major=self._major()).programs
            self._make_home(account)
            with self._locked():
                # At each start: the initdb of a killed starter may still have been writing at the last one.
                for leftover in self.home.glob("initdb-*"):
                    shutil.rmtree(leftover, ignore_errors=True)
                if not self._data.exists():
                    self._initialise(account, programs)
                if not self._answers():
                    make_socket_directory(self.home, account)
                    self._write_settings(account)
                    lock = socket_directory(self.home) / f"{SOCKET_NAME}.lock"
                    self._server.start(account, programs, socket_lock=lock)
                self._provide(DATABASE)

    def down(self) -> None:
        """Stop the server if it runs; clients are disconnected, what they committed is kept."""
        with self._explained():
            self._account()
            if self._server.pid is not None:
                with self._locked():
                    self._server.stop()

    def status(self) -> ClusterStatus:
        """What is there now, whether the server runs or not; nothing is started or made."""
        with self._explained():
            account = self._account()
            pid = self._server.pid
            major = self._major()
            versions = [each.version for each in find_installations(account) if each.major == major]
            return ClusterStatus(
                running=pid is not None,
                home=self.home,
                pid=pid,
                version=None if major is None else (*versions, str(major))[0],
                data_bytes=None if major is None else _bytes_on_disk(self._data),
                socket_directory=socket_directory(self.home),
                port=PORT,
                log_file=self._server.log_file,
            )

    def create_database_if_missing(self, dbname: str) -> None:
        """Have a database of this name in the running server, with the extensions that memories need."""
        with self._explained(), self._locked():
            self._provide(dbname)

    @property
    def _data(self) -> Path:
        return self.home / "data"

    @property
    def _server(self) -> ServerProcess:
        return ServerProcess(data=self._data, log_file=self.home / "log" / "server.log")

    def _account(self) -> ServerAccount:
        """Who runs the server: the owner of the data; before there are any, the caller or root's stand-in."""
        owner = self._data.stat().st_uid if self._data.exists() else None
        me = os.geteuid()
        if me == 0:
            return ServerAccount.of_uid(owner) if owner else ServerAccount.unprivileged()
        if owner not in (None, me):
            raise ClusterError(
                f"The cluster in {self.home} belongs to user `{ServerAccount.of_uid(owner).name}`. "
                f"Run elm as that user or as root, or set ELM_HOME to a directory of your own."
            )
        return ServerAccount.of_uid(me)

    def _major(self) -> int | None:
        try:
            return int((self._data / "PG_VERSION").read_text())
        except FileNotFoundError:
            return None

    @contextlib.contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise ClusterError(
                f"The cluster's directory {self.home} cannot be used: {error}. "
                f"Set ELM_HOME to a directory that you can write and that has room."
            ) from error

    @contextlib.contextmanager
    def _locked(self) -> Iterator[None]:
        """One process and thread at a time; the system lets go of the lock when its holder dies."""
        handle = os.open(self.home / "lock", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o600)
        with open(handle, "rb+") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield

    def _make_home(self, account: ServerAccount) -> None:
        missing = [each for each in (self.home, *self.home.parents) if not each.exists()]
        account.require_open(missing[-1].parent if missing else self.home)
        for directory in reversed(missing):
            directory.mkdir(mode=0o700, exist_ok=True)
            if account.differs:
                # Whatever root's umask is, the account must get through.
                directory.chmod(0o755)

    def _initialise(self, account: ServerAccount, programs: Path) -> None:
        """Create the data directory, under another name first: what a killed starter leaves is not used."""
        fresh = Path(tempfile.mkdtemp(prefix="initdb-", dir=self.home))
        account.own(fresh)
        done = account.run(
            *(programs / "initdb", "--pgdata", fresh, "--username", _USER, "--no-instructions"),
            *("--encoding", "UTF8", "--locale", "C" if sys.platform == "darwin" else "C.UTF-8"),
            *("--auth-local", "trust", "--auth-host", "reject"),
            *(["--no-sync"] if self.settings.get("fsync") == "off" else []),
        )
        if done.returncode != 0:
            shutil.rmtree(fresh, ignore_errors=True)
            raise ClusterError(f"initdb could not create a cluster in {self.home}: {done.stderr.strip()}")
        with (fresh / "postgresql.conf").open("a") as configuration:
            configuration.write("\n# elm writes elm.conf at each start; lines below this one and ALTER SYSTEM win.\n")
            configuration.write("include_if_exists = 'elm.conf'\n")
        fresh.rename(self._data)

    def _write_settings(self, account: ServerAccount) -> None:
        settings = {**default_settings(socket_directory(self.home)), **self.settings}
        handle, name = tempfile.mkstemp(prefix="elm-conf-", dir=self._data)
        with open(handle, "w") as file:
            file.write(as_configuration(settings))
        account.own(Path(name))
        Path(name).replace(self._data / "elm.conf")

    def _answers(self) -> bool:
        """Wait until the server takes connections, if it runs; False when it must be started."""
        from psycopg import pq

        begin = time.monotonic()
        while (pid := self._server.pid) is not None:
            if pq.PGconn.ping(self.dsn("postgres").encode()) == pq.Ping.OK:
                return True
            waited = time.monotonic() - begin
            if waited > 2 and not (socket_directory(self.home) / SOCKET_NAME).exists():
                # Somebody removed the socket of the running server: only a new start makes another.
                self._server.stop()
            if waited > PATIENCE:
                raise ClusterError(
                    f"The PostgreSQL server in {self.home} (process {pid}) has not taken connections for "
                    f"{PATIENCE} s. Look into {self._server.log_file}; `elm down` stops it."
                )
            time.sleep(0.02)
        return False

    def _is_complete(self) -> bool:
        """Whether the server takes connections and `up` has nothing to add."""
        import psycopg

        try:
            with psycopg.connect(self.dsn()) as connection:
                present = connection.execute(
                    "SELECT count(*) FROM pg_extension WHERE extname = ANY(%s)", [list(EXTENSIONS)]
                )
                return present.fetchone() == (len(EXTENSIONS),)
        except psycopg.OperationalError:
            return False

    def _provide(self, dbname: str) -> None:
        import psycopg
        from psycopg import sql

        # A killed starter's statement may still run in the server: the file lock is free then, this one is not.
        alone = sql.SQL("SELECT pg_advisory_lock(hashtext('elm: databases and extensions'))")
        try:
            with psycopg.connect(self.dsn("postgres"), autocommit=True) as connection:
                connection.execute(alone)
                known = connection.execute("SELECT FROM pg_database WHERE datname = %s", [dbname])
                if known.rowcount == 0:
                    connection.execute(sql.SQL("CREATE DATABASE {}").format(sql.Identifier(dbname)))
            with psycopg.connect(self.dsn(dbname), autocommit=True) as connection:
                connection.execute(alone)
                for name in EXTENSIONS:
                    create = sql.SQL("CREATE EXTENSION IF NOT EXISTS {}")
                    connection.execute(create.format(sql.Identifier(name)))
        except psycopg.Error as error:
            raise ClusterError(
                f"Database `{dbname}` of the cluster in {self.home} cannot be prepared "
                f"(the server's log is {self._server.log_file}): {error}"
            ) from error


def _bytes_on_disk(directory: Path) -> int:
    total = 0
    for folder, _, files in os.walk(directory):
        for name in files:
            # A running server removes files meanwhile.
            with contextlib.suppress(FileNotFoundError):
                total += os.lstat(os.path.join(folder, name)).st_blocks * 512
    return total
